// The particle passes of a method, chosen once at set-up as function pointers: one indirect call per pass and tile.
// A pass is a template on what it touches only, so that instantiations add up instead of multiplying.
#pragma once

#include "kernels/sweep.hpp"
#include "method/axes.hpp"

#include <cstddef>

namespace ordo {

template <int D>
struct Passes {
    using Scatter = void (*)(const Sweep<D>&, int begin, int end);
    using Gather  = void (*)(const Sweep<D>&, int begin, int end, TileReport&);

    Scatter project;            ///< m_i, (m v)_i
    Scatter force;              ///< f_i
    Scatter project_and_force;  ///< both in one sweep; null where forces need the masses of the nodes
    void (*apply_mass)(const Sweep<D>&, const Lanes* from, int begin, int end);  ///< + M from, M the consistent mass matrix

    Gather update_velocity;    ///< v_p
    Gather update_stress;      ///< F_p, sigma_p, V_p of the step to come
    Gather stress_of_past;     ///< F_p, sigma_p, V_p of the step that led here
    Gather move;               ///< x_p and domains; of cells nothing
    Gather velocity_and_move;  ///< v_p, x_p and domains in one sweep
    Gather update_all;         ///< all in one sweep

    void (*move_corners)(const Sweep<D>&, std::ptrdiff_t begin, std::ptrdiff_t end);  ///< x_c; null without cells
    Gather follow_corners;                                                            ///< x_p and V_p; null without cells

    void (*evolve)(const Sweep<D>&, int i);  ///< the domain of particle i from its F, or from its corners
    double (*reach)(const Lattice<D>&, const ParticleView<D>&, int i);             ///< from x_p to the edge of its domain, cells
    double max_reach;                                                              ///< the largest that the passes hold
    Lanes (*interpolate)(const Lattice<D>&, const Lanes* nodes, const Vec<D>& x);  ///< sum N_i(x) n_i
};

/// The passes for a choice that breaks no rule.
template <int D>
Passes<D> choose_passes(const MethodSpec& spec);

}  // namespace ordo
