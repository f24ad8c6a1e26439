#include "method/passes_of.hpp"
#include "shape/hat.hpp"

namespace ordo {

template Passes<1> passes_of<1, Hat>(const MethodSpec&);
template Passes<2> passes_of<2, Hat>(const MethodSpec&);
template Passes<3> passes_of<3, Hat>(const MethodSpec&);

}  // namespace ordo
