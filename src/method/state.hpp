// The state that steps change, and the model, which is fixed during a stage of a run.
#pragma once

#include "base/field.hpp"
#include "grid/hilbert.hpp"
#include "kernels/sweep.hpp"
#include "material/branches.hpp"
#include "method/contact.hpp"
#include "method/damping.hpp"
#include "method/node_field.hpp"
#include "method/obstacle.hpp"
#include "method/spec.hpp"
#include "method/tractions.hpp"
#include "particles/particles.hpp"
#include "shape/weights.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

namespace ordo {

/// Sets b of the particles [begin, end) at time t; called in parallel for pieces of all particles.
template <int D>
using BodyForceKernel = std::function<void(const ParticleView<D>&, std::ptrdiff_t begin, std::ptrdiff_t end, double t)>;

/// Adds to b of all particles at time t; called by one thread.
template <int D>
using AddedBodyForce = std::function<void(const ParticleView<D>&, double t)>;

/// The user's set-up, fixed during a stage of the run.
template <int D>
struct Model {
    MethodSpec method;
    Vec<D> origin{}, h{};
    Index<D> cells{};
    Vec<D, bool> periodic{};
    std::vector<Material> materials;
    std::vector<VectorField<D>> body_forces;  ///< one per body, per mass, m/s^2
    BodyForceKernel<D> body_force_kernel;     ///< if set, replaces body_forces
    std::vector<Traction<D>> tractions;
    std::vector<Load<D>> loads;  ///< the faces that the tractions act on, see add_loads
    std::vector<Condition<D>> conditions;
    std::vector<Wall<D>> walls;
    /// Level sets of bodies that end inside the grid, for schemes that need them: functions of the initial position, m,
    /// negative inside and zero on the free surface.
    std::vector<LevelSet<D>> surface;
    std::vector<ContactSurface<D>> surfaces;  ///< of the bodies in contact
    std::vector<ContactPair<D>> contacts;     ///< of two bodies, then of bodies and obstacles
    std::vector<Obstacle<D>> obstacles;
    std::vector<int> field_of_body;  ///< the velocity field that each body moves in; empty: all in one
    Vec<D> gravity{};
    Damping damping{};
    double residual = 0.0;  ///< up to which State::residual is measured; 0: not

    int field_of(int body) const { return field_of_body.empty() ? 0 : field_of_body[body]; }
    int field_count() const
    {
        return field_of_body.empty() ? 1 : *std::max_element(field_of_body.begin(), field_of_body.end()) + 1;
    }
    /// The position of a face of the grid, m.
    double face(int axis, bool above) const { return origin[axis] + (above ? cells[axis] * h[axis] : 0.0); }
};

/// The points of quadratures `cell` and `gauss`: particles of domain `point` that exist for one step. Tiles of one colour share
/// no node.
template <int D>
struct QuadraturePoints {
    Array<Vec<D>> x, v, b;
    Array<Stress<D>> sigma;
    Array<double> m, V;
    int count = 0;
    std::array<std::vector<Tile>, Tiles<D>::colour_count> colours;

    ParticleView<D> view();
    /// Makes room for n points.
    void resize(int n, bool has_body_force);
    /// f(tile) for all tiles, those of one colour in parallel.
    template <class F>
    void for_each_by_colour(F&& f) const
    {
        for (const auto& colour : colours)
            parallel_for_each(
                std::ssize(colour), [&](std::ptrdiff_t k) { f(colour[k]); }, Tiles<D>::tiles_together,
                Tiles<D>::are_worth_threads(count));
    }
};

/// Mass, kg, and momentum, kg m/s.
using MassAndMomentum = Numbers<4>;

/// Those that a node holds before a projection.
inline MassAndMomentum mass_and_momentum_of(const Lanes& node)
{
    constexpr int v = NodeLane::velocity;
    return {{node[NodeLane::mass], node[v], node[v + 1], node[v + 2]}};
}

/// Mass and momentum of the particles before a projection and of the nodes after it, before boundary conditions.
struct ProjectionReport {
    bool is_wanted     = false;                        ///< compute the sums in each step
    double mass_before = 0.0, mass_after = 0.0;        ///< kg
    Vec<3> momentum_before = {}, momentum_after = {};  ///< kg m/s
    FitReport fit;
    Vec<3> dropped_at  = {};   ///< the centre of the first block of nodes or cells with dropped pivots, m
    double first_block = 0.0;  ///< the number of that block

    void set(const MassAndMomentum& before, const MassAndMomentum& after)
    {
        mass_before = before[0];
        mass_after  = after[0];
        for (int a = 0; a < 3; ++a) {
            momentum_before[a] = before[1 + a];
            momentum_after[a]  = after[1 + a];
        }
    }
};

/// What forces did on the nodes in the kicks since the start, J, see method/energy_account.hpp.
struct NodalWork {
    double stresses = 0.0, loads = 0.0, gravity = 0.0, constraints = 0.0;

