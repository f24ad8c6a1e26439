// The consistent mass matrix as rows of a lattice stencil, formed once a step: a product costs a pass over nodes instead of
// two visits of every particle to its nodes. For domains with W nodes per axis and particle.
#pragma once

#include "grid/node_rows.hpp"
#include "kernels/sweep.hpp"
#include "shape/point.hpp"

#include <cmath>
#include <cstdlib>

namespace ordo {

/// The neighbours j - i of a row i, from -reach to reach along each axis, in lines along the first axis. Only half of the
/// symmetric matrix is stored: the row's own line from the diagonal on, and the `lines` after it.
template <int D, int W>
struct HalfRow {
    static constexpr int reach = W - 1;
    static constexpr int width = 2 * W - 1;
    static constexpr int lines = (power_of(width, D - 1) - 1) / 2;
    static constexpr int size  = lines * width + W;

    /// The place of a line relative to the row's own line; lines count from 1.
    ORDO_FLAT static std::ptrdiff_t offset(const RowView<D>& rows, int line)
    {
        std::ptrdiff_t r = 0;
        int k            = line + (power_of(width, D - 1) - 1) / 2;
        for (int a = 1; a < D; ++a, k /= width) r += (k % width - reach) * rows.stride[a];
        return r;
    }
};

/// The sums of m_p phi_ip phi_jp over consecutive particles with the same nodes, so that shared nodes are written to once.
template <int D, int W>
class CellMatrix {
  public:
    static constexpr int nodes = power_of(W, D);

    ORDO_FLAT void clear()
    {
        for (auto& row : M_)
            for (Lanes& m : row) m = Lanes{};
    }
    ORDO_FLAT void add(const Stencil<D, W>& s, double m)
    {
        alignas(64) double w[8 * vectors] = {};
        for (int i = 0; i < nodes; ++i) {
            w[i] = 1.0;
            for (int a = 0, k = i; a < D; ++a, k /= W) w[i] *= s.w[a][k % W];
        }
        const auto* phi = reinterpret_cast<const Lanes*>(w);
        for (int i = 0; i < nodes; ++i)
            for (int v = i / 8; v < vectors; ++v) M_[i][v] += phi[v] * (m * w[i]);
    }
    /// Adds them to the rows of the nodes from `first` on.
    ORDO_FLAT void add_to(double* entries, const RowView<D>& rows, std::ptrdiff_t first) const
    {
        for (int i = 0; i < nodes; ++i) {
            const int row = rows.row_of[first + place(rows, i)];
            if (row == 0) continue;  // a node at the edge of the domain, with weight zero
            double* to = entries + static_cast<std::ptrdiff_t>(row) * HalfRow<D, W>::size - entry(i);
            for (int j = i; j < nodes; ++j) to[entry(j)] += M_[i][j / 8][j % 8];
        }
    }

  private:
    static constexpr int vectors = (nodes + 7) / 8;

    /// The entry for node i in the row of the first node; differences of entries are the same in any row.
    static constexpr int entry(int i)
    {
        int r = 0;
        for (int a = 0, step = 1; a < D; ++a, i /= W, step *= HalfRow<D, W>::width) r += i % W * step;
        return r;
    }
    ORDO_FLAT static std::ptrdiff_t place(const RowView<D>& rows, int i)
    {
        std::ptrdiff_t r = 0;
        for (int a = 0; a < D; ++a, i /= W) r += i % W * rows.stride[a];
        return r;
    }

