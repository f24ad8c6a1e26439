// The part of the grid that a body with free surfaces fills, for projection spline-fit: whole, cut and empty cells, points in cut
// ones, and the splines that are unknowns there.
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

/// Points in cut cells. Rows have the functions of an axis after those of another.
struct CutPoints {
    std::vector<std::ptrdiff_t> first;  ///< of each cell, and the end; those of whole and empty cells have none
    std::vector<double> weights;        ///< m^D
    int v_width = 0, s_width = 0;       ///< of a row
    std::vector<double> v_values, v_slopes, s_values;

    std::ptrdiff_t count() const { return static_cast<std::ptrdiff_t>(weights.size()); }
};

template <int D>
struct SplineBody {
    std::vector<Cover> cover;  ///< of all cells, the first axis fastest
    CutPoints points;
    GhostPenalty<D> v, s;  ///< of the spaces of velocity and stress
};

/// f(number of the cell) for the cells of a box that are in the grid; those beyond a period are those of the next one.
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

/// What particles say alone: a cell is whole where each of its 2^D parts, or each cell around it, has a particle; others beside
/// them are parts, for surfaces are no further. `first` and `order` list the particles of cells, see SplineScratch.
template <int D>
std::vector<Cover> cover_by_particles(const Model<D>& model, const Particles<D>& p, const Array<int>& order,
                                      const std::vector<int>& first);

/// Finds the cells and points inside the body, and the penalties of both spaces. Inside, all level sets are negative: splines of the
/// space of velocities, with coefficients in the lanes of `surface`. `rough`: see cover_by_particles.
template <int D>
void find_body(const Model<D>& model, const SplineSpace<D>& v_space, const SplineSpace<D>& s_space, const Lanes* surface,
               const std::vector<Cover>& rough, int points, SplineBody<D>& body);

}  // namespace ordo
