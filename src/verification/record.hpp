// Optional records of a run: sums over time, and the particles at its end.
#pragma once

#include "method/diagnostics.hpp"
#include "sim/simulation.hpp"
#include "verification/measure.hpp"

#include <algorithm>
#include <limits>
#include <string>

namespace ordo::verification {

/// sum m |v| of the particles, kg m/s: the scale for changes of momentum.
template <int D>
double momentum_size(const Particles<D>& p)
{
    double size = 0;
    for (int i = 0; i < p.count; ++i) size += p.m[i] * norm(p.v[i]);
    return size;
}

/// The same for the nodes, with velocities after boundary conditions.
template <int D>
double momentum_size_of_nodes(const State<D>& s)
{
    double size        = 0;
    Index<D> first     = Index<D>::filled(s.lattice.margin), last{};
    const auto size_at = [&](const Lanes& n) {
        Vec<D> v{};
        for (int a = 0; a < D; ++a) v[a] = n[NodeLane::velocity + a];
        return n[NodeLane::mass] * norm(v);
    };
    for (int a = 0; a < D; ++a) last[a] = first[a] + s.lattice.cells[a] + s.lattice.basis.degree;
    IndexBox<D>{first, last}.for_each([&](const Index<D>& at) {
        for (int k = 0; k < s.field.tiles.fields(); ++k) {
            const Lanes& n = s.field.nodes[s.field.tiles.first_node(k) + s.lattice.offset(at)];
            if (s.field.tiles.is_active(at, k) && n[NodeLane::mass] > 0) size += size_at(n);
        }
    });
    for (const int c : s.particles.enriched)
        if (const std::ptrdiff_t own = s.particles.corner_node[c]; own >= 0) size += size_at(s.field.nodes[own]);
    return size;
}

/// Sums over the particles with the exact values of the solution. Rate laws have exact solutions in 1D only, without lateral
/// stress. Laws with history store an energy that F and stress alone do not give: theirs is not a number.
template <int D>
struct ExactTotals {
    double kinetic_energy = 0, strain_energy = 0, momentum_size = 0;
    Vec<D> momentum{};

    void add(const Material& material, const Particles<D>& p, int i, const Vec<D>& v, const Mat<D>& F, const Mat<D>& sigma)
    {
        kinetic_energy += 0.5 * p.m[i] * dot(v, v);
        strain_energy += material.law->history.empty()
                             ? ordo::strain_energy(material, F, make_stress(sigma, 0.0), p.V0[i], det(F) * p.V0[i])
                             : std::numeric_limits<double>::quiet_NaN();
        momentum_size += p.m[i] * norm(v);
        momentum += p.m[i] * v;
    }
    double total_energy() const { return kinetic_energy + strain_energy; }
};

inline std::string axis_name(int a) { return {static_cast<char>('x' + a)}; }

/// Fills `row.history` and `row.final_particles`. Energies and momenta of the solution are taken at the particles' X and times.
template <int D>
class Recorder : public Observer<D> {
  public:
    Recorder(const Problem<D>& problem, const Scheme<D>& method, Row& row)
        : problem_(problem),
          method_(method),
          row_(row),
          stride_(std::max<long>(1, (row.steps + largest - 1) / largest)),
          has_exact_(problem.solution && !problem.is_reference)
    {
        if (!problem.is_recorded) return;
        auto& names = row.history.columns;
        names       = {"time",         "time_velocity", "kinetic_energy",    "strain_energy",
                       "total_energy", "momentum_size", "grid_momentum_size"};
        for (int a = 0; a < D; ++a) names.push_back("momentum_" + axis_name(a));
        for (int a = 0; a < D; ++a) names.push_back("grid_momentum_" + axis_name(a));
        names.insert(names.end(), problem.observed.names.begin(), problem.observed.names.end());
        if (!has_exact_) return;
        names.insert(names.end(), {"kinetic_energy_exact", "strain_energy_exact", "total_energy_exact", "momentum_size_exact"});
        for (int a = 0; a < D; ++a) names.push_back("momentum_" + axis_name(a) + "_exact");
    }

    void before_step(Simulation<D>& sim, const StepSize&) override { sample(sim.state()); }

