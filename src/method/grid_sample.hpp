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

}  // namespace ordo