    Lanes M_[nodes][vectors] = {};
};

/// Adds particles [begin, end), of domain `point`, to the matrix. They write to the same nodes as a scatter, so tiles of one
/// colour share no row.
template <int D, class Basis>
void form_mass_rows(const Sweep<D>& sweep, const RowView<D>& rows, double* entries, int begin, int end)
{
    const Sweep<D> s = sweep;
    CellMatrix<D, Basis::width> M;
    std::ptrdiff_t first = -1;
    auto flush           = [&] {
        if (first >= 0) M.add_to(entries, rows, rows.place(s.lattice.index(first)));
    };
    for (int i = begin; i < end; ++i) {
        const auto phi = Point<D, Basis>::stencil(s.lattice, s.p, i);
        if (phi.first != first) {
            flush();
            M.clear();
            first = phi.first;
        }
        M.add(phi, s.p.m[i]);
    }
    flush();
}

/// Rows [begin, end) of the product with `from`, which is zero in row 0. Each is one sum in a fixed order.
template <int D, int W>
void multiply_mass_rows(const RowView<D>& rows, const double* entries, const Lanes* from, Lanes* to, int begin, int end)
{
    using H                             = HalfRow<D, W>;
    constexpr int reach                 = H::reach;
    std::ptrdiff_t offset[H::lines + 1] = {};
    for (int l = 1; l <= H::lines; ++l) offset[l] = H::offset(rows, l);
    for (int row = begin; row < end; ++row) {
        const double* a     = entries + static_cast<std::ptrdiff_t>(row) * H::size;
        const int* own      = rows.row_of + rows.places[row];
        Lanes sum[H::width] = {};  // several sums: a single chain of multiply-adds would be bound by latency
        sum[0]              = from[row] * a[0];
        for (int d = 1; d <= reach; ++d) {
            const int before = own[-d];
            sum[2 * d - 1] += from[own[d]] * a[d];
            sum[2 * d] += from[before] * entries[static_cast<std::ptrdiff_t>(before) * H::size + d];
        }
        for (int l = 1; l <= H::lines; ++l) {
            const int *above = own + offset[l], *below = own - offset[l];
            for (int d = -reach; d <= reach; ++d) sum[d + reach] += from[above[d]] * a[l * H::width + d];
            for (int d = -reach; d <= reach; ++d) {
                const int j = below[-d];
                sum[d + reach] += from[j] * entries[static_cast<std::ptrdiff_t>(j) * H::size + l * H::width + d];
            }
        }
        for (int d = 1; d < H::width; ++d) sum[0] += sum[d];
        to[row] = sum[0];
    }
}

/// T of rows [begin, end) along each axis a: entries of neighbours d = 0 to reach nodes ahead, summed over the other axes and
/// divided by the roots of the two masses, T[(row D + a) W + d]. If the matrix is a tensor product over the axes, these are its
/// factors. Lumped rows are not coupled.
template <int D, int W>
void sum_mass_rows(const RowView<D>& rows, const double* entries, const MassRowParts& parts, float* T, int begin, int end)
{
    using H                  = HalfRow<D, W>;
    const IndexBox<D> around = IndexBox<D>::around(Index<D>{}, H::reach);
    constexpr int middle     = H::size - 1;  // of a whole row
    for (int row = begin; row < end; ++row) {
        const int* own        = rows.row_of + rows.places[row];
        const bool is_coupled = parts.is_coupled(row);
        double sum[D][W]      = {};
        for (int a = 0; a < D; ++a) sum[a][0] = parts.diagonal[row];
        int k = 0;
        around.for_each([&](const Index<D>& o) {
            const int entry   = k++ - middle;
            std::ptrdiff_t to = 0;
            for (int a = 0; a < D; ++a) to += o[a] * rows.stride[a];
            const int j = own[to];
            if (!is_coupled || !parts.is_coupled(j)) return;
            const double m = entries[static_cast<std::ptrdiff_t>(entry < 0 ? j : row) * H::size + std::abs(entry)];
            for (int a = 0; a < D; ++a)
                if (o[a] >= 0) sum[a][o[a]] += m;
        });
        for (int a = 0; a < D; ++a)
            for (int d = 0; d < W; ++d) {
                const int j    = own[d * rows.stride[a]];
                const double t = d == 0 || parts.is_coupled(j) ? sum[a][d] * parts.scale[row] * parts.scale[j] : 0.0;
                T[(static_cast<std::ptrdiff_t>(row) * D + a) * W + d] = static_cast<float>(t);
            }
    }
}

/// L of T = L L^T along a line, in place: row k then has 1/L_kk and L_k+d,k. T may be indefinite if the matrix is not a tensor
/// product: pivots are raised to a fraction of T_kk below every eigenvalue of a line of splines (0.05 for cubic ones).
template <int D, int W>
void factor_line(const int* line, int count, int axis, float* T)
{
    constexpr double smallest = 0.02;
    double next[W][W]         = {};  // columns k to k + reach of what is left of T
    double whole[W]           = {};  // their T_kk
    auto load                 = [&](int column, int k) {
        const float* t = T + (static_cast<std::ptrdiff_t>(line[k]) * D + axis) * W;
        for (int d = 0; d < W; ++d) next[column][d] = k + d < count ? static_cast<double>(t[d]) : 0.0;
        whole[column] = next[column][0];
    };
    for (int k = 0; k < W && k < count; ++k) load(k, k);
    for (int k = 0; k < count; ++k) {
        double c[W];
        const double pivot = std::sqrt(larger(next[0][0], whole[0] > 0 ? smallest * whole[0] : 1.0));
        c[0]               = 1 / pivot;
        for (int d = 1; d < W; ++d) c[d] = next[0][d] / pivot;
        float* t = T + (static_cast<std::ptrdiff_t>(line[k]) * D + axis) * W;
        for (int d = 0; d < W; ++d) t[d] = static_cast<float>(c[d]);
        for (int e = 1; e < W; ++e) {
            for (int d = e; d < W; ++d) next[e][d - e] -= c[e] * c[d];
            for (int d = 0; d < W; ++d) next[e - 1][d] = next[e][d];
            whole[e - 1] = whole[e];
        }
        if (k + W < count) load(W - 1, k + W);
    }
}

/// x = L^-1 x along a line ..
template <int D, int W>
ORDO_FLAT inline void solve_forward(const int* line, int count, int axis, const float* L, Lanes* x)
{
    Lanes left[W] = {};  // what earlier rows subtract from this row and the next ones
    for (int k = 0; k < count; ++k) {
        const float* c = L + (static_cast<std::ptrdiff_t>(line[k]) * D + axis) * W;
        const Lanes y  = (x[line[k]] - left[0]) * static_cast<double>(c[0]);
        x[line[k]]     = y;
        for (int d = 1; d < W; ++d) left[d - 1] = left[d] + y * static_cast<double>(c[d]);
    }
}
/// .. and L^-T x.
template <int D, int W>
ORDO_FLAT inline void solve_backward(const int* line, int count, int axis, const float* L, Lanes* x)
{
    Lanes after[W] = {};
    for (int k = count - 1; k >= 0; --k) {
        const float* c = L + (static_cast<std::ptrdiff_t>(line[k]) * D + axis) * W;
        Lanes y        = x[line[k]];
        for (int d = W - 1; d > 0; --d) {
            y        = y - after[d] * static_cast<double>(c[d]);
            after[d] = after[d - 1];
        }
        after[1] = x[line[k]] = y * static_cast<double>(c[0]);
    }
}

template <int D, int W>
void solve_line(const int* line, int count, int axis, const float* L, Lanes* x, unsigned passes)
{
    if (passes & kForward) solve_forward<D, W>(line, count, axis, L, x);
    if (passes & kBackward) solve_backward<D, W>(line, count, axis, L, x);
}

}  // namespace ordo
