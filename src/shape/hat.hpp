// Basis `hat`: piecewise linear functions of one axis.
#pragma once

#include "base/config.hpp"

namespace ordo {

/// The hats that do not vanish at a cell coordinate. A basis gives rows of (first node, values, slopes per cell).
struct Hat {
    static constexpr int width = 2;  ///< functions that do not vanish in a cell

    ORDO_FLAT static int row(double y, double (&w)[width], double (&dw)[width])
    {
        const int cell = static_cast<int>(y);
        const double f = y - cell;
        w[0]           = 1 - f;
        w[1]           = f;
        dw[0]          = -1;
        dw[1]          = 1;
        return cell;
    }
    ORDO_FLAT static int row(double y, double (&w)[width])
    {
        const int cell = static_cast<int>(y);
        w[1]           = y - cell;
        w[0]           = 1 - w[1];
        return cell;
    }
};

}  // namespace ordo
