// Basis `bspline2`, `bspline3`: splines of one axis with clamped knots, n + degree functions over n cells. The first and the
// last function are 1 at the grid's faces; on a periodic axis all functions are alike.
#pragma once

#include "grid/cox_de_boor.hpp"
#include "grid/lattice.hpp"

namespace ordo {

/// Splines of degree P; a basis gives rows of (first node, values, slopes per cell). Beyond a face of the grid they keep the
/// values of the face: the overhanging part of a domain counts at the face, and weights stay positive.
template <int P>
struct BSpline {
    static_assert(P == 2 || P == 3);
    static constexpr int degree = P;
    static constexpr int width  = P + 1;  ///< functions that do not vanish in a cell

    template <int D>
    ORDO_FLAT static int row(const Lattice<D>& g, int a, double y, double (&w)[width], double (&dw)[width])
    {
        int before, after;
        const int cell = locate(g, a, y, before, after);
        if (before >= P - 1 && after >= P - 1)
            inner(y - cell, w, dw);
        else
            clamped(y - cell, before, after, w, dw);
        return cell;
    }
    /// Values alone.
    template <int D>
    ORDO_FLAT static int row(const Lattice<D>& g, int a, double y, double (&w)[width])
    {
        double dw[width];
        return row(g, a, y, w, dw);
    }

    /// The same at eight places, with the cells as whole numbers. Returns false if one is near a face: use `row` then.
    template <int D>
    ORDO_FLAT static bool rows(const Lattice<D>& g, int a, const Lanes& y, Lanes& cell, Lanes (&w)[width], Lanes (&dw)[width])
    {
        if (!g.periodic[a]) {
            const double low = g.margin + P - 1, high = g.margin + g.cells[a] - (P - 1);
            if (!(largest(larger(low - y, y - high)) < 0)) return false;
        }
        cell = truncate(y);
        inner(y - cell, w, dw);
        return true;
    }
    /// Values alone.
    template <int D>
    ORDO_FLAT static bool rows(const Lattice<D>& g, int a, const Lanes& y, Lanes& cell, Lanes (&w)[width])
    {
        Lanes dw[width];
        return rows(g, a, y, cell, w, dw);
    }

    /// Moves y into the grid; returns its cell and sets the number of cells before and after it.
    template <int D>
    ORDO_FLAT static int locate(const Lattice<D>& g, int a, double& y, int& before, int& after)
    {
        before = after = P;
        if (g.periodic[a]) return static_cast<int>(y);
        y              = smaller(larger(y, static_cast<double>(g.margin)), static_cast<double>(g.margin + g.cells[a]));
        const int cell = smaller(static_cast<int>(y), g.margin + g.cells[a] - 1);
        before         = cell - g.margin;
        after          = g.margin + g.cells[a] - 1 - cell;
        return cell;
    }

    /// Rows between evenly spaced knots.
    template <class T>
    ORDO_FLAT static void inner(const T& t, T (&w)[width], T (&dw)[width])
    {
        const T s = 1 - t;
        if constexpr (P == 2) {
            w[0]  = 0.5 * s * s;
            w[1]  = 0.5 + t * s;
            w[2]  = 0.5 * t * t;
            dw[0] = -s;
            dw[1] = s - t;
            dw[2] = t;
        } else {
            w[0]  = s * s * s * (1.0 / 6);
            w[1]  = 2.0 / 3 - t * t * (1 - 0.5 * t);
            w[2]  = 2.0 / 3 - s * s * (1 - 0.5 * s);
            w[3]  = t * t * t * (1.0 / 6);
            dw[0] = -0.5 * s * s;
            dw[1] = -t * (2 - 1.5 * t);
            dw[2] = s * (2 - 1.5 * s);
            dw[3] = 0.5 * t * t;
        }
    }

    /// Rows next to a face.
    ORDO_FLAT static void clamped(double t, int before, int after, double (&w)[width], double (&dw)[width])
    {
        double left[P + 1], right[P + 1];
        for (int j = 1; j <= P; ++j) {
            left[j]  = t + smaller(j - 1, before);
            right[j] = smaller(j, after + 1) - t;
        }
        cox_de_boor<P>(left, right, w, dw);
    }
};

}  // namespace ordo
