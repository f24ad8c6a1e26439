// Stable sort of particles by a key, and the permutation of their fields.
#pragma once

#include "base/array.hpp"
#include "base/parallel.hpp"
#include "particles/particles.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
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

/// Puts other particles in the place of those that there are: element k of each field becomes what source(field, offset, k) points to, where
/// `offset` is where the field begins among those of a particle, one after the other. `for_each_field` visits the fields. Fields of one narrow
/// type reuse each other's memory, because new pages cost more than the copy. Wide ones go through that of a vector, piece by piece, so that
/// this needs little more memory than the particles.
template <int D, class Fields, class Source>
void rearrange(std::ptrdiff_t n, const Fields& for_each_field, const Source& source)
{
    const auto count = static_cast<std::size_t>(n);
    std::tuple<Array<Vec<D>>, Array<double>, Array<std::int32_t>, Array<Turns<D>>> spare;
    auto make_room = [&]<class T>(Array<T>& array) {
        if (array.fit(count)) return;
        array = Array<T>(count + count / 16);  // pages that nothing touches cost nothing
        array.fit(count);
    };
    auto spare_of = [&]<class T>() -> Array<T>& {
        auto& r = std::get<Array<T>>(spare);
        make_room(r);
        return r;
    };
    std::size_t field_offset = 0;
    auto move_to             = [&]<class T>(Array<T>& moved, const Array<T>& field) {
        parallel_for_each(n, [&](std::ptrdiff_t k) {
            T one{};  // a store of its type changes none of the pointers here, so they stay in registers
            std::memcpy(static_cast<void*>(&one), source(field, field_offset, k), sizeof(T));
            moved[k] = one;
        });
    };
    // The bytes of all elements from `offset` up to `offset` + size.
    auto move_piece = [&]<std::size_t size, class T>(Array<T>& field, std::size_t offset) {
        auto* const bytes = reinterpret_cast<unsigned char*>(field.data()) + offset;
        auto* const moved = reinterpret_cast<unsigned char*>(spare_of.template operator()<Vec<D>>().data());
        parallel_for_each(
            n, [&](std::ptrdiff_t k) { std::memcpy(moved + k * size, source(field, field_offset, k) + offset, size); });
        parallel_for_each(n, [&](std::ptrdiff_t k) { std::memcpy(bytes + k * sizeof(T), moved + k * size, size); });
    };
    for_each_field([&]<class T>(Array<T>& field) {
        if constexpr (std::is_same_v<T, Vec<D>> || std::is_same_v<T, double> || std::is_same_v<T, std::int32_t> ||
                      std::is_same_v<T, Turns<D>>) {
            Array<T>& moved = spare_of.template operator()<T>();
            move_to(moved, field);
            std::swap(field, moved);
        } else if (field.fit(count)) {
            constexpr std::size_t piece = sizeof(Vec<D>), rest = sizeof(T) % piece;
            for (std::size_t offset = 0; offset + piece <= sizeof(T); offset += piece)
                move_piece.template operator()<piece>(field, offset);
            if constexpr (rest > 0) move_piece.template operator()<rest>(field, sizeof(T) - rest);
        } else {
            Array<T> moved;
            make_room(moved);
            move_to(moved, field);
            field = std::move(moved);
        }
        field_offset += sizeof(T);
    });
}

/// The bytes of an element.
template <class T>
const unsigned char* bytes_at(const Array<T>& field, std::ptrdiff_t i)
{
    return reinterpret_cast<const unsigned char*>(&field[static_cast<std::size_t>(i)]);
}

/// Permutes every field: new[k] = old[order[k]].
template <int D>
void permute(Particles<D>& particles, const Array<int>& order)
{
    rearrange<D>(
        particles.count, [&](auto&& visit) { particles.for_each_field(visit); },
        [&](const auto& field, std::size_t, std::ptrdiff_t k) { return bytes_at(field, order[k]); });
}

}  // namespace ordo
