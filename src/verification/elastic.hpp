// Shared by cases with manufactured solutions: parameters of the material and of the run, and problems made from motions.
#pragma once

#include "verification/any_law.hpp"
#include "verification/measure.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

namespace ordo::verification {

/// The parameters of a case, `own`, and after them material law, E, nu, density, cfl and end.
inline std::vector<Parameter> elastic_parameters(std::vector<Parameter> own, double young, double poisson, double cfl, double end)
{
    const std::vector<Parameter> common{{"material", "neo-hookean", "material law", 0, 0, {"neo-hookean", "st-venant-kirchhoff"}},
                                        {"young", young, "Young's modulus, Pa", 0},
                                        {"nu", poisson, "Poisson's ratio", -1, 0.5},
                                        {"density", 1000.0, "initial density, kg/m^3", 0},
                                        {"cfl", cfl, "dt c/h with c = sqrt(E/rho0)", 0},
                                        {"end", end, "end time, s", 0}};
    own.insert(own.end(), common.begin(), common.end());
    return own;
}

inline Material elastic_material(const Values& v)
{
    return elastic_material(find_law(v.word("material")), v.number("density"), v.number("young"), v.number("nu"));
}

/// c = sqrt(E/rho0), m/s: the speed to which frequencies and time steps of the papers refer.
inline double paper_speed(const Values& v) { return std::sqrt(v.number("young") / v.number("density")); }

/// A problem on a grid of cubes of size h = 1/cells; the caller adds particles and the body's extent.
template <int D>
Problem<D> on_grid(const Request& request, const Vec<D>& origin, const Index<D>& cells)
{
    Problem<D> p      = problem_of<D>(request);
    p.model.h         = Vec<D>::filled(1.0 / request.cells);
    p.model.origin    = origin;
    p.model.cells     = cells;
    p.model.materials = {elastic_material(request.values)};
    p.dt              = request.values.number("cfl") * p.model.h[0] / paper_speed(request.values);
    return p;
}

/// Parameters for the positions of particles in a box.
inline std::vector<Parameter> placement_parameters()
{
    return {{"seeding", "centres", "particles at the centres of sub-cells or at Gauss points", 0, 0, {"centres", "gauss"}},
            {"jitter", 0.0, "random part of the particles' places, in their distance", -1e-9, 0.5}};
}
template <int D>
std::vector<Seed<D>> placed_in(const Bounds<D>& box, const Model<D>& model, const Request& r)
{
    std::vector<Seed<D>> seeds =
        fill_box(box, SubCells<D>{model.origin, model.h, Index<D>::filled(r.per_axis), r.values.word("seeding") == "gauss"});
    std::mt19937_64 random(1);
    const double jitter = r.values.number("jitter");
    for (Seed<D>& seed : seeds)
        for (int a = 0; a < D && jitter > 0; ++a)
            seed.x[a] += jitter * model.h[a] / r.per_axis * (2 * std::generate_canonical<double, 53>(random) - 1);
    return seeds;
}

/// Makes the motion the solution of the problem, by adding its body force. The law is that of the material, as a function of F, or of
/// F and F'.
template <int D, class Motion, class Law>
void manufacture(Problem<D>& problem, const Motion& motion, const Law& law)
{
    const double density            = problem.model.materials[0].density;
    const auto solution             = std::make_shared<Manufactured<D, Motion, Law>>(motion, law, density);
    problem.solution                = solution;
    problem.model.body_force_kernel = [solution](const ParticleView<D>& p, std::ptrdiff_t begin, std::ptrdiff_t end, double t) {
        solution->fill_body_force(p, begin, end, t);
    };
}

template <int D, class Motion>
void manufacture(Problem<D>& problem, const Motion& motion)
{
    manufacture(problem, motion, AnyLaw<D>(problem.model.materials[0]));
}

/// A problem in the unit box between walls.
template <int D, class Motion>
Problem<D> in_unit_box(const Request& request, const Motion& motion, ConditionType walls = ConditionType::symmetry)
{
    Problem<D> p = on_grid<D>(request, Vec<D>{}, Index<D>::filled(request.cells));
    for (int a = 0; a < D; ++a) add_walls(p.model, a, walls);
    p.seeds    = placed_in(Bounds<D>{Vec<D>{}, Vec<D>::filled(1.0)}, p.model, request);
    p.contains = [](const Vec<D>& X) {
        for (int a = 0; a < D; ++a)
            if (!(X[a] >= -1e-12 && X[a] <= 1 + 1e-12)) return false;
        return true;
    };
    manufacture(p, motion);
    return p;
}

}  // namespace ordo::verification
