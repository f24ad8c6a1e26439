// The particle passes of a method, chosen once at set-up as function pointers: one indirect call per pass and tile. A pass is a
// template only on what it uses, so that instantiations add up instead of multiplying.
#pragma once

#include "grid/node_rows.hpp"
#include "grid/tiles.hpp"
#include "kernels/sweep.hpp"
#include "method/spec.hpp"

#include <cstddef>
#include <vector>

namespace ordo {

template <int D>
struct NodeWeight;

/// Fits of nodal velocities; all null if the projection is not a fit.
template <int D>
struct VelocityFitPasses {
    int size = 0;  ///< Lanes of a node's record
    int work = 0;  ///< multiply-adds of Lanes a sample
    void (*spread)(const Sweep<D>&, Lanes* records, bool with_corners, int begin, int end) = nullptr;
    void (*solve)(Lanes* nodes, const Lanes* records, const FitChoices&, std::ptrdiff_t first, std::ptrdiff_t end,
                  FitReport&)                                                              = nullptr;
};

/// Fits of fields in cells, evaluated at quadrature points; all null if the quadrature does not need them.
template <int D>
struct CellFitPasses {
    int size                = 0;        ///< Lanes of a cell's record
    int per_cell            = 0;        ///< quadrature points
    int (*work)(int fields) = nullptr;  ///< multiply-adds of Lanes a particle with that many fields
    void (*spread)(const Sweep<D>&, Lanes* contents, Lanes* records, int begin, int end) = nullptr;
    /// Sets the points of a cell, from `first` on, which share the volume V. `distance` is the offset of the one point of
    /// quadrature `cell` from the cell centre, in cells.
    void (*set_points)(const Lattice<D>&, const Index<D>& cell, const Lanes* record, const Lanes& content, const Vec<D>& distance,
                       double V, bool is_edge, const ParticleView<D>&, int first, FitReport&) = nullptr;
};

/// The consistent mass matrix as rows of a stencil, see kernels/mass_rows.hpp; all null if the number of nodes per particle is
/// not fixed.
template <int D>
struct MassRowPasses {
    int reach = 0;  ///< nodes to the furthest neighbour of a row along an axis
    int size  = 0;  ///< entries per row
    void (*form)(const Sweep<D>&, const RowView<D>&, double* entries, int begin, int end)                        = nullptr;
    void (*multiply)(const RowView<D>&, const double* entries, const Lanes* from, Lanes* to, int begin, int end) = nullptr;
    // The preconditioner.
    int factor_size = 0;  ///< numbers per row
    void (*sum)(const RowView<D>&, const double* entries, const MassRowParts&, float* T, int begin, int end) = nullptr;
    void (*factor)(const int* line, int count, int axis, float* T)                                           = nullptr;
    void (*solve)(const int* line, int count, int axis, const float* L, Lanes* x, unsigned passes)           = nullptr;
};

template <int D>
struct Passes {
    using Scatter = void (*)(const Sweep<D>&, int begin, int end);
    using Gather  = void (*)(const Sweep<D>&, int begin, int end, TileReport&);
    using Product = void (*)(const Sweep<D>&, const Lanes* from, int begin, int end);

    Scatter project;            ///< m_i, (m v)_i
    Scatter force;              ///< f_i
    Scatter project_and_force;  ///< both in one sweep; null if they cannot be combined
    Scatter surface_force;      ///< the part of f_i from loads on faces
    Product apply_mass;         ///< nodes += M from, with the consistent mass matrix M, which is not formed
    MassRowPasses<D> mass_rows;

    /// The same for quadrature points, which are particles of domain `point`.
    Scatter project_points, force_points, project_and_force_points;
    Product apply_mass_points;
    MassRowPasses<D> mass_rows_of_points;

    VelocityFitPasses<D> velocity_fit;
    CellFitPasses<D> cell_fit;
    /// The gradient at the centre of a cell, see kernels/cell_gradient.hpp; null if particles do not use it.
    void (*gradient_at_center)(const Lattice<D>&, const Tiles<D>&, const Lanes* nodes, const Index<D>& cell, Lanes* record);

    Gather keep;             ///< what particles carry to the next projection; null if nothing
    Gather update_velocity;  ///< v_p
    Gather deform;           ///< F_p, V_p after the coming step, or (USF) after the previous one; then StressUpdate
    Gather move;             ///< x_p and domains; null with cells
    Gather update_all;       ///< all in one sweep, L_p included

    // For implicit steps, see kernels/sample.hpp.
    void (*sample)(const Sweep<D>&, Vec<D>* value, Mat<D>* gradient, int begin, int end);
    void (*list_weights)(const Sweep<D>&, int i, std::vector<NodeWeight<D>>&);

    void (*move_corners)(const Sweep<D>&, std::ptrdiff_t begin, std::ptrdiff_t end);  ///< x_c; null without cells
    Gather follow_corners;                                                            ///< x_p and V_p; null without cells

    void (*evolve)(const Sweep<D>&, int i);  ///< sets the domain of particle i from its F or its corners
    double (*reach)(const Lattice<D>&, const ParticleView<D>&, int i);  ///< from x_p to the edge of its domain, cells
    double max_reach;                                                   ///< the largest reach that the passes allow
};

/// The passes of a method. Throws InputError if it breaks a rule.
template <int D>
Passes<D> choose_passes(const MethodSpec& spec);

template <int D>
VelocityFitPasses<D> choose_velocity_fit(const MethodSpec& spec);
template <int D>
CellFitPasses<D> choose_cell_fit(const MethodSpec& spec);
template <int D>
MassRowPasses<D> choose_mass_rows(Basis basis);

}  // namespace ordo
