// Single passes in 3D with 8 sorted particles per cell: scatter and gather of shapes, fits of velocities and of cells.
// ns per particle.
#include "method/explicit.hpp"
#include "method/planting.hpp"
#include "method/reconstruction.hpp"
#include "method/tables.hpp"

#include <benchmark/benchmark.h>

#include <string>

namespace {

using namespace ordo;

struct Block {
    Explicit<3> method;
    Passes<3> passes;
    State<3> s;
    Material material{find_law("neo-hookean"), 1e3, 5.8e5, 3.8e5};

    explicit Block(const MethodSpec& spec)
        : method(model_of(spec)),
          passes(choose_passes<3>(spec)),
          s(method.start(plant_all(method.model(), fill_box(Bounds<3>{Vec<3>::filled(0.25), Vec<3>::filled(0.75)},
                                                            SubCells<3>{{}, method.model().h, {2, 2, 2}}))))
    {}
    static Model<3> model_of(const MethodSpec& spec)
    {
        Model<3> model{};
        model.method    = spec;
        model.h         = Vec<3>::filled(1.0 / 32);
        model.cells     = {32, 32, 32};
        model.materials = {{find_law("neo-hookean"), 1e3, 5.8e5, 3.8e5}};
        model.body_forces.resize(1);
        return model;
    }
    Sweep<3> sweep(double dt) { return {s.lattice, s.particles.view(), s.field.nodes.data(), &material, dt, 0, 0}; }
};

void scatter_all(benchmark::State& bench, const MethodSpec& spec)
{
    Block b(spec);
    const Sweep<3> view = b.sweep(0);
    for (auto _ : bench) b.passes.project_and_force(view, 0, view.p.count);
    bench.SetItemsProcessed(bench.iterations() * view.p.count);
}

void gather_all(benchmark::State& bench, const MethodSpec& spec)
{
    Block b(spec);
    const Sweep<3> view = b.sweep(1e-9);
    TileReport report;
    for (auto _ : bench) b.passes.update_all(view, 0, view.p.count, report);
    bench.SetItemsProcessed(bench.iterations() * view.p.count);
}

/// Nodes must have masses. Each fit replaces the momenta, which does not affect the next one.
void fit_all_velocities(benchmark::State& bench, const MethodSpec& spec)
{
    Block b(spec);
    const Sweep<3> view = b.sweep(0);
    b.passes.project(view, 0, view.p.count);
    for (auto _ : bench) fit_velocities(b.method.model(), b.passes.velocity_fit, b.s, view, view.nodes);
    bench.SetItemsProcessed(bench.iterations() * view.p.count);
}

void fit_all_cells(benchmark::State& bench, const MethodSpec& spec)
{
    Block b(spec);
    const Sweep<3> view = b.sweep(0);
    for (auto _ : bench) fit_cells(b.method.model(), b.passes.cell_fit, b.s, view);
    bench.SetItemsProcessed(bench.iterations() * view.p.count);
}

void register_shapes()
{
    for (const auto& basis : Axis<Basis>::choices)
        for (const auto& domain : Axis<Domain>::choices) {
            const MethodSpec spec{.basis = basis.value, .domain = domain.value};
            if (broken_rule(spec) || basis.value == Basis::ddmpm) continue;
            const std::string name = std::string(basis.name) + "/" + std::string(domain.name);
            benchmark::RegisterBenchmark(("scatter/" + name).c_str(), scatter_all, spec);
            benchmark::RegisterBenchmark(("gather/" + name).c_str(), gather_all, spec);
        }
}

void register_fits()
{
    for (const Preset& preset : presets()) {
        const std::string name(preset.name);
        const Passes<3> passes = choose_passes<3>(preset.spec);
        if (passes.velocity_fit.spread)
            benchmark::RegisterBenchmark(("velocity_fit/" + name).c_str(), fit_all_velocities, preset.spec);
        if (passes.cell_fit.spread) benchmark::RegisterBenchmark(("cell_fit/" + name).c_str(), fit_all_cells, preset.spec);
    }
}

}  // namespace

int main(int argc, char** argv)
{
    register_shapes();
    register_fits();
    benchmark::Initialize(&argc, argv);
    benchmark::RunSpecifiedBenchmarks();
}