    double all() const { return stresses + loads + gravity + constraints; }
    NodalWork& operator+=(const NodalWork& o)
    {
        stresses += o.stresses;
        loads += o.loads;
        gravity += o.gravity;
        constraints += o.constraints;
        return *this;
    }
};

/// Energies of particles, J.
struct EnergyParts {
    double kinetic = 0.0, stored = 0.0, potential = 0.0;  ///< stored: heat included; potential: of gravity

    double all() const { return kinetic + stored + potential; }
    EnergyParts& operator+=(const EnergyParts& o)
    {
        kinetic += o.kinetic;
        stored += o.stored;
        potential += o.potential;
        return *this;
    }
    friend EnergyParts operator-(const EnergyParts& a, const EnergyParts& b)
    {
        return {a.kinetic - b.kinetic, a.stored - b.stored, a.potential - b.potential};
    }
};

/// What leaves kinetic and strain energy other than by gravity, and the forces that go with it. Computed if wanted.
struct Account {
    bool is_wanted = false;
    EnergyParts start;  ///< energies at the start, and what stages have added to them
    NodalWork nodes;
    double nodal_kinetic = 0.0;        ///< kinetic energy of the nodes after the last kick, J
    double filtered      = 0.0;        ///< kinetic energy that PIC and filters have taken from the particles since the start, J
    std::vector<Exchange> boundaries;  ///< by Condition::boundary and Wall::boundary
    std::vector<Exchange> tractions;
    double body_force_work = 0.0;  ///< taken by body forces since the start, J
    double nodes_work      = 0.0;  ///< taken by those who change nodes from outside since the start, J
    double damped          = 0.0;  ///< taken by damping since the start, J; always computed
    double staged = 0.0;  ///< left with what stages changed at their starts and others from outside, gravity and heat included, J
    // Of the step that is being taken, until `settle`.
    std::vector<ExchangeParts> of_boundaries;
    ExactSum of_stresses, of_filters;  ///< what adds to nodes.stresses and to filtered, J

    /// Forgets the last step.
    void begin_step()
    {
        for (Exchange& e : boundaries) e.force = {};
        of_boundaries.resize(boundaries.size());
        for (ExchangeParts& e : of_boundaries) e.clear();
        of_stresses.clear();
        of_filters.clear();
    }
    /// Adds the sums of the step.
    void settle(Ranks& ranks)
    {
        add_over(ranks, of_boundaries, boundaries);
        nodes.stresses += total(ranks, of_stresses);
        filtered += total(ranks, of_filters);
    }

    static double work_of(const std::vector<Exchange>& all)
    {
        double r = 0.0;
        for (const Exchange& e : all) r += e.work;
        return r;
    }
    double boundary_work() const { return work_of(boundaries); }
    double traction_work() const { return work_of(tractions); }
    /// What all of them have taken, J.
    double work() const { return boundary_work() + traction_work() + body_force_work + nodes_work; }
};

/// For the axis `averaging`, see method/averaging.hpp.
template <int D>
struct Averages {
    Array<Lanes> records;   ///< of cells or vertices
    Array<double> u;        ///< the scalar that is averaged
    Array<double> weights;  ///< volumes of particles, m^D
    int body_count = 0;
};

/// For the axis `filter`.
template <int D>
struct FilterNodes {
    Array<Lanes> sum, term, again;        ///< nodes: of the terms; the last term; the same projected again
    Array<Vec<D>> kept, kept_of_corners;  ///< velocities of particles and corners meanwhile, m/s
};

/// An iteration of Newton's method.
struct NewtonIteration {
    double residual;  ///< before it, N
    int linear_iterations = 0;
    double part           = 0.0;  ///< of its step, from which the next iteration goes on; 0: none, or there is no next one
};

/// Newton's method for a step of an implicit scheme, or for a part of one.
struct NewtonReport {
    double t = 0.0, dt = 0.0;  ///< at the start, and the size, s
    bool converged = false;
    std::vector<NewtonIteration> iterations;  ///< if it converged, the last one has the residual at the end only
};

/// The same since the start.
struct NewtonCounts {
    bool is_wanted    = false;  ///< the scheme is implicit
    double iterations = 0.0, linear_iterations = 0.0, halvings = 0.0;
    double residual = 0.0;              ///< at the end of the last step, N
    long step       = 0;                ///< that was begun last, since the program began
    std::vector<NewtonReport> of_step;  ///< all parts of that step, those that failed too

