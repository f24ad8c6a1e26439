#include "verification/measure.hpp"

#include "base/error.hpp"
#include "method/diagnostics.hpp"
#include "method/grid_sample.hpp"
#include "method/planting.hpp"
#include "method/watch.hpp"
#include "spline/scheme.hpp"
#include "verification/record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>

namespace ordo::verification {

namespace {

/// A row with counts and sizes; failed if there is nothing to run.
template <int D>
Row row_of(const Problem<D>& problem)
{
    for (const Condition<D>& b : problem.model.conditions)
        if (is_inner_plane_of_splines(problem.model, b))
            throw InputError("--method: the case has walls inside the grid, where splines do not interpolate; use basis hat");
    Row row{};
    row.h              = problem.model.h[0];
    row.cells          = static_cast<int>(std::lround(1 / row.h));
    row.particles      = static_cast<int>(problem.seeds.size());
    const double steps = std::ceil(problem.end / problem.dt * (1 - 1e-9));
    if (!(steps >= 1 && steps <= 1e9))
        throw InputError(fmt::format("end = {} s takes {:.3g} steps of dt = {} s; choose another end, cfl or dt", problem.end,
                                     steps, problem.dt));
    row.steps = std::lround(steps);
    row.dt    = problem.end / static_cast<double>(row.steps);
    if (row.particles == 0 && !problem.plant) row.failed = "the mesh is too coarse to hold a particle";
    const MethodSpec& method = problem.model.method;
    if (row.cells < least_spline_cells(method)) row.failed = "the mesh is too coarse for splines without knots next to the walls";
    return row;
}

/// The particles of a problem; also finds the faces of its tractions.
template <int D>
Particles<D> plant_all(Problem<D>& problem)
{
    Model<D>& model = problem.model;
    if (problem.plant) return problem.plant(model);
    Particles<D> p = ordo::plant_all(model, problem.seeds, problem.corners);
    if (problem.body) {
        for (int i = 0; i < p.count; ++i) {
            p.body[i] = p.material[i] = problem.body(p.x[i]);
            p.m[i]                    = model.materials[p.material[i]].density * p.V0[i];
        }
        enrich(model, p);
    }
    if (has_enrichment(model.method) && p.enriched.empty())
        throw InputError("--method: the case has one body and so no interface to enrich; set method.enrichment=all or use cpdi2");
    if (model.tractions.empty()) return p;
    const CellMesh<D> mesh = mesh_of(model.method, problem.seeds, problem.corners);
    for (int t = 0; t < static_cast<int>(model.tractions.size()); ++t)
        add_loads<D>(model.loads, p, mesh, 0, t,
                     [&](const Vec<D>& normal, const Vec<D>& center) { return problem.load(normal, center) == t; });
    return p;
}

/// The same in the initial state of the solution.
template <int D>
Particles<D> plant_exactly(Problem<D>& problem)
{
    Particles<D> particles = plant_all(problem);
    for (std::size_t c = 0; c < particles.corner_velocity.size(); ++c)
        particles.corner_velocity[c] = problem.solution->velocity(particles.corner[c], 0.0);
    for (Vec<D>& corner : particles.corner) corner = problem.solution->position(corner, 0.0);
    for (int i = 0; i < particles.count; ++i) {
        const Vec<D> X = particles.x[i];
        particles.X[i] = X;
        particles.x[i] = problem.solution->position(X, 0.0);
        particles.v[i] = problem.solution->velocity(X, 0.0);
        particles.F[i] = problem.solution->deformation(X, 0.0);
        if (!particles.L.empty()) particles.L[i] = problem.solution->velocity_gradient(X, 0.0);
    }
    return particles;
}

/// Calls see(state) after each step.
template <int D>
class AfterStep : public Observer<D> {
  public:
    explicit AfterStep(std::function<void(const State<D>&)> see) : see_(std::move(see)) {}
    void after_step(Simulation<D>& sim, const StepSize&) override { see_(sim.state()); }

  private:
    std::function<void(const State<D>&)> see_;
};

/// Says when the step was first above the limit of the method.
template <int D>
class StepLimit : public Observer<D> {
  public:
    explicit StepLimit(const Model<D>& model) : watch_(model, {}, [this](const std::string& said) { first_ = said; }) {}
    void before_step(Simulation<D>& sim, const StepSize& size) override
    {
        if (!first_.empty()) return;
        const auto begin         = std::chrono::steady_clock::now();
        const std::clock_t start = std::clock();
        watch_.before_step(sim.state(), size.dt);
        seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
        seconds_cpu += static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    }
    const std::string& first() const { return first_; }

    double seconds = 0.0, seconds_cpu = 0.0;  ///< what looking took

