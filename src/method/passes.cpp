#include "method/passes.hpp"

#include "method/passes_of.hpp"
#include "method/tables.hpp"
#include "shape/bspline.hpp"
#include "shape/hat.hpp"

namespace ordo {

#define ORDO_PASSES_OF(D)                                                  \
    extern template Passes<D> passes_of<D, Hat>(const MethodSpec&);        \
    extern template Passes<D> passes_of<D, BSpline<2>>(const MethodSpec&); \
    extern template Passes<D> passes_of<D, BSpline<3>>(const MethodSpec&);
ORDO_PASSES_OF(1)
ORDO_PASSES_OF(2)
ORDO_PASSES_OF(3)
#undef ORDO_PASSES_OF

namespace {

template <int D>
Passes<D> passes_of_basis(const MethodSpec& spec)
{
    switch (spec.basis) {
    case Basis::hat: return passes_of<D, Hat>(spec);
    case Basis::bspline2: return passes_of<D, BSpline<2>>(spec);
    case Basis::bspline3: return passes_of<D, BSpline<3>>(spec);
    case Basis::ddmpm: return passes_of_dual_domain<D>(spec);
    case Basis::bspline4:
    case Basis::bspline5: break;  // only for spline-fit
    }
    throw std::logic_error("choose_passes: unhandled choice");
}

}  // namespace

template <int D>
Passes<D> choose_passes(const MethodSpec& spec)
{
    require_allowed(spec);
    if (spec.quadrature == Quadrature::spline) throw std::logic_error("choose_passes: splines take their steps without passes");
    Passes<D> p    = passes_of_basis<D>(spec);
    p.velocity_fit = choose_velocity_fit<D>(spec);
    p.cell_fit     = choose_cell_fit<D>(spec);

    p.mass_rows_of_points = choose_mass_rows<D>(spec.basis);
    if (spec.domain == Domain::point) p.mass_rows = p.mass_rows_of_points;
    return p;
}

template Passes<1> choose_passes(const MethodSpec&);
template Passes<2> choose_passes(const MethodSpec&);
template Passes<3> choose_passes(const MethodSpec&);

}  // namespace ordo
