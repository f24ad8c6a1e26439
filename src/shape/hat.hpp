// Basis `hat`: piecewise linear functions of one axis.
#pragma once

#include "base/lane_math.hpp"
#include "grid/lattice.hpp"
#include "shape/interval_mean.hpp"

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

template <>
struct IntervalMean<Hat> {
    static constexpr bool takes_lanes = true;

    template <class T>
    ORDO_FLAT static T hat(const T& t)
    {
        return larger(T(0.0), 1 - fabs(t));
    }
    /// The integral of the hat over [a, b], each side by itself, which avoids cancellation near the ends of the hat. Otherwise a
    /// box that ends at a cell face could leave a gradient but no weight at the node beyond.
    template <class T>
    ORDO_FLAT static T hat_integral(const T& a, const T& b)
    {
        auto between = [](const T& t, double low, double high) { return smaller(larger(t, T(low)), T(high)); };
        const T a0 = between(a, -1.0, 0.0), b0 = between(b, -1.0, 0.0), a1 = between(a, 0.0, 1.0), b1 = between(b, 0.0, 1.0);
        return 0.5 * ((b0 - a0) * (2 + a0 + b0) + (b1 - a1) * (2 - a1 - b1));
    }
    template <int D>
    ORDO_FLAT static int first(const Lattice<D>&, int, double low, double high, int& cells)
    {
        const int cell = static_cast<int>(low);
        cells          = static_cast<int>(high) - cell + 1;
        return cell;
    }
    template <int D>
    ORDO_FLAT static void fill(const Lattice<D>&, int, double low, double high, int cell, int count, double* w, double* dw)
    {
        fill(low, high, static_cast<double>(cell), count, w, dw);
    }
    template <class T>
    ORDO_FLAT static void fill(const T& low, const T& high, const T& cell, int count, T* w, T* dw)
    {
        const T norm = T(1.0) / (high - low);
        for (int k = 0; k < count; ++k) {
            const T a = low - cell - k, b = high - cell - k;
            w[k]  = hat_integral(a, b) * norm;
            dw[k] = (hat(b) - hat(a)) * norm;
        }
    }
};

}  // namespace ordo
