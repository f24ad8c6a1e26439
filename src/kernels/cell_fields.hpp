// Fields of cells from particles, for the quadratures: least squares at the centre (IMPM) or Taylor least squares in the cell
// (TLS), and the quadrature points that carry them. The following passes treat these points as particles of domain `point`.
#pragma once

#include "kernels/moment_windows.hpp"
#include "kernels/sweep.hpp"
#include "kernels/taylor.hpp"
#include "particles/batch.hpp"

namespace ordo {

/// The reconstructed fields: density, momentum density if points have velocities, stress, and last the body force per mass,
/// which sums leave out if there is none.
template <int D, bool has_velocity>
struct CellFields {
    static constexpr int density = 0, momentum = 1, stress = has_velocity ? 1 + D : 1, body_force = stress + D * (D + 1) / 2;
    static constexpr int count = body_force + D;

    /// The number of fields in use.
    ORDO_FLAT static int used(const ParticleView<D>& p) { return p.b ? count : body_force; }

    template <int degree>
    using Record = Moments<D, degree, count>;

    /// The values at particle i.
    ORDO_FLAT static void get(const ParticleView<D>& p, int i, double (&u)[count])
    {
        u[density] = p.m[i] / p.V[i];
        int k      = stress;
        for (int a = 0; a < D; ++a) {
            if constexpr (has_velocity) u[momentum + a] = u[density] * p.v[i][a];
            for (int b = a; b < D; ++b) u[k++] = p.sigma[i](a, b);
            u[body_force + a] = p.b ? p.b[i][a] : 0.0;
        }
    }
};

/// The content of a cell, in the lanes of a node: momentum, mass and volume V of the particles inside, and sum V x.
struct CellContent {
    static constexpr int moment = NodeLane::increment;
};

/// The cell of a coordinate along an axis; the upper face of the grid belongs to the last cell.
template <int D>
ORDO_FLAT inline int cell_along(const Lattice<D>& g, int a, double y)
{
    const int cell = static_cast<int>(y);
    return g.periodic[a] ? cell : smaller(cell, g.margin + g.cells[a] - 1);
}

/// Adds particle i to the content of its cell. Returns the cell, and sets the distance from its centre, in cells.
template <int D>
ORDO_FLAT inline std::ptrdiff_t add_content(const Sweep<D>& s, int i, Lanes* contents, Vec<D>& distance)
{
    std::ptrdiff_t cell = 0;
    double mv[3] = {}, Vx[3] = {};
    for (int a = 0; a < D; ++a) {
        const double y = s.lattice.cell_coordinate(a, s.p.x[i][a]);
        const int at   = cell_along(s.lattice, a, y);
        distance[a]    = y - (at + 0.5);
        cell += s.lattice.stride[a] * at;
        mv[a] = s.p.m[i] * s.p.v[i][a];
        Vx[a] = s.p.V[i] * s.p.x[i][a];
    }
    contents[cell] += make_lanes(mv[0], mv[1], mv[2], s.p.m[i], Vx[0], Vx[1], Vx[2], s.p.V[i]);
    return cell;
}

/// Adds particles [begin, end) to the contents and records of their cells, for Taylor least squares. A particle on a face
/// belongs to one cell.
template <int D, int degree>
void spread_gauss_cells(const Sweep<D>& sweep, Lanes* contents, Lanes* records, int begin, int end)
{
    using F          = CellFields<D, true>;
    using Record     = typename F::template Record<degree>;
    const Sweep<D> s = sweep;
    for (int i = begin; i < end; ++i) {
        Vec<D> distance{};
        const std::ptrdiff_t cell = add_content(s, i, contents, distance);
        double u[F::count];
        F::get(s.p, i, u);
        Record::add(records + cell * Record::size, distance, 1.0, u);
    }
}

/// Adds particles [begin, end) to the contents of their cells and to the records of all cells in the support of quadratic
/// weights.
template <int D, int degree>
void spread_one_point_cells(const Sweep<D>& sweep, Lanes* contents, Lanes* records, int begin, int end)
{
    using F          = CellFields<D, false>;
    const Sweep<D> s = sweep;
    Vec<D> distance{};
    for (int i = begin; i < end; ++i) add_content(s, i, contents, distance);
    if constexpr (has_windows<D, CellCenters>) {
        thread_local MomentWindows<D, degree, F::count, CellCenters, 3> of_thread;  // keeps its memory
        auto& windows = of_thread;  // found once: in the Python module that is a call
        for (int first = begin; first < end; first += Batch::size) {
            const Batch b   = Batch::of(first, end);
            Vec<D, Lanes> y = load(s.p.x, b);
            for (int a = 0; a < D; ++a) y[a] = s.lattice.cell_coordinate(a, y[a]);
            Lanes u[F::count]{};
            for (int k = 0; k < Batch::size; ++k) {
                double one[F::count];
                F::get(s.p, b.particle(k), one);
                for (int f = 0; f < F::count; ++f) u[f][k] = one[f];
            }
            windows.add(y, u, b.count);
        }
        windows.spread(s.lattice, records, F::used(s.p));
    } else {
        for (int i = begin; i < end; ++i) {
            double u[F::count];
            F::get(s.p, i, u);
            F::template Record<degree>::template spread<CellCenters, 3>(s.lattice, records,
                                                                        {s.lattice.cell_coordinate(0, s.p.x[i][0])}, u);
        }
    }
}

/// Sets x, m, v, V, sigma and b of point k from the values u of the fields.
template <int D, bool has_velocity>
ORDO_FLAT inline void set_point(const ParticleView<D>& q, int k, const Vec<D>& x, double V,
                                const double (&u)[CellFields<D, has_velocity>::count])
{
    using F   = CellFields<D, has_velocity>;
    q.x[k]    = x;
    q.V[k]    = V;
    q.m[k]    = u[F::density] * V;
    int entry = F::stress;
    for (int a = 0; a < D; ++a) {
        q.v[k][a] = has_velocity ? u[F::momentum + a] / u[F::density] : 0.0;
        for (int b = a; b < D; ++b) q.sigma[k](a, b) = u[entry++];
        if (q.b) q.b[k][a] = u[F::body_force + a];
    }
}

/// Sets the one point of a cell, at a distance from its centre in cells, by least squares; of degree 0 if the samples do not
/// determine more (IMPM, Gong 2015, 5.7 and 5.8) or if the density would not be positive. Velocities are left to the
/// projection.
template <int D, int degree>
void set_cell_point(const Lanes* record, const Vec<D>& distance, const Vec<D>& x, double V, const ParticleView<D>& q, int k,
                    long& dropped)
{
    using F = CellFields<D, false>;
    using M = typename F::template Record<degree>;
    double matrix[M::unknowns][M::unknowns], row[M::unknowns], b[M::unknowns], u[F::count];
    M::matrix(record, matrix);
    const Ldl<M::unknowns> fit(matrix);
    Monomials<D, degree>::evaluate(distance, row);
    fit.solve(row);
    dropped += fit.dropped;
    for (int f = 0; f < F::count; ++f) {
        M::right_side(record, f, b);
        u[f] = 0.0;
        for (int j = 0; j < M::unknowns; ++j) u[f] += row[j] * b[j];
    }
    if (fit.dropped > 0 || !(u[F::density] > 0))
        for (int f = 0; f < F::count; ++f) u[f] = M::mean(record, f);
    set_point<D, false>(q, k, x, V, u);
}

/// Sets the Gauss points k, k + 1, ... of a cell: density and momentum conserve the mass and momentum inside, stress and body
/// force are plain least squares (Wobbes et al. 2020, sec. 3). V is the volume that the points share and over which mass and
/// momentum are spread. Density and momentum are constant if the density would fall below a tenth of its mean. At an edge,
/// where samples do not surround the cell, all fields are constant.
template <int D, int degree>
void set_gauss_points(const Lanes* record, const Lanes& content, const Vec<D>& center, const Vec<D>& h, double V, bool is_edge,
                      const ParticleView<D>& q, int k, long& dropped)
{
    using F              = CellFields<D, true>;
    using Fit            = TaylorLeastSquares<D, degree, F::count>;
    constexpr int points = 1 << D;
    const Fit fit(record);
    typename Fit::Coefficients c[F::count];
    dropped += fit.dropped();
    const double density = content[NodeLane::mass] / V;
    auto mean            = [&](int f) { return f == F::density ? density : content[NodeLane::velocity + f - F::momentum] / V; };
    for (int f = F::density; f < F::stress; ++f) fit.fit_with_mean(f, mean(f), c[f]);
    for (int f = F::stress; f < F::count; ++f) {
        fit.fit(f, c[f]);
        for (int j = 0; j < Fit::unknowns && is_edge; ++j) c[f][j] = j == 0 ? F::template Record<degree>::mean(record, f) : 0.0;
    }
    bool is_positive = !is_edge;
    for (int g = 0; g < points; ++g) is_positive = is_positive && Fit::evaluate(c[F::density], gauss_point<D>(g)) > 0.1 * density;
    for (int f = F::density; f < F::stress && !is_positive; ++f)
        for (int j = 0; j < Fit::unknowns; ++j) c[f][j] = j == 0 ? mean(f) : 0.0;
    for (int g = 0; g < points; ++g) {
        const Vec<D> d = gauss_point<D>(g);
        Vec<D> x       = center;
        for (int a = 0; a < D; ++a) x[a] += d[a] * h[a];
        double u[F::count];
        for (int f = 0; f < F::count; ++f) u[f] = Fit::evaluate(c[f], d);
        set_point<D, true>(q, k + g, x, V / points, u);
    }
}

}  // namespace ordo
