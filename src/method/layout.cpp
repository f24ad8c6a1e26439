#include "method/layout.hpp"

#include "method/enrichment.hpp"

#include <cmath>

namespace ordo {

template <int D>
void wrap_periodic(const Model<D>& model, Particles<D>& particles)
{
    for (int a = 0; a < D; ++a) {
        if (!model.periodic[a]) continue;
        const double length = model.cells[a] * model.h[a];
        for (int i = 0; i < particles.count; ++i) {
            const double turns = std::floor((particles.x[i][a] - model.origin[a]) / length);
            particles.x[i][a] -= length * turns;
            particles.turns[i][a] += static_cast<int>(turns);
        }
    }
}

template <int D>
void sort_particles(const Model<D>& model, State<D>& s)
{
    constexpr double min_slack = 0.25;  // cells that a particle may travel before the next sort
    s.extra_reach              = extra_reach(model.method);
    const int halo             = static_cast<int>(std::ceil(s.reach + min_slack)) + s.extra_reach;
    wrap_periodic(model, s.particles);

    const Lattice<D> lattice(model.origin, model.h, model.cells, model.periodic, halo + 1, grid_basis(model.method));
    Tiles<D> tiles(lattice, halo);
    const int count = s.particles.count;
    std::vector<std::uint64_t> keys(count), sorted(count);
    parallel_for_each(count, [&](std::ptrdiff_t i) {
        Index<D> cell{};
        for (int a = 0; a < D; ++a) cell[a] = static_cast<int>(lattice.cell_coordinate(a, s.particles.x[i][a]));
        keys[i] = tiles.key(cell);
    });
    const std::vector<int> order = stable_order(keys, tiles.key_end());
    permute(s.particles, order);
    for (int k = 0; k < count; ++k) sorted[k] = keys[order[k]];
    tiles.assign(sorted);

    s.halo                     = Halo<D>(lattice, tiles);
    const std::size_t enriched = add_enriched(lattice, s.particles, s.halo), nodes = lattice.node_count() + enriched;
    tiles.add_nodes(enriched);
    if (s.nodes.size() != nodes) {
        s.nodes = Array<Lanes>(nodes);
        if (model.method.scheme != Scheme::usl) s.strain_nodes = Array<Lanes>(nodes);
        if (model.method.mass == MassMatrix::consistent) s.known = Array<Lanes>(nodes);
    }
    s.lattice     = lattice;
    s.tiles       = std::move(tiles);
    s.constraints = Constraints<D>(model.boundaries, s.lattice, s.tiles);
    s.drift       = 0.0;
    number_enriched(s);
}

template void wrap_periodic(const Model<1>&, Particles<1>&);
template void wrap_periodic(const Model<2>&, Particles<2>&);
template void wrap_periodic(const Model<3>&, Particles<3>&);
template void sort_particles(const Model<1>&, State<1>&);
template void sort_particles(const Model<2>&, State<2>&);
template void sort_particles(const Model<3>&, State<3>&);

}  // namespace ordo
