// Random and regular particles for the tests of shapes and passes.
#pragma once

#include "method/explicit.hpp"
#include "particles/seeding.hpp"

#include <cmath>
#include <random>

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

/// A unit box of `cells` cells a side with one neo-Hookean material, and the chosen domain.
template <int D>
Model<D> unit_box(int cells, Domain domain)
{
    Model<D> model{};
    model.method.domain = domain;
    model.h             = Vec<D>::filled(1.0 / cells);
    model.cells         = Index<D>::filled(cells);
    model.materials     = {{MaterialModel::neo_hookean, 1000.0, 577.0, 385.0}};
    model.body_forces.resize(1);
    return model;
}

/// Particles from seeds, with initial domains as the model's method wants them.
template <int D>
Particles<D> make_particles(const Model<D>& model, const std::vector<Seed<D>>& seeds)
{
    Particles<D> p(static_cast<int>(seeds.size()), field_groups(model));
    for (int i = 0; i < p.count; ++i) plant(p, i, seeds[i], model.materials[0].density);
    return p;
}

/// A block of `per_axis` particles a cell and axis between low and high (unit box coordinates).
template <int D>
std::vector<Seed<D>> block(const Model<D>& model, double low, double high, int per_axis)
{
    return fill_box(Bounds<D>{Vec<D>::filled(low), Vec<D>::filled(high)},
                    SubCells<D>{model.origin, model.h, Index<D>::filled(per_axis)});
}

/// A state of `count` particles at random places with random velocities, stresses and deformed domains, sorted.
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
    State<D> s      = method.start(make_particles(model, seeds));
    Particles<D>& p = s.particles;
    s.reach         = 0;
    for (int i = 0; i < p.count; ++i) {
        p.F[i] = random_deformation<D>(random, deformation);
        p.V[i] = det(p.F[i]) * p.V0[i];
        for (int a = 0; a < D; ++a) {
            p.v[i][a] = uniform(random, -1, 1);
            for (int b = a; b < D; ++b) p.sigma[i](a, b) = p.sigma[i](b, a) = uniform(random, -100, 100);
        }
        if (!p.edges.empty()) p.edges[i] = p.F[i] * p.edges0[i];
        if (!p.half.empty())
            for (int a = 0; a < D; ++a) p.half[i][a] = p.F[i](a, a) * p.half0[i][a];
        s.reach = std::max(s.reach, reach_of<D>(model.method, s.lattice, p.view(), i).cells);
    }
    return s;
}

inline constexpr Domain kDomains[] = {Domain::point, Domain::box, Domain::stretched_box, Domain::parallelepiped};

}  // namespace ordo::test
