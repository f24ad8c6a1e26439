// Means of a basis over intervals, for boxes. A basis with a closed form specialises it in its own file.
#pragma once

#include "grid/lattice.hpp"

#include <cmath>

namespace ordo {

/// The means of a basis over [low, high] along one axis and their slopes per cell, for all functions that the interval touches.
template <class Basis>
struct IntervalMean {
    static constexpr bool takes_lanes = false;  ///< whether `fill` takes eight intervals at once

    /// The first function and the number of cells that the interval touches.
    template <int D>
    ORDO_FLAT static int first(const Lattice<D>& g, int a, double low, double high, int& cells)
    {
        int before, after;
        const int cell = Basis::locate(g, a, low, before, after);
        cells          = Basis::locate(g, a, high, before, after) - cell + 1;
        return cell;
    }
    /// Two Gauss points a cell are exact for splines up to the third degree.
    template <int D>
    ORDO_FLAT static void fill(const Lattice<D>& g, int a, double low, double high, int cell, int count, double* w, double* dw)
    {
        constexpr double gauss = 0.57735026918962576;
        const double norm      = 1 / (high - low);
        for (int k = 0; k < count; ++k) w[k] = dw[k] = 0.0;
        double row[Basis::width];
        auto add = [&](double y, double factor, double* to) {
            const int at = Basis::row(g, a, y, row) - cell;
            for (int k = 0; k < Basis::width; ++k) to[at + k] += factor * row[k];
        };
        for (double from = low; from < high;) {
            const double to   = smaller(high, std::floor(from) + 1);
            const double half = 0.5 * (to - from), middle = 0.5 * (to + from);
            add(middle - gauss * half, half * norm, w);
            add(middle + gauss * half, half * norm, w);
            from = to;
        }
        add(high, norm, dw);
        add(low, -norm, dw);
    }
};

}  // namespace ordo
