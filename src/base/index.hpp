// Indices of nodes, cells and tiles, and boxes of them.
#pragma once

#include "base/vec.hpp"

#include <utility>

namespace ordo {

/// f(std::integral_constant<int, k>{}) for k = 0, 1, ..., count - 1: a loop that is unrolled and whose index is a constant.
template <int count, class F>
ORDO_FLAT constexpr void for_constants(F&& f)
{
    [&]<int... k>(std::integer_sequence<int, k...>) ORDO_FLAT_LAMBDA { (f(std::integral_constant<int, k>{}), ...); }
    (std::make_integer_sequence<int, count>{});
}

constexpr int power_of(int base, int exponent) { return exponent == 0 ? 1 : base * power_of(base, exponent - 1); }

/// Indices of a node, a cell or a tile along each axis.
template <int D>
using Index = Vec<D, int>;

/// The flat number of an index 0 <= k < counts, the first axis fastest.
template <int D>
constexpr int number_of(const Index<D>& k, const Index<D>& counts)
{
    int r = 0;
    for (int a = D - 1; a >= 0; --a) r = r * counts[a] + k[a];
    return r;
}

/// The indices lo <= k < hi.
template <int D>
struct IndexBox {
    Index<D> lo, hi;

    /// `center` and all indices within `reach` of it along each axis.
    static IndexBox around(const Index<D>& center, int reach)
    {
        return {center + Index<D>::filled(-reach), center + Index<D>::filled(reach + 1)};
    }

    bool is_empty() const
    {
        for (int a = 0; a < D; ++a)
            if (lo[a] >= hi[a]) return true;
        return false;
    }
    bool contains(const Index<D>& k) const
    {
        for (int a = 0; a < D; ++a)
            if (k[a] < lo[a] || k[a] >= hi[a]) return false;
        return true;
    }

    /// f(k) for each index of the box, the first axis fastest.
    template <class F>
    void for_each(F&& f) const
    {
        if (is_empty()) return;
        Index<D> k = lo;
        for (;;) {
            f(k);
            int a = 0;
            while (a < D && ++k[a] == hi[a]) {
                k[a] = lo[a];
                ++a;
            }
            if (a == D) return;
        }
    }
};

}  // namespace ordo
