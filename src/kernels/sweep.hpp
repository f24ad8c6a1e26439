// The arguments of every particle pass: views and numbers, trivially copyable, no owners.
#pragma once

#include "grid/lattice.hpp"
#include "material/material.hpp"
#include "particles/particles.hpp"

namespace ordo {

template <int D>
struct Sweep {
    Lattice<D> lattice;
    ParticleView<D> p;
    Lanes* nodes;  ///< the node records that are written or read
    const Material* materials;
    double dt;                         ///< of positions and deformation, s
    double pic;                        ///< PIC fraction of the velocity update, 0..1
    double stretch_limit;              ///< of parallelepipeds, cells; 0 means no limit
    bool keeps_gradient    = false;    ///< L_p is stored
    const Lanes* gradients = nullptr;  ///< at the centres of cells, see cell_gradient.hpp; null if not used
    bool sums_energy       = false;    ///< velocity updates report the energies of the increments
    /// Here a gather stores the displacement gradients of the step for the stress update, from particle `increment_first` on;
    /// null if no law needs them.
    Mat<D>* increments  = nullptr;
    int increment_first = 0;
    bool is_past        = false;  ///< F follows the previous step: x^n is the end of that step, not its start
};

enum class Fault { none, not_finite, inverted, left_grid, domain_turned, domain_too_wide, not_solved };

/// What a tile reports on the motion of its particles. Reduced in tile order, so it is the same for any number of threads.
struct TileReport {
    double move     = 0.0;   ///< largest displacement of the pass, cells
    double reach    = -1.0;  ///< largest distance from a particle to the edge of its domain, cells; negative: not measured
    double kicked   = 0.0;   ///< sum m |dv|^2/2 of the increments, J, if Sweep::sums_energy
    double filtered = 0.0;   ///< kinetic energy that PIC took, J; the same
    Fault fault     = Fault::none;
    int particle    = -1;  ///< the first particle with the fault

    ORDO_HD void flag(Fault f, int i)
    {
        if (fault != Fault::none) return;
        fault    = f;
        particle = i;
    }
};

/// How nodal velocities are fitted.
struct FitChoices {
    bool is_whole;    ///< a node with dropped pivots takes the mean of its samples (mls), else the other monomials (imls)
    bool everywhere;  ///< also fit nodes without mass that have samples
};

/// What nodes and cells report on their fits.
struct FitReport {
    long dropped  = 0;  ///< pivots that samples did not determine
    long fallback = 0;  ///< nodes that took the mean of their samples (mls) or the mass projection (no sample)

    FitReport& operator+=(const FitReport& o)
    {
        dropped += o.dropped;
        fallback += o.fallback;
        return *this;
    }
};

/// How rows of the mass matrix take part in its solution, see MassSolver; row 0 stands for no node and is zero.
struct MassRowParts {
    static constexpr unsigned char coupled = 1u << NodeLane::mass;

    const unsigned char* lanes;  ///< a bit for each component that is solved for, and `coupled`
    const double* diagonal;      ///< added to the diagonal of the matrix, kg
    const double* scale;         ///< 1/sqrt(m_i), kg^-1/2

    ORDO_HD bool is_coupled(std::ptrdiff_t row) const { return lanes[row] & coupled; }  ///< else lumped
};

/// Which substitutions with the factors of a line are done.
enum LinePass : unsigned { kForward = 1u, kBackward = 2u };

}  // namespace ordo
