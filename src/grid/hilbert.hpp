// Places on Hilbert's curve, which visits all cells of a box of 2^bits a side and steps to a neighbour each time.
#pragma once

#include "base/index.hpp"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace ordo {

/// The number of a place on the curve; indices are below 2^bits, D bits below 64. After Skilling 2004, Programming the Hilbert curve (AIP
/// Conf. Proc. 707): bits of the axes, the highest first, are Gray coded after what higher bits have turned and exchanged is undone.
template <int D>
std::uint64_t hilbert_number(const Index<D>& at, int bits)
{
    std::uint32_t x[D];
    for (int a = 0; a < D; ++a) x[a] = static_cast<std::uint32_t>(at[a]);
    for (int b = bits - 1; b > 0; --b) {
        const std::uint32_t bit = std::uint32_t{1} << b, lower = bit - 1;
        for (int a = 0; a < D; ++a) {
            if (x[a] & bit) {
                x[0] ^= lower;  // turned
                continue;
            }
            const std::uint32_t differing = (x[0] ^ x[a]) & lower;  // exchanged with the first axis
            x[0] ^= differing;
            x[a] ^= differing;
        }
    }
    for (int a = 1; a < D; ++a) x[a] ^= x[a - 1];
    std::uint32_t turned = 0;
    for (int b = bits - 1; b > 0; --b)
        if (x[D - 1] >> b & 1) turned ^= (std::uint32_t{1} << b) - 1;
    std::uint64_t number = 0;
    for (int b = bits - 1; b >= 0; --b)
        for (int a = 0; a < D; ++a) number = number << 1 | ((x[a] ^ turned) >> b & 1);
    return number;
}

/// How many bits hold the indices below `counts`.
template <int D>
int bits_of(const Index<D>& counts)
{
    int bits = 1;
    for (int a = 0; a < D; ++a)
        while ((counts[a] - 1) >> bits != 0) ++bits;
    return bits;
}

/// Where on the curve the part of each rank begins, for tiles of this width on a curve of so many bits.
struct CurveCuts {
    int width = 0, bits = 0;
    std::vector<std::uint64_t> first{};

    /// The rank of a place.
    int rank_of(std::uint64_t place) const
    {
        return std::max(static_cast<int>(std::upper_bound(first.begin(), first.end(), place) - first.begin()) - 1, 0);
    }
};

}  // namespace ordo
