// The fields of the grid at any point, for probes, files and verification.
#pragma once

#include "method/state.hpp"

namespace ordo {

template <int D>
struct GridSample {
    Vec<D> velocity;  ///< m/s
    double mass;      ///< sum N_i m_i, kg
    double density;   ///< sum N_i m_i over the integral of N_i, kg/m^D
};

/// The fields of the grid at a point, from the last step, without nodes that have no mass.
template <int D>
GridSample<D> sample_grid(const State<D>& s, const Vec<D>& x);

/// Whether a node of the box may count in the fields at a point.
template <int D>
bool is_sampled(const State<D>& s, const Vec<D>& x, const IndexBox<D>& nodes)
{
    for (int a = 0; a < D; ++a) {
        const int cell = static_cast<int>(std::floor(s.lattice.cell_coordinate(a, x[a])));
        if (cell + s.lattice.basis.degree + 1 < nodes.lo[a] || cell - 1 >= nodes.hi[a]) return false;
    }
    return true;
}

}  // namespace ordo
