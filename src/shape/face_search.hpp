// Which face of a surface a point is in contact with: the nearest that faces it, found by bins. The same for any number of threads.
#pragma once

#include "base/index.hpp"
#include "shape/curved_face.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>

namespace ordo {

/// Surfaces face each other where the product of their outward normals is below this.
inline constexpr double kFacing = -0.3;

/// A face and the point of it that is nearest to a given one.
template <int D>
struct Nearest {
    int face = -1;
    Foot<D> foot{};
};

/// The faces of an outline at the present places of its vertices, in bins.
template <int D>
class FaceSearch {
  public:
    using Normals = std::vector<std::array<Vec<D>, Face<D>::max_corners>>;

    /// `reach`: the largest distance of points that are looked for, m; all of these lie in `within`.
    FaceSearch(const Outline<D>& outline, const Vec<D>* x, const typename Normals::value_type* n, double reach,
               const Extent<D>& within = Extent<D>::everywhere())
        : reach_(reach)
    {
        const std::vector<char> is_near = faces_near(outline, x, within.widened(reach));
        std::vector<int> near;
        for (std::size_t k = 0; k < is_near.size(); ++k)
            if (is_near[k]) near.push_back(static_cast<int>(k));
        if (near.empty()) return;
        looks_.resize(near.size());
        parallel_for_each(near.size(), [&](std::ptrdiff_t i) { looks_[i] = look_at(outline, near[i], x, n[near[i]].data()); });
        for (const Look& look : looks_) {
            all_.add(look.box.low);
            all_.add(look.box.high);
        }
        fill_bins();
    }

    /// The nearest face within reach of x that faces a surface of outward normal n there (n . n_face < kFacing); of equally near
    /// ones the first. None for points that lie beyond the edges of all.
    std::optional<Nearest<D>> nearest(const Vec<D>& x, const Vec<D>& n) const
    {
        std::optional<Nearest<D>> best;
        find_nearer(x, n, best);
        return best;
    }
    /// The same, if it is nearer than `best`.
    void find_nearer(const Vec<D>& x, const Vec<D>& n, std::optional<Nearest<D>>& best) const
    {
        if (!all_.has(x)) return;
        const std::int64_t here = key(bin_of(x));
        for (int i = first_[here]; i < first_[here + 1]; ++i) {
            const Look& look                      = looks_[in_bins_[i]];
            const std::optional<Vec<D - 1>> place = look.place_facing(x, n);
            if (!place) continue;
            const Foot<D> foot = look.curve.foot(x, *place);
            if (!foot.is_inside || !(std::fabs(foot.gap) <= reach_) || !(dot(foot.normal, n) < kFacing)) continue;
            if (!best || std::fabs(foot.gap) < std::fabs(best->foot.gap)) best = Nearest<D>{look.face, foot};
        }
    }

  private:
    /// A face, and what tells without its curve that it has no foot of a point.
    struct Look {
        int face = -1;
        CurvedFace<D> curve;
        Extent<D> box;  ///< of all points that it may be the nearest of, m
        Vec<D> middle{};
        Vec<D> dual[D - 1];   ///< of its edges: places in units of these, 1/m
        double margin = 0.0;  ///< by which a foot's place on the curve may differ from that on the plane