  private:
    std::string first_;
    Watch<D> watch_;
};

/// Takes all steps and calls `see(state)` after each. Fills seconds, and failed if the run ends early.
template <int D>
void run(Simulation<D>& sim, Row& row, Recorder<D>& recorder, const std::function<void(const State<D>&)>& see)
{
    AfterStep<D> after(see);
    sim.add(recorder);
    sim.add(after);
    StepLimit<D> limit(sim.model());
    sim.add(limit);
    StageTimes times;
    sim.scheme().measure(&times);
    const auto begin         = std::chrono::steady_clock::now();
    const std::clock_t start = std::clock();
    try {
        sim.run();
    } catch (const NumericalError& e) {
        row.failed = limit.first().empty() ? e.what() : fmt::format("{}; before, {}", e.what(), limit.first());
        row.steps  = sim.state().n;
    }
    row.seconds            = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() - limit.seconds;
    row.seconds_cpu        = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC - limit.seconds_cpu;
    row.seconds_body_force = times.seconds[StageTimes::body_force];
    sim.scheme().measure(nullptr);
    if (!row.failed.empty()) recorder.finish(sim.state());
}

/// Sums of squares of errors over particles, plain and weighted, and of the exact values.
struct Squares {
    double plain = 0, weighted = 0, exact = 0;

