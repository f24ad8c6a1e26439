// Bounds of points.
#pragma once

#include "base/vec.hpp"

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

namespace ordo {

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
    double largest_side() const
    {
        const Vec<D> sides = high - low;
        return *std::max_element(sides.c, sides.c + D);
    }
    bool covers(const Extent& other) const { return has(other.low) && has(other.high); }
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

}  // namespace ordo
