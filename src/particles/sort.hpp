// Stable sort of particles by a key, and the permutation of their fields.
#pragma once

#include "base/parallel.hpp"
#include "particles/particles.hpp"

#include <array>
#include <cstdint>
#include <numeric>
#include <vector>

namespace ordo {

/// The stable order of `keys` (each below `key_end`): result[k] is the index of the k-th smallest key.
/// A counting sort by digits of 11 bits, lowest first: linear in the particles, whatever the size of the grid.
inline std::vector<int> stable_order(const std::vector<std::uint64_t>& keys, std::uint64_t key_end)
{
    constexpr int bits            = 11;
    constexpr std::uint64_t radix = 1u << bits;
    std::vector<int> order(keys.size()), next(keys.size());
    std::iota(order.begin(), order.end(), 0);
    for (int shift = 0; shift < 64 && ((key_end - 1) >> shift) != 0; shift += bits) {
        std::array<int, radix + 1> start{};
        for (std::uint64_t k : keys) ++start[((k >> shift) & (radix - 1)) + 1];
        for (std::size_t d = 0; d < radix; ++d) start[d + 1] += start[d];
        for (int i : order) next[start[(keys[i] >> shift) & (radix - 1)]++] = i;
        order.swap(next);
    }
    return order;
}

/// Puts every field in the given order: new[k] = old[order[k]].
template <int D>
void permute(Particles<D>& particles, const std::vector<int>& order)
{
    particles.for_each_field([&](auto& field) {
        std::remove_reference_t<decltype(field)> moved(field.size());
        parallel_for_each(particles.count, [&](std::ptrdiff_t k) { moved[k] = field[order[k]]; });
        field = std::move(moved);
    });
}

}  // namespace ordo
