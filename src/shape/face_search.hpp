// Which face of a surface a point is in contact with: the nearest that faces it, found by bins. The same for any number of threads.
#pragma once

#include "base/index.hpp"
#include "shape/curved_face.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>

namespace ordo {

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
    /// `reach`: the largest distance of points that are looked for, m. Outline, places x and normals n are used until the last
    /// search.
    FaceSearch(const Outline<D>& outline, const Vec<D>* x, const std::array<Vec<D>, Face<D>::max_corners>* n, double reach)
        : outline_(outline), x_(x), n_(n), reach_(reach)
    {
        const std::size_t count = outline.faces.size();
        boxes_.resize(count);
        double width = 2 * reach;
        for (std::size_t k = 0; k < count; ++k) {
            const auto at = outline.corners_of(k, x);
            Box box{at[0], at[0]};
            for (int c = 1; c < outline.faces[k].count; ++c)
                for (int a = 0; a < D; ++a) {
                    box.low[a]  = std::min(box.low[a], at[c][a]);
                    box.high[a] = std::max(box.high[a], at[c][a]);
                }
            double size = 0.0;
            for (int a = 0; a < D; ++a) size = std::max(size, box.high[a] - box.low[a]);
            for (int a = 0; a < D; ++a) {  // the height of a curved face is below that of the slopes allowed at its corners
                box.low[a] -= reach + 0.2 * size;
                box.high[a] += reach + 0.2 * size;
            }
            boxes_[k] = box;
            width     = std::max(width, size);
            for (int a = 0; a < D; ++a) {
                all_.low[a]  = k == 0 ? box.low[a] : std::min(all_.low[a], box.low[a]);
                all_.high[a] = k == 0 ? box.high[a] : std::max(all_.high[a], box.high[a]);
            }
        }
        for (int a = 0; a < D; ++a) {
            // No more bins along an axis than keys of 63 bits can hold.
            bins_[a]  = std::clamp<std::int64_t>(static_cast<std::int64_t>((all_.high[a] - all_.low[a]) / width), 1, 1 << 20);
            per_m_[a] = static_cast<double>(bins_[a]) / (all_.high[a] - all_.low[a]);
        }
        for (std::size_t k = 0; k < count; ++k) {
            Index<D> from{}, to{};
            for (int a = 0; a < D; ++a) {
                from[a] = bin(a, boxes_[k].low[a]);
                to[a]   = bin(a, boxes_[k].high[a]) + 1;
            }
            IndexBox<D>{from, to}.for_each([&](const Index<D>& i) { faces_.emplace_back(key(i), static_cast<int>(k)); });
        }
        std::sort(faces_.begin(), faces_.end());
    }

    /// The nearest face within reach of x that faces a surface of outward normal n there (n . n_face < -0.3); of equally near
    /// ones the first. None for points that lie beyond the edges of all.
    std::optional<Nearest<D>> nearest(const Vec<D>& x, const Vec<D>& n) const
    {
        constexpr double facing = -0.3;
        std::optional<Nearest<D>> best;
        if (!all_.has(x)) return best;
        Index<D> i{};
        for (int a = 0; a < D; ++a) i[a] = bin(a, x[a]);
        const std::int64_t here = key(i);
        auto it                 = std::lower_bound(faces_.begin(), faces_.end(), std::pair{here, -1});
        for (; it != faces_.end() && it->first == here; ++it) {
            const int k = it->second;
            if (!boxes_[k].has(x)) continue;
            const Foot<D> foot = face(k).foot(x);
            if (!foot.is_inside || !(std::fabs(foot.gap) <= reach_) || !(dot(foot.normal, n) < facing)) continue;
            if (!best || std::fabs(foot.gap) < std::fabs(best->foot.gap)) best = Nearest<D>{k, foot};
        }
        return best;
    }
    CurvedFace<D> face(int k) const { return {outline_.corners_of(k, x_).data(), n_[k].data(), outline_.faces[k].count}; }

  private:
    struct Box {
        Vec<D> low{}, high{};
        bool has(const Vec<D>& x) const
        {
            for (int a = 0; a < D; ++a)
                if (!(x[a] >= low[a] && x[a] <= high[a])) return false;
            return true;
        }
    };
    int bin(int a, double x) const
    {
        return static_cast<int>(std::clamp<double>((x - all_.low[a]) * per_m_[a], 0.0, static_cast<double>(bins_[a] - 1)));
    }
    std::int64_t key(const Index<D>& i) const
    {
        std::int64_t r = 0;
        for (int a = D - 1; a >= 0; --a) r = r * bins_[a] + i[a];
        return r;
    }

    const Outline<D>& outline_;
    const Vec<D>* x_;
    const std::array<Vec<D>, Face<D>::max_corners>* n_;
    double reach_;
    std::vector<Box> boxes_;  ///< of the faces, widened by reach
    Box all_;
    std::array<std::int64_t, D> bins_{};
    Vec<D> per_m_{};
    std::vector<std::pair<std::int64_t, int>> faces_;  ///< bins and the faces in them, ascending
};

}  // namespace ordo
