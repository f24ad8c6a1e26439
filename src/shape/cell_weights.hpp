// Domain `cell` (CPDI2): the weights of the corners x_c of a cell, w_c = (1/V) int N_c dV and
// g_c = (1/V) int grad N_c dV, so that phi_ip = sum_c w_c N_i(x_c) and grad phi_ip = sum_c g_c N_i(x_c) (Sadeghirad,
// Brannon & Guilkey 2013, 17-22). Closed forms, evaluated for every particle in every pass. Knows no grid.
#pragma once

#include "base/lanes.hpp"
#include "particles/cells.hpp"

#include <cfloat>
#include <cmath>

namespace ordo {

/// Weights (1) and mean gradients (1/m) of the corners of one cell; entries beyond `count` are zero.
template <int D>
struct CellWeights {
    int count;         ///< corners
    double w[1 << D];  ///< sum 1
    Vec<D> g[1 << D];  ///< sum 0
    double V;          ///< geometric volume, m^D, negative for an inverted cell; w and g are undefined if it is 0
    /// V is positive and finite, and the Jacobian is positive at every corner. Then it is positive everywhere in a quadrilateral
    /// (which is convex), but a hexahedron can still fold inside (Knupp 1990).
    bool is_sound;
};

/// The positions of a cell's corners; zero for corners that a simplex does not have.
template <int D>
ORDO_FLAT inline void get_corners(const CornerIds<D>& cell, const Vec<D>* corners, Vec<D> (&x)[1 << D])
{
    for (int c = 0; c < (1 << D); ++c) x[c] = cell[c] < 0 ? Vec<D>{} : corners[cell[c]];
}

/// Segment, triangle or tetrahedron: w_c = 1/(D + 1); the gradients are the dual vectors of the edges from corner 0.
template <int D>
ORDO_FLAT inline CellWeights<D> simplex_weights(const Vec<D> (&x)[1 << D])
{
    CellWeights<D> r{};
    Mat<D> edges{};
    for (int d = 0; d < D; ++d)
        for (int a = 0; a < D; ++a) edges(a, d) = x[d + 1][a] - x[0][a];
    const double J    = det(edges);
    const Mat<D> dual = cofactor(edges) * (1.0 / J);
    r.count           = D + 1;
    r.V               = J * (D == 3 ? 1.0 / 6.0 : 1.0 / D);
    r.is_sound        = r.V > 0.0 && r.V <= DBL_MAX;
    for (int c = 0; c <= D; ++c) r.w[c] = 1.0 / (D + 1);
    for (int d = 0; d < D; ++d) {
        r.g[d + 1] = column(dual, d);
        r.g[0] -= r.g[d + 1];
    }
    return r;
}

ORDO_FLAT constexpr double cross(const Vec<2>& a, const Vec<2>& b) { return a[0] * b[1] - a[1] * b[0]; }
ORDO_FLAT constexpr Vec<3> cross(const Vec<3>& a, const Vec<3>& b)
{
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// Quadrilateral. With x = a_0 + a_1 xi + a_2 eta + a_3 xi eta the Jacobian is a_1 x a_2 + xi a_1 x a_3 - eta a_2 x a_3;
/// the gradients are perpendicular to the diagonals, as in Sadeghirad et al. (2013, 22). Corners by bits, not in a circle.
template <bool is_exact>
ORDO_FLAT inline CellWeights<2> quadrilateral_weights(const Vec<2> (&x)[4])
{
    const Vec<2> rising = x[3] - x[0], falling = x[2] - x[1];
    const Vec<2> a1 = 0.25 * (rising - falling), a2 = 0.25 * (rising + falling), a3 = 0.25 * ((x[3] - x[2]) - (x[1] - x[0]));
    const double V = 0.5 * cross(rising, falling), X = cross(a1, a3), Y = cross(a3, a2);
    const double u = is_exact ? X / (3.0 * V) : 0.0, v = is_exact ? Y / (3.0 * V) : 0.0, s = 0.5 / V;
    const Vec<2> g1{s * rising[1], -s * rising[0]}, g3{s * falling[1], -s * falling[0]};
    const bool is_sound = V > 0.0 && V <= DBL_MAX && 0.25 * V - std::fabs(X) - std::fabs(Y) > 0.0;
    return {4, {0.25 - u - v, 0.25 + u - v, 0.25 - u + v, 0.25 + u + v}, {-g3, g1, -g1, g3}, V, is_sound};
}

/// s_m: for each corner of a hexahedron the product of its signs (-1 or 1) along the axes whose bits are set in m. Spelt out,
/// because g++ 12 recomputes these constants in each call if a loop makes them (measured: 170 instead of 110 ns a hexahedron).
struct CornerSigns {
    Lanes s[8] = {make_lanes(1, 1, 1, 1, 1, 1, 1, 1),     make_lanes(-1, 1, -1, 1, -1, 1, -1, 1),
                  make_lanes(-1, -1, 1, 1, -1, -1, 1, 1), make_lanes(1, -1, -1, 1, 1, -1, -1, 1),
                  make_lanes(-1, -1, -1, -1, 1, 1, 1, 1), make_lanes(1, -1, 1, -1, -1, 1, -1, 1),
                  make_lanes(1, 1, -1, -1, -1, -1, 1, 1), make_lanes(-1, 1, 1, -1, 1, -1, -1, 1)};

    ORDO_FLAT const Lanes& operator[](int m) const { return s[m]; }
};

/// A hexahedron is x(xi) = sum_m a_m xi^m with xi in [-1, 1]^3, where xi^m is the product of the coordinates whose bits are
/// set in m. Gives a_1 to a_7. Differences are taken first, so cells far from the origin lose no digits.
ORDO_FLAT inline void hexahedron_modes(const Vec<3> (&x)[8], Vec<3> (&a)[8])
{
    for (int c = 0; c < 8; ++c) a[c] = 0.125 * (x[c] - x[0]);
    for (int bit = 1; bit < 8; bit *= 2)
        for (int m = 0; m < 8; ++m)
            if (!(m & bit)) {
                const Vec<3> low = a[m], high = a[m | bit];
                a[m]       = low + high;
                a[m | bit] = high - low;
            }
}

/// The moments G_m of the gradients of a hexahedron: int grad N_c dV = sum_m s_m(c) G_m, with s_m as in `CornerSigns`.
/// G_m = sum_{d in m} <xi^(m - d) cof_d>, with <.> the mean over [-1, 1]^3 and cof_d the column d of the cofactor of dx/dxi.
/// Most terms are odd or cancel in pairs: a_7 drops out.
ORDO_FLAT inline void gradient_moments(const Vec<3> (&a)[8], Vec<3> (&G)[8])
{
    constexpr double third = 1.0 / 3.0;
    G[0] = G[7] = Vec<3>{};
    G[1]        = cross(a[2], a[4]) + third * cross(a[3], a[5]);
    G[2]        = cross(a[4], a[1]) + third * cross(a[6], a[3]);
    G[4]        = cross(a[1], a[2]) + third * cross(a[5], a[6]);
    G[3]        = third * (cross(a[2], a[6]) - cross(a[1], a[5]));
    G[5]        = third * (cross(a[1], a[3]) - cross(a[4], a[6]));
    G[6]        = third * (cross(a[4], a[5]) - cross(a[2], a[3]));
}

/// det dx/dxi of a hexahedron at the eight points xi = (+-s, +-s, +-s).
ORDO_FLAT inline Lanes jacobians(const Vec<3> (&a)[8], double s)
{
    const CornerSigns signs;
    Lanes J[3][3];  // axis of space, local axis
    for (int d = 0; d < 3; ++d) {
        const int m = 1 << d, e = 1 << (d + 1) % 3, f = 1 << (d + 2) % 3;
        for (int i = 0; i < 3; ++i)
            J[i][d] = signs[0] * a[m][i] + signs[e] * (s * a[m | e][i]) + signs[f] * (s * a[m | f][i]) +
                      signs[e | f] * (s * s * a[7][i]);
    }
    return J[0][0] * (J[1][1] * J[2][2] - J[1][2] * J[2][1]) + J[0][1] * (J[1][2] * J[2][0] - J[1][0] * J[2][2]) +
           J[0][2] * (J[1][0] * J[2][1] - J[1][1] * J[2][0]);
}

/// w_c of a hexahedron. The Jacobian times N_c has degree 3 in each coordinate, so two Gauss points per axis are exact.
ORDO_FLAT inline void weigh_corners(const Vec<3> (&a)[8], double inverse_volume, double (&w)[8])
{
    constexpr double gauss = 0.57735026918962576451;  // 1/sqrt(3)
    constexpr double near = 0.5 * (1 + gauss), far = 0.5 * (1 - gauss);
    const Lanes J = jacobians(a, gauss) * inverse_volume;
    for (int c = 0; c < 8; ++c) w[c] = J[c];
    for (int bit = 1; bit < 8; bit *= 2)
        for (int c = 0; c < 8; ++c)
            if (!(c & bit)) {
                const double low = w[c], high = w[c | bit];
                w[c]       = near * low + far * high;
                w[c | bit] = far * low + near * high;
            }
}

template <bool is_exact>
ORDO_FLAT inline CellWeights<3> hexahedron_weights(const Vec<3> (&x)[8])
{
    const CornerSigns signs;
    Vec<3> a[8], G[8];
    hexahedron_modes(x, a);
    gradient_moments(a, G);
    CellWeights<3> r{.count = 8, .w = {}, .g = {}, .V = 0.0, .is_sound = false};
    for (int m = 1; m < 7; ++m) r.V += 8.0 / 3.0 * dot(a[m], G[m]);  // int div(x)/3 dV, x = sum_c x_c N_c
    const double inverse = 1.0 / r.V;
    for (int i = 0; i < 3; ++i) {
        Lanes g{};
        for (int m = 1; m < 7; ++m) g += signs[m] * (G[m][i] * inverse);
        for (int c = 0; c < 8; ++c) r.g[c][i] = g[c];
    }
    for (double& w : r.w) w = 0.125;
    if constexpr (is_exact) weigh_corners(a, inverse, r.w);
    const Lanes J = jacobians(a, 1.0);
    r.is_sound    = r.V > 0.0 && r.V <= DBL_MAX;
    for (int c = 0; c < 8; ++c) r.is_sound &= J[c] > 0.0;
    return r;
}

template <int D, bool is_exact>
ORDO_FLAT inline CellWeights<D> cell_weights(const Vec<D> (&x)[1 << D], bool is_simplex)
{
    if constexpr (D == 2)
        if (!is_simplex) return quadrilateral_weights<is_exact>(x);
    if constexpr (D == 3)
        if (!is_simplex) return hexahedron_weights<is_exact>(x);
    return simplex_weights<D>(x);
}

/// The exact integrals.
template <int D>
ORDO_FLAT inline CellWeights<D> exact_weights(const Vec<D> (&x)[1 << D], bool is_simplex)
{
    return cell_weights<D, true>(x, is_simplex);
}

/// Equal w_c (Sadeghirad et al. 2013, 21) and the mean gradients g_c. Equal weights are exact for parallelepipeds and simplices
/// only; for other cells sum_c w_c x_c is not the centroid.
template <int D>
ORDO_FLAT inline CellWeights<D> mean_weights(const Vec<D> (&x)[1 << D], bool is_simplex)
{
    return cell_weights<D, false>(x, is_simplex);
}

/// sum_c w_c x_c: the centroid of the cell if the weights are exact.
template <int D>
ORDO_FLAT inline Vec<D> centroid(const CellWeights<D>& weights, const Vec<D> (&x)[1 << D])
{
    Vec<D> r{};
    for (int c = 0; c < weights.count; ++c) r += weights.w[c] * x[c];
    return r;
}

}  // namespace ordo
