// Basis `hat`: piecewise linear functions of one axis.
#pragma once

#include "grid/lattice.hpp"

#include <limits>

namespace ordo {

/// The hats that do not vanish at a cell coordinate. A basis gives rows of (first node, values, slopes per cell).
struct Hat {
    static constexpr int degree = 1;
    static constexpr int width  = 2;  ///< functions that do not vanish in a cell

    /// Values and slopes. On a cell face the value of the far node is the smallest there is instead of zero: where it
    /// holds no other mass it must still have the velocity that its slope will ask for.
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
