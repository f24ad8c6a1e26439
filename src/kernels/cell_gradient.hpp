// Gradient `adjoint`: velocity gradients at the centres of cells, and their interpolation to particles by quadratic splines,
// L_p = sum_c w((x_p - x_c)/h) L_c. This is the adjoint of spreading stresses to the centres with the same weights. IMPM loses
// its order if the maps of stress and gradient are not adjoint (docs/design.md).
#pragma once

#include "kernels/ldl.hpp"
#include "kernels/sweep.hpp"
#include "shape/stencil.hpp"
#include "shape/weights.hpp"

namespace ordo {

/// The gradient at the centre of a cell, row by row, and its origin. Record k of the lattice belongs to the cell between
/// nodes k and k + 1 along each axis.
template <int D>
struct CellGradient {
    static constexpr int size  = D == 3 ? 2 : 1;          ///< Lanes of a record
    static constexpr double no = 0, yes = 1, filled = 2;  ///< unknown; from its own nodes; from cells nearby

    ORDO_FLAT static double& at(Lanes* record, int a, int b) { return record[(a * D + b) / 8][(a * D + b) % 8]; }
    ORDO_FLAT static double get(const Lanes* record, int a, int b) { return record[(a * D + b) / 8][(a * D + b) % 8]; }
    ORDO_FLAT static double& known(Lanes* record) { return record[size - 1][7]; }
    ORDO_FLAT static double get_known(const Lanes* record) { return record[size - 1][7]; }
};

/// L at particle i; returns false if a cell around it has no gradient.
template <int D>
ORDO_HD ORDO_CALL bool interpolate_gradient(const Sweep<D>& s, int i, Mat<D>& L)
{
    using C = CellGradient<D>;
    WeightRow<3> row[D];
    std::ptrdiff_t first = 0;
    for (int a = 0; a < D; ++a) {
        CellCenters::fill<3>(s.lattice, a, s.lattice.cell_coordinate(a, s.p.x[i][a]), row[a]);
        first += s.lattice.stride[a] * row[a].first;
    }
    Lanes sum[C::size] = {};
    bool is_known      = true;
    IndexBox<D>{{}, Index<D>::filled(3)}.for_each([&](const Index<D>& k) {
        double w = 1.0;
        for (int a = 0; a < D; ++a) w *= row[a].weight[k[a]];
        const Lanes* record = s.gradients + (first + s.lattice.offset(k)) * C::size;
        if (w > 0 && C::get_known(record) == C::no) is_known = false;
        for (int q = 0; q < C::size; ++q) sum[q] += record[q] * w;
    });
    if (!is_known) return false;
    for (int a = 0; a < D; ++a)
        for (int b = 0; b < D; ++b) L(a, b) = C::get(sum, a, b);
    return true;
}

/// The gradient at the centre of cell `at` from its nodes; unknown if a node has no mass or `is_there(node)` is false.
template <int D, class Basis, class IsThere>
void gradient_at_center(const Lattice<D>& g, const Lanes* nodes, const Index<D>& at, IsThere&& is_there, Lanes* record)
{
    using C = CellGradient<D>;
    Stencil<D, Basis::width> s;
    Index<D> first{};
    s.first = 0;
    for (int a = 0; a < D; ++a) {
        first[a] = Basis::row(g, a, at[a] + 0.5, s.w[a], s.dw[a]);
        s.first += g.stride[a] * first[a];
        for (double& d : s.dw[a]) d *= g.inv_h[a];
    }
    for (int q = 0; q < C::size; ++q) record[q] = Lanes{};
    bool is_known = true;
    IndexBox<D>{{}, Index<D>::filled(Basis::width)}.for_each([&](const Index<D>& k) {
        if (!is_known) return;
        Index<D> node = first;
        for (int a = 0; a < D; ++a) node[a] += k[a];
        is_known = is_there(node) && nodes[g.offset(node)][NodeLane::mass] > 0;
    });
    if (!is_known) return;
    for_each_node(s, g, [&](std::ptrdiff_t node, double, const Vec<D>& dw) {
        for (int a = 0; a < D; ++a)
            for (int b = 0; b < D; ++b) C::at(record, a, b) += nodes[node][NodeLane::velocity + a] * dw[b];
    });
    C::known(record) = C::yes;
}

/// The gradient of a cell that its own nodes do not determine: least squares of degree 1 of the known cells around it, weighted
/// by cubic splines of support 3h. It stays unknown if these do not determine a linear field.
template <int D, class Get>
void fill_gradient(const Index<D>& cell, const Get& known_record, Lanes* record)
{
    using C         = CellGradient<D>;
    constexpr int n = D + 1;
    double M[n][n] = {}, B[D * D][n] = {};
    IndexBox<D>::around(cell, 2).for_each([&](const Index<D>& at) {
        const Lanes* there = known_record(at);
        if (!there) return;
        double w = 1.0, p[n] = {1.0};
        for (int a = 0; a < D; ++a) {
            p[a + 1] = at[a] - cell[a];
            w *= spline_weight<4>(p[a + 1] / 1.5);
        }
        for (int i = 0; i < n; ++i) {
            for (int j = 0; j <= i; ++j) M[i][j] += w * p[i] * p[j];
            for (int c = 0; c < D * D; ++c) B[c][i] += w * p[i] * C::get(there, c / D, c % D);
        }
    });
    const Ldl<n> fit(M);
    if (fit.dropped > 0) return;
    for (int c = 0; c < D * D; ++c) {
        fit.solve(B[c]);
        C::at(record, c / D, c % D) = B[c][0];
    }
    C::known(record) = C::filled;
}

}  // namespace ordo
