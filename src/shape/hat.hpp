// Basis `hat`: piecewise linear functions of one axis.
#pragma once

#include "grid/lattice.hpp"

#include <limits>

namespace ordo {

/// The hats that do not vanish at a cell coordinate. A basis gives rows of (first node, values, slopes per cell).
struct Hat {
    static constexpr int degree = 1;
    static constexpr int width  = 2;  ///< functions that do not vanish in a cell

    /// Values and slopes. On a cell face the value at the far node is epsilon instead of zero: the slope there is not zero, so
    /// the node needs a velocity even if no other particle gives it mass.
    template <int D>
    ORDO_FLAT static int row(const Lattice<D>&, int, double y, double (&w)[width], double (&dw)[width])
    {
        constexpr double least = std::numeric_limits<double>::epsilon();
        const int cell         = static_cast<int>(y);
        const double f         = smaller(larger(y - cell, least), 1 - least);
        w[0]                   = 1 - f;
        w[1]                   = f;
        dw[0]                  = -1;
        dw[1]                  = 1;
        return cell;
    }
    /// The same at eight places, with the cells as whole numbers. Returns true: hats are the same at faces.
    template <int D>
    ORDO_FLAT static bool rows(const Lattice<D>&, int, const Lanes& y, Lanes& cell, Lanes (&w)[width], Lanes (&dw)[width])
    {
        constexpr double least = std::numeric_limits<double>::epsilon();
        cell                   = truncate(y);
        w[1]                   = smaller(larger(y - cell, Lanes(least)), Lanes(1 - least));
        w[0]                   = 1 - w[1];
        dw[0]                  = Lanes(-1.0);
        dw[1]                  = Lanes(1.0);
        return true;
    }
    /// Values alone.
    template <int D>
    ORDO_FLAT static bool rows(const Lattice<D>&, int, const Lanes& y, Lanes& cell, Lanes (&w)[width])
    {
        cell = truncate(y);
        w[1] = y - cell;
        w[0] = 1 - w[1];
        return true;
    }
    /// Values alone.
    template <int D>
    ORDO_FLAT static int row(const Lattice<D>&, int, double y, double (&w)[width])
    {
        const int cell = static_cast<int>(y);
        w[1]           = y - cell;
        w[0]           = 1 - w[1];
        return cell;
    }
};

}  // namespace ordo
