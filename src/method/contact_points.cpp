#include "method/contact_points.hpp"

#include "shape/face_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace ordo {

namespace {

template <int D>
using Normals = std::vector<std::array<Vec<D>, Face<D>::max_corners>>;

/// The whole periods by which one body must be moved so that it comes near another.
template <int D>
std::vector<Vec<D>> shifts_between(const Extent<D>& moved, const Extent<D>& other, double reach, const Vec<D>& period)
{
    IndexBox<D> turns{};
    for (int a = 0; a < D; ++a) {
        const double least = other.low[a] - reach - moved.high[a], most = other.high[a] + reach - moved.low[a];
        if (period[a] > 0) {
            turns.lo[a] = static_cast<int>(std::ceil(least / period[a]));
            turns.hi[a] = static_cast<int>(std::floor(most / period[a])) + 1;
        } else {
            turns.hi[a] = least <= 0 && most >= 0 ? 1 : 0;
        }
    }
    std::vector<Vec<D>> r;
    turns.for_each([&](const Index<D>& k) {
        Vec<D> shift{};
        for (int a = 0; a < D; ++a) shift[a] = k[a] * period[a];
        r.push_back(shift);
    });
    return r;
}

/// f(k, list) for k in [0, n), in parallel pieces; the pieces' lists one after the other.
template <int D, class F>
std::vector<ContactPoint<D>> in_pieces(std::size_t n, const F& f)
{
    constexpr std::ptrdiff_t piece = 256;
    const auto count               = static_cast<std::ptrdiff_t>(n);
    std::vector<std::vector<ContactPoint<D>>> found(static_cast<std::size_t>((count + piece - 1) / piece));
    parallel_for(static_cast<std::ptrdiff_t>(found.size()), [&](std::ptrdiff_t k) {
        for (std::ptrdiff_t i = k * piece; i < std::min(count, (k + 1) * piece); ++i) f(i, found[static_cast<std::size_t>(k)]);
    });
    std::vector<ContactPoint<D>> r;
    r.reserve(std::accumulate(found.begin(), found.end(), std::size_t{0},
                              [](std::size_t sum, const auto& one) { return sum + one.size(); }));
    for (const auto& one : found) r.insert(r.end(), one.begin(), one.end());
    return r;
}

/// A surface at the present places of its vertices, m. Its normals are found when they are asked for.
template <int D>
class PlacedSurface {
  public:
    PlacedSurface(const Outline<D>& outline, const std::vector<Vec<D>>& x) : outline_(&outline), x_(&x), extent_(Extent<D>::of(x))
    {}

    const Outline<D>& outline() const { return *outline_; }
    const std::vector<Vec<D>>& x() const { return *x_; }
    const Extent<D>& extent() const { return extent_; }
    /// At least of the faces that may meet `near`.
    const Normals<D>& normals(const Extent<D>& near = Extent<D>::everywhere())
    {
        if (normals_.empty() || !have_normals_.covers(near)) {
            const std::vector<char> is_near = faces_near(*outline_, x_->data(), near);
            normals_                        = corner_normals(*outline_, x_->data(), is_near);
            have_normals_                   = near;
            shares_.assign(normals_.size(), {});
            parallel_for_each(static_cast<std::ptrdiff_t>(normals_.size()), [&](std::ptrdiff_t k) {
                if (is_near[k])
                    shares_[k] = shares_of_corners(outline_->corners_of(k, x_->data()).data(), outline_->faces[k].count);
            });
        }
        return normals_;
    }
    /// What the corners of a face whose normals were found stand for, m^(D-1).
    const auto& shares(int face) const { return shares_[face]; }
    /// A Gauss point of a face.
    struct Sample {
        Vec<D> x, normal;
        double area;  ///< that it stands for, m^(D-1)
    };
    /// normals() must have been found.
    Sample sample(int face, const FacePoint<D>& point) const
    {
        const int count = outline_->faces[face].count;
        const CurvedFace<D> curved(outline_->corners_of(face, x_->data()).data(), normals_[face].data(), count);
        const auto t      = curved.tangents(point.place);
        const Vec<D> area = point.part * t.area();
        return {curved.first() + t.point, unit(area), norm(area)};
    }
    /// f(key, sample, to) for the Gauss points of all faces that may be near: is_near(x) is asked at their places on flat faces; all
    /// for which it is true lie in `within`.
    template <class IsNear, class F>
    std::vector<ContactPoint<D>> in_faces(int pair, int side, const Extent<D>& within, const IsNear& is_near, const F& f)
    {
        const auto count = static_cast<std::ptrdiff_t>(outline_->faces.size());
        std::vector<char> near(outline_->faces.size());
        parallel_for_each(count, [&](std::ptrdiff_t k) {
            const auto at = outline_->corners_of(k, x_->data());
            for (const FacePoint<D>& point : face_points<D>(outline_->faces[k].count)) {
                Vec<D> x{};
                for (int c = 0; c < outline_->faces[k].count; ++c) x += point.weight[c] * at[c];
                near[k] = near[k] || is_near(x);
            }
        });
        if (std::find(near.begin(), near.end(), 1) == near.end()) return {};
        normals(within);
        return in_pieces<D>(outline_->faces.size(), [&](std::ptrdiff_t k, std::vector<ContactPoint<D>>& to) {
            if (!near[k]) return;
            ContactKey key{pair, side, static_cast<int>(k), 0};
            for (const FacePoint<D>& point : face_points<D>(outline_->faces[k].count)) {
                f(key, sample(key.of, point), to);
                ++key.ordinal;
            }
        });
    }
    /// Of the plane of a face.
    Vec<D> normal_of(int face) const
    {
        return unit(face_area(outline_->corners_of(face, x_->data()).data(), outline_->faces[face].count));
    }