    void add(double error2, double exact2, double V)
    {
        plain += error2;
        weighted += V * error2;
        exact += V * exact2;
    }
};

template <int D>
void measure_particles(const Problem<D>& problem, const State<D>& s, Row& row)
{
    const Particles<D>& p       = s.particles;
    const Solution<D>& solution = *problem.solution;
    const Material& material    = problem.model.materials[0];
    Squares displacement, velocity, stress, density;
    ExactTotals<D> exact;
    for (int i = 0; i < p.count; ++i) {
        const Vec<D> x = solution.position(p.X[i], s.t), v = solution.velocity(p.X[i], s.t_v);
        const Mat<D> F = solution.deformation(p.X[i], s.t_F), sigma = solution.stress(p.X[i], s.t_F);
        const double rho = material.density / det(F);
        const Vec<D> u = x - p.X[i], error = ordo::displacement(problem.model, p, i) - u;
        displacement.add(dot(error, error), dot(u, u), p.V[i]);
        velocity.add(dot(p.v[i] - v, p.v[i] - v), dot(v, v), p.V[i]);
        const Mat<D> off = in_plane(p.sigma[i]) - sigma;
        stress.add(ddot(off, off), ddot(sigma, sigma), p.V[i]);
        density.add(std::pow(p.m[i] / p.V[i] - rho, 2), rho * rho, p.V[i]);
        exact.add(material, p, i, v, F, sigma);
    }
    const std::pair<const char*, const Squares&> all[] = {
        {"displacement", displacement}, {"velocity", velocity}, {"stress", stress}, {"density", density}};
    for (const auto& [name, sum] : all) {
        row.error.emplace_back(name, std::sqrt(sum.plain / p.count));
        row.error_l2.emplace_back(name, std::sqrt(sum.weighted));
        if (problem.is_reference) row.error_relative.emplace_back(name, std::sqrt(sum.weighted / sum.exact));
    }
    const Totals sums = totals(problem.model, s);
    row.quantities    = {{"kinetic_energy", sums.kinetic_energy},
                         {"kinetic_energy_exact", exact.kinetic_energy},
                         {"strain_energy", sums.strain_energy}};
    if (material.law->history.empty()) {
        row.quantities.emplace_back("strain_energy_exact", exact.strain_energy);
        row.quantities.emplace_back("energy_over_exact", sums.total_energy() / exact.total_energy());
    }
    for (int a = 0; a < D; ++a) {
        row.quantities.emplace_back("momentum_" + axis_name(a), sums.momentum[a]);
        row.quantities.emplace_back("momentum_" + axis_name(a) + "_exact", exact.momentum[a]);
    }
}

/// Momentum and velocity of the nodes. A node at x should have the velocity of the material point that is now at x, at the time
/// of the velocities.
template <int D>
void measure_nodes(const Problem<D>& problem, const Scheme<D>& method, State<D>& s, Row& row)
{
    const ProjectionReport& kept = method.project(s);
    const double size            = momentum_size(s.particles);
    for (int a = 0; a < D; ++a) row.quantities.emplace_back("momentum_grid_" + axis_name(a), kept.momentum_after[a]);
    row.quantities.emplace_back("momentum_defect", size > 0 ? norm(kept.momentum_after - kept.momentum_before) / size : 0.0);
    row.quantities.emplace_back("mass_defect", std::fabs(kept.mass_after / kept.mass_before - 1));
    if (problem.is_reference) return;

    double sum = 0, volume = 1;
    for (int a = 0; a < D; ++a) volume *= problem.model.h[a];
    Index<D> first = Index<D>::filled(s.lattice.margin), last{};
    for (int a = 0; a < D; ++a) last[a] = first[a] + s.lattice.cells[a] + 1;
    IndexBox<D>{first, last}.for_each([&](const Index<D>& at) {
        if (!(s.field.sum_at(s.lattice, at)[NodeLane::mass] > 0)) return;
        Vec<D> x{};
        for (int a = 0; a < D; ++a) x[a] = s.lattice.origin[a] + (at[a] - s.lattice.margin) * s.lattice.h[a];
        const Vec<D> v = sample_grid(s, x).velocity;
        const auto X   = material_point(*problem.solution, x, s.t);
        if (!X || !problem.contains(*X)) return;
        const Vec<D> e = v - problem.solution->velocity(*X, s.t_v);
        double share   = volume;  // of the node in the grid
        for (int a = 0; a < D; ++a)
            if (at[a] == first[a] || at[a] == last[a] - 1) share /= 2;
        sum += share * dot(e, e);
    });
    row.error_l2.emplace_back("velocity_grid", std::sqrt(sum));
}

}  // namespace

template <int D>
Row measure(const Problem<D>& given)
{
    Row row = row_of(given);
    if (!row.failed.empty()) return row;
    Problem<D> problem     = given;
    Particles<D> particles = plant_exactly(problem);
    row.particles          = particles.count;
    Simulation<D> sim(problem.model, [&](const Scheme<D>& scheme) { return scheme.start_deformed(std::move(particles)); },
                      {.end = problem.end, .dt = row.dt});
    State<D>& s = sim.state();
    if (problem.at_start) problem.at_start(s);
    const double size      = momentum_size(s.particles);
    s.projection.is_wanted = true;
    double mass_defect = 0, momentum_defect = 0;
    Recorder<D> recorder(problem, sim.scheme(), row);
    run<D>(sim, row, recorder, [&](const State<D>& now) {
        const ProjectionReport& kept = now.projection;
        mass_defect                  = std::max(mass_defect, std::fabs(kept.mass_after / kept.mass_before - 1));
        momentum_defect              = std::max(momentum_defect, norm(kept.momentum_after - kept.momentum_before));
    });
    if (!row.failed.empty()) return row;
    measure_particles(problem, s, row);
    if (problem.at_end)
        for (auto& quantity : problem.at_end(s)) row.quantities.push_back(std::move(quantity));
    recorder.finish(s);
    row.quantities.emplace_back("largest_mass_defect", mass_defect);
    row.quantities.emplace_back("largest_momentum_defect", size > 0 ? momentum_defect / size : 0.0);
    try {
        measure_nodes(problem, sim.scheme(), s, row);
    } catch (const NumericalError& e) {
        row.failed = e.what();
        return row;
    }
    for (const auto& [name, value] : row.error)
        if (!std::isfinite(value)) row.failed = "the error of " + name + " is not a finite number";
    return row;
}

template <int D>
Row follow(const Problem<D>& given, const std::function<void(const State<D>&)>& see)
{
    Row row = row_of(given);
    if (!row.failed.empty()) return row;
    Problem<D> problem     = given;
    Particles<D> particles = plant_all(problem);
    row.particles          = particles.count;
    if (problem.velocity) set_velocities<D>(particles, 0, particles.count, problem.velocity, problem.model.h);
    Simulation<D> sim(problem.model, [&](const Scheme<D>& scheme) { return scheme.start(std::move(particles)); },
                      {.end = problem.end, .dt = row.dt});
    if (problem.at_start) problem.at_start(sim.state());
    see(sim.state());
    Recorder<D> recorder(problem, sim.scheme(), row);
    run<D>(sim, row, recorder, see);
    if (row.failed.empty()) recorder.finish(sim.state());
    return row;
}

template <int D>
Row watch(const Problem<D>& problem)
{
    double largest = 0, strain = 0, size = -1;
    Totals first, last;
    Row row = follow<D>(problem, [&](const State<D>& now) {
        last = totals(problem.model, now);
        if (size < 0) {  // the start
            first = last;
            size  = momentum_size(now.particles);
            return;
        }
        largest = std::max(largest, last.total_energy());
        strain  = std::max(strain, last.strain_energy);
    });
    if (!row.failed.empty()) return row;
    const double energy = first.total_energy();
    row.quantities      = {{"total_energy", last.total_energy() / energy},
                           {"largest_total_energy", largest / energy},
                           {"largest_strain_energy", strain / energy},
                           {"momentum_change", norm(last.momentum - first.momentum) / size}};
    for (int a = 0; a < D; ++a) row.quantities.emplace_back("momentum_" + axis_name(a), last.momentum[a]);
    return row;
}

template Row measure(const Problem<1>&);
template Row measure(const Problem<2>&);
template Row measure(const Problem<3>&);
template Row follow(const Problem<2>&, const std::function<void(const State<2>&)>&);
template Row follow(const Problem<3>&, const std::function<void(const State<3>&)>&);
template Row watch(const Problem<2>&);

}  // namespace ordo::verification
