// Numbers the nodes with mass: the rows of a sparse matrix over the lattice, so that its vectors have no gaps.
// Used by the consistent mass matrix; knows nothing of entries. Row 0 stands for no node: vectors are zero there.
#pragma once

#include "base/array.hpp"
#include "base/parallel.hpp"
#include "grid/lattice.hpp"
#include "grid/tiles.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>
#include <vector>

namespace ordo {

/// The view for kernels: the row of a place. Places are the nodes of the lattice and of `reach` layers around it, so neighbours
/// need no test for the edge.
template <int D>
struct RowView {
    const int* row_of;             ///< [place]
    const std::ptrdiff_t* places;  ///< [row]
    Vec<D, std::ptrdiff_t> stride;
    int reach;

    ORDO_HD std::ptrdiff_t place(const Index<D>& node) const
    {
        std::ptrdiff_t r = 0;
        for (int a = 0; a < D; ++a) r += (node[a] + reach) * stride[a];
        return r;
    }
};

/// Rows whose nodes follow one another along an axis: line k has rows[begins[k]] to rows[begins[k + 1] - 1].
struct RowLines {
    std::vector<int> rows, begins;

    /// f(begin, end) for each line, in parallel; its rows are rows[begin, end).
    template <class F>
    void for_each(F&& f) const
    {
        const auto count = static_cast<std::ptrdiff_t>(rows.size());
        auto line_from   = [&](std::ptrdiff_t k) { return std::lower_bound(begins.begin(), begins.end() - 1, k); };
        parallel_pieces(count, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
            for (auto line = line_from(begin); *line < end; ++line) f(line[0], line[1]);
        });
    }
};

/// The rows of nodes of one velocity field, in the order of the lattice within a row of blocks: neighbours along the first axis have consecutive
/// numbers, and neighbours along the others are still in the cache.
template <int D>
class NodeRows {
  public:
    /// Numbers the nodes inside the period for which has(node) is true. Returns false if nothing has changed.
    template <class Has>
    bool assign(const Lattice<D>& lattice, const Tiles<D>& tiles, int reach, Has&& has)
    {
        bool has_changed = false;
        auto forget      = [&] {
            if (!std::exchange(has_changed, true)) for_each_place([&](std::ptrdiff_t place, int) { row_of_[place] = 0; });
        };
        // In place: with eight particles a cell, a second list would cost a byte per particle.
        auto set = [&](std::vector<std::ptrdiff_t>& list, std::size_t at, std::ptrdiff_t node) {
            if (at < list.size() && list[at] == node) return;
            forget();
            list.resize(at);
            list.push_back(node);
        };
        if (!(lattice.nodes == lattice_.nodes) || reach != view_.reach) forget();
        std::size_t count = 1, ghosts = 0;
        for (const Run& run : runs(lattice, tiles)) {
            Index<D> at = lattice.index(run.first);
            for (std::ptrdiff_t i = run.first; i < run.first + run.length; ++i, ++at[0]) {
                if (lattice.is_image(at))
                    set(ghost_nodes_, ghosts++, i);
                else if (has(i))
                    set(nodes_, count++, i);
            }
        }
        if (count < nodes_.size() || ghosts < ghost_nodes_.size()) forget();
        if (!has_changed) return false;
        nodes_.resize(count);
        ghost_nodes_.resize(ghosts);
        lattice_ = lattice;
        set_places(reach);
        return true;
    }

    int count() const { return static_cast<int>(nodes_.size()) - 1; }  ///< without row 0
    int end() const { return count() + 1; }
    int end_with_images() const { return end() + static_cast<int>(ghosts_.size()); }
    std::ptrdiff_t node(int row) const { return nodes_[row]; }
    /// The row of a node of the lattice; 0 if it has none.
    int row(std::ptrdiff_t node) const { return row_of_[view_.place(lattice_.index(node))]; }
    RowView<D> view() const { return view_; }
    /// On a periodic axis lines end at the seam.
    const RowLines& lines(int axis) const { return lines_[axis]; }

    /// Gives images rows of their own, for tiles of one colour to write to ..
    void part_images()
    {
        for (std::size_t k = 0; k < ghosts_.size(); ++k) row_of_[ghosts_[k].place] = end() + static_cast<int>(k);
    }
    /// .. or the rows of the nodes that they repeat, after add(row, row of the image).
    template <class Add>
    void join_images(Add&& add)
    {
        for (std::size_t k = 0; k < ghosts_.size(); ++k) {
            add(ghosts_[k].row, end() + static_cast<int>(k));
            row_of_[ghosts_[k].place] = ghosts_[k].row;
        }
    }

