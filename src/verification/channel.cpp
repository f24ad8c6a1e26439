// Flows between parallel walls and down a plane, periodic along the flow.
#include "verification/channel.hpp"

#include "material/laws.hpp"
#include "method/courant.hpp"
#include "method/planting.hpp"
#include "verification/cases.hpp"
#include "verification/measure.hpp"

#include <cmath>

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

}  // namespace ordo::verification
