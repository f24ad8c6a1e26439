#include "method/reconstruction.hpp"

#include "kernels/cell_fields.hpp"
#include "kernels/cell_gradient.hpp"
#include "kernels/nodes.hpp"
#include "kernels/velocity_fit.hpp"

#include <algorithm>
#include <utility>

namespace ordo {

template <int D>
ParticleView<D> QuadraturePoints<D>::view()
{
    ParticleView<D> p{};
    p.x     = x.data();
    p.v     = v.data();
    p.b     = b.data();
    p.sigma = sigma.data();
    p.m     = m.data();
    p.V     = V.data();
    p.count = count;
    return p;
}

template <int D>
void QuadraturePoints<D>::resize(int n, bool has_body_force)
{
    keep_room(x, n);
    keep_room(v, n);
    keep_room(sigma, n);
    keep_room(m, n);
    keep_room(V, n);
    if (has_body_force) keep_room(b, n);
    count = n;
}

/// Adds the reports of blocks, and records where pivots were dropped first.
template <int D>
void add_reports(State<D>& s, const std::vector<FitReport>& reports)
{
    ProjectionReport& total = s.projection;
    for (std::size_t k = 0; k < reports.size(); ++k) {
        if (!s.field.tiles.counts_here(k)) continue;
        if (total.fit.dropped == 0 && reports[k].dropped > 0) {
            total.first_block       = static_cast<double>(s.field.tiles.block_numbers()[k]);
            const IndexBox<D> nodes = s.field.tiles.nodes_of(s.field.tiles.blocks()[k]);
            for (int a = 0; a < D; ++a)
                total.dropped_at[a] =
                    0.5 * (s.lattice.node_position(a, nodes.lo[a]) + s.lattice.node_position(a, nodes.hi[a] - 1));
        }
        total.fit += reports[k];
    }
}

template <int D>
void fit_velocities(const Model<D>& model, const VelocityFitPasses<D>& passes, State<D>& s, const Sweep<D>& sweep, Lanes* nodes)
{
    make_room(s.velocity_records, s.field.nodes.size(), passes.size);
    Lanes* records = s.velocity_records.data();
    clear(records, s.field.tiles, passes.size);
    const bool with_corners = model.method.samples == Samples::corners;
    s.field.tiles.for_each_by_colour({{records, passes.size}}, [&](const Tile& t) {
        passes.spread(sweep, records + t.first_node * passes.size, with_corners, t.begin, t.end);
    });
    s.field.halo.add_records(records, passes.size);
    s.field.halo.clear(nodes);  // images are not fitted
    std::vector<FitReport> reports(s.field.tiles.blocks().size());
    const FitChoices choices{.is_whole   = model.method.projection == Projection::mls,
                             .everywhere = model.method.quadrature == Quadrature::cell};  // its points reach other nodes
    s.field.tiles.for_each_block_run([&](std::ptrdiff_t block, std::ptrdiff_t first, std::ptrdiff_t end) {
        passes.solve(nodes, records, choices, first, end, reports[block]);
    });
    s.field.halo.copy(nodes);
    add_reports(s, reports);
}

/// The cells that hold particles, by the sums of the first pass of fit_cells.
template <int D>
struct FilledCells {
    const Lattice<D>& grid;
    const Tiles<D>& tiles;
    const Lanes* contents;

