// Particles that go from rank to rank. They arrive in the order that a single process has them in.
#pragma once

#include "base/ranks.hpp"
#include "particles/particles.hpp"

#include <algorithm>
#include <compare>
#include <cstdint>
#include <cstring>
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

/// Takes the particles for which goes(i) holds out of `p`, and puts those in `bytes`, one list a rank, between the others in the order of
/// their places. `places` are those of the particles of p, ascending. Corners are not renumbered: each rank has room for all.
template <int D, class Goes>
void merge(Particles<D>& p, const FieldGroups& groups, const std::vector<OldPlace>& places, const Goes& goes,
           const std::vector<Bytes>& bytes)
{
    struct Entry {
        OldPlace place;
        int kept;                    ///< its number in p, or -1
        const unsigned char* bytes;  ///< after its place
    };
    std::vector<Entry> all;
    for (int i = 0; i < p.count; ++i)
        if (!goes(i)) all.push_back({places[static_cast<std::size_t>(i)], i, nullptr});
    const auto kept = static_cast<std::ptrdiff_t>(all.size());

    const std::size_t size = size_of_fields(p, groups);
    for (const Bytes& from : bytes)
        for (const unsigned char* at = from.data(); at != from.data() + from.size();) {
            Entry one{{}, -1, at + sizeof(OldPlace)};
            std::memcpy(&one.place, at, sizeof(OldPlace));
            all.push_back(one);
            at = one.bytes + size;
            if (!groups.cells) continue;
            CornerIds<D> cell;
            std::size_t offset = 0;
            p.for_each_field_of(groups, [&](const auto& field) {
                if (static_cast<const void*>(&field) == &p.cell) std::memcpy(&cell, one.bytes + offset, sizeof(cell));
                offset += sizeof(field[0]);
            });
            for (int c = 0; c < cell.count(); ++c) {
                const auto corner = static_cast<std::size_t>(cell[c]);
                std::memcpy(&p.corner[corner], at, sizeof(Vec<D>));
                at += sizeof(Vec<D>);
                if (p.corner_velocity.empty()) continue;
                std::memcpy(&p.corner_velocity[corner], at, sizeof(Vec<D>));
                at += sizeof(Vec<D>);
            }
        }
    if (kept == p.count && kept == static_cast<std::ptrdiff_t>(all.size())) return;
    auto by_place = [](const Entry& a, const Entry& b) { return a.place < b.place; };
    std::sort(all.begin() + kept, all.end(), by_place);
    std::inplace_merge(all.begin(), all.begin() + kept, all.end(), by_place);

    std::size_t offset = 0;
    p.for_each_field_of(groups, [&]<class T>(Array<T>& field) {
        Array<T> moved(all.size(), Pages::own);
        parallel_for_each(static_cast<std::ptrdiff_t>(all.size()), [&](std::ptrdiff_t k) {
            const Entry& from = all[static_cast<std::size_t>(k)];
            std::memcpy(&moved[static_cast<std::size_t>(k)],
                        from.kept >= 0 ? static_cast<const void*>(&field[static_cast<std::size_t>(from.kept)])
                                       : from.bytes + offset,
                        sizeof(T));
        });
        field = std::move(moved);
        offset += sizeof(T);
    });
    p.count = static_cast<int>(all.size());
}

}  // namespace ordo
