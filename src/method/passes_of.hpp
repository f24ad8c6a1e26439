// The passes of one basis: compiled once for each, see passes_*.cpp.
#pragma once

#include "kernels/affine.hpp"
#include "kernels/evolve.hpp"
#include "kernels/gather.hpp"
#include "kernels/sample.hpp"
#include "kernels/scatter.hpp"
#include "method/passes.hpp"
#include "shape/box.hpp"
#include "shape/corners.hpp"
#include "shape/point.hpp"

#include <stdexcept>
#include <type_traits>

namespace ordo {

/// Whether the rules allow only projection mass, shape gradients and lumped mass for a shape.
template <class S>
inline constexpr bool is_plain = false;
template <int D, class Basis>
inline constexpr bool is_plain<Cell<D, Basis, true, true>> = true;
/// Points have their own passes for projections with velocity gradients, see passes_of_points.
template <class S>
inline constexpr bool is_point = false;
template <int D, class Basis, class Slopes>
inline constexpr bool is_point<Point<D, Basis, Slopes>> = true;

/// The passes of a shape whose domains follow `Evolution`: F, or the corners of cells.
template <Shape S, class Basis, class Evolution>
Passes<S::dim> passes_of_shape(const MethodSpec& spec)
{
    constexpr int D = S::dim;
    Passes<D> p{};
    p.project           = scatter<S, MassMomentum<D>>;
    p.force             = scatter<S, Forces<D, false>>;
    p.project_and_force = scatter<S, Forces<D, true>>;
    p.surface_force     = scatter<S, SurfaceForce<D>>;
    p.update_velocity   = gather<S, void, kUpdateVelocity, !is_plain<S>>;
    p.deform            = gather<S, void, kDeform, !is_plain<S>>;
    if constexpr (std::is_same_v<Evolution, OfCorners<S>>) {
        p.update_all = gather<S, void, kUpdateVelocity | kDeform, !is_plain<S>>;
    } else {
        p.move       = gather<S, Evolution, kMove>;
        p.update_all = gather<S, Evolution, kUpdateVelocity | kDeform | kMove>;
    }
    p.evolve       = [](const Sweep<D>& s, int i) { Evolution::apply(s, Batch{i, 1}); };
    p.reach        = [](const Lattice<D>& g, const ParticleView<D>& view, int i) { return S::reach(g, view, Batch{i, 1})[0]; };
    p.max_reach    = S::max_reach;
    p.sample       = sample<S>;
    p.list_weights = list_weights<S>;

    if constexpr (!is_plain<S>) {
        p.apply_mass = apply_mass<S>;
        if (carries_gradient(spec)) p.keep = keep_gradient<S>;
        if (spreads_gradient(spec)) p.project_and_force = nullptr;
        if constexpr (!is_point<S>) {
            if (spreads_gradient(spec)) p.project = project_affine<S>;
            if (spec.projection == Projection::affine) p.keep = keep_affine<S>;
        }
    }
    return p;
}

/// Adds the passes of quadrature points, whose shape is S, and the gradient at cell centres if needed.
template <Shape S, class Basis>
void add_points(const MethodSpec& spec, Passes<S::dim>& p)
{
    constexpr int D            = S::dim;
    p.project_points           = scatter<S, MassMomentum<D>>;
    p.force_points             = scatter<S, Forces<D, false>>;
    p.project_and_force_points = scatter<S, Forces<D, true>>;
    p.apply_mass_points        = apply_mass<S>;
    if (spec.gradient != Gradient::adjoint) return;
    p.gradient_at_center = [](const Lattice<D>& g, const Tiles<D>& tiles, const Lanes* nodes, const Index<D>& cell,
                              Lanes* record) {
        gradient_at_center<D, Basis>(
            g, nodes, cell, [&](const Index<D>& node) { return tiles.is_active(node); }, record);
    };
}

/// The passes of cells: corners move and particles follow.
template <int D, class Basis, bool is_exact, bool is_enriched>
Passes<D> passes_of_cells(const MethodSpec& spec)
{
    using S          = Cell<D, Basis, is_exact, is_enriched>;
    Passes<D> p      = passes_of_shape<S, Basis, OfCorners<S>>(spec);
    p.move_corners   = move_corners<D, Basis, is_enriched>;
    p.follow_corners = follow_corners<S>;
    return p;
}

/// The passes of domain `point`.
template <int D, class Basis>
Passes<D> passes_of_points(const MethodSpec& spec)
{
    Passes<D> p = passes_of_shape<Point<D, Basis>, Basis, Rigid<D>>(spec);
    if constexpr (Basis::degree > 1) {
        if (spec.gradient == Gradient::affine) p = passes_of_shape<AffinePoint<D, Basis>, Basis, Rigid<D>>(spec);
        if (spec.projection == Projection::affine) p.keep = keep_gradient<AffinePoint<D, Basis>>;
        if (spec.projection == Projection::polynomial) {
            p.project           = spec.degree > 1 ? project_modes<D, Basis, 2> : project_modes<D, Basis, 1>;
            p.keep              = spec.degree > 1 ? keep_modes<D, Basis, 2> : keep_modes<D, Basis, 1>;
            p.project_and_force = nullptr;
        }
    }
    if (spreads_gradient(spec)) p.project = scatter<PointWithArms<D, Basis>, AffineMomentum<D>>;
    return p;
}

/// The passes of a basis, for the domain of `spec`.
template <int D, class Basis>
Passes<D> passes_of(const MethodSpec& spec)
{
    Passes<D> p = [&] {
        switch (spec.domain) {
        case Domain::point: return passes_of_points<D, Basis>(spec);
        case Domain::box: return passes_of_shape<Box<D, Basis>, Basis, Rigid<D>>(spec);
        case Domain::stretched_box: return passes_of_shape<Box<D, Basis>, Basis, StretchedBox<D>>(spec);
        case Domain::parallelepiped: return passes_of_shape<Parallelepiped<D, Basis>, Basis, AffineEdges<D>>(spec);
        case Domain::cell:
        case Domain::simplex:
            // Mean weights without enrichment are rare; they use the passes for enriched corners, which find none.
            if (spec.weights == CornerWeights::mean) return passes_of_cells<D, Basis, false, true>(spec);
            return has_enrichment(spec) ? passes_of_cells<D, Basis, true, true>(spec)
                                        : passes_of_cells<D, Basis, true, false>(spec);
        }
        throw std::logic_error("passes_of: unhandled choice");
    }();
    add_points<Point<D, Basis>, Basis>(spec, p);
    return p;
}

/// The passes of basis `ddmpm`.
template <int D>
Passes<D> passes_of_dual_domain(const MethodSpec& spec);

}  // namespace ordo
