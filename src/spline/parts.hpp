// Shared by the sources of SplineScheme only.
#pragma once

#include "base/parallel.hpp"
#include "method/state.hpp"
#include "spline/axis_mass.hpp"
#include "spline/scheme.hpp"

#include <array>
#include <cstddef>

namespace ordo {

inline void add(Lanes& total, const Lanes& one) { total += one; }

/// Makes n records of zero.
inline void clear(Array<Lanes>& array, std::size_t n)
{
    keep_room(array, n);
    parallel_for_each(static_cast<std::ptrdiff_t>(n), [&](std::ptrdiff_t i) { array[i] = Lanes(0.0); });
}

/// The position, m, of a point given in cells.
template <int D>
Vec<D> place_of(const Model<D>& model, Vec<D> y)
{
    for (int a = 0; a < D; ++a) y[a] = model.origin[a] + y[a] * model.h[a];
    return y;
}

template <int D>
struct SplineScheme<D>::System {
    SplineSolve::Kind solve;
    const char* what;  ///< for messages
    const SplineSpace<D>& space;
    const Lanes Held::*free;  ///< masks of the walls; null without walls
    Lanes ghost_weight;       ///< factor of the penalty in the matrix
    CutFactor<D>* factor;     ///< the preconditioner, for bodies with free surfaces, else null
    const Factors* factors;   ///< the preconditioner for others, else null
    SplineMatrix<D>& matrix;  ///< A without walls
};

template <int D>
Cover SplineScheme<D>::cover_of(int cell) const
{
    SplineScratch<D>& work = *scratch_;
    return is_cut_ ? work.body.cover[cell] : Cover::all;
}

/// f(cell, number) for all cells. Cells that share a function are visited one after another, in an order that does not depend
/// on the number of threads.
template <int D>
template <class F>
void SplineScheme<D>::for_each_cell(F&& f) const
{
    auto visits = static_cast<double>(v_space_.count());
    for (int a = 0; a < D; ++a) visits *= v_space_.axis[a].degree + 1;
    for (const auto& colour : blocks_)
        parallel_for(
            static_cast<std::ptrdiff_t>(colour.size()),
            [&](std::ptrdiff_t k) { colour[k].for_each([&](const Index<D>& cell) { f(cell, number_of(cell, cells_)); }); },
            visits > 10000);
}

/// f(cell, number, cover) for the cells that are not empty.
template <int D>
template <class F>
void SplineScheme<D>::for_each_covered_cell(F&& f) const
{
    for_each_cell([&](const Index<D>& cell, int number) {
        const Cover cover = cover_of(number);
        if (cover != Cover::none) f(cell, number, cover);
    });
}

/// The sum of the weights divided by the sum of the volumes.
template <int D>
Lanes SplineScheme<D>::mean_weight(const Weight& weight)
{
    const Lanes sum = parallel_reduce(weight.p.count, Lanes(0.0), weight, add);
    auto volume_of  = [&](std::ptrdiff_t i) { return weight.p.V[i]; };
    auto add_volume = [](double& total, double V) { total += V; };
    return sum * (1 / parallel_reduce(weight.p.count, 0.0, volume_of, add_volume));
}

}  // namespace ordo