  private:
    const Outline<D>* outline_;
    const std::vector<Vec<D>>* x_;
    Extent<D> extent_;
    Normals<D> normals_;
    std::vector<std::array<double, Face<D>::max_corners>> shares_;
    Extent<D> have_normals_;
};

/// Finds the points of one surface on another.
template <int D>
class PointFinder {
  public:
    /// `on_faces`: at Gauss points of the faces, else at the vertices.
    PointFinder(PlacedSurface<D>& slave, PlacedSurface<D>& master, bool on_faces, double reach, const Vec<D>& period = {})
        : placed_(slave), slave_(slave.outline()), x_(slave.x()), on_faces_(on_faces), near_(master.extent().widened(reach))
    {
        Extent<D> within;  // of the points that are looked for
        for (const Vec<D>& shift : shifts_between(slave.extent(), master.extent(), reach, period)) {
            if (on_faces) {  // which may be larger than what they meet
                const Extent<D> both = near_.common_with(slave.extent().moved(shift).widened(reach));
                within.add(both.low);
                within.add(both.high);
                shifts_.push_back(shift);
                continue;
            }
            bool comes_near = false;
            for (const Vec<D>& x : x_) {
                if (!near_.has(x + shift)) continue;
                within.add(x + shift);
                comes_near = true;
            }
            if (comes_near) shifts_.push_back(shift);
        }
        if (shifts_.empty()) return;
        const bool is_shifted =
            std::any_of(shifts_.begin(), shifts_.end(), [](const Vec<D>& shift) { return !(shift == Vec<D>{}); });
        if (!is_shifted) common_ = near_.common_with(slave.extent().widened(reach)).widened(reach);
        normals_ = &slave.normals(common_);
        search_.emplace(master.outline(), master.x().data(), master.normals(common_).data(), reach, within);
    }

    std::vector<ContactPoint<D>> all(int pair, int side) const
    {
        if (shifts_.empty()) return {};
        if (on_faces_)
            return placed_.in_faces(
                pair, side, common_, [&](const Vec<D>& x) { return is_near(x); },
                [&](const ContactKey& key, const auto& at, auto& to) {
                    if (const auto found = nearest(at.x, at.normal)) to.push_back(point_at(key, at.x, 0.5 * at.area, *found));
                });
        return in_pieces<D>(x_.size(), [&](std::ptrdiff_t v, std::vector<ContactPoint<D>>& to) {
            if (is_near(x_[v])) add({pair, side, static_cast<int>(v), 0}, to);
        });
    }

