#include "kernels/mass_rows.hpp"
#include "method/passes.hpp"
#include "shape/bspline.hpp"
#include "shape/hat.hpp"

#include <stdexcept>

namespace ordo {

namespace {

template <int D, class Basis>
MassRowPasses<D> mass_rows_of()
{
    using Row = HalfRow<D, Basis::width>;
    return {Row::reach,
            Row::size,
            form_mass_rows<D, Basis>,
            multiply_mass_rows<D, Basis::width>,
            D * Basis::width,
            sum_mass_rows<D, Basis::width>,
            factor_line<D, Basis::width>,
            solve_line<D, Basis::width>};
}

}  // namespace

template <int D>
MassRowPasses<D> choose_mass_rows(Basis basis)
{
    switch (basis) {
    case Basis::hat:
    case Basis::ddmpm: return mass_rows_of<D, Hat>();  // ddmpm has the values of hats
    case Basis::bspline2: return mass_rows_of<D, BSpline<2>>();
    case Basis::bspline3: return mass_rows_of<D, BSpline<3>>();
    case Basis::bspline4:
    case Basis::bspline5: break;  // only for spline-fit
    }
    throw std::logic_error("choose_mass_rows: unhandled basis");
}

template MassRowPasses<1> choose_mass_rows(Basis);
template MassRowPasses<2> choose_mass_rows(Basis);
template MassRowPasses<3> choose_mass_rows(Basis);

}  // namespace ordo
