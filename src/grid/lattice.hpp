// The background grid: index maths of a regular lattice of nodes, and the record that a node holds.
// Used by shapes and kernels; knows nothing of particles. A node is a function of the basis: splines have one more per axis
// for each degree above the first.
#pragma once

#include "base/index.hpp"
#include "base/lanes.hpp"
#include "base/vec.hpp"

#include <cmath>
#include <cstddef>

namespace ordo {

/// Lanes of a node record. A node holds sums over particles before `advance`, and velocities after it:
/// momentum (kg m/s) -> velocity (m/s); mass (kg); force (N) -> velocity increment of the step (m/s); volume (m^D).
struct NodeLane {
    static constexpr int velocity  = 0;
    static constexpr int mass      = 3;
    static constexpr int increment = 4;
    static constexpr int volume    = 7;
    static constexpr int end       = 8;
};

/// Parameters of the basis that are known at run time only.
struct GridBasis {
    int degree = 1;
    double a0  = 0.5;  ///< ddmpm: weight of the plain gradient in the middle of a cell
};

/// A regular lattice of cells of size h with `margin` extra layers of nodes around it. Domains that reach over the edge of
/// the grid and the images of a periodic axis write to these.
template <int D>
struct Lattice {
    static constexpr int dim = D;

    Vec<D> origin{};
    Vec<D> h{};
    Vec<D> inv_h{};
    Index<D> cells{};
    Vec<D, bool> periodic{};
    int margin = 0;
    GridBasis basis{};
    Index<D> nodes{};
    Vec<D, std::ptrdiff_t> stride{};

    Lattice() = default;
    Lattice(const Vec<D>& origin_, const Vec<D>& h_, const Index<D>& cells_, const Vec<D, bool>& periodic_, int margin_,
            const GridBasis& basis_ = {})
        : origin(origin_), h(h_), cells(cells_), periodic(periodic_), margin(margin_), basis(basis_)
    {
        std::ptrdiff_t step = 1;
        for (int a = 0; a < D; ++a) {
            inv_h[a]  = 1.0 / h[a];
            nodes[a]  = cells[a] + basis.degree + 2 * margin;
            stride[a] = step;
            step *= nodes[a];
        }
    }

    /// The coordinate along axis a in cells, counted from the first node of the margin: its integer part is the cell.
    template <class T>
    ORDO_FLAT T cell_coordinate(int a, const T& x) const
    {
        return (x - origin[a]) * inv_h[a] + margin;
    }
    /// The place of node k of axis a in cells from the lower face; for a spline its Greville point, the mean of its inner knots.
    ORDO_HD double node_place(int a, int k) const
    {
        const int p = basis.degree;
        if (p == 1) return k - margin;
        double sum = 0.0;
        for (int j = 1; j <= p; ++j) sum += knot(a, k - margin + j - p);
        return sum / p;
    }
    /// The same, m.
    ORDO_HD double node_position(int a, int k) const { return origin[a] + node_place(a, k) * h[a]; }
    /// The centre of a cell; a cell has the index of its lower node.
    ORDO_HD Vec<D> cell_center(const Index<D>& cell) const
    {
        Vec<D> x{};
        for (int a = 0; a < D; ++a) x[a] = origin[a] + (cell[a] - margin + 0.5) * h[a];
        return x;
    }
    /// Whether a cell lies in the grid and not in its margin.
    ORDO_HD bool has_cell(const Index<D>& cell) const
    {
        for (int a = 0; a < D; ++a)
            if (cell[a] < margin || cell[a] >= margin + cells[a]) return false;
        return true;
    }
    /// The knot between cells k - 1 and k, counted inside the grid; degree + 1 knots meet at a face.
    ORDO_HD int knot(int a, int k) const { return periodic[a] ? k : smaller(larger(k, 0), cells[a]); }
    /// The integral of the function of node k along axis a over the grid, m: the span of its knots / (degree + 1). A hat in
    /// the margin counts whole.
    ORDO_HD double node_length(int a, int k) const
    {
        const int p = basis.degree, j = k - margin;
        const int span = knot(a, j + 1) - knot(a, j - p);
        return h[a] * (span > 0 ? span : p + 1) / (p + 1);
    }
    ORDO_HD std::ptrdiff_t offset(const Index<D>& k) const
    {
        std::ptrdiff_t r = 0;
        for (int a = 0; a < D; ++a) r += k[a] * stride[a];
        return r;
    }

    ORDO_HD Index<D> index(std::ptrdiff_t offset) const
    {
        Index<D> k{};
        for (int a = 0; a < D; ++a) {
            k[a] = static_cast<int>(offset % nodes[a]);
            offset /= nodes[a];
        }
        return k;
    }

    std::size_t node_count() const
    {
        std::size_t n = 1;
        for (int a = 0; a < D; ++a) n *= nodes[a];
        return n;
    }

    /// The node inside the period that node k of a periodic axis repeats.
    int periodic_image(int a, int k) const
    {
        const int n = cells[a];
        return ((k - margin) % n + n) % n + margin;
    }
    /// The same for a node or cell, along all periodic axes.
    Index<D> inside_period(Index<D> at) const
    {
        for (int a = 0; a < D; ++a)
            if (periodic[a]) at[a] = periodic_image(a, at[a]);
        return at;
    }
    /// A place moved into the first period.
    Vec<D> inside_period(Vec<D> x) const
    {
        for (int a = 0; a < D; ++a) {
            const double period = cells[a] * h[a];
            if (periodic[a]) x[a] -= period * std::floor((x[a] - origin[a]) / period);
        }
        return x;
    }
    /// Whether a node or cell repeats one inside the period.
    bool is_image(const Index<D>& at) const { return !(inside_period(at) == at); }
};

}  // namespace ordo