  private:
    bool is_near(const Vec<D>& x) const
    {
        return std::any_of(shifts_.begin(), shifts_.end(), [&](const Vec<D>& shift) { return near_.has(x + shift); });
    }
    static ContactPoint<D> point_at(const ContactKey& key, const Vec<D>& x, double area, const Nearest<D>& found)
    {
        ContactPoint<D> r{.key = key, .face = found.face, .weight = {}};
        std::copy_n(found.foot.weight, ContactPoint<D>::max_corners, r.weight.begin());
        r.x      = x;
        r.normal = found.foot.normal;
        r.gap    = found.foot.gap;
        r.area   = area;
        return r;
    }
    std::optional<Nearest<D>> nearest(const Vec<D>& x, const Vec<D>& n) const
    {
        std::optional<Nearest<D>> best;
        for (const Vec<D>& shift : shifts_) {
            const Vec<D> at = x + shift;
            if (!near_.has(at)) continue;
            search_->find_nearer(at, n, best);
        }
        return best;
    }

    /// Adds the points of a vertex: each of its faces counts with its share where its own normal finds a foot.
    void add(ContactKey key, std::vector<ContactPoint<D>>& to) const
    {
        const std::size_t begin = to.size();
        std::optional<Nearest<D>> found;
        Vec<D> of{};
        for (int i = slave_.first[key.of]; i < slave_.first[key.of + 1]; ++i) {
            const auto [face, corner] = slave_.around[i];
            const Vec<D>& n           = (*normals_)[face][corner];
            if (i == slave_.first[key.of] || !(n == of)) found = nearest(x_[key.of], of = n);
            if (!found) continue;
            const double share = 0.5 * placed_.shares(face)[corner];
            const auto same    = std::find_if(to.begin() + static_cast<std::ptrdiff_t>(begin), to.end(),
                                              [&](const ContactPoint<D>& one) { return one.face == found->face; });
            if (same != to.end()) {
                same->area += share;
                continue;
            }
            to.push_back(point_at(key, x_[key.of], share, *found));
            ++key.ordinal;
        }
    }

    PlacedSurface<D>& placed_;
    const Outline<D>& slave_;
    const std::vector<Vec<D>>& x_;
    bool on_faces_;
    Extent<D> near_;
    /// Where faces meet: the same for both sides of a pair, which finds normals once.
    Extent<D> common_ = Extent<D>::everywhere();
    std::vector<Vec<D>> shifts_;
    const Normals<D>* normals_ = nullptr;
    std::optional<FaceSearch<D>> search_;
};

/// A vector of a tangent plane, moved with its normal from `before` to `now`: turned by the least rotation between them.
template <int D>
Vec<D> turned(const Vec<D>& v, const Vec<D>& before, const Vec<D>& now)
{
    const double cosine = dot(before, now);
    if (!(cosine > -0.99)) return {};
    const Vec<D> sum = before + now;
    return v - (dot(v, sum) / (1 + cosine)) * sum + 2.0 * dot(v, before) * now;
}

template <int D>
void keep_anchors(const std::vector<ContactPoint<D>>& before, std::vector<ContactPoint<D>>& points)
{
    auto old = before.begin();
    for (ContactPoint<D>& point : points) {
        while (old != before.end() && old->key < point.key) ++old;
        if (old == before.end() || old->key != point.key) continue;
        point.has_pressed = old->p > 0;
        point.anchor      = turned(old->anchor, old->normal, point.normal);
    }
}

/// The tied point of a vertex or face, for the normal out of the other side; `part` of the vertex's faces that look there, or of the
/// area of the point, count.
template <int D>
ContactPoint<D> point_of(const TiedPoint<D>& tied, bool on_faces, PlacedSurface<D>& slave, const Vec<D>& normal, double part)
{
    const Outline<D>& outline = slave.outline();
    ContactPoint<D> r{.key = tied.key, .face = tied.face, .weight = tied.weight};
    r.normal  = normal;
    r.is_tied = true;
    if (on_faces) {
        slave.normals();
        const auto at = slave.sample(tied.key.of, face_points<D>(outline.faces[tied.key.of].count)[tied.key.ordinal]);
        r.x           = at.x;
        r.at          = r.x + tied.shift;
        r.area        = part * at.area;
        return r;
    }
    r.x  = slave.x()[tied.key.of];
    r.at = r.x + tied.shift;
    for (int i = outline.first[tied.key.of]; i < outline.first[tied.key.of + 1]; ++i) {
        const auto [face, corner] = outline.around[i];
        const auto own            = outline.corners_of(face, slave.x().data());
        if (dot(face_area(own.data(), outline.faces[face].count), r.normal) < 0)
            r.area += part * shares_of_corners(own.data(), outline.faces[face].count)[corner];
    }
    return r;
}

/// Adds the points that were found on one side of a pair; what is tied has point(tied) instead, a vertex one of them.
template <int D, class F>
void add_points(std::vector<ContactPoint<D>> found, const ContactPair<D>& pair, int side, const F& point,
                std::vector<ContactPoint<D>>& to)
{
    const std::vector<TiedPoint<D>>& tied = pair.tied;
    auto comes_before                     = [&](const ContactKey& a, const ContactKey& b) {
        return pair.on_faces ? a < b : std::pair{a.side, a.of} < std::pair{b.side, b.of};
    };
    if (!tied.empty()) {
        std::erase_if(found, [&](const ContactPoint<D>& one) {
            const auto at = std::lower_bound(tied.begin(), tied.end(), one.key,
                                             [&](const TiedPoint<D>& a, const ContactKey& b) { return comes_before(a.key, b); });
            return at != tied.end() && !comes_before(one.key, at->key);
        });
        for (std::size_t k = 0; k < tied.size(); ++k) {
            const bool is_last = k + 1 == tied.size() || comes_before(tied[k].key, tied[k + 1].key);
            if (tied[k].key.side == side && is_last) found.push_back(point(tied[k]));
        }
        std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.key < b.key; });
    }
    if (to.empty())
        to = std::move(found);
    else
        to.insert(to.end(), found.begin(), found.end());
}

