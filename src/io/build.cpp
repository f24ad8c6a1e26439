#include "io/build.hpp"

#include "io/expression.hpp"
#include "io/mesh_file.hpp"
#include "io/particle_file.hpp"
#include "method/courant.hpp"
#include "method/explicit.hpp"
#include "method/place.hpp"
#include "method/planting.hpp"
#include "method/spline_scheme.hpp"
#include "particles/sort.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace ordo::io {

namespace {

template <int D, class T = double>
Vec<D, T> to_vec(const std::vector<T>& v)
{
    Vec<D, T> r{};
    for (int a = 0; a < D; ++a) r[a] = v[a];
    return r;
}

/// How far the domain of a seed reaches from its centre along each axis, m.
template <int D>
Vec<D> reach_of_domain(const Seed<D>& s)
{
    Vec<D> r{};
    for (int a = 0; a < D; ++a)
        for (int d = 0; d < D; ++d) r[a] += std::fabs(s.edges(a, d));
    return r;
}

/// Throws where an expression does not give numbers at the start.
template <int D>
void require_finite(const Vec<D>& value, const std::vector<Expression>& from, const Vec<D>& at)
{
    for (int a = 0; a < D; ++a)
        if (!std::isfinite(value[a]))
            fail(from[a].place, from[a].key,
                 fmt::format("is {} at {}, t = 0; the expression must give a number everywhere", std::fabs(value[a]),
                             place_text(at)));
}

/// Prescribed velocities must be numbers on the nodes of their plane; of a plane of two axes 1000 along each are asked.
template <int D>
void require_finite(const Boundary<D>& b, const std::vector<Expression>& from, const Model<D>& model)
{
    Index<D> n{}, step{};
    for (int a = 0; a < D; ++a) {
        step[a] = D < 3 ? 1 : model.cells[a] / 1000 + 1;
        n[a]    = a == b.axis ? 1 : model.cells[a] / step[a] + 1;
    }
    IndexBox<D>{{}, n}.for_each([&](const Index<D>& k) {
        Vec<D> x{}, value{};
        for (int a = 0; a < D; ++a) x[a] = a == b.axis ? b.at : model.origin[a] + k[a] * step[a] * model.h[a];
        for (int a = 0; a < D; ++a)
            if (b.value[a]) value[a] = (*b.value[a])({padded(x), padded(x), 0.0});
        require_finite(value, from, x);
    });
}

template <int D>
void set_up_boundaries(const CaseInput& in, Model<D>& model)
{
    for (const BoundaryInput& b : in.boundaries)
        for (const std::string& face : b.face) {
            const int axis = face[0] - 'x';
            if (b.type == "periodic") model.periodic[axis] = true;
            if (b.type == "periodic" || b.type == "free") continue;
            Boundary<D> r{};
            r.axis           = axis;
            r.outer_is_above = face.ends_with("max");
            r.at             = b.at_coordinate.value_or(model.face(axis, r.outer_is_above));
            r.type           = b.type == "fixed"      ? BoundaryType::fixed
                               : b.type == "symmetry" ? BoundaryType::symmetry
                                                      : BoundaryType::velocity;
            for (int a = 0; a < D && r.type == BoundaryType::velocity; ++a)
                if (b.value[a].value != decltype(b.value[a].value){"free"}) r.value[a] = make_field(b.value[a]);
            if (r.type == BoundaryType::velocity) require_finite(r, b.value, model);
            if (is_inner_plane_of_splines(model, r))
                b.fail("at", fmt::format("the plane {} = {} lies inside the grid, where splines do not interpolate: a wall there "
                                         "would be wrong by up to a cell; let the grid end there, or use basis \"hat\"",
                                         "xyz"[axis], r.at));
            model.boundaries.push_back(std::move(r));
        }
    for (const BoundaryInput& b : in.boundaries)
        for (const std::string& face : b.face)
            if (b.type != "periodic" && model.periodic[face[0] - 'x'])
                b.fail("face",
                       fmt::format("{} belongs to a periodic axis, which has no faces; remove one of the two entries", face));
}

/// What a body is made of. Without corners and mesh, corners are those of the seeds' parallelepipeds.
template <int D>
struct Filling {
    std::vector<Seed<D>> seeds;
    std::vector<CornerPoints<D>> corners{};
    CellMesh<D> mesh{};
};

template <int D>
Filling<D> fill_mesh(const BodyInput& b)
{
    Filling<D> r{.seeds = {}, .corners = {}, .mesh = {}};
    try {
        r.mesh = read_mesh<D>(b.file, b.group);
    } catch (const InputError& e) {
        b.fail("file", e.what());
    }
    for (const CornerIds<D>& cell : r.mesh.cells) r.seeds.push_back(seed_of(r.mesh, cell));
    return r;
}

void require_count(const BodyInput& b, double count, double most)
{
    if (!(count <= most))
        b.fail(b.file.empty() ? "particles_per_cell" : "file",
               fmt::format("makes about {:.3g} particles in all, more than {:.3g}; use fewer, a smaller body or a coarser [grid] "
                           "spacing",
                           count, most));
}

/// A built-in shape must meet the grid, or the periods beside it, before it is looked through.
template <int D>
void require_near(const BodyInput& b, const Bounds<D>& bounds, const Model<D>& model)
{
    for (int a = 0; a < D; ++a) {
        const double length = model.cells[a] * model.h[a], around = model.periodic[a] ? length : 0.0;
        const double low = model.origin[a] - around, high = model.origin[a] + length + around;
        if (!(bounds.upper[a] >= low && bounds.lower[a] <= high))
            b.fail("shape",
                   fmt::format("body \"{}\" lies outside the grid: it runs from {:.6g} to {:.6g} along axis {}, between {} "
                               "and {} it would meet the grid; move the body or enlarge [grid] size",
                               b.name, bounds.lower[a], bounds.upper[a], "xyz"[a], low, high));
    }
}

/// The same, and the sub-cells in its bounds must not be more than there may be particles.
template <int D>
void require_fillable(const BodyInput& b, const Bounds<D>& bounds, const SubCells<D>& cells, const Model<D>& model, double most)
{
    require_near(b, bounds, model);
    double count = 1;
    for (int a = 0; a < D; ++a) count *= (bounds.upper[a] - bounds.lower[a]) / (cells.h[a] / cells.n[a]) + 1;
    require_count(b, count, most);
}

constexpr double kDegree = std::numbers::pi / 180;

/// Of a body of shape ring or cylinder.
template <int D>
Tube<D> tube_of(const BodyInput& b)
{
    Tube<D> tube{.center = to_vec<D>(b.center), .inner = b.inner_radius.value_or(0.0), .outer = *b.radius};
    if (!b.angle.empty()) {
        tube.from = b.angle[0] * kDegree;
        tube.to   = b.angle[1] * kDegree;
    }
    if constexpr (D == 3) {
        tube.axis   = b.axis.empty() ? 2 : b.axis[0] - 'x';
        tube.bottom = tube.center[tube.axis] - *b.height / 2;
        tube.top    = tube.center[tube.axis] + *b.height / 2;
    }
    return tube;
}

template <int D>
Filling<D> fill_round(const BodyInput& b, const SubCells<D>& cells, const Model<D>& model, double most)
{
    if (b.shape == "ball") {
        const Ball<D> ball{to_vec<D>(b.center), *b.radius};
        require_fillable(b, ball.bounds(), cells, model, most);
        return {fill(ball, cells)};
    }
    if constexpr (D >= 2) {
        const Tube<D> tube = tube_of<D>(b);
        if (b.cells != "polar") {
            require_fillable(b, tube.bounds(), cells, model, most);
            return {fill(tube, cells)};
        }
        require_near(b, tube.bounds(), model);
        // As many polar cells as the grid's sub-cells would give at the middle radius.
        double all = 1;
        auto count = [&](std::optional<int> given, double length, double cell) {
            const double n = given ? *given : std::max(1.0, std::round(length / cell));
            require_count(b, all *= n, most);
            return static_cast<int>(n);
        };
        const int e1 = tube.first(), e2 = tube.second();
        const int radial  = count(b.radial, tube.outer - tube.inner, cells.h[e1] / cells.n[e1]);
        const int angular = count(b.angular, (tube.to - tube.from) * (tube.inner + tube.outer) / 2, cells.h[e2] / cells.n[e2]);
        const int layers  = D == 3 ? count(b.layers, tube.top - tube.bottom, cells.h[tube.axis] / cells.n[tube.axis]) : 1;
        if ((tube.to - tube.from) / angular > 60 * kDegree * (1 + 1e-12))
            b.fail("angular",
                   fmt::format("makes cells of {:.3g} degrees; at most 60 are allowed, for a domain is drawn with straight sides",
                               (tube.to - tube.from) / angular / kDegree));
        return {fill_polar(tube, radial, angular, layers), polar_cells(tube, radial, angular, layers)};
    }
    throw std::logic_error("fill_round: unhandled shape");
}

template <int D>
Filling<D> fill_body(const BodyInput& b, const Model<D>& model, double most)
{
    if (b.shape == "particles") return {read_particles<D>(b)};
    if (b.shape == "mesh") return fill_mesh<D>(b);
    const SubCells<D> cells{model.origin, model.h, to_vec<D, int>(b.particles_per_cell), b.seeding == "gauss"};
    if (cells.gauss && model.method.domain != Domain::point)
        b.fail("seeding", "gauss has no domains that tile the body: use centres, or a method with method.domain \"point\"");
    Filling<D> filling{};
    if (b.shape == "box") {
        const Bounds<D> box{to_vec<D>(b.lower), to_vec<D>(b.upper)};
        require_fillable(b, box, cells, model, most);
        filling.seeds = fill_box(box, cells);
    } else {
        filling = fill_round(b, cells, model, most);
    }
    if (filling.seeds.empty())
        b.fail(
            "shape",
            "holds no particle: it is smaller than a sub-cell of the grid; refine [grid] spacing or use more particles_per_cell");
    return filling;
}

/// The cells of a body, with shared corners.
template <int D>
CellMesh<D> mesh_body(const BodyInput& b, const Filling<D>& filling, const MethodSpec& method)
try {
    if (filling.mesh.cells.empty()) return mesh_of(method, filling.seeds, filling.corners);
    return method.domain == Domain::simplex ? split(filling.mesh) : filling.mesh;
} catch (const InputError& e) {
    b.fail(b.file.empty() ? "shape" : "file", e.what());
}

/// The bounding box of a body: of its mesh, else of the domains of its seeds.
template <int D>
Bounds<D> bounds_of(const Filling<D>& body)
{
    constexpr double infinity = std::numeric_limits<double>::infinity();
    Bounds<D> r{Vec<D>::filled(infinity), Vec<D>::filled(-infinity)};
    auto add = [&](const Vec<D>& x, const Vec<D>& reach) {
        for (int a = 0; a < D; ++a) {
            r.lower[a] = std::min(r.lower[a], x[a] - reach[a]);
            r.upper[a] = std::max(r.upper[a], x[a] + reach[a]);
        }
    };
    for (const Vec<D>& x : body.mesh.corners) add(x, {});
    for (const Seed<D>& s : body.seeds)
        if (body.mesh.corners.empty()) add(s.x, reach_of_domain(s));
    return r;
}

/// Along periodic axes a body must be no longer than the period, and lie in it or in the next ones.
template <int D>
void require_in_periods(const BodyInput& b, const Bounds<D>& bounds, const Model<D>& model)
{
    const std::string key = b.file.empty() ? "shape" : "file";
    for (int a = 0; a < D; ++a) {
        if (!model.periodic[a]) continue;
        const double low = model.origin[a], period = model.cells[a] * model.h[a];
        if (!(bounds.upper[a] - bounds.lower[a] <= period * (1 + 1e-6)))
            b.fail(key, fmt::format("body \"{}\" overlaps itself: it is longer than the period {} of axis {}", b.name, period,
                                    "xyz"[a]));
        if (!(bounds.lower[a] >= low - period && bounds.upper[a] <= low + 2 * period))
            b.fail(key, fmt::format("body \"{}\" lies outside the grid and the periods beside it: it runs from {:.6g} to {:.6g} "
                                    "along axis {}, the grid from {} to {}; move the body",
                                    b.name, bounds.lower[a], bounds.upper[a], "xyz"[a], low, low + period));
    }
}

/// Every particle and the corners of its domain must lie in the grid and on the inner side of every plane.
template <int D>
void require_inside(const BodyInput& b, const std::vector<Seed<D>>& seeds, const Model<D>& model)
{
    const std::string key = b.file.empty() ? "shape" : "file";
    for (const Seed<D>& s : seeds)
        for (int a = 0; a < D; ++a) {
            if (model.periodic[a]) continue;
            const double tolerance = 1e-9 * model.h[a];
            // Sectors bulge over their parallelograms; there the centre decides.
            const double reach = b.cells == "polar" || b.shape == "mesh" ? 0.0 : reach_of_domain(s)[a];
            const double low = model.origin[a], high = low + model.cells[a] * model.h[a];
            if (!(s.x[a] - reach >= low - tolerance && s.x[a] + reach <= high + tolerance))
                b.fail(key, fmt::format("body \"{}\" lies outside the grid: its particle at {} reaches beyond {} to {} of axis "
                                        "{}; move the body or enlarge [grid] size",
                                        b.name, place_text(s.x), low, high, "xyz"[a]));
            for (const Boundary<D>& plane : model.boundaries)
                if (plane.axis == a && (plane.outer_is_above ? s.x[a] > plane.at + tolerance : s.x[a] < plane.at - tolerance))
                    b.fail(key,
                           fmt::format(
                               "body \"{}\" lies beyond the boundary at {} = {}: its particle at {}; move the body or the plane",
                               b.name, "xyz"[a], plane.at, place_text(s.x)));
        }
}

/// Every corner of a mesh must lie in the grid.
template <int D>
void require_inside(const BodyInput& b, const CellMesh<D>& mesh, const Model<D>& model)
{
    for (const Vec<D>& x : mesh.corners)
        for (int a = 0; a < D; ++a) {
            const double low = model.origin[a], high = low + model.cells[a] * model.h[a], tolerance = 1e-9 * model.h[a];
            if (!model.periodic[a] && !(x[a] >= low - tolerance && x[a] <= high + tolerance))
                b.fail("file", fmt::format("body \"{}\" lies outside the grid: its corner at {} lies beyond {} to {} of axis {}; "
                                           "move the mesh or enlarge [grid] size",
                                           b.name, place_text(x), low, high, "xyz"[a]));
        }
}

/// No particle centre may lie in the domain of another particle: the mass would be there twice. Particles of one built-in
/// shape cannot; checked are those of files, and those near another body.
template <int D>
void require_apart(const CaseInput& in, std::vector<Seed<D>> seeds, const std::vector<int>& body, const Model<D>& model)
{
    // The seed of a mesh's cell is a box of its volume, which pokes out where the cell is slender: less than half of it counts.
    for (std::size_t i = 0; i < seeds.size(); ++i)
        if (in.bodies[body[i]].shape == "mesh") seeds[i].edges *= 0.4;
    std::vector<Bounds<D>> bounds(in.bodies.size(), {Vec<D>::filled(std::numeric_limits<double>::infinity()),
                                                     Vec<D>::filled(-std::numeric_limits<double>::infinity())});
    for (std::size_t i = 0; i < seeds.size(); ++i) {
        const Vec<D> r = reach_of_domain(seeds[i]);
        for (int a = 0; a < D; ++a) {
            bounds[body[i]].lower[a] = std::min(bounds[body[i]].lower[a], seeds[i].x[a] - r[a]);
            bounds[body[i]].upper[a] = std::max(bounds[body[i]].upper[a], seeds[i].x[a] + r[a]);
        }
    }
    auto is_candidate = [&](std::size_t i) {
        const Vec<D> r = reach_of_domain(seeds[i]);
        for (std::size_t k = 0; k < bounds.size(); ++k) {
            bool meets = static_cast<int>(k) != body[i];
            for (int a = 0; a < D; ++a)
                meets = meets && seeds[i].x[a] + r[a] > bounds[k].lower[a] && seeds[i].x[a] - r[a] < bounds[k].upper[a];
            if (meets) return true;
        }
        return in.bodies[body[i]].shape == "particles";
    };
    // Candidates in bins of a grid cell; a domain may reach over several.
    auto bin_of = [&](const Vec<D>& x) {
        std::uint64_t key = 0;
        for (int a = D - 1; a >= 0; --a)
            key = key * static_cast<std::uint64_t>(model.cells[a]) +
                  static_cast<std::uint64_t>(std::clamp((x[a] - model.origin[a]) / model.h[a], 0.0, model.cells[a] - 0.5));
        return key;
    };
    std::vector<std::pair<std::uint64_t, int>> bins;
    for (std::size_t i = 0; i < seeds.size(); ++i)
        if (is_candidate(i)) bins.emplace_back(bin_of(seeds[i].x), static_cast<int>(i));
    std::sort(bins.begin(), bins.end());
    for (const auto& entry : bins) {
        const int i            = entry.second;
        const Seed<D>& s       = seeds[i];
        const Mat<D> to_domain = inverse(s.edges);
        const Vec<D> reach     = reach_of_domain(s);
        auto require_outside   = [&](int j) {
            if (j == i) return;
            const Vec<D> local = to_domain * (seeds[j].x - s.x);
            bool inside        = true;
            for (int a = 0; a < D; ++a) inside = inside && std::fabs(local[a]) < 1 - 1e-9;
            if (!inside) return;
            const BodyInput &one = in.bodies[std::max(body[i], body[j])], &other = in.bodies[std::min(body[i], body[j])];
            one.fail(one.file.empty() ? "shape" : "file",
                     fmt::format("body \"{}\" overlaps {} near {}; move them apart", one.name,
                                 &one == &other ? "itself" : "body \"" + other.name + "\"", place_text(seeds[j].x)));
        };
        double count = 1;
        for (int a = 0; a < D; ++a) count *= std::ceil(2 * reach[a] / model.h[a]) + 1;
        if (!(count <= static_cast<double>(bins.size()))) {  // the domain has more bins than there are particles
            for (const auto& other : bins) require_outside(other.second);
            continue;
        }
        Index<D> n{};
        for (int a = 0; a < D; ++a) n[a] = static_cast<int>(std::ceil(2 * reach[a] / model.h[a])) + 1;
        IndexBox<D>{{}, n}.for_each([&](const Index<D>& k) {
            Vec<D> at{};
            for (int a = 0; a < D; ++a) at[a] = s.x[a] - reach[a] + std::min(k[a] * model.h[a], 2 * reach[a]);
            const std::uint64_t bin = bin_of(at);
            for (auto it = std::lower_bound(bins.begin(), bins.end(), std::pair{bin, 0}); it != bins.end() && it->first == bin;
                 ++it)
                require_outside(it->second);
        });
    }
}

/// Whether a face looks the way that `where` says.
template <int D>
bool looks(const std::string& where, const Vec<D>& normal, const Vec<D>& from_center)
{
    if (where == "all") return true;
    if (where == "inner" || where == "outer") {
        const double cosine = dot(normal, from_center) / norm(from_center);
        return where == "inner" ? cosine < -0.01 : cosine > 0.01;  // every stair of a round body, no side of a part
    }
    const double along = normal[where[0] - 'x'];
    for (int a = 0; a < D; ++a)
        if (std::fabs(normal[a]) > std::fabs(along) * (1 + 1e-9)) return false;
    return (along > 0) == where.ends_with("max");
}

/// The faces of tractions on body k, whose particles are those of `mesh` from `first` on.
template <int D>
void set_up_tractions(const CaseInput& in, int k, const CellMesh<D>& mesh, int first, Model<D>& model, Particles<D>& p)
{
    const BodyInput& body = in.bodies[k];
    Bounds<D> extent{mesh.corners[0], mesh.corners[0]};
    for (const Vec<D>& x : mesh.corners)
        for (int a = 0; a < D; ++a) {
            extent.lower[a] = std::min(extent.lower[a], x[a]);
            extent.upper[a] = std::max(extent.upper[a], x[a]);
        }
    // Where a body fills a periodic axis, its ends meet: they are no surface.
    auto is_on_seam = [&](const Vec<D>& normal, const Vec<D>& center) {
        for (int a = 0; a < D; ++a) {
            const double tolerance = 1e-9 * model.h[a], period = model.cells[a] * model.h[a];
            if (model.periodic[a] && extent.upper[a] - extent.lower[a] > period - tolerance && std::fabs(normal[a]) > 1 - 1e-9 &&
                (center[a] < extent.lower[a] + tolerance || center[a] > extent.upper[a] - tolerance))
                return true;
        }
        return false;
    };
    for (std::size_t t = 0; t < in.tractions.size(); ++t) {
        const TractionInput& traction = in.tractions[t];
        if (traction.body != body.name) continue;
        const VectorField<D>& value = model.tractions[t].value;
        std::vector<bool> found(traction.face.size(), false);
        auto is_chosen = [&](const Vec<D>& normal, const Vec<D>& center) {
            if (is_on_seam(normal, center)) return false;
            Vec<D> arm = center;
            for (int a = 0; a < D; ++a) arm[a] -= body.center.empty() ? 0.0 : body.center[a];
            if constexpr (D == 3)
                if (body.shape == "cylinder" || !body.axis.empty()) arm[body.axis.empty() ? 2 : body.axis[0] - 'x'] = 0.0;
            bool chosen = false;
            for (std::size_t f = 0; f < traction.face.size(); ++f)
                if (looks(traction.face[f], normal, arm)) chosen = found[f] = true;
            for (std::size_t a = 0; chosen && a < traction.value.size(); ++a)
                if (const double start = value[a]({padded(center), padded(center), 0.0}); !std::isfinite(start))
                    traction.fail("value", fmt::format("is {} at {}, t = 0; the expression must give a number everywhere",
                                                       std::fabs(start), place_text(center)));
            return chosen;
        };
        add_loads<D>(model.loads, p, mesh, first, static_cast<int>(t), is_chosen);
        for (std::size_t f = 0; f < traction.face.size(); ++f)
            if (!found[f])
                traction.fail("face", fmt::format("body \"{}\" has no face that looks to {}; choose another, or \"all\"",
                                                  body.name, traction.face[f]));
    }
}

template <int D>
void set_up_enrichment(const CaseInput& in, const Model<D>& model, Particles<D>& p)
{
    const std::string key = in.method.has("enrichment") ? "enrichment" : "preset";
    int count             = 0;
    try {
        count = enrich(model, p);
    } catch (const InputError& e) {
        in.method.fail(key, e.what());
    }
    if (count == 0)
        in.method.fail(key,
                       "finds no interface: no two bodies share a corner. Meshes must conform, and shapes have the same cells on "
                       "both sides; or choose enrichment = \"all\" or a method without (cpdi2)");
}

/// Whether a plane across an axis is a face of the grid that a wall or a period closes.
template <int D>
bool is_closed(const Model<D>& model, int axis, bool above, double at)
{
    if (std::fabs(at - model.face(axis, above)) > 1e-9 * model.h[axis]) return false;
    return model.periodic[axis] || std::any_of(model.boundaries.begin(), model.boundaries.end(), [&](const Boundary<D>& b) {
               return b.axis == axis && b.outer_is_above == above && !is_inner_plane(model, b);
           });
}

/// The free surface of a built-in shape: functions that are negative inside, without its plane faces on walls and periods of the
/// grid. None where the grid has to be filled.
template <int D>
std::vector<LevelSet<D>> free_surface(const BodyInput& b, const Model<D>& model)
{
    std::vector<LevelSet<D>> r;
    auto add_plane = [&](const Vec<D>& normal, const Vec<D>& through) {
        for (int a = 0; a < D; ++a)
            if (std::fabs(normal[a]) > 1 - 1e-12 && is_closed(model, a, normal[a] > 0, through[a])) return;
        r.push_back([normal, through](const Vec<D>& X) { return dot(normal, X - through); });
    };
    auto add_faces = [&](int a, double lower, double upper) {
        Vec<D> normal{}, through{};
        normal[a]  = -1;
        through[a] = lower;
        add_plane(normal, through);
        normal[a]  = 1;
        through[a] = upper;
        add_plane(normal, through);
    };
    if (b.shape == "box")
        for (int a = 0; a < D; ++a) add_faces(a, b.lower[a], b.upper[a]);
    if (b.shape == "ball" && D == 1) add_faces(0, b.center[0] - *b.radius, b.center[0] + *b.radius);
    if (b.shape == "ball" && D > 1)
        r.push_back([center = to_vec<D>(b.center), square = *b.radius * *b.radius](const Vec<D>& X) {
            return dot(X - center, X - center) - square;
        });
    if constexpr (D >= 2) {
        if (b.shape != "ring" && b.shape != "cylinder") return r;
        const Tube<D> tube = tube_of<D>(b);
        r                  = tube.round_faces();
        if constexpr (D == 3) add_faces(tube.axis, tube.bottom, tube.top);
        if (tube.to - tube.from < 2 * std::numbers::pi * (1 - 1e-12)) {
            if (tube.to - tube.from > std::numbers::pi * (1 + 1e-12))
                b.fail("angle",
                       "leaves a notch in the body: splines that are fitted to particles take parts of at most 180 degrees");
            for (const auto& [angle, sign] : {std::pair{tube.from, 1.0}, {tube.to, -1.0}}) {
                Vec<D> normal{};
                normal[tube.first()]  = sign * std::sin(angle);
                normal[tube.second()] = -sign * std::cos(angle);
                add_plane(normal, tube.center);
            }
        }
    }
    return r;
}

/// Projection spline-fit takes bodies that fill a grid between walls, or one built-in shape, which may end inside it.
template <int D>
void set_up_splines(const CaseInput& in, Model<D>& model, int particles)
{
    const std::string key = in.method.has("projection") ? "projection" : "preset";
    if (in.bodies.size() == 1) model.surface = free_surface(in.bodies[0], model);
    double cells = 1;
    for (int a = 0; a < D; ++a) cells *= model.cells[a];
    if (model.surface.empty() && cells > particles)
        in.method.fail(
            key, fmt::format("fits splines on {} cells to {} particles, and wants two or more a cell along each axis: let the "
                             "bodies fill the grid, or take one of shape box, ball, ring or cylinder",
                             cells, particles));
    try {
        require_spline_model(model);
    } catch (const InputError& e) {
        in.method.fail(key, e.what());
    }
}

template <int D>
void require_stable(const CaseInput& in, const Model<D>& model, const Particles<D>& particles)
{
    const double limit = stable_time_step(model, particles);
    if (in.time.dt && *in.time.dt > limit)
        in.time.fail("dt",
                     fmt::format("{} s is above the limit {:.4g} s = {:.3g} h/(c + |v|) of the method, the P-wave speed and "
                                 "the particle speed; use a smaller step, or cfl = 0.4",
                                 *in.time.dt, limit, stable_courant_number(model)));
    const double steps = in.time.end / (in.time.dt ? *in.time.dt : automatic_time_step(model, particles, *in.time.cfl));
    if (!(steps <= 1e12))
        in.time.fail("end", fmt::format("takes about {:.1g} steps of the time step; use a larger step or a shorter time", steps));
}

}  // namespace