    /// Adds a row if one is due. It projects to the nodes for their momentum, which does not change the step.
    void sample(State<D>& s)
    {
        if (!problem_.is_recorded || (s.n % stride_ != 0 && s.n != row_.steps)) return;
        const Totals sums = totals(method_.model(), s);
        const Vec<3> kept = method_.project(s).momentum_after;
        auto& out         = row_.history.values;
        out.insert(out.end(), {s.t, s.t_v, sums.kinetic_energy, sums.strain_energy, sums.total_energy(),
                               momentum_size(s.particles), momentum_size_of_nodes(s)});
        for (int a = 0; a < D; ++a) out.push_back(sums.momentum[a]);
        for (int a = 0; a < D; ++a) out.push_back(kept[a]);
        if (!problem_.observed.names.empty()) {
            const std::vector<double> own = problem_.observed.values(s);
            out.insert(out.end(), own.begin(), own.end());
        }
        if (has_exact_) add_exact(s);
    }

    /// At the end, after particles were measured: the projection may sort them. Also for a failed run, whose reference solution is
    /// not known.
    void finish(State<D>& s)
    {
        if (!problem_.is_recorded) return;
        if (row_.failed.empty()) sample(s);
        const Particles<D>& p = s.particles;
        const bool has_exact  = problem_.solution && (row_.failed.empty() || !problem_.is_reference);
        const int corners     = corner_count(p);
        if (p.count > most_particles) return;
        name_particles(has_exact, corners);
        for (int i = 0; i < p.count; ++i) {
            add_vector(p.X[i]);
            add_state(p.x[i], p.v[i], in_plane(p.sigma[i]));
            row_.final_particles.values.push_back(p.V[i]);
            if (has_exact)
                add_state(problem_.solution->position(p.X[i], s.t), problem_.solution->velocity(p.X[i], s.t_v),
                          problem_.solution->stress(p.X[i], s.t_F));
            for (int c = 0; c < corners; ++c) add_vector(corner(p, i, c));
        }
    }

  private:
    static constexpr long largest       = 1000;     ///< samples of a history, about
    static constexpr int most_particles = 100'000;  ///< of a table

    void add_exact(const State<D>& s)
    {
        const Particles<D>& p       = s.particles;
        const Solution<D>& solution = *problem_.solution;
        ExactTotals<D> sums;
        for (int i = 0; i < p.count; ++i)
            sums.add(problem_.model.materials[0], p, i, solution.velocity(p.X[i], s.t_v), solution.deformation(p.X[i], s.t_F),
                     solution.stress(p.X[i], s.t_F));
        auto& out = row_.history.values;
        out.insert(out.end(), {sums.kinetic_energy, sums.strain_energy, sums.total_energy(), sums.momentum_size});
        for (int a = 0; a < D; ++a) out.push_back(sums.momentum[a]);
    }

    /// The number of corners of each particle's domain, 0 for points.
    static int corner_count(const Particles<D>& p)
    {
        if (!p.cell.empty()) return p.count > 0 ? p.cell[0].count() : 0;
        return p.edges.empty() && p.half.empty() ? 0 : 1 << D;
    }

    Vec<D> corner(const Particles<D>& p, int i, int c) const
    {
        if (!p.cell.empty()) return corner_place(method_.model(), p, i, p.cell[i][c]);
        Vec<D> x = p.x[i];
        for (int d = 0; d < D; ++d) {
            const double sign = c >> d & 1 ? 1.0 : -1.0;
            if (!p.edges.empty())
                x += sign * column(p.edges[i], d);
            else
                x[d] += sign * p.half[i][d];
        }
        return x;
    }

    void name_particles(bool has_exact, int corners)
    {
        auto& names     = row_.final_particles.columns;
        auto add_vector = [&](const std::string& name, const std::string& end) {
            for (int a = 0; a < D; ++a) names.push_back(name + "_" + axis_name(a) + end);
        };
        auto add_state = [&](const std::string& end) {
            add_vector("position", end);
            add_vector("velocity", end);
            for (int a = 0; a < D; ++a)
                for (int b = a; b < D; ++b) names.push_back("stress_" + axis_name(a) + axis_name(b) + end);
        };
        add_vector("reference", "");
        add_state("");
        names.push_back("volume");
        if (has_exact) add_state("_exact");
        for (int c = 0; c < corners; ++c) add_vector("corner" + std::to_string(c), "");
    }

    void add_vector(const Vec<D>& x)
    {
        for (int a = 0; a < D; ++a) row_.final_particles.values.push_back(x[a]);
    }
    void add_state(const Vec<D>& x, const Vec<D>& v, const Mat<D>& sigma)
    {
        add_vector(x);
        add_vector(v);
        for (int a = 0; a < D; ++a)
            for (int b = a; b < D; ++b) row_.final_particles.values.push_back(sigma(a, b));
    }

    const Problem<D>& problem_;
    const Scheme<D>& method_;
    Row& row_;
    long stride_;
    bool has_exact_;
};

}  // namespace ordo::verification
