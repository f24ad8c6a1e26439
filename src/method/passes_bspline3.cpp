#include "method/passes_of.hpp"
#include "shape/bspline.hpp"

namespace ordo {

template Passes<1> passes_of<1, BSpline<3>>(const MethodSpec&);
template Passes<2> passes_of<2, BSpline<3>>(const MethodSpec&);
template Passes<3> passes_of<3, BSpline<3>>(const MethodSpec&);

}  // namespace ordo
