// Flows between parallel walls and down a plane, periodic along the flow.
#include "verification/channel.hpp"

#include "material/elastic_state.hpp"
#include "material/laws.hpp"
#include "method/courant.hpp"
#include "method/planting.hpp"
#include "verification/cases.hpp"
#include "verification/measure.hpp"

#include <fmt/format.h>

#include <cmath>
#include <span>

namespace ordo::verification {

namespace {

constexpr int kCellsAlong = 4;  // periodic, so more would repeat these

/// A fluid of 1 kg/m^3 in a channel 1 m wide, with walls that hold it.
Problem<2> channel(const Request& r, double speed_of_upper_wall)
{
    Problem<2> p = problem_of<2>(r);
    Material fluid{find_law("fluid"), 1.0, 0.0, 0.0, {}};
    const double numbers[] = {r.values.number("sound_speed"), 7.0, r.values.number("viscosity"), 0.0, LawParameter::none, 1.0};
    std::copy(std::begin(numbers), std::end(numbers), fluid.parameters.begin());
    fluid.law->complete(fluid);
    const double h      = 1.0 / r.cells;
    p.model.h           = {h, h};
    p.model.cells       = {kCellsAlong, r.cells};
    p.model.periodic[0] = true;
    p.model.materials   = {fluid};
    for (const bool is_above : {false, true}) {
        Condition<2> wall{
            .axis = 1, .outer_is_above = is_above, .at = is_above ? 1.0 : 0.0, .type = ConditionType::velocity, .value = {}};
        wall.value[0] = Field(is_above ? speed_of_upper_wall : 0.0);
        wall.value[1] = Field(0.0);
        p.model.conditions.push_back(std::move(wall));
    }
    p.seeds = fill_box(Bounds<2>{{0.0, 0.0}, {kCellsAlong * h, 1.0}}, SubCells<2>{{}, p.model.h, Index<2>::filled(r.per_axis)});
    p.contains = [](const Vec<2>& X) { return X[1] >= -1e-12 && X[1] <= 1 + 1e-12; };
    p.dt       = r.values.number("cfl") * stable_time_step(p.model, ordo::plant_all(p.model, p.seeds));
    return p;
}

/// Velocities along the flow in the two rows next to the middle, and of all, relative to the exact ones.
Named measure_flow(const State<2>& s, const Solution<2>& solution, double h)
{
    double error = 0, size = 0, middle = 0, middle_exact = 0, across = 0;
    for (int i = 0; i < s.particles.count; ++i) {
        const Vec<2> X = s.particles.X[i], v = s.particles.v[i], exact = solution.velocity(X, s.t_v);
        error += dot(v - exact, v - exact);
        size += dot(exact, exact);
        across = std::fmax(across, std::fabs(v[1]));
        if (std::fabs(X[1] - 0.5) > h) continue;
        middle += v[0];
        middle_exact += exact[0];
    }
    return {{"velocity_error_over_size", std::sqrt(error / size)},
            {"middle_velocity", solution.velocity({0.0, 0.5}, s.t_v)[0] * middle / middle_exact},
            {"middle_velocity_over_exact", middle / middle_exact},
            {"largest_velocity_across", across}};
}

template <class Profile>
Row flow(Problem<2>& p, const Profile& profile)
{
    const auto solution = std::make_shared<ChannelFlow<Profile>>(profile, profile.nu * p.model.materials[0].density);
    p.solution          = solution;
    p.at_end            = [solution, h = p.model.h[1]](const State<2>& s) { return measure_flow(s, *solution, h); };
    return measure(p);
}

Row start_couette(const Request& r)
{
    const double speed = r.values.number("speed");
    Problem<2> p       = channel(r, speed);
    return flow(p, StartingCouette{speed, r.values.number("viscosity")});
}

Row start_poiseuille(const Request& r)
{
    const double force        = r.values.number("force");
    Problem<2> p              = channel(r, 0.0);
    p.model.body_forces[0][0] = Field(force);
    return flow(p, StartingPoiseuille{force, r.values.number("viscosity")});
}

std::vector<Parameter> channel_parameters(const Parameter& drive, double end)
{
    return {drive,
            {"viscosity", 1.0, "dynamic viscosity, Pa s; the density is 1 kg/m^3", 0},
            {"sound_speed", 20.0, "m/s", 0},
            {"cfl", 0.5, "part of the stable time step", 0},
            {"end", end, "end time, s", 0}};
}

/// Wall nodes are set to the velocity of the wall and pull the particles next to them, which a lumped mass matrix gives a velocity of
/// the cell's mean: with mass-weighted velocities order 1.5 in velocity and 1 in stress.
std::vector<Study> channel_studies()
{
    const std::vector<int> cells{8, 16, 32};
    const auto middle = [](int n) { return value_between("middle_velocity_over_exact", n, 0.99, 1.01); };
    std::vector<Study> studies{
        {.method = "cpdi1",
         .set    = {},
         .cells  = cells,
         .bars   = orders_at_least("displacement", cells, 1.95) + orders_between("velocity", cells, 1.35, 1.65) +
                 std::vector<Bar>{middle(16), middle(32)}},
        {.method = "cpls",
         .set    = {},
         .cells  = cells,
         .bars   = orders_at_least("displacement", cells, 1.95) + orders_at_least("velocity", cells, 1.95) +
                 std::vector<Bar>{middle(16), middle(32)}},
        // At the limit of the time step, and at that of hats with lumped mass: 5.4 = 1/0.430^2, see courant_scale.
        {.method = "bsmpm",
         .set    = {{"cfl", 1.0}},
         .cells  = {8, 16},
         .bars   = orders_at_least("displacement", {8, 16}, 1.9) + orders_at_least("velocity", {8, 16}, 1.9) +
                 std::vector<Bar>{middle(16)}},
        {.method = "bsmpm", .set = {{"cfl", 5.4}}, .cells = {16}, .bars = {fails_at(16)}}};
    for (const double end : {0.05, 0.2})
        studies.push_back({.method = "cpls", .set = {{"end", end}}, .cells = {32}, .bars = {middle(32)}});
    // The middle has 1.2 % of the speed of the wall by then.
    studies.push_back({.method = "cpls",
                       .set    = {{"end", 0.02}},
                       .cells  = {32, 64, 128},
                       .bars   = orders_at_least("velocity", {32, 64, 128}, 1.95) + std::vector<Bar>{middle(128)},
                       .length = Study::night});
    return studies;
}

// ---- grains down a plane ----------------------------------------------------------------------------------------------------

/// From rest, with the pressure of the weight: t (s), surface and mean velocity (m/s), of an independent program (finite volumes, 200
/// cells).
struct SlopeVelocity {
    double t, surface, mean;
};
constexpr SlopeVelocity kTransient[] = {{0.1, 0.0752899, 0.0622642}, {0.25, 0.186455, 0.138303}, {0.5, 0.353738, 0.240219},
                                        {1.0, 0.607492, 0.387826},   {2.0, 0.910869, 0.561188},  {4.0, 1.164899, 0.704438},
                                        {8.0, 1.278638, 0.767979},   {12.0, 1.292849, 0.775891}, {20.0, 1.294904, 0.777034}};

/// Particles at rest: the pressure of what lies above them and the shear stress of their weight, but at most mu_s p, as b_e and
/// stress with F = I. Without that shear stress they would slide freely until shear waves have built it up.
void start_at_yield(State<2>& s, const PlaneOfGrains& plane, const HenckyElasticity& elastic)
{
    Particles<2>& p = s.particles;
    for (int i = 0; i < p.count; ++i) {
        const double pressure = plane.pressure(p.x[i][1]);
        HenckyStrain<2> e{-pressure / elastic.bulk, {}};
        e.dev(0, 1)          = std::fmin(plane.slow, std::tan(plane.slope)) * pressure / (2 * elastic.shear);
        const Symmetric<2> b = stretched(e);
        for (int k = 0; k < Symmetric<2>::size; ++k) p.history[p.history_column(kElasticColumns[k].name)][i] = b.c[k];
        p.sigma[i] = elastic.kirchhoff(e);
    }
}

/// Compares velocities along the plane with the table, and at the end the profile with the steady one.
class GrainFlow {
  public:
    GrainFlow(const PlaneOfGrains& plane, double layer, std::span<const SlopeVelocity> table)
        : plane_(plane), layer_(layer), table_(table)
    {}