/// Finds the points of bodies on an obstacle.
template <int D>
class ObstacleFinder {
  public:
    /// `reach` of points at rest, m; what the obstacle moves in dt is added.
    ObstacleFinder(const Obstacle<D>& obstacle, const ObstacleMotion<D>& motion, double reach, double dt,
                   const Vec<D>& period = {})
        : obstacle_(obstacle), motion_(motion), reach_(reach), dt_(dt), period_(period), bounds_(bounds_of(obstacle, motion))
    {}

    /// Of the vertices of a surface: each of their faces counts with its share where its own normal finds a foot. Or of the Gauss
    /// points of its faces.
    std::vector<ContactPoint<D>> all(int pair, PlacedSurface<D>& surface, bool on_faces = false) const
    {
        const std::vector<Vec<D>>& x     = surface.x();
        const std::vector<Vec<D>> shifts = shifts_of(surface.extent());
        if (shifts.empty()) return {};
        if (on_faces)
            return surface.in_faces(
                pair, 0, Extent<D>::everywhere(), [&](const Vec<D>& at) { return nearest(at, nullptr, shifts).has_value(); },
                [&](const ContactKey& key, const auto& at, auto& to) {
                    if (const auto foot = nearest(at.x, &at.normal, shifts)) to.push_back(point_at(key, at.x, at.area, *foot));
                });
        std::vector<char> near(x.size());
        parallel_for_each(static_cast<std::ptrdiff_t>(x.size()),
                          [&](std::ptrdiff_t v) { near[v] = nearest(x[v], nullptr, shifts).has_value(); });
        if (std::find(near.begin(), near.end(), 1) == near.end()) return {};
        const Normals<D>& normals = surface.normals();
        return in_pieces<D>(x.size(), [&](std::ptrdiff_t v, std::vector<ContactPoint<D>>& to) {
            if (near[v]) add({pair, 0, static_cast<int>(v), 0}, surface, normals, shifts, to);
        });
    }
    /// Of the particles of a body, half of whose size is between them and their surface. On all ranks those of all.
    std::vector<ContactPoint<D>> all(int pair, int body, const Particles<D>& p, Ranks& ranks) const
    {
        using Most      = std::array<double, 1 + 2 * D>;  // of volumes, of places, and of places with the other sign
        Most most_first = {0.0};
        std::fill(most_first.begin() + 1, most_first.end(), -std::numeric_limits<double>::infinity());
        Most most = parallel_reduce(
            p.count, most_first,
            [&](std::ptrdiff_t i) {
                Most one{p.body[i] == body ? p.V[i] : 0.0};
                for (int a = 0; a < D; ++a) {
                    one[1 + a]     = p.x[i][a];
                    one[1 + D + a] = -p.x[i][a];
                }
                return one;
            },
            [](Most& all, const Most& one) {
                for (std::size_t k = 0; k < all.size(); ++k) all[k] = std::max(all[k], one[k]);
            });
        ranks.largest(most);
        if (std::isinf(most[1])) return {};
        const double more = std::pow(most[0], 1.0 / D) / 2;
        Extent<D> places;
        for (int a = 0; a < D; ++a) {
            places.high[a] = most[1 + a];
            places.low[a]  = -most[1 + D + a];
        }
        const std::vector<Vec<D>> shifts = shifts_of(places, more);
        std::vector<ContactPoint<D>> r =
            in_pieces<D>(static_cast<std::size_t>(p.count), [&](std::ptrdiff_t i, std::vector<ContactPoint<D>>& to) {
                if (p.body[i] != body) return;
                const auto foot = nearest(p.x[i], nullptr, shifts, more);
                if (!foot) return;
                const double size = std::pow(p.V[i], 1.0 / D);
                to.push_back(point_at({pair, 0, p.id[i], 0}, p.x[i], std::pow(size, D - 1), *foot));
                to.back().gap -= size / 2;
            });
        if (!ranks.is_alone()) {
            const auto all_points = gather_all(ranks, r);
            r.clear();
            for (const auto& of_rank : all_points) r.insert(r.end(), of_rank.begin(), of_rank.end());
        }
        std::sort(r.begin(), r.end(), [](const auto& a, const auto& b) { return a.key < b.key; });
        return r;
    }

