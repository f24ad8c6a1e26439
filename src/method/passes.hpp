// The particle passes of a method, chosen once at set-up as function pointers: one indirect call per pass and tile.
// A pass is a template on what it touches only, so that instantiations add up instead of multiplying.
#pragma once

#include "kernels/sweep.hpp"
#include "method/axes.hpp"

namespace ordo {

template <int D>
struct Passes {
    using Scatter = void (*)(const Sweep<D>&, int begin, int end);
    using Gather  = void (*)(const Sweep<D>&, int begin, int end, TileReport&);

    Scatter project;            ///< m_i, (m v)_i
    Scatter force;              ///< f_i
    Scatter project_and_force;  ///< both in one sweep

    Gather update_velocity;    ///< v_p
    Gather update_stress;      ///< F_p, sigma_p, V_p of the step to come
    Gather stress_of_past;     ///< F_p, sigma_p, V_p of the step that led here
    Gather move;               ///< x_p and domains
    Gather velocity_and_move;  ///< v_p, x_p and domains in one sweep
    Gather update_all;         ///< all in one sweep

    void (*evolve)(const ParticleView<D>&, int i);  ///< the domain of particle i from its F
};

/// The passes for a valid choice; `body_force` says whether any body has a force of its own.
template <int D>
Passes<D> choose_passes(const MethodSpec& spec, bool body_force);

/// The distance from a particle to the edge of its domain, and the largest that the passes hold, in cells.
struct DomainReach {
    double cells, max;
};
template <int D>
DomainReach reach_of(const MethodSpec& spec, const Lattice<D>& lattice, const ParticleView<D>& p, int i);

}  // namespace ordo
