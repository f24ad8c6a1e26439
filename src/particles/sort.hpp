// Stable sort of particles by a key, and the permutation of their fields.
#pragma once

#include "base/array.hpp"
#include "base/parallel.hpp"
#include "particles/particles.hpp"

#include <algorithm>
#include <cstdint>
#include <tuple>
#include <type_traits>
#include <utility>

namespace ordo {

/// Sorts `keys` (each below `key_end`) and keeps the order of equal keys. Result k is the former place of the k-th key; the
/// result is empty if all keys were in order.
/// A counting sort by digits of 11 bits, lowest first: linear in the particles, whatever the size of the grid. The stable
/// order is unique, so keys may be counted and moved in pieces by any number of threads.
inline Array<int> sort_keys(Array<std::uint64_t>& keys, std::uint64_t key_end)
{
    constexpr int bits             = 11;
    constexpr std::ptrdiff_t radix = 1 << bits, piece = 1 << 16;
    const auto n = static_cast<std::ptrdiff_t>(keys.size()), pieces = (n + piece - 1) / piece;
    const int falls = parallel_reduce(
        n, 0, [&](std::ptrdiff_t i) { return int{i > 0 && keys[i] < keys[i - 1]}; }, [](int& any, int one) { any |= one; });
    if (!falls) return {};

    Array<std::uint64_t> next_keys(n, Pages::own);
    Array<int> order(n, Pages::own), next_order(n, Pages::own), place(pieces * radix);
    parallel_for_each(n, [&](std::ptrdiff_t i) { order[i] = static_cast<int>(i); });
    for (int shift = 0; shift < 64 && ((key_end - 1) >> shift) != 0; shift += bits) {
        auto digit          = [&](std::ptrdiff_t i) { return static_cast<std::ptrdiff_t>((keys[i] >> shift) & (radix - 1)); };
        auto for_each_piece = [&](auto&& f) {
            parallel_for(pieces, [&](std::ptrdiff_t p) {
                int* const of_piece = place.data() + p * radix;
                f(of_piece, p * piece, std::min(n, (p + 1) * piece));
            });
        };
        for_each_piece([&](int* count, std::ptrdiff_t begin, std::ptrdiff_t end) {
            std::fill(count, count + radix, 0);
            for (std::ptrdiff_t i = begin; i < end; ++i) ++count[digit(i)];
        });
        int total = 0;
        for (std::ptrdiff_t d = 0; d < radix; ++d)
            for (std::ptrdiff_t p = 0; p < pieces; ++p) total += std::exchange(place[p * radix + d], total);
        for_each_piece([&](int* to, std::ptrdiff_t begin, std::ptrdiff_t end) {
            for (std::ptrdiff_t i = begin; i < end; ++i) {
                const int k   = to[digit(i)]++;
                next_keys[k]  = keys[i];
                next_order[k] = order[i];
            }
        });
        std::swap(keys, next_keys);
        std::swap(order, next_order);
    }
    return order;
}

/// Permutes every field: new[k] = old[order[k]]. Fields of one type reuse each other's memory, because new pages cost more
/// than the copy.
template <int D>
void permute(Particles<D>& particles, const Array<int>& order)
{
    std::tuple<Array<Vec<D>>, Array<Mat<D>>, Array<Stress<D>>, Array<double>, Array<std::int32_t>, Array<CornerIds<D>>,
               Array<Modes<D>>, Array<Turns<D>>>
        spare;
    particles.for_each_field([&](auto& field) {
        auto& moved = std::get<std::remove_reference_t<decltype(field)>>(spare);
        if (moved.empty()) moved = std::remove_reference_t<decltype(moved)>(field.size());
        parallel_for_each(particles.count, [&](std::ptrdiff_t k) { moved[k] = field[order[k]]; });
        std::swap(field, moved);
    });
}

}  // namespace ordo
