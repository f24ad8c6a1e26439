// The particles of a body before they are planted: seeds, their corners, cells. Used by setup/build.cpp.
#pragma once

#include "setup/spec.hpp"

#include "particles/cell_seeding.hpp"

#include <cstddef>
#include <functional>
#include <vector>

namespace ordo::setup {

/// Calls its argument with each seed of a body, in the order of the particles. Seeds of shapes exist one at a time: a rank need not hold
/// those of all.
template <int D>
using SeedWalk = std::function<void(const std::function<void(const Seed<D>&)>&)>;

/// f(seed, number of its body) for the seeds of all bodies.
template <int D, class F>
void for_each_seed(const std::vector<SeedWalk<D>>& bodies, F&& f)
{
    for (std::size_t k = 0; k < bodies.size(); ++k) bodies[k]([&](const Seed<D>& seed) { f(seed, static_cast<int>(k)); });
}

/// The parts of a body. Without corners and mesh, corners are those of the seeds' parallelepipeds.
template <int D>
struct Filling {
    SeedWalk<D> walk;
    std::function<std::vector<CornerPoints<D>>()> corners{};
    CellMesh<D> mesh{};
};

/// Fills body k; moves particles and meshes out of it. Throws SetupError if a shape is invalid, misses the grid, or could hold
/// more than `most_particles`.
template <int D>
Filling<D> fill_body(BodySpec<D>& body, int k, const Model<D>& model, double most_particles);

/// The cells of a body, with shared corners.
template <int D>
CellMesh<D> mesh_body(const Filling<D>& filling, int k, const MethodSpec& method);

/// Throws SetupError if there would be more particles than `most`, or none in body k.
void require_count(int k, double count, double most);
void require_some(int k, std::ptrdiff_t count);

/// Whether the cells of a body are polar, which differ from the domains of their seeds.
template <int D>
bool is_polar(const BodySpec<D>& body)
{
    const auto* tube = std::get_if<TubeShape<D>>(&body.shape);
    return (tube && tube->is_polar) || std::holds_alternative<PolarBall<D>>(body.shape);
}
template <int D>
bool is_mesh(const BodySpec<D>& body)
{
    return std::holds_alternative<MeshShape<D>>(body.shape);
}

}  // namespace ordo::setup
