#include "method/layout.hpp"

#include "method/enrichment.hpp"
#include "method/sharing.hpp"

#include <cmath>

namespace ordo {

template <int D>
void wrap_periodic(const Model<D>& model, Particles<D>& particles)
{
    for (int a = 0; a < D; ++a) {
        if (!model.periodic[a]) continue;
        const double length = model.cells[a] * model.h[a];
        parallel_for_each(particles.count, [&](std::ptrdiff_t i) {
            const double turns = std::floor((particles.x[i][a] - model.origin[a]) / length);
            particles.x[i][a] -= length * turns;
            particles.turns[i][a] += static_cast<int>(turns);
        });
    }
}

namespace {

/// Sorts the particles by velocity field, tile and cell.
template <int D>
void assign(const Model<D>& model, const Lattice<D>& lattice, Tiles<D>& tiles, State<D>& s)
{
    Particles<D>& p = s.particles;
    auto key        = [&](const Vec<D>& x, int body) {
        Index<D> cell{};
        for (int a = 0; a < D; ++a) cell[a] = static_cast<int>(lattice.cell_coordinate(a, x[a]));
        return tiles.key(cell, model.field_of(body));
    };
    auto sorted = [&](int count, const auto& key_of) {
        Array<std::uint64_t> keys(count, Pages::own);
        parallel_for_each(count, [&](std::ptrdiff_t i) { keys[i] = key_of(i); });
        Array<int> order = sort_keys(keys, tiles.key_end());
        tiles.assign(keys);
        return order;
    };
    auto key_here = [&](std::ptrdiff_t i) { return key(p.x[i], p.body[i]); };
    if (s.ranks->is_alone()) {
        if (const Array<int> order = sorted(p.count, key_here); !order.empty()) permute(p, order);
        return;
    }
    Division division        = migrate<D>(model, s, tiles, [&](int i) { return tiles.tile_of(key_here(i)); });
    const FieldGroups groups = field_groups(model);
    const std::size_t x_at = offset_of(p, groups, p.x), body_at = offset_of(p, groups, p.body);
    const Merged& all = division.particles;
    take(p, groups, all,
         sorted(all.count(), [&](std::ptrdiff_t k) { return key(all.value(p.x, x_at, k), all.value(p.body, body_at, k)); }));
    division.particles = {};
    join_rims(*s.ranks, model.method, lattice, division.owners, tiles);
    for (std::size_t k = 0; k < tiles.tile_numbers().size(); ++k)
        if (const auto known = division.seconds.find(tiles.tile_numbers()[k]); known != division.seconds.end())
            tiles.weigh(k, known->second);
}

/// The corners of cells by the velocity field of the body that they belong to; without those of other ranks.
template <int D>
std::vector<CornerRun> corner_runs(const Model<D>& model, const State<D>& s, const Tiles<D>& tiles)
{
    constexpr int none    = -1;
    const Particles<D>& p = s.particles;
    const auto count      = static_cast<std::ptrdiff_t>(p.corner.size());
    if (tiles.fields() == 1 && s.ranks->is_alone()) return {{0, count, 0}};
    std::vector<int> field(p.corner.size(), none);
    for (int i = 0; i < p.count && count > 0; ++i)
        for (int c = 0; c < p.cell[i].count(); ++c) field[p.cell[i][c]] = model.field_of(p.body[i]);
    std::vector<CornerRun> runs;
    for (std::ptrdiff_t begin = 0, end; begin < count; begin = end) {
        for (end = begin + 1; end < count && field[end] == field[begin];) ++end;
        if (field[begin] != none) runs.push_back({begin, end, tiles.first_node(field[begin])});
    }
    return runs;
}

/// Sets where the particles are that have the numbers 0, 1, ..; -1 for those that have been taken out or are on other ranks.
template <int D>
void find_ids(Ranks& ranks, const Particles<D>& p, std::vector<int>& place_of)
{
    const auto last = largest(ranks, p.count == 0 ? -1 : *std::max_element(p.id.begin(), p.id.end()));
    place_of.assign(std::max(static_cast<std::size_t>(last + 1), place_of.size()), -1);
    for (int i = 0; i < p.count; ++i) place_of[p.id[i]] = i;
}

}  // namespace

template <int D>
void arrange_nodes(const Model<D>& model, State<D>& s, const Lattice<D>& lattice, Tiles<D> tiles)
{
    s.field.halo               = Halo<D>(lattice, tiles);
    const std::size_t enriched = add_enriched(lattice, s.particles, s.field.halo),
                      nodes    = tiles.fields() * lattice.node_count() + enriched;
    tiles.add_nodes(enriched);
    if (s.field.nodes.size() != nodes) {
        s.field.nodes = Array<Lanes>(nodes, Pages::own);
        if (!strains_by_advanced(model.method)) s.field.strain_nodes = Array<Lanes>(nodes, Pages::own);
        if (model.method.mass == MassMatrix::consistent) s.field.known = Array<Lanes>(nodes, Pages::own);
    }
    s.lattice           = lattice;
    s.field.tiles       = std::move(tiles);
    s.field.placed      = Constraints<D>(model.conditions, s.lattice, s.field.tiles);
    s.field.constraints = s.field.placed;
    s.field.wall_nodes  = WallNodes<D>(model.walls, s.wall_shifts, s.lattice, s.field.tiles);
    s.field.wall_nodes.leave(s.field.constraints);
    s.field.corner_runs = corner_runs(model, s, s.field.tiles);
    if (!model.surfaces.empty()) find_ids(*s.ranks, s.particles, s.contacts.place_of);
    number_enriched(s);
}

template <int D>
void sort_particles(const Model<D>& model, State<D>& s)
{
    constexpr double min_slack = 0.25;  // cells that a particle can travel before the next sort, at least
    s.extra_reach              = extra_reach(model.method);
    const int halo             = static_cast<int>(std::ceil(s.reach + min_slack)) + s.extra_reach;
    wrap_periodic(model, s.particles);

    const Lattice<D> lattice(model.origin, model.h, model.cells, model.periodic, halo + 1, grid_basis(model.method));
    std::int64_t count = s.particles.count;
    s.ranks->add({&count, 1});
    Tiles<D> tiles(lattice, halo, count, model.field_count());
    s.field.mass = {};  // frees memory for the sort; the matrix is formed again in each step
    assign(model, lattice, tiles, s);

    s.drift = 0.0;
    arrange_nodes(model, s, lattice, std::move(tiles));
}

template <int D>
bool restore_layout(const Model<D>& model, State<D>& s, TileRecord record, int halo, std::int64_t first)
{
    s.extra_reach = extra_reach(model.method);
    if (halo < 0 || halo > 1'000'000) return false;
    const Lattice<D> lattice(model.origin, model.h, model.cells, model.periodic, halo + 1, grid_basis(model.method));
    std::int64_t count = s.particles.count;
    s.ranks->add({&count, 1});
    Tiles<D> tiles(lattice, halo, count, model.field_count());
    if (!tiles.restore(std::move(record), static_cast<int>(count))) return false;
    if (!s.ranks->is_alone()) distribute(model, lattice, first, tiles, s);
    arrange_nodes(model, s, lattice, std::move(tiles));
    return true;
}

#define ORDO_LAYOUT(D)                                                                    \
    template void wrap_periodic(const Model<D>&, Particles<D>&);                          \
    template void arrange_nodes(const Model<D>&, State<D>&, const Lattice<D>&, Tiles<D>); \
    template void sort_particles(const Model<D>&, State<D>&);                             \
    template bool restore_layout(const Model<D>&, State<D>&, TileRecord, int, std::int64_t);
ORDO_LAYOUT(1)
ORDO_LAYOUT(2)
ORDO_LAYOUT(3)
#undef ORDO_LAYOUT

}  // namespace ordo
