// The ghost penalty of implicit steps: stiffness against jumps of the highest derivative of displacements next to nodes with little of a body
// (Burman 2010, Comptes Rendus Mathematique 348:1217; for MPM Coombs 2023, IJNME 124:4841). It couples such nodes to their neighbours, so that
// equations stay regular however bodies cut cells, and is zero for polynomials of the basis' degree. Nodes that conditions hold need none.
#pragma once

#include "grid/cox_de_boor.hpp"
#include "grid/node_rows.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace ordo {

/// Sum over lines of nodes across the faces of cells of weight (sum_k c_k u_k)^2/2, for each component. The integral over a face is taken node
/// by node, which leaves what it is zero for. Lines in which no node has a filled part below `least` have none.
template <int D>
class JumpPenalty {
  public:
    JumpPenalty() = default;
    /// @param factor of the modulus times area over spacing, Pa m^(D-2): dimensionless
    /// @param filled,modulus of each row: the filled part of its function, and the P-wave modulus there, Pa
    /// @param is_held (row, component): such nodes need no help, and may lie beyond a plane through which motions do not continue
    template <class IsHeld>
    JumpPenalty(const Lattice<D>& g, const NodeRows<D>& rows, double factor, double least, const std::vector<double>& filled,
                const std::vector<double>& modulus, const IsHeld& is_held)
    {
        const int width = g.basis.degree + 2;
        for (int row = 1; row < rows.end(); ++row)
            for (int a = 0; a < D; ++a) {
                Line line{};
                line.count  = width;
                Index<D> at = g.index(rows.node(row));
                if (!set_jump(g, a, at[a] - g.margin, line.jump.data())) continue;
                double stiff  = 0.0;
                bool is_whole = true;
                for (int k = 0; k < width && is_whole; ++k, ++at[a]) {
                    const bool is_inside = g.periodic[a] || at[a] < g.nodes[a];
                    const int r          = is_inside ? rows.row(g.offset(g.inside_period(at))) : 0;
                    is_whole             = r > 0;
                    if (!is_whole) break;
                    line.row[static_cast<std::size_t>(k)] = r;
                    stiff                                 = std::max(stiff, modulus[r]);
                    for (int c = 0; c < D; ++c) line.acts[c] = line.acts[c] || (filled[r] < least && !is_held(r, c));
                }
                if (!is_whole || line.acts == Vec<D, bool>{}) continue;
                line.weight = factor * stiff / g.h[a];
                for (int b = 0; b < D; ++b)
                    if (b != a) line.weight *= g.h[b];
                lines_.push_back(line);
            }
    }

    /// to -= G from, for rows of D components; row r is at D (r - 1).
    void subtract_product(const double* from, double* to) const
    {
        for (const Line& l : lines_)
            for (int a = 0; a < D; ++a) {
                if (!l.acts[a]) continue;
                double jump = 0.0;
                for (std::size_t k = 0; k < l.size(); ++k) jump += l.jump[k] * from[D * (l.row[k] - 1) + a];
                for (std::size_t k = 0; k < l.size(); ++k) to[D * (l.row[k] - 1) + a] -= l.weight * l.jump[k] * jump;
            }
    }
    /// add(row, row, value of each component) for all entries of G.
    template <class Add>
    void for_each_entry(const Add& add) const
    {
        for (const Line& l : lines_)
            for (std::size_t i = 0; i < l.size(); ++i)
                for (std::size_t j = 0; j < l.size(); ++j) {
                    Vec<D> value{};
                    for (int a = 0; a < D; ++a) value[a] = l.acts[a] ? l.weight * l.jump[i] * l.jump[j] : 0.0;
                    add(l.row[i], l.row[j], value);
                }
    }
    bool is_empty() const { return lines_.empty(); }

  private:
    static constexpr std::size_t most = 5;  ///< nodes of cubic splines
    struct Line {
        int count;
        std::array<int, most> row;
        std::array<double, most> jump;
        double weight;
        Vec<D, bool> acts;  ///< on each component

        std::size_t size() const { return static_cast<std::size_t>(count); }
    };

    /// The jump of the derivative of order p between cells `first` and `first` + 1, of the functions from number `first` on, so scaled that it is
    /// a difference of order p + 1 where knots are even. False if there is no such face in the grid; hats of the margin have theirs.
    static bool set_jump(const Lattice<D>& g, int axis, int first, double* jump)
    {
        const int p = g.basis.degree;
        if (p == 1) {
            jump[0] = jump[2] = 1.0;
            jump[1]           = -2.0;
            return true;
        }
        if (!g.periodic[axis] && (first < 0 || first > g.cells[axis] - 2)) return false;
        if (p == 2) set<2>(g, axis, first, jump);
        if (p == 3) set<3>(g, axis, first, jump);
        return true;
    }
    template <int P>
    static void set(const Lattice<D>& g, int axis, int first, double* jump)
    {
        struct Knots {
            const Lattice<D>& g;
            int axis;
            double knot(int k) const { return g.knot(axis, k); }
        };
        double before[P + 1], after[P + 1], largest = 0.0;
        highest_derivative<P>(Knots{g, axis}, first, before);
        highest_derivative<P>(Knots{g, axis}, first + 1, after);
        for (int k = 0; k < P + 2; ++k) {
            jump[k] = (k > 0 ? after[k - 1] : 0.0) - (k <= P ? before[k] : 0.0);
            largest = std::max(largest, std::fabs(jump[k]));
        }
        for (int k = 0; k < P + 2; ++k) jump[k] *= 3.0 * (P - 1) / largest;  // 3 and 6: the largest of even knots
    }

    std::vector<Line> lines_;
};

}  // namespace ordo
