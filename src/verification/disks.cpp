// Disks that collide with each other and with walls: Tran et al. (2019) secs. 4.5 and 4.6. No exact solution: energies.
#include "verification/cases.hpp"
#include "verification/elastic.hpp"

#include <cmath>

namespace ordo::verification {

namespace {

constexpr double kYoung = 1000.0, kPoisson = 0.3, kDensity = 1000.0, kRadius = 0.2, kSpeed = 0.1;

std::vector<Parameter> disk_parameters(double end)
{
    return {{"material", "jaumann-elastic", "material law", 0, 0, {"jaumann-elastic", "neo-hookean", "st-venant-kirchhoff"}},
            {"nu", kPoisson, "Poisson's ratio", -1, 0.5},
            {"dt", 0.005, "time step, s", 0},
            {"end", end, "end time, s", 0}};
}

/// The unit box with disks at `centers`.
Problem<2> disks(const Request& r, const std::vector<Vec<2>>& centers)
{
    const std::string& law = r.values.word("material");
    Problem<2> p           = problem_of<2>(r);
    p.model.h              = Vec<2>::filled(1.0 / r.cells);
    p.model.cells          = Index<2>::filled(r.cells);
    p.model.materials      = {elastic_material(find_law(law), kDensity, kYoung, r.values.number("nu"))};
    p.dt                   = r.values.number("dt");
    for (const Vec<2>& center : centers) {
        const auto own = fill(Ball<2>{center, kRadius}, SubCells<2>{{}, p.model.h, Index<2>::filled(r.per_axis)});
        p.seeds.insert(p.seeds.end(), own.begin(), own.end());
    }
    return p;
}

Row collide(const Request& r)
{
    Problem<2> p = disks(r, {{0.3, 0.3}, {0.8, 0.8}});
    p.velocity   = [](const Vec<2>& X) { return Vec<2>::filled((X[0] + X[1] < 1.1 ? 1 : -1) * kSpeed / std::sqrt(2.0)); };
    return watch(p);
}

Row rebound(const Request& r)
{
    Problem<2> p = disks(r, {{0.4, 0.4}});
    p.velocity   = [](const Vec<2>&) { return Vec<2>{kSpeed, 0.0}; };
    p.model.conditions.push_back({.axis = 0, .at = 0.05, .type = ConditionType::symmetry, .value = {}});
    p.model.conditions.push_back({.axis = 0, .outer_is_above = true, .at = 0.75, .type = ConditionType::symmetry, .value = {}});
    return watch(p);
}

}  // namespace

Case two_disks()
{
    return {"two-disks",
            "two elastic disks collide along the diagonal: energies of Tran sec. 4.5, after Sulsky et al. (1994)",
            2,
            3,
            {20},
            disk_parameters(3.5),
            collide,
            {{.method = "cpdi1",
              .set    = {},
              .cells  = {20},
              .bars   = {value_between("total_energy", 20, 0.945, 0.965), value_at_most("largest_total_energy", 20, 1.001),
                         value_at_most("momentum_change", 20, 1e-12)}},
             {.method = "cpls-limited",
              .set    = {},
              .cells  = {20},
              .bars   = {value_between("total_energy", 20, 0.945, 0.975), value_at_most("largest_total_energy", 20, 1.001),
                         value_at_most("momentum_change", 20, 1e-12)}},
             {.method = "cpls-limited",
              .set    = {{"method.strain_velocity", 0.3}},
              .cells  = {20},
              .bars   = {value_between("total_energy", 20, 0.96, 0.98), value_at_most("largest_total_energy", 20, 1.001)}},
             {.method = "cpls", .set = {}, .cells = {20}, .bars = {value_between("largest_total_energy", 20, 1.003, 1.02)}}}};
}

Case wall_rebound()
{
    return {"wall-rebound",
            "an elastic disk rebounds between frictionless walls: energies of Tran sec. 4.6",
            2,
            2,
            {20},
            disk_parameters(10.0),
            rebound,
            {{.method = "cpdi1",
              .set    = {},
              .cells  = {20},
              .bars   = {value_between("total_energy", 20, 0.78, 0.83), value_at_most("largest_total_energy", 20, 1.01)}}}};
}

}  // namespace ordo::verification
