// The passes of one basis: compiled once for each, see passes_*.cpp.
#pragma once

#include "kernels/evolve.hpp"
#include "kernels/gather.hpp"
#include "kernels/scatter.hpp"
#include "method/passes.hpp"
#include "shape/box.hpp"
#include "shape/corners.hpp"
#include "shape/dual_domain.hpp"
#include "shape/point.hpp"

#include <stdexcept>

namespace ordo {

/// The passes of a shape whose domains follow F by `Evolution`.
template <Shape S, class Basis, class Evolution>
Passes<S::dim> passes_of_shape()
{
    constexpr int D = S::dim;
    Passes<D> p{};
    p.project           = scatter<S, MassMomentum<D>>;
    p.force             = scatter<S, InternalForce<D>, ExternalForce<D>>;
    p.project_and_force = scatter<S, MassMomentum<D>, InternalForce<D>, ExternalForce<D>>;
    p.apply_mass        = apply_mass<S>;
    p.update_velocity   = gather<S, Evolution, kUpdateVelocity>;
    p.update_stress     = gather<S, Evolution, kUpdateStress>;
    p.stress_of_past    = gather<S, Evolution, kUpdateStress | kStressOfPast>;
    p.move              = gather<S, Evolution, kMove>;
    p.velocity_and_move = gather<S, Evolution, kUpdateVelocity | kMove>;
    p.update_all        = gather<S, Evolution, kUpdateVelocity | kUpdateStress | kMove>;
    p.evolve            = Evolution::apply;
    p.reach             = S::reach;
    p.max_reach         = S::max_reach;
    p.interpolate       = interpolate<D, Basis>;
    return p;
}

/// The passes of cells: corners move, particles follow.
template <Shape S, class Basis>
Passes<S::dim> passes_of_cells()
{
    constexpr int D     = S::dim;
    Passes<D> p         = passes_of_shape<S, Basis, OfCorners<S>>();
    p.move              = nullptr;
    p.velocity_and_move = p.update_velocity;
    p.update_all        = gather<S, OfCorners<S>, kUpdateVelocity | kUpdateStress>;
    p.move_corners      = move_corners<D, Basis>;
    p.follow_corners    = follow_corners<S>;
    return p;
}

/// The passes of a basis and the domain of `spec`.
template <int D, class Basis>
Passes<D> passes_of(const MethodSpec& spec)
{
    switch (spec.domain) {
    case Domain::point: return passes_of_shape<Point<D, Basis>, Basis, Rigid<D>>();
    case Domain::box: return passes_of_shape<Box<D, Basis>, Basis, Rigid<D>>();
    case Domain::stretched_box: return passes_of_shape<Box<D, Basis>, Basis, StretchedBox<D>>();
    case Domain::parallelepiped: return passes_of_shape<Parallelepiped<D, Basis>, Basis, AffineEdges<D>>();
    case Domain::cell:
    case Domain::simplex:
        return spec.weights == CornerWeights::exact ? passes_of_cells<Cell<D, Basis, true>, Basis>()
                                                    : passes_of_cells<Cell<D, Basis, false>, Basis>();
    }
    throw std::logic_error("passes_of: unhandled choice");
}

}  // namespace ordo
