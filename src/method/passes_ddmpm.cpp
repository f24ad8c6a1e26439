#include "method/passes_of.hpp"
#include "shape/dual_domain.hpp"

namespace ordo {

template <int D>
Passes<D> passes_of_dual_domain(const MethodSpec& spec)
{
    Passes<D> p         = passes_of_shape<DualDomain<D>, Hat, Rigid<D>>(spec);
    p.project_and_force = nullptr;  // its gradients need the nodal masses
    add_points<DualDomain<D>, Hat>(spec, p);
    p.project_and_force_points = nullptr;
    return p;
}

template Passes<1> passes_of_dual_domain(const MethodSpec&);
template Passes<2> passes_of_dual_domain(const MethodSpec&);
template Passes<3> passes_of_dual_domain(const MethodSpec&);

}  // namespace ordo