    void see(const State<2>& s)
    {
        const SlopeVelocity now = velocity_of(s);
        for (; next_ < table_.size() && table_[next_].t <= s.t_v; ++next_) {
            const SlopeVelocity& wanted = table_[next_];
            const double part           = (wanted.t - last_.t) / (now.t - last_.t);
            auto between                = [part](double a, double b) { return a + part * (b - a); };
            const std::string at        = fmt::format("_over_reference_{}", wanted.t);
            found_.emplace_back("surface" + at, between(last_.surface, now.surface) / wanted.surface);
            found_.emplace_back("mean" + at, between(last_.mean, now.mean) / wanted.mean);
        }
        last_  = now;
        error_ = profile_error(s);
    }
    Named found() const
    {
        Named r = found_;
        r.insert(r.end(), {{"surface_velocity", last_.surface}, {"mean_velocity", last_.mean}});
        if (plane_.inertial_number() > 0)
            r.insert(r.end(), {{"surface_over_steady", last_.surface / plane_.steady_velocity(plane_.depth)},
                               {"profile_error_over_size", error_}});
        return r;
    }

  private:
    /// The mean, and that of the uppermost layer of particles; X is where a particle started.
    SlopeVelocity velocity_of(const State<2>& s) const
    {
        SlopeVelocity r{s.t_v, 0, 0};
        double mass = 0, upper = 0;
        for (int i = 0; i < s.particles.count; ++i) {
            const double m = s.particles.m[i], v = s.particles.v[i][0];
            r.mean += m * v;
            mass += m;
            if (s.particles.X[i][1] < plane_.depth - layer_) continue;
            r.surface += m * v;
            upper += m;
        }
        return {r.t, r.surface / upper, r.mean / mass};
    }
    /// Relative L2 difference of velocities from the steady ones.
    double profile_error(const State<2>& s) const
    {
        double error = 0, size = 0;
        for (int i = 0; i < s.particles.count; ++i) {
            const Vec<2> exact{plane_.steady_velocity(std::fmin(s.particles.X[i][1], plane_.depth)), 0.0};
            error += dot(s.particles.v[i] - exact, s.particles.v[i] - exact);
            size += dot(exact, exact);
        }
        return std::sqrt(error / size);
    }

