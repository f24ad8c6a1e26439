// Particles that are taken out, with the corners that no other cell has.
#pragma once

#include "base/ranks.hpp"
#include "particles/particles.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

namespace ordo {

/// The elements of `field` at the places `kept`, in their order; a field that does not exist stays so.
template <class T>
void keep_elements(Array<T>& field, const std::vector<int>& kept)
{
    if (field.empty()) return;
    Array<T> rest(kept.size());
    for (std::size_t k = 0; k < kept.size(); ++k) rest[k] = field[static_cast<std::size_t>(kept[k])];
    field = std::move(rest);
}

/// Keeps the particles [begin, end) with their numbers `id`, and all corners.
template <int D>
void keep_particles(Particles<D>& p, int begin, int end)
{
    std::vector<int> kept(static_cast<std::size_t>(end - begin));
    std::iota(kept.begin(), kept.end(), begin);
    p.for_each_field([&](auto& field) { keep_elements(field, kept); });
    p.count = end - begin;
}

/// Takes out the particles for which is_out(i) holds; the others keep their order and their numbers `id`. Not for enriched corners. All ranks
/// keep the corners that any of them needs.
template <int D, class IsOut>
void remove_particles(Ranks& ranks, Particles<D>& p, const IsOut& is_out)
{
    std::vector<int> kept;
    for (int i = 0; i < p.count; ++i)
        if (!is_out(i)) kept.push_back(i);
    p.for_each_field([&](auto& field) { keep_elements(field, kept); });
    p.count = static_cast<int>(kept.size());
    if (p.corner.empty()) return;

    std::vector<std::int64_t> cells_of(p.corner.size(), 0);
    for (const CornerIds<D>& cell : p.cell)
        for (int c = 0; c < cell.count(); ++c) ++cells_of[static_cast<std::size_t>(cell[c])];
    ranks.add(cells_of);
    std::vector<int> number(p.corner.size(), -1), corners;
    for (std::size_t c = 0; c < number.size(); ++c) {
        if (cells_of[c] == 0) continue;
        number[c] = static_cast<int>(corners.size());
        corners.push_back(static_cast<int>(c));
    }
    for (CornerIds<D>& cell : p.cell)
        for (int c = 0; c < cell.count(); ++c) cell[c] = number[static_cast<std::size_t>(cell[c])];
    keep_elements(p.corner, corners);
    keep_elements(p.corner_velocity, corners);
}

}  // namespace ordo
