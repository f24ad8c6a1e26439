// The scatter and the gather of each shape in 3D, 8 particles a cell, sorted: ns per particle.
#include "kernels/evolve.hpp"
#include "kernels/gather.hpp"
#include "kernels/scatter.hpp"
#include "method/explicit.hpp"
#include "particles/seeding.hpp"
#include "shape/box.hpp"
#include "shape/corners.hpp"
#include "shape/point.hpp"

#include <benchmark/benchmark.h>

namespace {

using namespace ordo;

State<3> block(Domain domain)
{
    Model<3> model{};
    model.method.domain = domain;
    model.h             = Vec<3>::filled(1.0 / 32);
    model.cells         = {32, 32, 32};
    model.materials     = {{MaterialModel::neo_hookean, 1e3, 5.8e5, 3.8e5}};
    model.body_forces.resize(1);
    const auto seeds = fill_box(Bounds<3>{Vec<3>::filled(0.25), Vec<3>::filled(0.75)}, SubCells<3>{{}, model.h, {2, 2, 2}});
    Particles<3> p(static_cast<int>(seeds.size()), field_groups(model));
    for (int i = 0; i < p.count; ++i) plant(p, i, seeds[i], 1e3);
    return Explicit<3>(std::move(model)).start(std::move(p));
}

template <class S>
constexpr Domain domain_of()
{
    if constexpr (std::is_same_v<S, Box<3>>) return Domain::box;
    if constexpr (std::is_same_v<S, Parallelepiped<3, Hat>>) return Domain::parallelepiped;
    return Domain::point;
}

template <class S>
void scatter_all(benchmark::State& bench)
{
    State<3> s              = block(domain_of<S>());
    const Material material = {MaterialModel::neo_hookean, 1e3, 5.8e5, 3.8e5};
    const Sweep<3> view{s.lattice, s.particles.view(), s.nodes.data(), &material, 0, 0};
    for (auto _ : bench) scatter<S, MassMomentum<3>, InternalForce<3>>(view, 0, view.p.count);
    bench.SetItemsProcessed(bench.iterations() * view.p.count);
}

template <class S, class Evolution>
void gather_all(benchmark::State& bench)
{
    State<3> s              = block(domain_of<S>());
    const Material material = {MaterialModel::neo_hookean, 1e3, 5.8e5, 3.8e5};
    const Sweep<3> view{s.lattice, s.particles.view(), s.nodes.data(), &material, 1e-9, 0};
    TileReport report;
    for (auto _ : bench) gather<S, Evolution, kUpdateVelocity | kUpdateStress | kMove>(view, 0, view.p.count, report);
    bench.SetItemsProcessed(bench.iterations() * view.p.count);
}

BENCHMARK(scatter_all<Point<3, Hat>>);
BENCHMARK(scatter_all<Box<3>>);
BENCHMARK(scatter_all<Parallelepiped<3, Hat>>);
BENCHMARK(gather_all<Point<3, Hat>, Rigid<3>>);
BENCHMARK(gather_all<Box<3>, StretchedBox<3>>);
BENCHMARK(gather_all<Parallelepiped<3, Hat>, AffineEdges<3>>);

}  // namespace