    const Lanes& content(const Index<D>& cell) const { return contents[grid.offset(cell)]; }
    bool is_filled(const Index<D>& cell) const { return content(cell)[NodeLane::volume] > 0; }
    /// f(cell) for the filled cells of block k.
    template <class F>
    void for_each(std::ptrdiff_t k, const F& f) const
    {
        tiles.nodes_of(tiles.blocks()[k]).for_each([&](const Index<D>& cell) {
            if (grid.has_cell(cell) && is_filled(cell)) f(cell);
        });
    }
    /// Whether a neighbour of the cell is in the grid and empty.
    bool is_at_edge(const Index<D>& cell) const
    {
        bool r = false;
        IndexBox<D>::around(cell, 1).for_each([&](const Index<D>& at) {
            const Index<D> there = grid.inside_period(at);
            r                    = r || (grid.has_cell(there) && !(tiles.is_active(there) && is_filled(there)));
        });
        return r;
    }
};

/// Sums over particles: contents of cells, and the records of their fits.
template <int D>
void spread_to_cells(const CellFitPasses<D>& passes, State<D>& s, const Sweep<D>& sweep)
{
    make_room(s.cell_records, s.field.nodes.size(), passes.size);
    make_room(s.cell_contents, s.field.nodes.size());
    Lanes *records = s.cell_records.data(), *contents = s.cell_contents.data();
    clear(records, s.field.tiles, passes.size);
    clear(contents, s.field.tiles);
    s.field.tiles.for_each_by_colour({{records, passes.size}, {contents}},
                                     [&](const Tile& t) { passes.spread(sweep, contents, records, t.begin, t.end); });
    s.field.halo.add_records(records, passes.size);
    s.field.halo.add_records(contents, 1);
    s.field.halo.copy_records(contents, 1);
}

/// Makes room for the points of all filled cells and sorts them by colour. Returns the first point of each block, and the end.
template <int D>
std::vector<int> number_points(const CellFitPasses<D>& passes, const FilledCells<D>& cells, State<D>& s, bool has_body_force)
{
    const auto& blocks = s.field.tiles.blocks();
    std::vector<int> first(blocks.size() + 1, 0);
    s.field.tiles.for_each_block(
        [&](std::ptrdiff_t k) { cells.for_each(k, [&](const Index<D>&) { first[k + 1] += passes.per_cell; }); });
    for (std::size_t k = 0; k < blocks.size(); ++k) first[k + 1] += first[k];
    s.points.resize(first.back(), has_body_force);
    for (auto& colour : s.points.colours) colour.clear();
    for (std::size_t k = 0; k < blocks.size(); ++k)
        if (first[k + 1] > first[k]) s.points.colours[Tiles<D>::colour(blocks[k].at)].push_back({first[k], first[k + 1]});
    return first;
}

template <int D>
void fit_cells(const Model<D>& model, const CellFitPasses<D>& passes, State<D>& s, const Sweep<D>& sweep)
{
    spread_to_cells(passes, s, sweep);
    const Lattice<D>& g = s.lattice;
    const FilledCells<D> cells{g, s.field.tiles, s.cell_contents.data()};
    const std::vector<int> first = number_points(passes, cells, s, sweep.p.b != nullptr);

    double whole = 1.0;
    for (int a = 0; a < D; ++a) whole *= g.h[a];
    Lanes* records = s.cell_records.data();
    std::vector<FitReport> reports(s.field.tiles.blocks().size());
    const ParticleView<D> q = s.points.view();
    s.field.tiles.for_each_block([&](std::ptrdiff_t k) {
        int point = first[k];
        cells.for_each(k, [&](const Index<D>& cell) {
            const Lanes& content = cells.content(cell);
            double V             = whole;
            Vec<D> distance{};
            const bool is_edge = model.method.cell_volume == CellVolume::filled && cells.is_at_edge(cell);
            if (is_edge) {
                const Vec<D> center = g.cell_center(cell);
                V                   = std::min(whole, content[NodeLane::volume]);
                for (int a = 0; a < D; ++a)  // the one point
                    distance[a] = (content[CellContent::moment + a] / content[NodeLane::volume] - center[a]) * g.inv_h[a];
            }
            passes.set_points(g, cell, records + g.offset(cell) * passes.size, content, distance, V, is_edge, q, point,
                              reports[k]);
            point += passes.per_cell;
        });
    });
    add_reports(s, reports);
}

template <int D>
void settle_masses(State<D>& s, Lanes* nodes, const Lanes* of_particles, bool has_velocities)
{
    std::vector<FitReport> reports(s.field.tiles.blocks().size());
    s.field.tiles.for_each_block_run([&](std::ptrdiff_t block, std::ptrdiff_t first, std::ptrdiff_t end) {
        for (std::ptrdiff_t i = first; i < end; ++i) {
            double& m            = nodes[i][NodeLane::mass];
            const double m_there = of_particles[i][NodeLane::mass];
            if (has_velocities && !(m_there > 0)) m = 0.0;
            if (m > 0 || !(m_there > kHasVelocity)) continue;
            if (has_velocities)
                m = m_there;
            else
                nodes[i] = of_particles[i];
            ++reports[block].fallback;
        }
    });
    add_reports(s, reports);
}

template <int D>
void find_cell_gradients(const Passes<D>& passes, State<D>& s, const Lanes* nodes)
{
    using C             = CellGradient<D>;
    const Lattice<D>& g = s.lattice;
    const auto& blocks  = s.field.tiles.blocks();
    make_room(s.gradients, s.field.nodes.size(), C::size);
    Lanes* gradients = s.gradients.data();
    clear(gradients, s.field.tiles, C::size);
    auto record = [&](const Index<D>& cell) { return gradients + g.offset(cell) * C::size; };
    s.field.tiles.for_each_block([&](std::ptrdiff_t k) {
        s.field.tiles.nodes_of(blocks[k]).for_each([&](const Index<D>& cell) {
            if (g.has_cell(cell)) passes.gradient_at_center(g, s.field.tiles, nodes, cell, record(cell));
        });
    });
    s.field.halo.copy_records(gradients, C::size);

    // Cells with a node without mass, from cells whose nodes all have mass.
    std::vector<std::vector<std::pair<Index<D>, std::array<Lanes, C::size>>>> filled(blocks.size());
    s.field.tiles.for_each_block([&](std::ptrdiff_t k) {
        s.field.tiles.nodes_of(blocks[k]).for_each([&](const Index<D>& cell) {
            if (!g.has_cell(cell) || C::get_known(record(cell)) != C::no) return;
            auto known = [&](const Index<D>& at) -> const Lanes* {
                const Index<D> there = g.inside_period(at);
                if (!g.has_cell(there) || !s.field.tiles.is_active(there)) return nullptr;
                return C::get_known(record(there)) == C::yes ? record(there) : nullptr;
            };
            bool has_neighbour = false;
            IndexBox<D>::around(cell, 1).for_each([&](const Index<D>& there) { has_neighbour = has_neighbour || known(there); });
            if (!has_neighbour) return;
            std::array<Lanes, C::size> found{};
            fill_gradient<D>(cell, known, found.data());
            if (C::get_known(found.data()) != C::no) filled[k].emplace_back(cell, found);
        });
    });
    for (const auto& block : filled)
        for (const auto& [cell, found] : block) std::copy(found.begin(), found.end(), record(cell));
    s.field.halo.copy_records(gradients, C::size);

    // Beyond walls, one axis after the other: linear extrapolation, or the value itself if only one cell is known.
    for (int axis = 0; axis < D; ++axis) {
        if (g.periodic[axis]) continue;
        s.field.tiles.for_each_block([&](std::ptrdiff_t k) {
            s.field.tiles.nodes_of(blocks[k]).for_each([&](const Index<D>& cell) {
                const bool is_below = cell[axis] == g.margin - 1, is_above = cell[axis] == g.margin + g.cells[axis];
                if (!is_below && !is_above) return;
                Index<D> first = cell, second = cell;
                first[axis] += is_below ? 1 : -1;
                second[axis] += is_below ? 2 : -2;
                if (!s.field.tiles.is_active(first) || C::get_known(record(first)) == C::no) return;
                const bool is_linear =
                    s.field.tiles.is_active(second) && C::get_known(record(second)) != C::no && g.cells[axis] > 1;
                for (int q = 0; q < C::size; ++q) {
                    const Lanes one = record(first)[q];
                    record(cell)[q] = is_linear ? one * 2.0 - record(second)[q] : one;
                }
                C::known(record(cell)) = C::filled;
            });
        });
    }
}

#define ORDO_RECONSTRUCTION(D)                                                                                      \
    template struct QuadraturePoints<D>;                                                                            \
    template void fit_velocities(const Model<D>&, const VelocityFitPasses<D>&, State<D>&, const Sweep<D>&, Lanes*); \
    template void settle_masses(State<D>&, Lanes*, const Lanes*, bool);                                             \
    template void fit_cells(const Model<D>&, const CellFitPasses<D>&, State<D>&, const Sweep<D>&);                  \
    template void find_cell_gradients(const Passes<D>&, State<D>&, const Lanes*);
ORDO_RECONSTRUCTION(1)
ORDO_RECONSTRUCTION(2)
ORDO_RECONSTRUCTION(3)
#undef ORDO_RECONSTRUCTION

}  // namespace ordo