    /// How deep the particles of a body are in it, at most, m.
    double depth_of(const Particles<D>& p, int body) const
    {
        std::vector<Vec<D>> places;
        for (int i = 0; i < p.count; ++i)
            if (p.body[i] == body) places.push_back(p.x[i]);
        if (places.empty()) return 0.0;
        const std::vector<Vec<D>> shifts = shifts_of(Extent<D>::of(places));
        return parallel_reduce(
            std::ssize(places), 0.0,
            [&](std::ptrdiff_t i) {
                double r = 0.0;
                for (const Vec<D>& shift : shifts)
                    if (const auto foot = nearest(places[i], nullptr, {shift})) r = std::max(r, -foot->gap);
                return r;
            },
            [](double& deepest, double one) { deepest = std::max(deepest, one); });
    }

  private:
    struct Foot : Clearance<D> {
        Vec<D> shift;  ///< of the point to where it has this foot, m
    };
    static ContactPoint<D> point_at(const ContactKey& key, const Vec<D>& x, double area, const Foot& foot)
    {
        ContactPoint<D> r{.key = key, .face = -1, .weight = {}};
        r.x      = x;
        r.at     = x + foot.shift;
        r.normal = foot.normal;
        r.gap    = foot.gap;
        r.area   = area;
        return r;
    }
    std::vector<Vec<D>> shifts_of(const Extent<D>& extent, double more = 0.0) const
    {
        if (std::holds_alternative<HalfSpace<D>>(obstacle_.solid)) return {Vec<D>{}};  // along periodic axes it looks the same
        const double fast = dt_ * (norm(motion_.velocity) + norm(motion_.spin) * norm(bounds_.upper - bounds_.lower));
        return shifts_between(extent, Extent<D>{bounds_.lower, bounds_.upper}, reach_ + more + fast, period_);
    }
    std::optional<Foot> nearest(const Vec<D>& x, const Vec<D>* n, const std::vector<Vec<D>>& shifts, double more = 0.0) const
    {
        std::optional<Foot> best;
        for (const Vec<D>& shift : shifts) {
            const Vec<D> at    = x + shift;
            const double reach = more + reach_ + dt_ * norm(velocity_at(motion_, at));
            bool is_near       = true;
            for (int a = 0; a < D; ++a)
                is_near = is_near && at[a] >= bounds_.lower[a] - reach && at[a] <= bounds_.upper[a] + reach;
            if (!is_near) continue;
            const auto one = clearance(obstacle_, motion_, at, n, reach);
            if (one && (!best || std::fabs(one->gap) < std::fabs(best->gap))) best = Foot{*one, shift};
        }
        return best;
    }
    void add(ContactKey key, const PlacedSurface<D>& surface, const Normals<D>& normals, const std::vector<Vec<D>>& shifts,
             std::vector<ContactPoint<D>>& to) const
    {
        const Outline<D>& outline = surface.outline();
        const Vec<D>& x           = surface.x()[key.of];
        constexpr double same     = 1 - 1e-9;  // cosine between normals of one foot
        const std::size_t begin   = to.size();
        for (int i = outline.first[key.of]; i < outline.first[key.of + 1]; ++i) {
            const auto [face, corner] = outline.around[i];
            const auto foot           = nearest(x, &normals[face][corner], shifts);
            if (!foot) continue;
            const double share = surface.shares(face)[corner];
            const auto old     = std::find_if(to.begin() + static_cast<std::ptrdiff_t>(begin), to.end(),
                                              [&](const ContactPoint<D>& one) { return dot(one.normal, foot->normal) > same; });
            if (old != to.end()) {
                old->area += share;
                continue;
            }
            to.push_back(point_at(key, x, share, *foot));
            ++key.ordinal;
        }
    }

