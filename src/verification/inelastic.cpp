// Manufactured solutions with plastic flow and with viscosity.
#include "material/fluid.hpp"
#include "material/laws.hpp"
#include "method/courant.hpp"
#include "method/planting.hpp"
#include "verification/cases.hpp"
#include "verification/elastic.hpp"
#include "verification/monotone_j2.hpp"
#include "verification/motions.hpp"
#include "verification/newtonian.hpp"
#include "verification/polar.hpp"

namespace ordo::verification {

namespace {

// ---- plastic flow ----------------------------------------------------------------------------------------------------------

std::vector<Parameter> plastic_parameters(std::vector<Parameter> own, double end)
{
    const std::vector<Parameter> common{{"young", 1e7, "Young's modulus, Pa", 0},
                                        {"nu", 0.3, "Poisson's ratio", -1, 0.5},
                                        {"yield", 2e5, "yield stress, Pa", 0},
                                        {"hardening", 1e6, "its slope over plastic strain, Pa", -1e-9},
                                        {"density", 1000.0, "initial density, kg/m^3", 0},
                                        {"cfl", 0.4, "dt c/h with c = sqrt(E/rho0)", 0},
                                        {"end", end, "end time, s", 0}};
    own.insert(own.end(), common.begin(), common.end());
    return own;
}

MonotoneJ2 monotone_law(const Values& v)
{
    const Material m = ordo::elastic_material(nullptr, v.number("density"), v.number("young"), v.number("nu"));
    return {{m.bulk_modulus(), m.mu}, v.number("yield"), v.number("hardening")};
}

/// A problem on a grid of cubes, of material j2, with the motion as its solution.
template <int D, class Motion>
Problem<D> plastic_problem(const Request& r, const Index<D>& cells, const Motion& motion)
{
    Problem<D> p = problem_of<D>(r);
    Material m =
        ordo::elastic_material(find_law("j2"), r.values.number("density"), r.values.number("young"), r.values.number("nu"));
    m.parameters[0] = m.parameters[2] = r.values.number("yield");
    m.parameters[1]                   = r.values.number("hardening");
    p.model.h                         = Vec<D>::filled(1.0 / r.cells);
    p.model.cells                     = cells;
    p.model.materials                 = {m};
    p.dt                              = r.values.number("cfl") * p.model.h[0] / paper_speed(r.values);
    manufacture(p, motion, monotone_law(r.values));
    return p;
}

/// The plastic strain against that of the solution, and against that which follows from the particle's own F: the latter holds to
/// round-off if the particle yielded in every step.
template <int D>
Named measure_plastic_strain(const State<D>& s, const Solution<D>& solution, const MonotoneJ2& law)
{
    const Particles<D>& p       = s.particles;
    const Array<double>& strain = p.history[p.history_column("plastic_strain")];
    double error = 0, defect = 0, least = 1e300, largest = 0;
    for (int i = 0; i < p.count; ++i) {
        const double off = strain[i] - law.plastic_strain(solution.deformation(p.X[i], s.t_F));
        error += off * off;
        defect  = std::fmax(defect, std::fabs(strain[i] - law.plastic_strain(p.F[i])));
        least   = std::fmin(least, strain[i]);
        largest = std::fmax(largest, strain[i]);
    }
    return {{"plastic_strain_error", std::sqrt(error / p.count)},
            {"plastic_strain_defect", defect},
            {"least_plastic_strain", least},
            {"largest_plastic_strain", largest}};
}

/// A dead traction with the first Piola-Kirchhoff stress of the solution on a face with normal along x through X.
template <int D>
Traction<D> exact_traction_at(const Vec<D>& X, const std::shared_ptr<const Solution<D>>& solution)
{
    Traction<D> r{.type = TractionType::dead, .value = {}};
    r.value[0] =
        Field([=](const FieldPoint& at) { return (solution->stress(X, at.t) * cofactor(solution->deformation(X, at.t)))(0, 0); });
    return r;
}

/// A bar held at one end, stretched or compressed from the yield point at the other.
template <int D>
Row stretch_bar(const Request& r)
{
    const double amplitude = r.values.number("amplitude");
    const MonotoneJ2 law   = monotone_law(r.values);
    GrowingStretch motion{.start     = std::exp(std::copysign(law.yield / (2 * law.elastic.shear), amplitude)),
                          .amplitude = amplitude,
                          .frequency = kPi / 2 * paper_speed(r.values)};
    Index<D> cells = Index<D>::filled(r.cells);
    cells[0]       = static_cast<int>(std::ceil((motion.start + std::fmax(amplitude, 0.0)) * r.cells)) + 1;
    for (int a = 1; a < D; ++a) cells[a] = 2;  // nothing varies along these axes
    Problem<D> p = plastic_problem<D>(r, cells, motion);
    p.model.conditions.push_back({.axis = 0, .at = 0.0, .type = ConditionType::symmetry, .value = {}});
    for (int a = 1; a < D; ++a) add_walls(p.model, a);
    Bounds<D> box{Vec<D>{}, Vec<D>::filled(2 * p.model.h[0])};
    box.upper[0] = 1.0;
    p.seeds      = fill_box(box, SubCells<D>{Vec<D>{}, p.model.h, Index<D>::filled(r.per_axis)});
    p.contains   = [](const Vec<D>& X) { return X[0] >= -1e-12 && X[0] <= 1 + 1e-12; };
    Vec<D> face  = Vec<D>::filled(p.model.h[0]);
    face[0]      = 1.0;
    p.model.tractions.push_back(exact_traction_at<D>(face, p.solution));
    p.load   = [](const Vec<D>& normal, const Vec<D>&) { return normal[0] > 0.5 ? 0 : -1; };
    p.at_end = [law, solution = p.solution](const State<D>& s) { return measure_plastic_strain(s, *solution, law); };
    return measure(p);
}

/// Sets plastic strain, elastic strain and stress of particles of j2 that have yielded on the way to F, without what that dissipated.
template <int D>
void start_yielded(State<D>& s, const MonotoneJ2& law)
{
    Particles<D>& p = s.particles;
    for (int i = 0; i < p.count; ++i) {
        const Symmetric<D> b                             = stretched(law.elastic_strain(p.F[i]));
        p.history[p.history_column("plastic_strain")][i] = law.plastic_strain(p.F[i]);
        for (int k = 0; k < Symmetric<D>::size; ++k) p.history[p.history_column(kElasticColumns[k].name)][i] = b.c[k];
        p.sigma[i] = law.cauchy(p.F[i]);
    }
}

/// A quarter of a ring grows without change of volume under the exact pressure on its rims.
Row grow_ring(const Request& r)
{
    const double inner = 0.4, outer = 0.6, start = 0.02, amplitude = r.values.number("amplitude");
    const MonotoneJ2 law = monotone_law(r.values);
    const int n          = r.per_axis * r.cells;  // particles per metre of the undeformed grid
    const RingGrowth motion{start, amplitude, kPi / 2 * paper_speed(r.values)};
    const Index<2> cells =
        Index<2>::filled(static_cast<int>(std::ceil(std::sqrt(outer * outer + start + amplitude) * r.cells)) + 2);
    Problem<2> p = plastic_problem<2>(r, cells, motion);
    add_symmetry_planes(p);
    fill_tube(p, Tube<2>{.inner = inner, .outer = outer, .to = kPi / 2}, cells_along(0.2, n), cells_along(0.8, n), 1);
    load_rims(p, exact_pressure(p, inner), exact_pressure(p, outer));
    p.at_start = [law](State<2>& s) { start_yielded(s, law); };
    p.at_end   = [law, solution = p.solution](const State<2>& s) { return measure_plastic_strain(s, *solution, law); };
    return measure(p);
}

// ---- viscosity -------------------------------------------------------------------------------------------------------------

/// A fluid in the unit box, whose walls hold it. It starts deformed and at rest: the stress at the start is that of F alone.
template <int D>
Row stir_box(const Request& r)
{
    const Values& v = r.values;
    Material fluid{find_law("fluid"), v.number("density"), 0.0, 0.0, {}};
    const double numbers[] = {v.number("sound_speed"), 7.0, v.number("viscosity"), 0.0, LawParameter::none, 1.0};
    std::copy(std::begin(numbers), std::end(numbers), fluid.parameters.begin());
    fluid.law->complete(fluid);
    Problem<D> p      = problem_of<D>(r);
    p.model.h         = Vec<D>::filled(1.0 / r.cells);
    p.model.cells     = Index<D>::filled(r.cells);
    p.model.materials = {fluid};
    for (int a = 0; a < D; ++a) add_walls(p.model, a, ConditionType::fixed);
    p.seeds = fill_box(Bounds<D>{Vec<D>{}, Vec<D>::filled(1.0)}, SubCells<D>{Vec<D>{}, p.model.h, Index<D>::filled(r.per_axis)});
    p.contains = [](const Vec<D>& X) {
        for (int a = 0; a < D; ++a)
            if (!(X[a] >= -1e-12 && X[a] <= 1 + 1e-12)) return false;
        return true;
    };
    p.dt = v.number("cfl") * stable_time_step(p.model, ordo::plant_all(p.model, p.seeds));
    manufacture(p, BentBox{v.number("amplitude"), kPi * v.number("sound_speed"), kPi / 2}, NewtonianFlow{Fluid::of(fluid)});
    return measure(p);
}

std::vector<Study> bar_studies()
{
    const std::vector<int> cells{16, 32, 64};
    std::vector<Study> studies;
    for (const char* dim : {"1", "2"})
        for (const double amplitude : {0.1, -0.1}) {
            const auto study = [&](const char* method, const std::vector<Bar>& bars) {
                studies.push_back({.method = method,
                                   .set    = {{"dim", dim}, {"amplitude", amplitude}},
                                   .cells  = cells,
                                   .bars   = bars + std::vector<Bar>{value_at_most("plastic_strain_defect", 64, 1e-12)}});
            };
            for (const char* method : {"cpdi1", "cpdi2"}) study(method, orders_at_least("displacement", cells, 1.9));
            study("cpls", orders_at_least("displacement", cells, 1.95) + orders_at_least("velocity", cells, 1.95) +
                              orders_at_least("stress", cells, 1.75) + orders_at_least("plastic_strain_error", cells, 1.75));
        }
    // Negative controls: points lose contact with the free end, boxes of constant size overlap or gape.
    studies.push_back({.method = "mpm", .set = {}, .cells = {32}, .bars = {fails_at(32)}});
    studies.push_back({.method = "ugimp",
                       .set    = {{"amplitude", -0.1}},
                       .cells  = {32, 64},
                       .bars   = orders_at_most("displacement", {32, 64}, 0.8)});
    return studies;
}

Study box_study(const std::string& method, const std::vector<int>& cells, Study::Length length)
{
    return {.method = method,
            .set    = {},
            .cells  = cells,
            .bars   = orders_at_least("displacement", cells, 1.95) + orders_at_least("velocity", cells, 1.8) +
                    orders_at_least("stress", cells, 1.6),
            .length = length};
}

}  // namespace

Case plastic_ring()
{
    return {"plastic-ring",
            "a quarter of a ring of j2 grows without change of volume under the exact pressure; all of it loads all the time",
            2,
            2,
            {10, 20, 40},
            plastic_parameters({{"amplitude", 0.06, "growth of the squared radii, m^2", 0}}, 0.008),
            grow_ring,
            {{.method = "cpdi2",
              .set    = {},
              .cells  = {10, 20, 40},
              .bars   = orders_at_least("displacement", {10, 20, 40}, 1.95) + orders_at_least("stress", {10, 20, 40}, 1.4) +
                      std::vector<Bar>{value_at_most("plastic_strain_defect", 40, 3e-5)}},
             {.method = "cpdi2t", .set = {}, .cells = {10, 20, 40}, .bars = orders_at_least("displacement", {10, 20, 40}, 1.95)},
             // Negative control: parallelepipeds do not tile the ring.
             {.method = "cpdi1", .set = {}, .cells = {20, 40}, .bars = orders_at_most("displacement", {20, 40}, 1.6)}}};
}

Case viscous_box()
{
    return {"viscous-box",
            "a viscous fluid in a box shears and turns, from its largest deformation at rest",
            2,
            2,
            {8, 16, 32},
            {{"amplitude", 0.03, "m"},
             {"density", 1000.0, "initial density, kg/m^3", 0},
             {"sound_speed", 100.0, "m/s", 0},
             {"viscosity", 1e4, "dynamic viscosity, Pa s", 0},
             {"cfl", 0.5, "part of the stable time step", 0},
             {"end", 0.008, "end time, s", 0},
             {"dim", "2", "dimensions", 0, 0, {"2", "3"}}},
            [](const Request& r) { return r.values.word("dim") == "3" ? stir_box<3>(r) : stir_box<2>(r); },
            {box_study("cpdi1", {8, 16, 32}, Study::quick),
             box_study("cpls", {8, 16}, Study::quick),
             box_study("cpdi2", {8, 16}, Study::quick),
             box_study("cpls", {16, 32}, Study::night),
             box_study("cpdi2", {16, 32}, Study::night),
             {.method = "cpdi1",
              .set    = {{"dim", "3"}},
              .cells  = {4, 8},
              .bars   = orders_at_least("displacement", {4, 8}, 1.95) + orders_at_least("velocity", {4, 8}, 1.95)}}};
}

Case plastic_bar()
{
    return {"plastic-bar",
            "a bar of j2 held at one end, stretched from the yield point; all of it loads all the time",
            1,
            2,
            {16, 32, 64},
            plastic_parameters({{"amplitude", 0.1, "strain added, on average; negative compresses", -0.5, 2.0},
                                {"dim", "1", "dimensions", 0, 0, {"1", "2"}}},
                               0.008),
            [](const Request& r) { return r.values.word("dim") == "2" ? stretch_bar<2>(r) : stretch_bar<1>(r); },
            bar_studies()};
}

}  // namespace ordo::verification
