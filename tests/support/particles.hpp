// Methods, random and regular particles for the tests of shapes and passes.
#pragma once

#include "method/courant.hpp"
#include "method/explicit.hpp"
#include "method/planting.hpp"
#include "method/tables.hpp"
#include "particles/cell_seeding.hpp"
#include "particles/seeding.hpp"
#include "shape/box.hpp"
#include "shape/bspline.hpp"
#include "shape/cell_planting.hpp"
#include "shape/corners.hpp"
#include "shape/dual_domain.hpp"
#include "shape/point.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <type_traits>
#include <vector>

namespace ordo::test {

/// A generator with a fixed seed: tests must not depend on the day.
using Random = std::mt19937_64;

inline double uniform(Random& random, double low, double high)
{
    return std::uniform_real_distribution<double>(low, high)(random);
}

/// I + a random matrix of entries up to `size`: stretch, shear and rotation at once.
template <int D>
Mat<D> random_deformation(Random& random, double size)
{
    for (;;) {
        Mat<D> F = Mat<D>::identity();
        for (int i = 0; i < D; ++i)
            for (int j = 0; j < D; ++j) F(i, j) += uniform(random, -size, size);
        if (det(F) > 0.2) return F;
    }
}

/// Any rotation, by a quaternion.
inline Mat<3> random_rotation(Random& random)
{
    for (;;) {
        double q[4], size = 0;
        for (double& one : q) one = uniform(random, -1, 1), size += one * one;
        if (size > 1 || size < 0.01) continue;
        const double w = q[0], x = q[1], y = q[2], z = q[3], s = 2 / size;
        return {{{1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)},
                 {s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)},
                 {s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)}}};
    }
}

/// `specs`, and each of them with any one axis changed.
inline std::vector<MethodSpec> with_neighbours(const std::vector<MethodSpec>& specs)
{
    std::vector<MethodSpec> r;
    auto add = [&](const MethodSpec& s) {
        if (std::find(r.begin(), r.end(), s) == r.end()) r.push_back(s);
    };
    for (const MethodSpec& s : specs) add(s);
    for (const MethodSpec& s : specs)
        for_each_axis([&](auto axis) {
            for (const auto& choice : Axis<std::decay_t<decltype(s.*axis)>>::choices) {
                MethodSpec other = s;
                other.*axis      = choice.value;
                add(other);
            }
        });
    return r;
}

/// Combinations of the axes, allowed or not: every pair of choices, every preset, and every preset with any one axis
/// changed. From the tables, so that a new choice is among them.
inline std::vector<MethodSpec> all_specs()
{
    std::vector<MethodSpec> specs = with_neighbours({MethodSpec{}});
    for (const Preset& p : presets()) specs.push_back(p.spec);
    return with_neighbours(specs);
}

inline MethodSpec shape_spec(Basis basis, Domain domain, CornerWeights weights = CornerWeights::exact)
{
    MethodSpec s;
    s.basis   = basis;
    s.domain  = domain;
    s.weights = weights;
    return s;
}

/// The allowed shapes: basis, domain and corner weights, the other axes as they are by default.
inline std::vector<MethodSpec> shapes()
{
    std::vector<MethodSpec> r;
    for (const auto& basis : Axis<Basis>::choices)
        for (const auto& domain : Axis<Domain>::choices)
            for (const auto& weights : Axis<CornerWeights>::choices)
                if (const MethodSpec s = shape_spec(basis.value, domain.value, weights.value); !broken_rule(s)) r.push_back(s);
    return r;
}

/// The same and, where there are cells, with enriched corners.
inline std::vector<MethodSpec> all_shapes()
{
    std::vector<MethodSpec> r = shapes();
    for (const MethodSpec& s : shapes())
        for (const Enrichment enrichment : {Enrichment::interface, Enrichment::all}) {
            r.push_back(s);
            r.back().enrichment = enrichment;
            if (broken_rule(r.back())) r.pop_back();
        }
    return r;
}

/// The choices that differ from the default, for messages.
inline std::string describe(const MethodSpec& s)
{
    std::string r;
    const MethodSpec usual;
    for_each_axis([&](auto axis) {
        if (s.*axis != usual.*axis) r += (r.empty() ? "" : ", ") + std::string(name_of(s.*axis));
    });
    return r.empty() ? "defaults" : r;
}

/// f(spec) for each of them; failures and errors name it.
template <class F>
void for_each_spec(const std::vector<MethodSpec>& specs, F&& f)
{
    for (const MethodSpec& s : specs) {
        SCOPED_TRACE(describe(s));
        EXPECT_NO_THROW(f(s));
    }
}

template <class S>
struct ShapeType {
    using type = S;
};

/// f(ShapeType<S>) for the shape of a domain on a basis.
template <int D, class Basis, class F>
void with_domain(const MethodSpec& s, F&& f)
{
    switch (s.domain) {
    case Domain::point: return f(ShapeType<Point<D, Basis>>{});
    case Domain::box:
    case Domain::stretched_box: return f(ShapeType<Box<D, Basis>>{});
    case Domain::parallelepiped: return f(ShapeType<Parallelepiped<D, Basis>>{});
    case Domain::cell:
    case Domain::simplex:
        if (has_enrichment(s))
            return s.weights == CornerWeights::exact ? f(ShapeType<Cell<D, Basis, true, true>>{})
                                                     : f(ShapeType<Cell<D, Basis, false, true>>{});
        return s.weights == CornerWeights::exact ? f(ShapeType<Cell<D, Basis, true>>{}) : f(ShapeType<Cell<D, Basis, false>>{});
    }
}

