#include "method/passes.hpp"

#include "kernels/evolve.hpp"
#include "kernels/gather.hpp"
#include "kernels/scatter.hpp"
#include "shape/box.hpp"
#include "shape/corners.hpp"
#include "shape/point.hpp"

#include <stdexcept>

namespace ordo {

namespace {

template <Shape S, class Evolution>
struct ShapeAndEvolution {
    using shape     = S;
    using evolution = Evolution;
};

/// f(ShapeAndEvolution) for the basis and the domain of a method.
template <int D, class F>
auto with_domain(const MethodSpec& spec, F&& f)
{
    switch (spec.basis) {
    case Basis::hat:
        switch (spec.domain) {
        case Domain::point: return f(ShapeAndEvolution<Point<D, Hat>, Rigid<D>>{});
        case Domain::box: return f(ShapeAndEvolution<Box<D>, Rigid<D>>{});
        case Domain::stretched_box: return f(ShapeAndEvolution<Box<D>, StretchedBox<D>>{});
        case Domain::parallelepiped: return f(ShapeAndEvolution<Parallelepiped<D, Hat>, AffineEdges<D>>{});
        }
    }
    throw std::logic_error("with_domain: unhandled choice");
}

}  // namespace

template <int D>
Passes<D> choose_passes(const MethodSpec& spec, bool body_force)
{
    return with_domain<D>(spec, [&](auto choice) {
        using S = typename decltype(choice)::shape;
        using E = typename decltype(choice)::evolution;
        Passes<D> p{};
        p.project = scatter<S, MassMomentum<D>>;
        if (body_force) {
            p.force             = scatter<S, InternalForce<D>, BodyForce<D>>;
            p.project_and_force = scatter<S, MassMomentum<D>, InternalForce<D>, BodyForce<D>>;
        } else {
            p.force             = scatter<S, InternalForce<D>>;
            p.project_and_force = scatter<S, MassMomentum<D>, InternalForce<D>>;
        }
        p.update_velocity   = gather<S, E, kUpdateVelocity>;
        p.update_stress     = gather<S, E, kUpdateStress>;
        p.stress_of_past    = gather<S, E, kUpdateStress | kStressOfPast>;
        p.move              = gather<S, E, kMove>;
        p.velocity_and_move = gather<S, E, kUpdateVelocity | kMove>;
        p.update_all        = gather<S, E, kUpdateVelocity | kUpdateStress | kMove>;
        p.evolve            = E::apply;
        return p;
    });
}

template <int D>
DomainReach reach_of(const MethodSpec& spec, const Lattice<D>& lattice, const ParticleView<D>& p, int i)
{
    return with_domain<D>(spec, [&](auto choice) {
        using S = typename decltype(choice)::shape;
        return DomainReach{S::reach(lattice, p, i), S::max_reach};
    });
}

template Passes<1> choose_passes(const MethodSpec&, bool);
template Passes<2> choose_passes(const MethodSpec&, bool);
template Passes<3> choose_passes(const MethodSpec&, bool);
template DomainReach reach_of(const MethodSpec&, const Lattice<1>&, const ParticleView<1>&, int);
template DomainReach reach_of(const MethodSpec&, const Lattice<2>&, const ParticleView<2>&, int);
template DomainReach reach_of(const MethodSpec&, const Lattice<3>&, const ParticleView<3>&, int);

}  // namespace ordo