  private:
    struct Run {
        std::ptrdiff_t line_of_blocks, first, length;
    };
    /// The nodes of all blocks, by rows of blocks along the first axis.
    static std::vector<Run> runs(const Lattice<D>& lattice, const Tiles<D>& tiles)
    {
        std::vector<Run> r;
        r.reserve(tiles.blocks().size() * power_of(Tiles<D>::block_width, D - 1));
        std::ptrdiff_t line = 0;
        for (std::size_t k = 0; k < tiles.blocks().size(); ++k) {
            const Block<D>& block = tiles.blocks()[k];
            for (int a = 1; a < D; ++a)
                if (k > 0 && block.at[a] != tiles.blocks()[k - 1].at[a]) line = static_cast<std::ptrdiff_t>(k);
            IndexBox<D> nodes = tiles.nodes_of(block);
            const int length  = nodes.hi[0] - nodes.lo[0];
            nodes.hi[0]       = nodes.lo[0] + 1;
            nodes.for_each([&](const Index<D>& at) { r.push_back({line, lattice.offset(at), length}); });
        }
        std::sort(r.begin(), r.end(), [](const Run& g, const Run& h) {
            return g.line_of_blocks != h.line_of_blocks ? g.line_of_blocks < h.line_of_blocks : g.first < h.first;
        });
        return r;
    }

    void set_places(int reach)
    {
        std::size_t size = 1;
        view_.reach      = reach;
        for (int a = 0; a < D; ++a) {
            view_.stride[a] = static_cast<std::ptrdiff_t>(size);
            size *= lattice_.nodes[a] + 2 * reach;
        }
        if (row_of_.size() != size) row_of_ = Array<int>(size, Pages::own);
        places_.assign(nodes_.size(), -1);
        for (int row = 1; row < end(); ++row) places_[row] = view_.place(lattice_.index(nodes_[row]));
        view_.row_of = row_of_.data();
        view_.places = places_.data();
        for_each_place([&](std::ptrdiff_t place, int row) { row_of_[place] = row; });
        ghosts_.clear();
        for (const std::ptrdiff_t node : ghost_nodes_) {
            const std::ptrdiff_t place = view_.place(lattice_.index(node));
            if (row_of_[place] > 0) ghosts_.push_back({place, row_of_[place]});
        }
        for (int a = 0; a < D; ++a) set_lines(a);
    }

    void set_lines(int axis)
    {
        RowLines& lines           = lines_[axis];
        const std::ptrdiff_t step = view_.stride[axis];
        // The row of the next node, or 0; beyond a seam it is an image.
        auto neighbour = [&](int row, std::ptrdiff_t to) {
            const int r = row_of_[places_[row] + to];
            return places_[r] == places_[row] + to ? r : 0;
        };
        lines.rows.clear();
        lines.rows.reserve(nodes_.size());
        lines.begins.clear();
        for (int row = 1; row < end(); ++row) {
            if (neighbour(row, -step) > 0) continue;
            lines.begins.push_back(static_cast<int>(lines.rows.size()));
            for (int r = row; r > 0; r = neighbour(r, step)) lines.rows.push_back(r);
        }
        lines.begins.push_back(static_cast<int>(lines.rows.size()));
    }

    /// f(place, row) for all rows and their images.
    template <class F>
    void for_each_place(F&& f)
    {
        for (int row = 1; row < end(); ++row) {
            const Index<D> at = lattice_.index(nodes_[row]);
            IndexBox<D> turns{Index<D>{}, Index<D>::filled(1)};
            for (int a = 0; a < D; ++a) {
                if (!lattice_.periodic[a]) continue;
                turns.lo[a] = -((at[a] + view_.reach) / lattice_.cells[a]);
                turns.hi[a] = (lattice_.nodes[a] + view_.reach - 1 - at[a]) / lattice_.cells[a] + 1;
            }
            turns.for_each([&](const Index<D>& turn) {
                Index<D> image = at;
                for (int a = 0; a < D; ++a) image[a] += turn[a] * lattice_.cells[a];
                f(view_.place(image), row);
            });
        }
    }

    struct Ghost {
        std::ptrdiff_t place;
        int row;
    };
    Lattice<D> lattice_{};
    std::vector<std::ptrdiff_t> nodes_{-1}, ghost_nodes_, places_;
    std::vector<Ghost> ghosts_;
    std::array<RowLines, D> lines_;
    Array<int> row_of_;
    RowView<D> view_{};
};

}  // namespace ordo