    PlaneOfGrains plane_;
    double layer_;
    std::span<const SlopeVelocity> table_;
    std::size_t next_ = 0;
    SlopeVelocity last_{};
    double error_ = 0;
    Named found_;
};

Row flow_down(const Request& r)
{
    PlaneOfGrains plane{};
    const bool has_table   = r.values.number("slope") == 25;
    plane.slope            = r.values.number("slope") * kPi / 180;
    Problem<2> p           = problem_of<2>(r);
    Material sand          = elastic_material(find_law("mu-i"), plane.density(), r.values.number("young"), 0.3);
    const double numbers[] = {plane.slow, plane.fast, plane.I0, plane.grain, plane.grain_density};
    std::copy(std::begin(numbers), std::end(numbers), sand.parameters.begin());
    const double h      = 1.0 / r.cells;
    p.model.h           = {h, h};
    p.model.cells       = {kCellsAlong, static_cast<int>(std::ceil(plane.depth / h - 1e-9)) + 2};
    p.model.periodic[0] = true;
    p.model.materials   = {sand};
    p.model.gravity     = {plane.gravity * std::sin(plane.slope), -plane.gravity * std::cos(plane.slope)};
    p.model.conditions.push_back({.axis = 1, .at = 0.0, .type = ConditionType::fixed, .value = {}});
    p.seeds =
        fill_box(Bounds<2>{{0.0, 0.0}, {kCellsAlong * h, plane.depth}}, SubCells<2>{{}, p.model.h, Index<2>::filled(r.per_axis)});
    p.dt       = r.values.number("cfl") * h / sand.wave_speed();
    p.at_start = [&](State<2>& s) { start_at_yield(s, plane, {sand.bulk_modulus(), sand.mu}); };

    GrainFlow flow(plane, h / r.per_axis,
                   has_table ? std::span<const SlopeVelocity>(kTransient) : std::span<const SlopeVelocity>());
    Row row = follow<2>(p, [&](const State<2>& s) { flow.see(s); });
    if (row.failed.empty()) row.quantities = flow.found();
    return row;
}

std::vector<Study> grain_studies()
{
    std::vector<Study> studies;
    for (const char* method : {"mpm", "ugimp"}) {
        std::vector<Bar> bars;
        for (const char* t : {"0.1", "0.25", "0.5", "1"})
            for (const char* name : {"surface", "mean"})
                bars.push_back(value_between(std::string(name) + "_over_reference_" + t, 80, 0.99, 1.01));
        studies.push_back({.method = method, .set = {}, .cells = {80}, .bars = bars});
    }
    // The steady flow. That of mpm is unstable after a shear of about 100.
    studies.push_back(
        {.method = "mls-mpm",
         .set    = {{"end", 12.01}},
         .cells  = {160},
         .bars = {value_between("mean_over_reference_12", 160, 0.98, 1.02), value_between("surface_over_steady", 160, 1.0, 1.05),
                  value_at_most("profile_error_over_size", 160, 0.025)},
         .length = Study::night});
    // 20 degrees, below arctan mu_s: the grains stay where they are. 22 degrees, above it: they do not.
    studies.push_back(
        {.method = "mpm", .set = {{"slope", 20.0}}, .cells = {80}, .bars = {value_between("surface_velocity", 80, -1e-4, 1e-4)}});
    studies.push_back({.method = "mpm",
                       .set    = {{"slope", 22.0}},
                       .cells  = {80},
                       .bars   = {{.name = "surface_velocity", .from = 80, .low = 0.05}}});
    return studies;
}

}  // namespace

Case couette()
{
    return {"couette",
            "a fluid from rest between two walls, of which one starts to move; periodic along them",
            2,
            2,
            {8, 16, 32},
            channel_parameters({"speed", 1.0, "of the wall, m/s", 0}, 0.1),
            start_couette,
            channel_studies()};
}

Case poiseuille()
{
    return {"poiseuille",
            "a fluid from rest between two walls, driven by a force along them; periodic along them",
            2,
            2,
            {8, 16, 32},
            channel_parameters({"force", 1.0, "per mass, m/s^2", 0}, 0.1),
            start_poiseuille,
            channel_studies()};
}

Case grains_on_plane()
{
    return {"grains-on-plane",
            "dry grains (mu-i) flow down a plane from rest; periodic along it",
            2,
            2,
            {80, 160},
            {{"slope", 25.0, "of the plane, degrees; transient references are those of 25", -1e-9, 32.0},
             {"young", 1e6, "Young's modulus, Pa", 0},
             {"cfl", 0.4, "dt c/h with the P-wave speed", 0},
             {"end", 1.01, "end time, s", 0}},
            flow_down,
            grain_studies()};
}

}  // namespace ordo::verification