    const Obstacle<D>& obstacle_;
    const ObstacleMotion<D>& motion_;
    double reach_, dt_;
    Vec<D> period_;
    Bounds<D> bounds_;
};

/// Where a holder has its vertex, m, and the periods that it has travelled.
template <int D>
struct Held {
    int holder = -1;  ///< its number; -1 if no rank has it
    Vec<D> x{};
    Turns<D> turns{};
};

/// By holder `k` of a surface, on this rank.
template <int D>
Held<D> held_by(const ContactSurface<D>& surface, std::ptrdiff_t k, const Model<D>& model, const State<D>& s)
{
    const Particles<D>& p = s.particles;
    const auto& holder    = surface.holders[k];
    const int i           = s.contacts.place_of[holder.particle];
    if (i < 0) return {};
    Held<D> r{static_cast<int>(k), {}, {}};
    r.x = has_cells(model.method) ? p.corner[p.cell[i][holder.corner]] : p.x[i] + p.edges[i] * holder.place;
    if (!p.turns.empty()) r.turns = p.turns[i];
    return r;
}

/// By all holders of a surface, of which several ranks have some.
template <int D>
std::vector<Held<D>> held_on_ranks(const ContactSurface<D>& surface, const Model<D>& model, const State<D>& s)
{
    std::vector<Held<D>> mine(surface.holders.size());
    parallel_for_each(std::ssize(mine), [&](std::ptrdiff_t k) { mine[k] = held_by(surface, k, model, s); });
    std::erase_if(mine, [](const Held<D>& one) { return one.holder < 0; });
    std::vector<Held<D>> held(surface.holders.size());
    for (const std::vector<Held<D>>& of_rank : gather_all(*s.ranks, mine))
        for (const Held<D>& one : of_rank) held[one.holder] = one;
    return held;
}

/// A direction of an obstacle at the start, as it is now.
template <int D>
Vec<D> turned_with(const ObstacleMotion<D>& motion, const Vec<D>& v)
{
    return first_components<D>(rotation_of(motion.turn) * padded(v));
}

}  // namespace

template <int D>
Vec<D> period_of(const Model<D>& model)
{
    Vec<D> r{};
    for (int a = 0; a < D; ++a)
        if (model.periodic[a]) r[a] = model.cells[a] * model.h[a];
    return r;
}

template <int D>
ContactSurface<D> surface_of(int body, const CellMesh<D>& mesh, const Particles<D>& p, int first, const Vec<D>& period)
{
    ContactSurface<D> r{.body = body, .outline = outline_of(mesh, period), .first = {0}, .holders = {}};
    std::vector<std::vector<std::pair<int, int>>> of(mesh.corners.size());
    for (int k = 0; k < static_cast<int>(mesh.cells.size()); ++k)
        for (int c = 0; c < mesh.cells[k].count(); ++c) of[mesh.cells[k][c]].emplace_back(first + k, c);
    for (const int corner : r.outline.corners) {
        for (const auto& [i, c] : of[corner]) {
            r.holders.push_back({i, c, {}});
            if (p.cell.empty()) r.holders.back().place = inverse(p.edges0[i]) * (mesh.corners[corner] - p.x[i]);
        }
        r.first.push_back(static_cast<int>(r.holders.size()));
    }
    return r;
}

