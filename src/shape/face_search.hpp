// Which face of a surface a point is in contact with: the nearest that faces it, found by bins. The same for any number of threads.
#pragma once

#include "base/index.hpp"
#include "shape/curved_face.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>

namespace ordo {

/// Surfaces face each other where the product of their outward normals is below this.
inline constexpr double kFacing = -0.3;

/// Bounds of points, m; empty at first.
template <int D>
struct Extent {
    Vec<D> low = Vec<D>::filled(std::numeric_limits<double>::infinity()), high = -1.0 * low;

    static Extent of(const std::vector<Vec<D>>& x)
    {
        Extent r;
        for (const Vec<D>& one : x) r.add(one);
        return r;
    }
    static Extent everywhere()
    {
        Extent r;
        std::swap(r.low, r.high);
        return r;
    }
    void add(const Vec<D>& x)
    {
        for (int a = 0; a < D; ++a) {
            low[a]  = std::min(low[a], x[a]);
            high[a] = std::max(high[a], x[a]);
        }
    }
    Extent widened(double by) const { return {low - Vec<D>::filled(by), high + Vec<D>::filled(by)}; }
    Extent moved(const Vec<D>& by) const { return {low + by, high + by}; }
    Extent common_with(const Extent& other) const
    {
        Extent r;
        for (int a = 0; a < D; ++a) {
            r.low[a]  = std::max(low[a], other.low[a]);
            r.high[a] = std::min(high[a], other.high[a]);
        }
        return r;
    }
    bool has(const Vec<D>& x) const
    {
        for (int a = 0; a < D; ++a)
            if (!(x[a] >= low[a] && x[a] <= high[a])) return false;
        return true;
    }
    bool meets(const Extent& other) const
    {
        for (int a = 0; a < D; ++a)
            if (!(other.high[a] >= low[a] && other.low[a] <= high[a])) return false;
        return true;
    }
};

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

    /// `reach`: the largest distance of points that are looked for, m; all of these lie in `within`. Outline, places x and normals n
    /// are used until the last search.
    FaceSearch(const Outline<D>& outline, const Vec<D>* x, const typename Normals::value_type* n, double reach,
               const Extent<D>& within = Extent<D>::everywhere())
        : outline_(outline), x_(x), n_(n), reach_(reach), looks_(outline.faces.size())
    {
        parallel_for_each(static_cast<std::ptrdiff_t>(looks_.size()), [&](std::ptrdiff_t k) { looks_[k] = look_at(k); });
        std::vector<int> wanted;
        double width = 2 * reach;
        for (std::size_t k = 0; k < looks_.size(); ++k) {
            if (!looks_[k].box.meets(within)) continue;
            wanted.push_back(static_cast<int>(k));
            all_.add(looks_[k].box.low);
            all_.add(looks_[k].box.high);
            width = std::max(width, looks_[k].size);
        }
        if (!wanted.empty()) fill_bins(wanted, width);
    }

    /// The nearest face within reach of x that faces a surface of outward normal n there (n . n_face < kFacing); of equally near
    /// ones the first. None for points that lie beyond the edges of all.
    std::optional<Nearest<D>> nearest(const Vec<D>& x, const Vec<D>& n) const
    {
        std::optional<Nearest<D>> best;
        if (!all_.has(x)) return best;
        const std::int64_t here = key(bin_of(x));
        for (int i = first_[here]; i < first_[here + 1]; ++i) {
            const int k = faces_[i];
            if (!looks_[k].may_face(x, n, outline_.faces[k].count == 3)) continue;
            const Foot<D> foot = face(k).foot(x);
            if (!foot.is_inside || !(std::fabs(foot.gap) <= reach_) || !(dot(foot.normal, n) < kFacing)) continue;
            if (!best || std::fabs(foot.gap) < std::fabs(best->foot.gap)) best = Nearest<D>{k, foot};
        }
        return best;
    }
    CurvedFace<D> face(int k) const { return {outline_.corners_of(k, x_).data(), n_[k].data(), outline_.faces[k].count}; }