    void begin_step()
    {
        ++step;
        of_step.clear();
    }
    void add(NewtonReport r)
    {
        for (const NewtonIteration& one : r.iterations) linear_iterations += one.linear_iterations;
        iterations += static_cast<double>(r.iterations.size()) - (r.converged ? 1 : 0);
        if (!r.iterations.empty()) residual = r.iterations.back().residual;
        of_step.push_back(std::move(r));
    }
};

/// How a node moves.
template <int D>
struct NodeMotion {
    Index<D> node;    ///< without the lattice's margin, which changes
    Vec<D> velocity;  ///< m/s
};

/// All that a step changes.
template <int D>
struct State {
    Particles<D> particles;
    Ranks* ranks = &alone();  ///< that share the run; particles and nodes are those of this one, numbers those of all
    CurveCuts cuts;           ///< between the parts of the ranks

    // Rebuilt by the sort; see method/layout.hpp.
    Lattice<D> lattice;
    NodeField<D> field;
    Array<Lanes> velocity_records;            ///< for least-squares fits of the velocity
    Array<Lanes> cell_records;                ///< for least-squares fits of fields in cells
    Array<Lanes> cell_contents;               ///< see kernels/cell_fields.hpp
    Array<Lanes> gradients;                   ///< see kernels/cell_gradient.hpp
    Array<Lanes> particle_nodes;              ///< sums over particles if `field.nodes` has sums over quadrature points
    std::vector<unsigned char> held_corners;  ///< bit a of enriched corner e: a body's condition holds component a
    Array<Lanes> forces;                      ///< nodes before the kick, for the account
    Array<Lanes> load_nodes;                  ///< the part of tractions and body forces, for the account
    Array<Stress<D>> no_stress;               ///< zeros, the same
    std::vector<double> least_masses;         ///< of the particles of each body with a condition, kg
    Array<Lanes> body_nodes;                  ///< sums over the particles of one body, for conditions of bodies
    Array<Lanes> wall_forces;                 ///< forces without walls, with a consistent mass matrix
    QuadraturePoints<D> points;               ///< for quadratures cell and gauss
    Averages<D> averages;
    Array<Mat<D>> increments;  ///< displacement gradients of the step, if stresses need those of all particles
    FilterNodes<D> filter;
    Contacts<D> contacts;
    Array<Stress<D>> force_stress;     ///< of particles, where forces come from stresses other than sigma
    ProjectionReport projection;       ///< of the last step
    Account account;                   ///< since the start
    bool has_external_forces = false;  ///< those that the next evaluation would find
    double drift             = 0.0;    ///< upper bound on the displacement of particles since the sort, cells
    double move              = 0.0;    ///< largest displacement along an axis in the last step, cells
    double reach             = 0.0;    ///< largest distance from a particle to the edge of its domain, cells
    int extra_reach          = 0;      ///< cells beyond that edge in which the particle's samples count

    std::vector<Vec<D>> wall_shifts;  ///< how far each wall has moved since t = 0, m

    TileReport report;  ///< of the tiles in this step, until ranks agree at its end
    NewtonCounts newton;
    std::vector<NodeMotion<D>> load_step;  ///< scheme static: how nodes moved in the last step, where the next one begins

    int stage             = 0;                                        ///< of the run
    double kinetic_energy = 0.0;                                      ///< after the last step, J; if velocities are damped
    double residual       = std::numeric_limits<double>::infinity();  ///< of the last step, see docs/stages.md; if it is measured

