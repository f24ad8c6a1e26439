// What every particle pass gets: views and numbers, trivially copyable, no owners.
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
    double stretch_limit;              ///< of parallelepipeds, cells; 0 is none
    bool keeps_gradient    = false;    ///< L_p is stored
    const Lanes* gradients = nullptr;  ///< at the centres of cells, see cell_gradient.hpp; null where particles use their own
    /// Where a gather leaves the displacement gradients of the step for the stress update, those of particle `increment_first`
    /// first; null where no law asks for them.
    Mat<D>* increments  = nullptr;
    int increment_first = 0;
    bool is_past        = false;  ///< F follows the step that led here: x^n is its end, not its start
};

enum class Fault { none, not_finite, inverted, left_grid, domain_turned, domain_too_wide };

/// What a tile found out while its particles moved. Reduced in tile order, so that it is the same for any thread count.
struct TileReport {
    double move  = 0.0;   ///< largest displacement of the pass, cells
    double reach = -1.0;  ///< largest distance from a particle to the edge of its domain, cells; negative: not measured
    Fault fault  = Fault::none;
    int particle = -1;  ///< the first with the fault

    ORDO_HD void flag(Fault f, int i)
    {
        if (fault != Fault::none) return;
        fault    = f;
        particle = i;
    }
};

/// How velocities of nodes are fitted.
struct FitChoices {
    bool is_whole;    ///< mls: a node that its samples do not determine takes their mean; else the monomials that they do
    bool everywhere;  ///< nodes without mass too, where there are samples
};

/// What nodes and cells found out while fits were solved.
struct FitReport {
    long dropped  = 0;  ///< pivots that samples did not determine
    long fallback = 0;  ///< nodes that took a lower degree whole (mls) or the mass projection (no sample)

    FitReport& operator+=(const FitReport& o)
    {
        dropped += o.dropped;
        fallback += o.fallback;
        return *this;
    }
};

/// How rows of the mass matrix take part in its solution, see MassSolver; row 0 is none and zero.
struct MassRowParts {
    static constexpr unsigned char coupled = 1u << NodeLane::mass;

    const unsigned char* lanes;  ///< a bit for each component that is solved for, and `coupled`
    const double* diagonal;      ///< added to that of the matrix, kg
    const double* scale;         ///< 1/sqrt(m_i), kg^-1/2

    ORDO_HD bool is_coupled(std::ptrdiff_t row) const { return lanes[row] & coupled; }  ///< else lumped
};

/// Parts of the solution with the factors of a line.
enum LinePass : unsigned { kForward = 1u, kBackward = 2u };

}  // namespace ordo