  private:
    /// What tells without its curve that a face has no foot of a point.
    struct Look {
        Extent<D> box;      ///< of its corners, widened by reach and height
        double size = 0.0;  ///< largest side of the box of its corners, m
        Vec<D> middle{}, normal{};
        Vec<D> dual[D - 1];   ///< of its edges: places in units of these, 1/m
        double margin = 0.0;  ///< by which a foot's place on the curve may differ from that on the plane

        bool may_face(const Vec<D>& x, const Vec<D>& n, bool is_triangle) const
        {
            constexpr double aside = 0.5;  // normals of a curved face differ by less than 0.7 from that of the plane
            if (!box.has(x) || dot(normal, n) > aside) return false;
            double least = 0.0, sum = 0.0, most = 0.0;
            for (const Vec<D>& d : dual) {
                const double place = dot(x - middle, d);
                least              = std::min(least, place);
                most               = std::max(most, place);
                sum += place;
            }
            if (is_triangle) return least > -1.0 / 3 - margin && sum < 1.0 / 3 + margin;
            return least > -0.5 - margin && most < 0.5 + margin;
        }
    };
    Look look_at(std::ptrdiff_t k) const
    {
        const int count = outline_.faces[k].count;
        const auto at   = outline_.corners_of(static_cast<std::size_t>(k), x_);
        Look r;
        for (int c = 0; c < count; ++c) r.box.add(at[c]);
        for (int a = 0; a < D; ++a) r.size = std::max(r.size, r.box.high[a] - r.box.low[a]);
        r.box    = r.box.widened(reach_ + 0.2 * r.size);  // the height is below that of the slopes allowed at corners
        r.middle = face_center(at.data(), count);
        r.normal = unit(face_area(at.data(), count));
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
            r.dual[d] = {};
            for (int e = 0; e < D - 1; ++e) r.dual[d] += inverted(d, e) * edge[e];
            per_m = std::max(per_m, norm(r.dual[d]));
        }
        for (int c = 0; c < count; ++c) {
            const double cosine = dot(n_[k][c], r.normal);
            slope               = std::max(slope, std::sqrt(std::max(0.0, 1 / (cosine * cosine) - 1)));
        }
        slope *= 2;  // between the corners
        r.margin = 0.02 + per_m * ((reach_ + slope * r.size) * slope + norm(warp) / 4);
        return r;
    }
    void fill_bins(const std::vector<int>& wanted, double width)
    {
        const auto most     = static_cast<std::int64_t>(64 + 8 * wanted.size());
        const Vec<D> length = all_.high - all_.low;
        for (;; width *= 2) {
            std::int64_t total = 1;
            for (int a = 0; a < D; ++a) {
                bins_[a]  = std::clamp<std::int64_t>(static_cast<std::int64_t>(length[a] / width), 1, most);
                per_m_[a] = static_cast<double>(bins_[a]) / length[a];
                total     = std::min(total * bins_[a], most + 1);
            }
            if (total > most) continue;
            first_.assign(static_cast<std::size_t>(total) + 1, 0);
            break;
        }
        auto for_each_bin = [&](int k, auto&& f) {
            IndexBox<D>{bin_of(looks_[k].box.low), bin_of(looks_[k].box.high) + Index<D>::filled(1)}.for_each(
                [&](const Index<D>& i) { f(key(i)); });
        };
        for (const int k : wanted) for_each_bin(k, [&](std::int64_t b) { ++first_[b + 1]; });
        for (std::size_t b = 1; b < first_.size(); ++b) first_[b] += first_[b - 1];
        faces_.resize(static_cast<std::size_t>(first_.back()));
        std::vector<int> next(first_.begin(), first_.end() - 1);
        for (const int k : wanted) for_each_bin(k, [&](std::int64_t b) { faces_[next[b]++] = k; });
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

    const Outline<D>& outline_;
    const Vec<D>* x_;
    const typename Normals::value_type* n_;
    double reach_;
    std::vector<Look> looks_;
    Extent<D> all_;  ///< of the boxes in bins
    std::array<std::int64_t, D> bins_{};
    Vec<D> per_m_{};
    std::vector<int> first_;  ///< of each bin, and the end of the last: where its faces begin, ascending
    std::vector<int> faces_;
};

}  // namespace ordo