template <int D>
void find_planes_of_symmetry(const Model<D>& model, const CellMesh<D>& mesh, ContactSurface<D>& surface)
{
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    Outline<D>& outline   = surface.outline;
    for (const Condition<D>& one : model.conditions) {
        if (one.type != ConditionType::symmetry || !one.is_plane()) continue;
        // Between nodes the condition does not hold the plane itself.
        const double nodes = (one.at - model.origin[one.axis]) / model.h[one.axis], off = 1e-6 * model.h[one.axis];
        if (std::fabs(nodes - std::round(nodes)) > 1e-9) continue;
        if (outline.planes.empty()) outline.planes.assign(outline.corners.size(), Vec<D>::filled(none));
        for (std::size_t v = 0; v < outline.corners.size(); ++v)
            if (std::fabs(mesh.corners[outline.corners[v]][one.axis] - one.at) <= off) outline.planes[v][one.axis] = one.at;
    }
}

template <int D>
void keep_planes_of_symmetry(const std::vector<Condition<D>>& conditions, ContactSurface<D>& surface)
{
    for (Vec<D>& plane : surface.outline.planes)
        for (int a = 0; a < D; ++a)
            if (std::none_of(conditions.begin(), conditions.end(), [&](const Condition<D>& one) {
                    return one.type == ConditionType::symmetry && one.is_plane() && one.axis == a && one.at == plane[a];
                }))
                plane[a] = std::numeric_limits<double>::quiet_NaN();
}

template <int D>
std::vector<Vec<D>> vertices_of(const ContactSurface<D>& surface, const Model<D>& model, const State<D>& s)
{
    std::vector<Held<D>> on_ranks;
    if (!s.ranks->is_alone()) on_ranks = held_on_ranks(surface, model, s);
    auto held = [&](std::ptrdiff_t k) { return on_ranks.empty() ? held_by(surface, k, model, s) : on_ranks[k]; };
    if (held(0).holder < 0) return {};
    const Vec<D> period = period_of(model);
    std::vector<Vec<D>> r(surface.outline.corners.size());
    parallel_for_each(static_cast<std::ptrdiff_t>(r.size()), [&](std::ptrdiff_t v) {
        if (has_cells(model.method)) {  // the first holder of each vertex counts
            r[v] = held(surface.first[v]).x;
            return;
        }
        for (int k = surface.first[v]; k < surface.first[v + 1]; ++k) {
            const Held<D> one = held(k);
            r[v] += one.x;
            for (int a = 0; a < D; ++a)
                if (period[a] > 0) r[v][a] += one.turns[a] * period[a];
        }
        r[v] *= 1.0 / (surface.first[v + 1] - surface.first[v]);
        for (int a = 0; a < D && !surface.outline.planes.empty(); ++a)  // each half drifts away from its image
            if (!std::isnan(surface.outline.planes[v][a])) r[v][a] = surface.outline.planes[v][a];
    });
    return r;
}

template <int D>
std::vector<ContactPoint<D>> find_contact_points(const Model<D>& model, const State<D>& s,
                                                 const std::vector<std::vector<Vec<D>>>& vertices, double dt, double reach)
{
    const Vec<D> period = period_of(model);
    std::vector<PlacedSurface<D>> placed;
    for (std::size_t k = 0; k < vertices.size(); ++k) placed.emplace_back(model.surfaces[k].outline, vertices[k]);
    std::vector<ContactPoint<D>> r;
    for (std::size_t k = 0; k < model.contacts.size(); ++k) {
        const ContactPair<D>& pair = model.contacts[k];
        const int number           = static_cast<int>(k);
        if (pair.obstacle >= 0) {
            const ObstacleMotion<D>& motion = s.contacts.obstacles[pair.obstacle];
            const ObstacleFinder<D> finder(model.obstacles[pair.obstacle], motion, reach, dt, period);
            const int own = pair.surface[0];
            if (own < 0) {
                const auto found = finder.all(number, pair.body, s.particles, *s.ranks);
                r.insert(r.end(), found.begin(), found.end());
            } else if (!vertices[own].empty()) {
                auto point = [&](const TiedPoint<D>& tied) {
                    return point_of(tied, pair.on_faces, placed[own], turned_with(motion, tied.normal), 1.0);
                };
                add_points(finder.all(number, placed[own], pair.on_faces), pair, 0, point, r);
            }
            continue;
        }
        for (int side = 0; side < 2; ++side) {
            const int own = pair.surface[side], other = pair.surface[1 - side];
            if (vertices[own].empty() || vertices[other].empty()) continue;
            const PointFinder<D> finder(placed[own], placed[other], pair.on_faces, reach, period);
            auto point = [&](const TiedPoint<D>& tied) {
                return point_of(tied, pair.on_faces, placed[own], placed[other].normal_of(tied.face), 0.5);
            };
            add_points(finder.all(number, side), pair, side, point, r);
        }
    }
    keep_anchors(s.contacts.points, r);
    return r;
}

