// Mass matrices of splines along one axis, with wall conditions at its ends.
#pragma once

#include "base/gauss_rule.hpp"
#include "solve/banded.hpp"
#include "spline/axis.hpp"

#include <array>
#include <utility>

namespace ordo {

/// f(cell, position in the cell, weight, first function, values, slopes) at the Gauss points of an axis; lengths are in cells.
template <class F>
void for_each_gauss_point(const SplineAxis& axis, int points, F&& f)
{
    const auto rule = gauss_rule(points);
    with_degree(axis.degree, [&]<int P>() {
        double w[P + 1], dw[P + 1];
        for (int cell = 0; cell < axis.cells; ++cell)
            for (const auto& [at, weight] : rule) {
                const int span = axis.span_of(cell);
                axis.row<P>(span, cell + at, w, dw);
                f(cell, at, weight, span, w, dw);
            }
    });
}

/// Wall conditions on the first and last function of an axis: 1 in free lanes, 0 in lanes that a wall holds.
using AxisEnds = std::array<Lanes, 2>;
inline const AxisEnds kFreeEnds{Lanes(1.0), Lanes(1.0)};

/// A matrix sum w N_i N_j of an axis. In lanes that a wall holds, the row and column of the end function are those of the identity.
class AxisMass {
  public:
    AxisMass(const SplineAxis& axis, const AxisEnds& free)
        : axis_(axis), free_(free), sum_(axis.count(), axis.degree, axis.periodic)
    {}

    /// Adds to the entries (i, i + distance) and (i + distance, i).
    void add(int i, int distance, const Lanes& value)
    {
        const int j            = axis_.wrapped(i + distance);
        const Lanes free_value = value * free(i) * free(j);
        sum_.add(i, j, free_value);
        if (distance > 0) sum_.add(j, i, free_value);
    }
    /// The factors, and the first row whose pivot is zero within `tolerance`; -1 if none is.
    std::pair<Banded<Lanes>, int> factored(double tolerance)
    {
        for (int i = 0; i < axis_.count(); ++i) sum_.add(i, i, 1.0 - free(i));
        const int singular = sum_.factor(tolerance);
        return {std::move(sum_), singular};
    }

  private:
    Lanes free(int i) const
    {
        if (axis_.periodic || (i > 0 && i < axis_.count() - 1)) return Lanes(1.0);
        return free_[i > 0];
    }

    const SplineAxis& axis_;
    AxisEnds free_;
    Banded<Lanes> sum_;
};

/// The factors of int N_i N_j, lengths in cells.
inline Banded<Lanes> unit_mass(const SplineAxis& axis)
{
    AxisMass mass(axis, kFreeEnds);
    for_each_gauss_point(axis, axis.degree + 1, [&](int, double, double weight, int span, const double* w, const double*) {
        for (int i = 0; i <= axis.degree; ++i)
            for (int j = i; j <= axis.degree; ++j) mass.add(axis.wrapped(span + i), j - i, Lanes(weight * w[i] * w[j]));
    });
    return mass.factored(0.0).first;
}

}  // namespace ordo