        /// The place of x on the plane of the face, if a foot on the curve may face a surface of normal n there.
        std::optional<Vec<D - 1>> place_facing(const Vec<D>& x, const Vec<D>& n) const
        {
            constexpr double aside = 0.5;  // normals of a curved face differ by less than 0.7 from that of the plane
            if (!box.has(x) || dot(curve.plane_normal(), n) > aside) return {};
            Vec<D - 1> place = curve.middle();
            double sum       = 0.0;
            for (int d = 0; d < D - 1; ++d) {
                place[d] += dot(x - middle, dual[d]);
                if (!(place[d] > -margin && place[d] < 1 + margin)) return {};
                sum += place[d];
            }
            if (curve.corner_count() == 3 && !(sum < 1 + margin)) return {};
            return place;
        }
    };
    Look look_at(const Outline<D>& outline, int k, const Vec<D>* x, const Vec<D>* n) const
    {
        const int count = outline.faces[k].count;
        const auto at   = outline.corners_of(static_cast<std::size_t>(k), x);
        Look r{.face = k, .curve = {at.data(), n, count}, .box = outline.extent_of(k, x), .dual = {}};
        const double size    = r.box.largest_side();
        const Vec<D>& normal = r.curve.plane_normal();
        r.middle             = face_center(at.data(), count);
        Vec<D> edge[D - 1], warp{};
        edge[0] = at[1] - at[0];
        if constexpr (D == 3) {
            edge[1] = at[2] - at[0];
            if (count == 4) {
                warp    = at[0] - at[1] + at[2] - at[3];
                edge[0] = 0.5 * (at[1] - at[0] + at[2] - at[3]);
                edge[1] = 0.5 * (at[3] - at[0] + at[2] - at[1]);
            }
        }
        Mat<D - 1> metric{};
        for (int d = 0; d < D - 1; ++d)
            for (int e = 0; e < D - 1; ++e) metric(d, e) = dot(edge[d], edge[e]);
        const Mat<D - 1> inverted = inverse(metric);
        double per_m = 0.0, slope = 0.0;
        for (int d = 0; d < D - 1; ++d) {
            for (int e = 0; e < D - 1; ++e) r.dual[d] += inverted(d, e) * edge[e];
            per_m = std::max(per_m, norm(r.dual[d]));
        }
        for (int c = 0; c < count; ++c) {
            const double cosine = dot(n[c], normal);
            slope               = std::max(slope, 1 / (cosine * cosine) - 1);  // its square
        }
        slope    = 2 * std::sqrt(slope);  // between the corners
        r.margin = 0.02 + per_m * ((reach_ + slope * size) * slope + norm(warp) / 4);
        // A point with the foot P + h N on the curve is P + h N + g n, with P on the flat face, |g| <= reach and a normal n that
        // is N within the slopes of the curve and those of a warped face.
        const double turn = slope + 2 * per_m * norm(warp);
        for (int a = 0; a < D; ++a) {
            const double across = std::min(1.0, std::fabs(normal[a]));  // 1 where a face has no normal
            const double by     = 1e-6 * size + kLargestHeight * size * across + reach_ * std::min(1.0, across + turn);
            r.box.low[a] -= by;
            r.box.high[a] += by;
        }
        return r;
    }
    /// Bins are as wide as the mean box, if they are not too many.
    void fill_bins()
    {
        Vec<D> width{};
        for (const Look& look : looks_) width += (1.0 / static_cast<double>(looks_.size())) * (look.box.high - look.box.low);
        const auto most     = static_cast<std::int64_t>(64 + 8 * looks_.size());
        const Vec<D> length = all_.high - all_.low;
        for (;; width *= 2) {
            std::int64_t total = 1;
            for (int a = 0; a < D; ++a) {
                bins_[a]  = std::clamp<std::int64_t>(static_cast<std::int64_t>(length[a] / width[a]), 1, most);
                per_m_[a] = static_cast<double>(bins_[a]) / length[a];
                total     = std::min(total * bins_[a], most + 1);
            }
            if (total > most) continue;
            first_.assign(static_cast<std::size_t>(total) + 1, 0);
            break;
        }
        auto for_each_bin = [&](const Look& look, auto&& f) {
            IndexBox<D>{bin_of(look.box.low), bin_of(look.box.high) + Index<D>::filled(1)}.for_each(
                [&](const Index<D>& i) { f(key(i)); });
        };
        for (const Look& look : looks_) for_each_bin(look, [&](std::int64_t b) { ++first_[b + 1]; });
        for (std::size_t b = 1; b < first_.size(); ++b) first_[b] += first_[b - 1];
        in_bins_.resize(static_cast<std::size_t>(first_.back()));
        std::vector<int> next(first_.begin(), first_.end() - 1);
        for (std::size_t i = 0; i < looks_.size(); ++i)
            for_each_bin(looks_[i], [&](std::int64_t b) { in_bins_[next[b]++] = static_cast<int>(i); });
    }
    Index<D> bin_of(const Vec<D>& x) const
    {
        Index<D> r{};
        for (int a = 0; a < D; ++a)
            r[a] = static_cast<int>(std::clamp<double>((x[a] - all_.low[a]) * per_m_[a], 0.0, static_cast<double>(bins_[a] - 1)));
        return r;
    }
    std::int64_t key(const Index<D>& i) const
    {
        std::int64_t r = 0;
        for (int a = D - 1; a >= 0; --a) r = r * bins_[a] + i[a];
        return r;
    }

    double reach_;
    std::vector<Look> looks_;  ///< at the faces that may be near, ascending
    Extent<D> all_;            ///< of the boxes in bins
    std::array<std::int64_t, D> bins_{};
    Vec<D> per_m_{};
    std::vector<int> first_;    ///< of each bin, and the end of the last: where its looks begin
    std::vector<int> in_bins_;  ///< ascending in each
};

}  // namespace ordo
