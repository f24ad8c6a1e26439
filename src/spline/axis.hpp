// Splines of degree 1 to 5 along one axis, optionally without the knots next to the faces: the spaces of projection
// `spline-fit`. Positions are in cells from the first face.
#pragma once

#include "base/index.hpp"
#include "base/vec.hpp"
#include "grid/cox_de_boor.hpp"

#include <cmath>
#include <cstddef>

namespace ordo {

/// The splines of one degree over `cells` equal cells. Knots lie between cells; the first `removed` ones next to each face are
/// left out, and degree + 1 knots coincide at a face. A periodic axis has uniform knots and no faces.
struct SplineAxis {
    static constexpr int max_degree = 5;

    int degree = 1, cells = 1, removed = 0;
    bool periodic = false;

    ORDO_HD int spans() const { return periodic ? cells : cells - 2 * removed; }  ///< knot intervals
    ORDO_HD int count() const { return periodic ? cells : spans() + degree; }     ///< functions
    ORDO_HD int span_of(int cell) const { return periodic ? cell : smaller(larger(cell - removed, 0), spans() - 1); }
    /// The start of span k.
    ORDO_HD double knot(int k) const
    {
        if (periodic) return k;
        return k <= 0 ? 0 : k >= spans() ? cells : k + removed;
    }
    /// The Greville point of function i: the mean of its inner knots.
    ORDO_HD double center(int i) const
    {
        double sum = 0.0;
        for (int j = 1; j <= degree; ++j) sum += knot(i - degree + j);
        return sum / degree;
    }
    /// The integral of function i, in cells.
    ORDO_HD double integral(int i) const { return (knot(i + 1) - knot(i - degree)) / (degree + 1); }
    /// The function number for k: on a periodic axis the first function follows the last.
    ORDO_HD int wrapped(int k) const { return periodic ? k % cells : k; }

    /// y moved onto the axis: into the first period, or to the nearest face.
    ORDO_HD double inside(double y) const
    {
        if (periodic) return y - cells * std::floor(y / cells);
        return smaller(larger(y, 0.0), static_cast<double>(cells));
    }
    /// The cell of a position on the axis.
    ORDO_HD int cell_of(double y) const { return smaller(static_cast<int>(y), cells - 1); }

    /// Values and slopes, per cell, at y of the functions that do not vanish in `span`; the first is function `span`.
    template <int P>
    ORDO_FLAT void row(int span, double y, double (&w)[P + 1], double (&dw)[P + 1]) const
    {
        double left[P + 1], right[P + 1];
        for (int j = 1; j <= P; ++j) {
            left[j]  = y - knot(span + 1 - j);
            right[j] = knot(span + j) - y;
        }
        cox_de_boor<P>(left, right, w, dw);
    }
};

/// Calls f with the degree, 1 to 5, as a template argument.
template <class F>
auto with_degree(int degree, F&& f)
{
    switch (degree) {
    case 1: return f.template operator()<1>();
    case 2: return f.template operator()<2>();
    case 3: return f.template operator()<3>();
    case 4: return f.template operator()<4>();
    default: return f.template operator()<5>();
    }
}

/// Tensor products of the splines of each axis, numbered with the first axis fastest.
template <int D>
struct SplineSpace {
    Vec<D, SplineAxis> axis{};

    Index<D> counts() const
    {
        Index<D> n{};
        for (int a = 0; a < D; ++a) n[a] = axis[a].count();
        return n;
    }
    std::size_t count() const
    {
        std::size_t n = 1;
        for (int a = 0; a < D; ++a) n *= axis[a].count();
        return n;
    }
    std::size_t number(const Index<D>& k) const  ///< of a function, from its numbers along the axes
    {
        return static_cast<std::size_t>(number_of(k, counts()));
    }
    Index<D> first_of(const Index<D>& cell) const  ///< the first function that does not vanish in a cell
    {
        Index<D> k{};
        for (int a = 0; a < D; ++a) k[a] = axis[a].span_of(cell[a]);
        return k;
    }
    /// The numbers along the axes of the function with this number.
    Index<D> index(std::size_t number) const
    {
        Index<D> k{};
        for (int a = 0; a < D; ++a) {
            k[a] = static_cast<int>(number % axis[a].count());
            number /= axis[a].count();
        }
        return k;
    }
    /// The Greville point of a function, in cells.
    Vec<D> center(std::size_t number) const
    {
        const Index<D> k = index(number);
        Vec<D> y{};
        for (int a = 0; a < D; ++a) y[a] = axis[a].center(k[a]);
        return y;
    }
    /// The integral of a function, in cell volumes.
    double integral(std::size_t number) const
    {
        const Index<D> k = index(number);
        double r         = 1.0;
        for (int a = 0; a < D; ++a) r *= axis[a].integral(k[a]);
        return r;
    }
};

}  // namespace ordo