template <int D>
Built<D> build(const CaseInput& in, double most_particles)
{
    Model<D> model{};
    model.method  = in.spec;
    model.origin  = to_vec<D>(in.grid.origin);
    model.h       = to_vec<D>(in.grid.spacing);
    model.gravity = to_vec<D>(in.gravity);
    for (int a = 0; a < D; ++a) {
        model.cells[a] = static_cast<int>(std::lround(in.grid.size[a] / in.grid.spacing[a]));
        model.h[a]     = in.grid.size[a] / model.cells[a];
    }
    model.materials = in.resolved_materials;
    set_up_boundaries(in, model);
    for (const TractionInput& t : in.tractions) {
        Traction<D> traction{.type  = t.type == "pressure"   ? TractionType::pressure
                                      : t.type == "traction" ? TractionType::traction
                                                             : TractionType::dead,
                             .value = {}};
        for (std::size_t a = 0; a < t.value.size(); ++a) traction.value[a] = make_field(t.value[a]);
        model.tractions.push_back(std::move(traction));
    }

    std::vector<Seed<D>> seeds;
    std::vector<int> body_of;
    std::vector<CellMesh<D>> meshes;
    std::vector<int> first;  // particle of each body, and behind the last
    double count = 0;
    for (std::size_t k = 0; k < in.bodies.size(); ++k) {
        const BodyInput& b = in.bodies[k];
        model.body_forces.push_back(make_vector_field<D>(b.body_force));
        const Filling<D> own = fill_body<D>(b, model, most_particles);
        require_in_periods(b, bounds_of(own), model);
        require_inside(b, own.seeds, model);
        require_inside(b, own.mesh, model);
        seeds.insert(seeds.end(), own.seeds.begin(), own.seeds.end());
        body_of.resize(seeds.size(), static_cast<int>(k));
        first.push_back(static_cast<int>(count));
        if (has_cells(model.method) || !in.tractions.empty()) meshes.push_back(mesh_body(b, own, model.method));
        count += static_cast<double>(meshes.empty() ? own.seeds.size() : meshes.back().cells.size());
        require_count(b, count, most_particles);
    }
    first.push_back(static_cast<int>(count));
    require_apart(in, seeds, body_of, model);

    Particles<D> p(first.back(), field_groups(model));
    for (std::size_t k = 0; k < in.bodies.size(); ++k) {
        const BodyInput& b = in.bodies[k];
        const auto found =
            std::find_if(in.materials.begin(), in.materials.end(), [&](const auto& m) { return m.name == b.material; });
        const int material            = static_cast<int>(found - in.materials.begin());
        const double density          = model.materials[material].density;
        const VectorField<D> velocity = make_vector_field<D>(b.velocity);
        if (has_cells(model.method)) plant_cells(p, first[k], meshes[k], density);
        for (int i = first[k]; i < first[k + 1]; ++i) {
            if (!has_cells(model.method)) plant(p, i, seeds[i], density);
            const Vec<D> x = p.x[i];
            p.body[i]      = static_cast<int>(k);
            p.material[i]  = material;
            require_finite(evaluate<D>(model.body_forces[k], {padded(x), padded(x), 0.0}), b.body_force, x);
        }
        const auto velocity_at = [&](const Vec<D>& x) { return evaluate<D>(velocity, {padded(x), padded(x), 0.0}); };
        set_velocities(p, first[k], first[k + 1], velocity_at, model.h);
        for (int i = first[k]; i < first[k + 1]; ++i) require_finite(p.v[i], b.velocity, p.x[i]);
        if (!in.tractions.empty()) set_up_tractions(in, static_cast<int>(k), meshes[k], first[k], model, p);
    }
    if (has_enrichment(model.method)) set_up_enrichment(in, model, p);
    if (is_spline_fit(model.method)) set_up_splines(in, model, p.count);
    require_stable(in, model, p);
    return {std::move(model), std::move(p)};
}

template <int D>
int nearest_particle(const Particles<D>& particles, const Vec<D>& at)
{
    int best     = -1;
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < particles.count; ++i) {
        const double d = norm(particles.x[i] - at);
        if (d < least) {
            least = d;
            best  = particles.id[i];
        }
    }
    return best;
}

template Built<1> build(const CaseInput&, double);
template Built<2> build(const CaseInput&, double);
template Built<3> build(const CaseInput&, double);
template int nearest_particle(const Particles<1>&, const Vec<1>&);
template int nearest_particle(const Particles<2>&, const Vec<2>&);
template int nearest_particle(const Particles<3>&, const Vec<3>&);

}  // namespace ordo::io