    double t       = 0.0;  ///< time of positions, s
    double t_rest  = 0.0;  ///< rounding error of t (Kahan 1965), so that n steps add up to n dt
    double t_v     = 0.0;  ///< time of velocities, s
    double t_F     = 0.0;  ///< time of F and stresses, s; USF updates them at the start of the next step
    double dt_prev = 0.0;  ///< 0 before the first step
    long n         = 0;    ///< steps taken
};

/// One more than the largest number of a body that has particles, on any rank.
template <int D>
int body_count(const State<D>& s)
{
    const auto& body = s.particles.body;
    const int most   = body.empty() ? -1 : *std::max_element(body.begin(), body.end());
    return static_cast<int>(largest(*s.ranks, most)) + 1;
}

/// The number of the tile that particle i is in, which orders particles of different ranks; infinite where there is no such particle.
template <int D>
double tile_of_particle(const State<D>& s, int i)
{
    const auto& tiles = s.field.tiles.tiles();
    const auto tile   = std::partition_point(tiles.begin(), tiles.end(), [&](const Tile& t) { return t.end <= i; });
    return tile == tiles.end()
               ? std::numeric_limits<double>::infinity()
               : static_cast<double>(s.field.tiles.tile_numbers()[static_cast<std::size_t>(tile - tiles.begin())]);
}

/// Resizes `array` to a record of `size` Lanes for each node.
inline void make_room(Array<Lanes>& array, std::size_t nodes, int size = 1)
{
    if (array.size() != nodes * size) array = Array<Lanes>(nodes * size, Pages::own);
}

/// The basis of a method's grid.
inline GridBasis grid_basis(const MethodSpec& method) { return {.degree = node_degree(method), .a0 = method.a0}; }

/// How far beyond a particle's domain its samples still count at nodes, cells.
inline int extra_reach(const MethodSpec& method)
{
    const bool fits_cells = method.quadrature == Quadrature::cell || method.gradient == Gradient::adjoint;
    if (!fits_velocity(method)) return fits_cells ? 1 : 0;
    return std::max<int>(fits_cells, extra_reach(width_of(method.weight), grid_basis(method).degree));
}

/// How many boundaries the conditions and walls of a model belong to.
template <int D>
std::size_t boundary_count(const Model<D>& model)
{
    int count = 0;
    for (const Condition<D>& b : model.conditions) count = std::max(count, b.boundary + 1);
    for (const Wall<D>& w : model.walls) count = std::max(count, w.boundary + 1);
    return static_cast<std::size_t>(count);
}

/// Whether a condition is on a plane other than the grid face on its side.
template <int D>
bool is_inner_plane(const Model<D>& model, const Condition<D>& b)
{
    return b.is_plane() && std::fabs(b.at - model.face(b.axis, b.outer_is_above)) > 1e-9 * model.h[b.axis];
}
/// Whether a condition is on a plane inside a grid of splines, which do not interpolate there.
template <int D>
bool is_inner_plane_of_splines(const Model<D>& model, const Condition<D>& b)
{
    return grid_basis(model.method).degree > 1 && is_inner_plane(model, b);
}

/// Walls on both faces of the grid along an axis, frictionless by default.
template <int D>
void add_walls(Model<D>& model, int axis, ConditionType type = ConditionType::symmetry)
{
    for (const bool above : {false, true})
        model.conditions.push_back(
            {.axis = axis, .outer_is_above = above, .at = model.face(axis, above), .type = type, .value = {}});
}

/// The names of the history columns of all materials in `dim` dimensions, each once.
inline std::vector<std::string> history_columns(const std::vector<Material>& materials, int dim)
{
    std::vector<std::string> names;
    for (const Material& m : materials)
        for (const HistoryColumn& c : history_of(m, dim))
            if (std::find(names.begin(), names.end(), c.name) == names.end()) names.emplace_back(c.name);
    return names;
}

/// The groups of particle fields that a model needs.
template <int D>
FieldGroups field_groups(const Model<D>& model)
{
    FieldGroups g{};
    g.box             = model.method.domain == Domain::box || model.method.domain == Domain::stretched_box;
    g.corners         = model.method.domain == Domain::parallelepiped;
    g.cells           = has_cells(model.method);
    g.traction        = !model.tractions.empty();
    g.gradient        = carries_gradient(model.method);
    g.modes           = model.method.projection == Projection::polynomial;
    g.corner_samples  = g.cells && model.method.samples == Samples::corners;
    g.corner_velocity = g.corner_samples || keeps_corner_velocity(model.method);
    for (int a = 0; a < D; ++a) g.periodic = g.periodic || model.periodic[a];
    g.history    = history_columns(model.materials, D);
    g.averaged   = model.method.averaging != Averaging::none;
    g.shock      = has_artificial_viscosity(model.method);
    g.body_force = static_cast<bool>(model.body_force_kernel);
    for (const auto& b : model.body_forces) g.body_force = g.body_force || !is_zero<D>(b);
    return g;
}

/// x - X of particle i, m; on a periodic axis the total displacement, including full periods.
template <int D>
Vec<D> displacement(const Model<D>& model, const Particles<D>& p, int i)
{
    Vec<D> u = p.x[i] - p.X[i];
    for (int a = 0; a < D; ++a)
        if (model.periodic[a]) u[a] += p.turns[i][a] * (model.cells[a] * model.h[a]);
    return u;
}

/// The position of a corner of particle i's cell, next to the particle: periodic axes wrap particles but not corners.
template <int D>
Vec<D> corner_place(const Model<D>& model, const Particles<D>& p, int i, int corner)
{
    Vec<D> x = p.corner[corner];
    for (int a = 0; a < D; ++a)
        if (model.periodic[a]) x[a] -= p.turns[i][a] * (model.cells[a] * model.h[a]);
    return x;
}

/// The position of particle i for output and for fields: in the first period of periodic axes. Between sorts x may be up to the
/// halo outside it.
template <int D>
Vec<D> place_in_period(const Model<D>& model, const Particles<D>& p, int i)
{
    Vec<D> x = p.x[i];
    for (int a = 0; a < D; ++a) {
        const double period = model.cells[a] * model.h[a];
        if (model.periodic[a]) x[a] -= period * std::floor((x[a] - model.origin[a]) / period);
    }
    return x;
}

}  // namespace ordo