/// f(ShapeType<S>) for the shape of a method.
template <int D, class F>
void with_shape(const MethodSpec& s, F&& f)
{
    switch (s.basis) {
    case Basis::hat: return with_domain<D, Hat>(s, f);
    case Basis::bspline2: return with_domain<D, BSpline<2>>(s, f);
    case Basis::bspline3: return with_domain<D, BSpline<3>>(s, f);
    case Basis::ddmpm: return f(ShapeType<DualDomain<D>>{});
    case Basis::bspline4:
    case Basis::bspline5: break;  // of splines that are fitted, which have no shape
    }
}

/// A unit box of `cells` cells a side with one neo-Hookean material, and the chosen method.
template <int D>
Model<D> unit_box(int cells, const MethodSpec& method)
{
    Model<D> model{};
    model.method    = method;
    model.h         = Vec<D>::filled(1.0 / cells);
    model.cells     = Index<D>::filled(cells);
    model.materials = {{find_law("neo-hookean"), 1000.0, 577.0, 385.0}};
    model.body_forces.resize(2);  // of halves
    return model;
}
template <int D>
Model<D> unit_box(int cells, Domain domain)
{
    return unit_box<D>(cells, shape_spec(Basis::hat, domain));
}

/// The same between walls, frictionless by default.
template <int D>
Model<D> walled_box(int cells, const MethodSpec& method, ConditionType walls = ConditionType::symmetry)
{
    Model<D> model = unit_box<D>(cells, method);
    for (int a = 0; a < D; ++a) add_walls(model, a, walls);
    return model;
}

/// A block of `per_axis` particles a cell and axis between low and high (unit box coordinates).
template <int D>
std::vector<Seed<D>> block(const Model<D>& model, double low, double high, int per_axis)
{
    return fill_box(Bounds<D>{Vec<D>::filled(low), Vec<D>::filled(high)},
                    SubCells<D>{model.origin, model.h, Index<D>::filled(per_axis)});
}

/// Particles of the seeds, as two bodies that meet in the middle of the first axis: enrichment finds an interface.
template <int D>
Particles<D> plant_halves(const Model<D>& model, const std::vector<Seed<D>>& seeds)
{
    Particles<D> p = plant_all(model, seeds);
    const auto [first, last] =
        std::minmax_element(p.x.begin(), p.x.end(), [](const auto& x, const auto& y) { return x[0] < y[0]; });
    const double middle = 0.5 * ((*first)[0] + (*last)[0]);
    for (int i = 0; i < p.count; ++i) p.body[i] = p.x[i][0] > middle;
    enrich(model, p);
    return p;
}

/// Where record n of the nodes is: a node of the grid, of splines its Greville point, or an enriched corner.
template <int D>
Vec<D> place_of_node(const State<D>& s, std::size_t n)
{
    if (n >= s.lattice.node_count()) return s.particles.corner[s.particles.enriched[n - s.lattice.node_count()]];
    const Index<D> at = s.lattice.index(static_cast<std::ptrdiff_t>(n));
    Vec<D> x{};
    for (int a = 0; a < D; ++a) x[a] = s.lattice.node_position(a, at[a]);
    return x;
}

/// Every other corner becomes an enriched one, whatever the method chooses.
template <int D>
void enrich_every_other(Particles<D>& p)
{
    p.enriched      = Array<std::int32_t>(p.corner.size() / 2);
    p.corner_planes = Array<std::uint64_t>(p.corner.size());
    p.part_count    = 1;  // random cells lie on each other
    for (std::size_t e = 0; e < p.enriched.size(); ++e) p.enriched[e] = static_cast<std::int32_t>(2 * e);
}

/// Domains follow F or their corners, which have changed; the reach is measured.
template <int D>
void follow(const Model<D>& model, State<D>& s)
{
    const Passes<D> passes  = choose_passes<D>(model.method);
    const ParticleView<D> p = s.particles.view();
    const Sweep<D> view{s.lattice, p, nullptr, model.materials.data(), 0.0, 0.0, model.method.stretch_limit};
    s.reach = 0;
    for (int i = 0; i < p.count; ++i) {
        passes.evolve(view, i);
        s.reach = std::max(s.reach, passes.reach(s.lattice, p, i));
    }
}

/// A state of particles from `count` seeds at random places with random velocities, stresses and deformed domains, sorted.
template <int D>
State<D> random_state(const Explicit<D>& method, int count, Random& random, double deformation = 0.3)
{
    const Model<D>& model = method.model();
    std::vector<Seed<D>> seeds;
    for (int i = 0; i < count; ++i) {
        Seed<D> seed{.x = {}, .volume = 1.0, .edges = {}};
        for (int a = 0; a < D; ++a) {
            seed.x[a]        = uniform(random, 0.3, 0.7);
            seed.edges(a, a) = model.h[a] / 4;
            seed.volume *= model.h[a] / 2;
        }
        seeds.push_back(seed);
    }
    Particles<D> planted = plant_all(model, seeds);
    if (has_enrichment(model.method)) enrich_every_other(planted);
    State<D> s      = method.start(std::move(planted));
    Particles<D>& p = s.particles;
    for (Vec<D>& corner : p.corner)  // corners are h/2 apart
        for (int a = 0; a < D; ++a) corner[a] += uniform(random, -0.2, 0.2) * deformation * model.h[a];
    for (int i = 0; i < p.count; ++i) {
        p.F[i] = random_deformation<D>(random, deformation);
        p.V[i] = det(p.F[i]) * p.V0[i];
        for (int a = 0; a < D; ++a) {
            p.v[i][a] = uniform(random, -1, 1);
            for (int b = a; b < D; ++b) p.sigma[i](a, b) = uniform(random, -100, 100);
        }
    }
    follow(model, s);
    return s;
}

}  // namespace ordo::test
