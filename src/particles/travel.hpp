// Particles that go from rank to rank, and the order of a single process that they have there.
#pragma once

#include "base/ranks.hpp"
#include "particles/particles.hpp"
#include "particles/sort.hpp"

#include <algorithm>
#include <compare>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <utility>
#include <vector>

namespace ordo {

/// Where a particle was after the last sort, among those of all ranks.
struct OldPlace {
    std::uint64_t tile  = 0;
    std::uint64_t place = 0;  ///< in the tile

    auto operator<=>(const OldPlace&) const = default;  // NOLINT(modernize-use-nullptr): a false alarm of clang-tidy 14
};

/// How many bytes the fields of a particle have.
template <int D>
std::size_t size_of_fields(Particles<D>& p, const FieldGroups& groups)
{
    std::size_t size = 0;
    p.for_each_field_of(groups, [&](const auto& field) { size += sizeof(field[0]); });
    return size;
}

/// How many bytes `pack` appends, at most.
template <int D>
std::size_t packed_size(Particles<D>& p, const FieldGroups& groups)
{
    const std::size_t of_corner = sizeof(Vec<D>) * (p.corner_velocity.empty() ? 1 : 2);
    return sizeof(OldPlace) + size_of_fields(p, groups) + (groups.cells ? of_corner << D : 0);
}

/// Appends particle i with its place: its fields and, under their numbers, the corners of its cell.
template <int D>
void pack(Particles<D>& p, const FieldGroups& groups, int i, const OldPlace& place, Bytes& to)
{
    put(to, place);
    p.for_each_field_of(groups, [&](const auto& field) { put(to, field[i]); });
    if (!groups.cells) return;
    for (int c = 0; c < p.cell[i].count(); ++c) {
        const auto corner = static_cast<std::size_t>(p.cell[i][c]);
        put(to, p.corner[corner]);
        if (!p.corner_velocity.empty()) put(to, p.corner_velocity[corner]);
    }
}

/// Where a field begins among the packed fields of a particle.
template <int D, class T>
std::size_t offset_of(Particles<D>& p, const FieldGroups& groups, const Array<T>& which)
{
    std::size_t r = 0;
    bool is_found = false;
    p.for_each_field_of(groups, [&](const auto& field) {
        is_found = is_found || static_cast<const void*>(&field) == &which;
        if (!is_found) r += sizeof(field[0]);
    });
    return r;
}

/// The particles of a rank after some have gone and others have come, in the order of their places.
struct Merged {
    std::vector<int> from;                       ///< its former number here, or -1 - k of the one that has come as number k
    std::vector<const unsigned char*> arrivals;  ///< the packed fields of those that have come
    std::vector<Bytes> bytes;                    ///< where these lie

    Merged()                         = default;
    Merged(Merged&&)                 = default;
    Merged& operator=(Merged&&)      = default;
    Merged(const Merged&)            = delete;  // its pointers would be those of the other
    Merged& operator=(const Merged&) = delete;

    int count() const { return static_cast<int>(from.size()); }
    /// The bytes of an element of particle k, of a field that begins at `offset` of the packed ones.
    template <class T>
    const unsigned char* at(const Array<T>& field, std::size_t offset, std::ptrdiff_t k) const
    {
        const int i = from[static_cast<std::size_t>(k)];
        return i >= 0 ? bytes_at(field, i) : arrivals[static_cast<std::size_t>(-1 - i)] + offset;
    }
    /// The element.
    template <class T>
    T value(const Array<T>& field, std::size_t offset, std::ptrdiff_t k) const
    {
        T r{};
        std::memcpy(&r, at(field, offset, k), sizeof(r));
        return r;
    }
};

/// Lists the particles for which goes(i) does not hold, and those in `bytes`, one list a rank. `places` are those of the particles of p,
/// ascending. Sets the corners of those that have come; corners are not renumbered: each rank has room for all.
template <int D, class Goes>
Merged merge(Particles<D>& p, const FieldGroups& groups, const std::vector<OldPlace>& places, const Goes& goes,
             std::vector<Bytes> bytes)
{
    struct Arrival {
        OldPlace place;
        const unsigned char* fields;
    };
    std::vector<Arrival> arrivals;
    const std::size_t size = size_of_fields(p, groups), cell_at = offset_of(p, groups, p.cell);
    for (const Bytes& from : bytes)
        for (const unsigned char* at = from.data(); at != from.data() + from.size();) {
            Arrival one{{}, at + sizeof(OldPlace)};
            std::memcpy(&one.place, at, sizeof(OldPlace));
            arrivals.push_back(one);
            at = one.fields + size;
            if (!groups.cells) continue;
            CornerIds<D> cell;
            std::memcpy(&cell, one.fields + cell_at, sizeof(cell));
            for (int c = 0; c < cell.count(); ++c) {
                const auto corner = static_cast<std::size_t>(cell[c]);
                std::memcpy(&p.corner[corner], at, sizeof(Vec<D>));
                at += sizeof(Vec<D>);
                if (p.corner_velocity.empty()) continue;
                std::memcpy(&p.corner_velocity[corner], at, sizeof(Vec<D>));
                at += sizeof(Vec<D>);
            }
        }
    std::sort(arrivals.begin(), arrivals.end(), [](const Arrival& a, const Arrival& b) { return a.place < b.place; });

    Merged r;
    r.bytes = std::move(bytes);
    for (const Arrival& one : arrivals) r.arrivals.push_back(one.fields);
    r.from.reserve(static_cast<std::size_t>(p.count) + arrivals.size());
    int come = 0;
    for (int i = 0; i < p.count; ++i) {
        if (goes(i)) continue;
        for (;
             come < std::ssize(arrivals) && arrivals[static_cast<std::size_t>(come)].place < places[static_cast<std::size_t>(i)];
             ++come)
            r.from.push_back(-1 - come);
        r.from.push_back(i);
    }
    for (; come < std::ssize(arrivals); ++come) r.from.push_back(-1 - come);
    return r;
}

/// Makes them the particles of p, in that order, or permuted: number k is merged[order[k]].
template <int D>
void take(Particles<D>& p, const FieldGroups& groups, const Merged& merged, const Array<int>& order = {})
{
    if (order.empty() && merged.arrivals.empty() && merged.count() == p.count) return;
    rearrange<D>(
        merged.count(), [&](auto&& visit) { p.for_each_field_of(groups, visit); },
        [&](const auto& field, std::size_t offset, std::ptrdiff_t k) {
            return merged.at(field, offset, order.empty() ? k : order[k]);
        });
    p.count = merged.count();
}

}  // namespace ordo
