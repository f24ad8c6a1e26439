// Motions with uniform F: a rigid rotation and a simple shear. All errors come from the method.
#include "verification/cases.hpp"
#include "verification/elastic.hpp"
#include "verification/motions.hpp"

namespace ordo::verification {

namespace {

/// A free block of half the unit box rotates about its middle.
template <int D>
Row turn(const Request& r)
{
    const double h = 1.0 / r.cells;
    Problem<D> p   = on_grid<D>(r, Vec<D>{}, Index<D>::filled(r.cells));
    p.seeds        = fill_box(Bounds<D>{Vec<D>::filled(0.25), Vec<D>::filled(0.75)},
                              SubCells<D>{Vec<D>{}, Vec<D>::filled(h), Index<D>::filled(r.per_axis)});
    p.contains     = [](const Vec<D>& X) {
        for (int a = 0; a < D; ++a)
            if (!(X[a] >= 0.25 && X[a] <= 0.75)) return false;
        return true;
    };
    const double frequency = 2 * kPi * r.values.number("turns") / p.end;
    manufacture(p, RigidRotation{frequency});
    // The centripetal force depends on the current position of the particle. As a function of X and t, which automatic
    // differentiation gives, it would drive the block away from its angle: errors would grow by e^(w t).
    p.model.body_force_kernel = nullptr;
    for (int a = 0; a < 2; ++a)
        p.model.body_forces[0][a] = Field([=](const FieldPoint& at) { return -frequency * frequency * (at.x[a] - 0.5); });
    return measure(p);
}

/// The unit box, periodic along x, between walls that slide on each other.
template <int D>
Row slide(const Request& r)
{
    const double rate   = r.values.number("shear") / r.values.number("end");
    Problem<D> p        = on_grid<D>(r, Vec<D>{}, Index<D>::filled(r.cells));
    p.model.periodic[0] = true;
    if constexpr (D == 3) add_walls(p.model, 2);
    for (const bool above : {false, true}) {
        Condition<D> wall{
            .axis = 1, .outer_is_above = above, .at = above ? 1.0 : 0.0, .type = ConditionType::velocity, .value = {}};
        wall.value[0] = Field(above ? rate : 0.0);
        wall.value[1] = Field(0.0);
        p.model.conditions.push_back(std::move(wall));
    }
    p.seeds = fill_box(Bounds<D>{Vec<D>{}, Vec<D>::filled(1.0)}, SubCells<D>{Vec<D>{}, p.model.h, Index<D>::filled(r.per_axis)});
    p.contains = [](const Vec<D>& X) { return X[1] >= -1e-12 && X[1] <= 1 + 1e-12; };
    manufacture(p, SimpleShear{rate});
    return measure(p);
}

bool is_3d(const Request& r) { return r.values.word("dim") == "3"; }

}  // namespace

Case rotation()
{
    return {"rotation",
            "a free block turns rigidly about its middle",
            2,
            2,
            {8, 16, 32},
            elastic_parameters({{"turns", 1.0, "how often"}, {"dim", "2", "dimensions", 0, 0, {"2", "3"}}}, 1e5, 0.3, 0.2, 1.0),
            [](const Request& r) { return is_3d(r) ? turn<3>(r) : turn<2>(r); },
            {{.method = "cpdi1", .set = {}, .cells = {8, 16, 32}, .bars = orders_at_least("displacement", {16, 32}, 1.9)},
             {.method = "cpdi2", .set = {}, .cells = {8, 16, 32}, .bars = orders_at_least("displacement", {16, 32}, 1.9)},
             {.method = "cpdi2t", .set = {}, .cells = {8, 16, 32}, .bars = orders_at_least("displacement", {16, 32}, 1.9)}}};
}

Case simple_shear()
{
    return {"simple-shear",
            "layers slide on each other between walls, periodic along them",
            2,
            2,
            {8, 16, 32},
            elastic_parameters({{"shear", 5.0, "gamma at the end"}, {"dim", "2", "dimensions", 0, 0, {"2", "3"}}}, 1e5, 0.3, 0.1,
                               1.0),
            [](const Request& r) { return is_3d(r) ? slide<3>(r) : slide<2>(r); },
            // The walls drag the particles next to them: the error of the lumped mass.
            {{.method = "cpdi1", .set = {}, .cells = {8, 16}, .bars = {value_at_most("displacement", 16, 1e-4)}},
             {.method = "cpdi2", .set = {}, .cells = {8, 16}, .bars = {value_at_most("displacement", 16, 1e-4)}},
             {.method = "bsmpm", .set = {}, .cells = {8}, .bars = {value_at_most("displacement", 8, 1e-10)}}}};
}

}  // namespace ordo::verification
