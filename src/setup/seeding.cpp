#include "setup/seeding.hpp"

#include "method/place.hpp"
#include "method/planting.hpp"
#include "particles/round_cells.hpp"
#include "setup/inside.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

namespace ordo::setup {

namespace {

constexpr double kDegree = std::numbers::pi / 180;

[[noreturn]] void fail(int k, std::string_view key, std::string_view why) { throw SetupError(Part::body, k, key, why); }

void require_radius(int k, double radius)
{
    if (!(radius > 0)) fail(k, "radius", fmt::format("must be positive (got {})", radius));
}

template <int D>
void require_shape(const Bounds<D>& box, int k)
{
    for (int a = 0; a < D; ++a)
        if (!(box.lower[a] < box.upper[a]))
            fail(k, "upper",
                 fmt::format("must be larger than lower on every axis (axis {}: {} and {})", "xyz"[a], box.lower[a],
                             box.upper[a]));
}

template <int D>
void require_shape(const TubeShape<D>& shape, int k)
{
    const Tube<D>& tube = shape.tube;
    require_radius(k, tube.outer);
    if (!(tube.inner >= 0 && tube.inner < tube.outer))
        fail(k, "inner_radius", fmt::format("must be smaller than radius {} (got {})", tube.outer, tube.inner));
    const double angle = tube.to - tube.from;
    if (!(angle > 0 && angle <= 2 * std::numbers::pi * (1 + 1e-12)))
        fail(k, "angle", fmt::format("must grow by at most 360 degrees (got {} to {})", tube.from / kDegree, tube.to / kDegree));
    if (shape.is_polar && !(tube.inner > 0) && angle < 2 * std::numbers::pi * (1 - 1e-12))
        fail(k, "cells", "polar cells of a part need a hole: give an inner_radius above zero");
    if (D == 3 && !(tube.axis >= 0 && tube.axis < 3)) fail(k, "axis", "must be 0, 1 or 2");
    if (D == 3 && !(tube.bottom < tube.top)) fail(k, "height", "must be positive");
}

/// The bounds of a shape must meet the grid and hold at most `most` sub-cells.
template <int D>
void require_fillable(const BodySpec<D>& b, int k, const Bounds<D>& bounds, const SubCells<D>& cells, const Model<D>& model,
                      double most)
{
    require_near(b, k, bounds, model);
    double count = 1;
    for (int a = 0; a < D; ++a) count *= (bounds.upper[a] - bounds.lower[a]) / (cells.h[a] / cells.n[a]) + 1;
    require_count(k, count, most);
}

/// Polar cells: as many as the shape says, else about as large as the grid's sub-cells at the middle radius.
template <int D>
Filling<D> fill_polar_cells(const TubeShape<D>& shape, int k, const SubCells<D>& cells, double most)
{
    const Tube<D>& tube = shape.tube;
    double all          = 1;
    auto count          = [&](std::optional<int> given, double length, double cell) {
        const double n = given ? *given : std::max(1.0, std::round(length / cell));
        require_count(k, all *= n, most);
        return std::max(1, static_cast<int>(n));
    };
    const int e1 = tube.first(), e2 = tube.second();
    const int radial  = count(shape.radial, tube.outer - tube.inner, cells.h[e1] / cells.n[e1]);
    const int angular = count(shape.angular, (tube.to - tube.from) * (tube.inner + tube.outer) / 2, cells.h[e2] / cells.n[e2]);
    const int layers  = D == 3 ? count(shape.layers, tube.top - tube.bottom, cells.h[tube.axis] / cells.n[tube.axis]) : 1;
    if ((tube.to - tube.from) / angular > 60 * kDegree * (1 + 1e-12))
        fail(k, "angular",
             fmt::format("makes cells of {:.3g} degrees; at most 60 are allowed, because domains have straight sides",
                         (tube.to - tube.from) / angular / kDegree));
    return {[=](const auto& f) { walk_polar(tube, radial, angular, layers, f); },
            [=] { return polar_cells(tube, radial, angular, layers); },
            {}};
}

/// Around a core: as many cells as the shape says, else about as large as the grid's sub-cells.
template <int D, class Shape>
RoundCount count_of(const Shape& shape, int k, double radius, const SubCells<D>& cells, int dim)
{
    double size = 1.0;
    for (int a = 0; a < D; ++a) size *= cells.h[a] / cells.n[a];
    const double cell = std::pow(size, 1.0 / D);
    require_count(k, std::pow(radius / cell, dim), 1e15);
    RoundCount r = RoundCount::of(radius, cell, dim);
    if (shape.angular && (*shape.angular % 4 != 0 || *shape.angular < 8))
        fail(k, "angular", fmt::format("must be a multiple of 4, and 8 at least, around a core (got {})", *shape.angular));
    if (shape.angular) r.side = *shape.angular / 4;
    if (shape.radial) r.radial = *shape.radial;
    return r;
}

template <int D>
SeedWalk<D> walk_list(std::vector<Seed<D>> seeds)
{
    return [all = std::make_shared<const std::vector<Seed<D>>>(std::move(seeds))](const auto& f) {
        for (const Seed<D>& seed : *all) f(seed);
    };
}

/// The cells of a mesh, and seeds in their place for domains without corners of their own.
template <int D>
Filling<D> fill_mesh(CellMesh<D> mesh)
{
    std::vector<Seed<D>> seeds;
    for (const CornerIds<D>& cell : mesh.cells) seeds.push_back(seed_of(mesh, cell));
    return {walk_list(std::move(seeds)), {}, std::move(mesh)};
}

template <int D>
Filling<D> fill_ball(const PolarBall<D>& shape, int k, const SubCells<D>& cells, double most)
{
    const RoundCount count = count_of(shape, k, shape.ball.radius, cells, D);
    require_count(k, count.cells(D), most);
    return fill_mesh(weld(round_cells(shape.ball, count)));
}

template <int D>
Filling<D> fill_solid_tube(const TubeShape<D>& shape, int k, const SubCells<D>& cells, double most)
{
    const Tube<D>& tube    = shape.tube;
    const RoundCount count = count_of(shape, k, tube.outer, cells, 2);
    double layers          = 1;
    if (D == 3)
        layers = shape.layers ? *shape.layers
                              : std::max(1.0, std::round((tube.top - tube.bottom) / (cells.h[tube.axis] / cells.n[tube.axis])));
    require_count(k, layers * count.cells(2), most);
    return fill_mesh(weld(round_cells(tube, count, static_cast<int>(layers))));
}

template <int D>
Filling<D> fill_tube(const BodySpec<D>& b, int k, const SubCells<D>& cells, const Model<D>& model, double most)
{
    const auto& shape = std::get<TubeShape<D>>(b.shape);
    require_shape(shape, k);
    if (shape.is_polar) {
        require_near(b, k, shape.tube.bounds(), model);
        if (!(shape.tube.inner > 0)) return fill_solid_tube(shape, k, cells, most);
        return fill_polar_cells(shape, k, cells, most);
    }
    require_fillable(b, k, shape.tube.bounds(), cells, model, most);
    return {[tube = shape.tube, cells](const auto& f) { walk(tube, cells, f); }, {}, {}};
}

/// A box, a ball or a tube, in sub-cells of the grid.
template <int D>
Filling<D> fill_shape(const BodySpec<D>& b, int k, const Model<D>& model, double most)
{
    for (int a = 0; a < D; ++a)
        if (b.particles_per_cell[a] < 1) fail(k, "particles_per_cell", "must be one or more along each axis");
    const SubCells<D> cells{model.origin, model.h, b.particles_per_cell, b.gauss};
    if (cells.gauss && model.method.domain != Domain::point)
        fail(k, "seeding", "gauss has no domains that tile the body: use centres, or a method with method.domain \"point\"");
    if (const auto* box = std::get_if<Bounds<D>>(&b.shape)) {
        require_shape(*box, k);
        require_fillable(b, k, *box, cells, model, most);
        return {[box = *box, cells](const auto& f) { walk_box(box, cells, f); }, {}, {}};
    }
    if (const auto* ball = std::get_if<Ball<D>>(&b.shape)) {
        require_radius(k, ball->radius);
        require_fillable(b, k, ball->bounds(), cells, model, most);
        return {[ball = *ball, cells](const auto& f) { walk(ball, cells, f); }, {}, {}};
    }
    if constexpr (D >= 2) {
        if (const auto* polar = std::get_if<PolarBall<D>>(&b.shape)) {
            require_radius(k, polar->ball.radius);
            require_near(b, k, polar->ball.bounds(), model);
            return fill_ball(*polar, k, cells, most);
        }
        return fill_tube(b, k, cells, model, most);
    } else if (std::holds_alternative<PolarBall<D>>(b.shape)) {
        fail(k, "cells", "polar cells need two dimensions or more");
    } else {
        fail(k, "shape", "rings and cylinders need two dimensions or more");
    }
}

}  // namespace

void require_count(int k, double count, double most)
{
    if (!(count <= most))
        fail(k, "particles_per_cell",
             fmt::format("makes about {:.3g} particles in all, more than {:.3g}; use fewer, a smaller body or a coarser [grid] "
                         "spacing",
                         count, most));
}

void require_some(int k, std::ptrdiff_t count)
{
    if (count == 0)
        fail(
            k, "shape",
            "holds no particle: it is smaller than a sub-cell of the grid; refine [grid] spacing or use more particles_per_cell");
}

template <int D>
Filling<D> fill_body(BodySpec<D>& b, int k, const Model<D>& model, double most)
{
    if (auto* seeds = std::get_if<std::vector<Seed<D>>>(&b.shape)) {
        if (seeds->empty()) fail(k, "shape", "holds no particle");
        for (const Seed<D>& s : *seeds)
            if (!(s.volume > 0)) fail(k, "shape", fmt::format("its particle at {} has no positive volume", place_text(s.x)));
        return {walk_list(std::move(*seeds)), {}, {}};
    }
    if (auto* shape = std::get_if<MeshShape<D>>(&b.shape)) {
        if (shape->mesh.cells.empty()) fail(k, "shape", "holds no particle");
        return fill_mesh(std::move(shape->mesh));
    }
    return fill_shape(b, k, model, most);
}

template <int D>
CellMesh<D> mesh_body(const Filling<D>& filling, int k, const MethodSpec& method)
try {
    if (!filling.mesh.cells.empty()) return method.domain == Domain::simplex ? split(filling.mesh) : filling.mesh;
    if (filling.corners) return mesh_of<D>(method, {}, filling.corners());
    std::vector<Seed<D>> seeds;
    filling.walk([&](const Seed<D>& seed) { seeds.push_back(seed); });
    return mesh_of(method, seeds);
} catch (const InputError& e) {
    fail(k, "shape", e.what());
}

template Filling<1> fill_body(BodySpec<1>&, int, const Model<1>&, double);
template Filling<2> fill_body(BodySpec<2>&, int, const Model<2>&, double);
template Filling<3> fill_body(BodySpec<3>&, int, const Model<3>&, double);
template CellMesh<1> mesh_body(const Filling<1>&, int, const MethodSpec&);
template CellMesh<2> mesh_body(const Filling<2>&, int, const MethodSpec&);
template CellMesh<3> mesh_body(const Filling<3>&, int, const MethodSpec&);

}  // namespace ordo::setup
