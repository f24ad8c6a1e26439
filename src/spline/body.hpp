// The part of the grid that a body with free surfaces fills, for projection spline-fit: full, cut and empty cells, quadrature
// points in cut cells, and ghost penalties.
#pragma once

#include "base/array.hpp"
#include "base/lanes.hpp"
#include "spline/cut_rule.hpp"
#include "spline/ghost_penalty.hpp"

#include <cstddef>
#include <vector>

namespace ordo {

template <int D>
struct Model;
template <int D>
struct Particles;

/// Quadrature points in cut cells. A row has the functions of one axis after another.
struct CutPoints {
    std::vector<std::ptrdiff_t> first;  ///< point of each cell, then the end; full and empty cells have no points
    std::vector<double> weights;        ///< m^D
    int v_width = 0, s_width = 0;       ///< entries of a row
    std::vector<double> v_values, v_slopes, s_values;

    std::ptrdiff_t count() const { return static_cast<std::ptrdiff_t>(weights.size()); }
};

template <int D>
struct SplineBody {
    std::vector<Cover> cover;  ///< of each cell, the first axis fastest
    CutPoints points;
    GhostPenalty<D> v, s;  ///< for the velocity space and the stress space
};

/// f(cell number) for the cells of a box that are in the grid; cell indices are wrapped on periodic axes.
template <int D, class F>
void for_each_cell_of(const Model<D>& model, const IndexBox<D>& box, const F& f)
{
    box.for_each([&](Index<D> at) {
        for (int a = 0; a < D; ++a) {
            if (model.periodic[a]) at[a] = (at[a] + model.cells[a]) % model.cells[a];
            if (at[a] < 0 || at[a] >= model.cells[a]) return;
        }
        f(number_of(at, model.cells));
    });
}

/// A first guess from the particles alone. A cell is full if each of its 2^D sub-cells, or it and each of its neighbours, has a
/// particle. Other cells with particles and their neighbours are marked as cut: the surface is at most one cell away. `first`
/// and `order` list the particles of each cell, see SplineScratch.
template <int D>
std::vector<Cover> cover_by_particles(const Model<D>& model, const Particles<D>& p, const Array<int>& order,
                                      const std::vector<int>& first);

/// Finds the cells and quadrature points inside the body, and the ghost penalties of both spaces. Inside, all level sets are
/// negative; they are splines of the velocity space, with coefficients in the lanes of `surface`. `rough`: see
/// cover_by_particles.
template <int D>
void find_body(const Model<D>& model, const SplineSpace<D>& v_space, const SplineSpace<D>& s_space, const Lanes* surface,
               const std::vector<Cover>& rough, int points, SplineBody<D>& body);

}  // namespace ordo
