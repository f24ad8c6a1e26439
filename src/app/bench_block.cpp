#include "app/bench_block.hpp"

#include "app/memory.hpp"
#include "method/planting.hpp"
#include "particles/seeding.hpp"
#include "sim/simulation.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <vector>

namespace ordo::app {

namespace {

constexpr double kSpeed = 31.6227766016838;  ///< about the speed of sound of all materials, m/s

/// The time step in units of h/c. Taylor least squares need three particles per cell and axis (docs/design.md) and break down
/// after a few steps with two; so they take tiny steps, which cost the same.
double courant_number(const MethodSpec& method)
{
    const bool is_taylor = method.projection == Projection::tls || method.quadrature == Quadrature::gauss;
    return is_taylor ? 0.002 : 0.2;
}

double median(std::vector<double> values)
{
    std::sort(values.begin(), values.end());
    const std::size_t n = values.size();
    return 0.5 * (values[(n - 1) / 2] + values[n / 2]);
}

template <class F>
double seconds_of(F&& f)
{
    const auto begin = std::chrono::steady_clock::now();
    f();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// The side of the block relative to the box: splines fitted to particles need a full box.
double side_of(const MethodSpec& method) { return needs_full_grid(method) ? 1.0 : 0.75; }

template <int D>
Model<D> block_model(const MethodSpec& spec, const Material& material, int cells)
{
    Model<D> model{};
    model.method    = spec;
    model.h         = Vec<D>::filled(1.0 / cells);
    model.cells     = Index<D>::filled(cells);
    model.materials = {material};
    model.body_forces.resize(2);
    if (needs_full_grid(spec))
        for (int a = 0; a < D; ++a) add_walls(model, a);
    return model;
}

template <int D>
Particles<D> block_particles(const Model<D>& model)
{
    const int low  = static_cast<int>(std::lround(0.5 * (1 - side_of(model.method)) * model.cells[0]));
    const double h = model.h[0];
    Particles<D> p = plant_all(model, fill_box(Bounds<D>{Vec<D>::filled(low * h), Vec<D>::filled((model.cells[0] - low) * h)},
                                               SubCells<D>{Vec<D>{}, model.h, Index<D>::filled(2)}));
    for (int i = 0; i < p.count; ++i) {
        p.v[i][0] = 0.01 * std::sin(6 * p.x[i][0]);
        p.body[i] = p.x[i][0] > 0.5;  // two bodies, so that enrichment has an interface
    }
    enrich(model, p);
    return p;
}

/// Resident memory from construction on.
class Memory {
  public:
    /// The peak since construction, per particle. If the system cannot reset the peak, it is that since the start of the process,
    /// and nothing if that was reached before.
    std::optional<double> per_particle(int particles) const
    {
        const auto peak = peak_resident_bytes();
        if (!before_ || !peak || (!has_own_peak_ && *peak <= peak_before_)) return std::nullopt;
        return (*peak - *before_) / particles;
    }

  private:
    bool has_own_peak_                  = reset_peak_resident_bytes();
    const std::optional<double> before_ = resident_bytes();
    const double peak_before_           = peak_resident_bytes().value_or(0);
};

/// Times the steps of each repetition.
template <int D>
void time_steps(Simulation<D>& sim, int repeats, Measurement& m)
{
    std::vector<double> seconds, solves, iterations;
    std::array<std::vector<double>, StageTimes::count> stages;
    for (int r = 0; r < repeats; ++r) {
        StageTimes times;
        sim.scheme().measure(&times);
        seconds.push_back(seconds_of([&] {
            for (int k = 0; k < m.steps; ++k) sim.step();
        }));
        sim.scheme().measure(nullptr);
        for (int k = 0; k < StageTimes::count; ++k) stages[k].push_back(times.seconds[k]);
        solves.push_back(static_cast<double>(times.mass_solves) / m.steps);
        iterations.push_back(static_cast<double>(times.mass_iterations) / m.steps);
    }
    m.seconds         = median(seconds);
    m.mass_solves     = median(solves);
    m.mass_iterations = median(iterations);
    for (int k = 0; k < StageTimes::count; ++k) m.stages[k] = median(stages[k]);
}

template <int D>
Measurement run_block(const BenchTask& task)
{
    Measurement m{};
    const double per_axis = std::pow(task.particles, 1.0 / D) / 2;  // cells along a side of the block
    const int unit        = needs_full_grid(task.method) ? 4 : 8;   // cells: the block has a whole number of cells
    m.cells_per_axis      = std::max(1, static_cast<int>(std::lround(per_axis / side_of(task.method) / unit))) * unit;
    m.courant_number      = courant_number(task.method);
    const double dt       = m.courant_number / m.cells_per_axis / kSpeed;

    const Memory memory;
    const Model<D> model = block_model<D>(task.method, task.material, m.cells_per_axis);
    Particles<D> p       = block_particles(model);
    m.particles          = p.count;
    m.setup_bytes        = memory.per_particle(p.count);
    Simulation<D> sim(model, [&](const Scheme<D>& scheme) { return scheme.start(std::move(p)); },
                      {.end = std::numeric_limits<double>::infinity(), .dt = dt});
    m.bytes_per_particle = static_cast<double>(sim.state().particles.bytes_per_particle());

    const double first_step = seconds_of([&] { sim.step(); });  // touches all memory
    m.steps                 = task.steps ? *task.steps : static_cast<int>(std::clamp(2 / first_step, 1.0, 20.0));
    time_steps(sim, task.repeats, m);
    m.resident_bytes = memory.per_particle(m.particles);
    m.work           = count_work(sim.scheme(), sim.state(), m.mass_solves, m.mass_iterations);
    return m;
}

}  // namespace

Measurement run_bench(const BenchTask& task)
{
    switch (task.dim) {
    case 1: return run_block<1>(task);
    case 2: return run_block<2>(task);
    default: return run_block<3>(task);
    }
}

}  // namespace ordo::app