template <int D>
std::vector<TiedPoint<D>> find_tied_points(const ContactPair<D>& pair, int number, const std::vector<ContactSurface<D>>& surfaces,
                                           const std::vector<std::vector<Vec<D>>>& vertices, double distance,
                                           const Vec<D>& period)
{
    std::vector<TiedPoint<D>> r;
    for (int side = 0; side < 2; ++side) {
        const int own = pair.surface[side], other = pair.surface[1 - side];
        PlacedSurface<D> slave(surfaces[own].outline, vertices[own]), master(surfaces[other].outline, vertices[other]);
        const PointFinder<D> finder(slave, master, pair.on_faces, distance, period);
        for (const ContactPoint<D>& one : finder.all(number, side)) r.push_back({one.key, one.face, one.weight, {}, {}});
    }
    return r;
}

template <int D>
std::vector<TiedPoint<D>> find_tied_points(int number, bool on_faces, const Obstacle<D>& obstacle,
                                           const ContactSurface<D>& surface, const std::vector<Vec<D>>& vertices, double distance,
                                           const Vec<D>& period)
{
    const ObstacleMotion<D> start = start_of(obstacle, 0.0);
    std::vector<TiedPoint<D>> r;
    PlacedSurface<D> placed(surface.outline, vertices);
    for (const ContactPoint<D>& one : ObstacleFinder<D>(obstacle, start, distance, 0.0, period).all(number, placed, on_faces))
        if (std::fabs(one.gap) <= distance) r.push_back({one.key, -1, {}, one.normal, one.at - one.x});
    return r;
}

template <int D>
double depth_in(const Obstacle<D>& obstacle, const ContactSurface<D>& surface, const std::vector<Vec<D>>& vertices, double reach,
                const Vec<D>& period)
{
    const ObstacleMotion<D> start = start_of(obstacle, 0.0);
    double r                      = 0.0;
    PlacedSurface<D> placed(surface.outline, vertices);
    for (const ContactPoint<D>& one : ObstacleFinder<D>(obstacle, start, reach, 0.0, period).all(0, placed))
        r = std::max(r, -one.gap);
    return r;
}

template <int D>
double depth_in(const Obstacle<D>& obstacle, const Particles<D>& p, int body, double reach, const Vec<D>& period)
{
    const ObstacleMotion<D> start = start_of(obstacle, 0.0);
    return ObstacleFinder<D>(obstacle, start, reach, 0.0, period).depth_of(p, body);
}

#define ORDO_CONTACT_POINTS(D)                                                                                                 \
    template Vec<D> period_of(const Model<D>&);                                                                                \
    template ContactSurface<D> surface_of(int, const CellMesh<D>&, const Particles<D>&, int, const Vec<D>&);                   \
    template void find_planes_of_symmetry(const Model<D>&, const CellMesh<D>&, ContactSurface<D>&);                            \
    template void keep_planes_of_symmetry(const std::vector<Condition<D>>&, ContactSurface<D>&);                               \
    template std::vector<Vec<D>> vertices_of(const ContactSurface<D>&, const Model<D>&, const State<D>&);                      \
    template std::vector<ContactPoint<D>> find_contact_points(const Model<D>&, const State<D>&,                                \
                                                              const std::vector<std::vector<Vec<D>>>&, double, double);        \
    template std::vector<TiedPoint<D>> find_tied_points(const ContactPair<D>&, int, const std::vector<ContactSurface<D>>&,     \
                                                        const std::vector<std::vector<Vec<D>>>&, double, const Vec<D>&);       \
    template std::vector<TiedPoint<D>> find_tied_points(int, bool, const Obstacle<D>&, const ContactSurface<D>&,               \
                                                        const std::vector<Vec<D>>&, double, const Vec<D>&);                    \
    template double depth_in(const Obstacle<D>&, const ContactSurface<D>&, const std::vector<Vec<D>>&, double, const Vec<D>&); \
    template double depth_in(const Obstacle<D>&, const Particles<D>&, int, double, const Vec<D>&);
ORDO_CONTACT_POINTS(2)
ORDO_CONTACT_POINTS(3)
#undef ORDO_CONTACT_POINTS

}  // namespace ordo
