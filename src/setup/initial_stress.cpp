#include "setup/initial_stress.hpp"

#include "method/place.hpp"

#include <fmt/format.h>

#include <cmath>

namespace ordo::setup {

namespace {

[[noreturn]] void fail(int k, std::string_view key, std::string_view why) { throw SetupError(Part::body, k, key, why); }

template <int D>
const char* key_of(const InitialStress<D>& s)
{
    return s.k0 ? "k0" : "initial_stress";
}

template <int D>
std::string text_of(const Stress<D>& s)
{
    std::string r = fmt::format("{:.4g}, {:.4g}, {:.4g}", s.c[0], s.c[1], s.c[2]);
    for (int k = 3; k < Stress<D>::size; ++k) r += fmt::format(", {:.4g}", s.c[k]);
    return r + (D == 1 ? " Pa (xx, yy, zz)" : D == 2 ? " Pa (xx, yy, zz, xy)" : " Pa (xx, yy, zz, xy, yz, zx)");
}

/// Throws if the law of a body cannot have the stress of a particle without deformation: its elasticity must reach it, and a step
/// of no length must not return it to a yield surface.
template <int D>
void require_possible(const CaseSpec<D>& spec, int k, const Stress<D>& sigma, const Vec<D>& x)
{
    const BodySpec<D>& b = spec.bodies[k];
    const Material& m    = spec.materials[b.material];
    if (!can_have_stress<D>(m))
        fail(k, key_of(b.stress),
             fmt::format(
                 "needs a law whose stress may differ at the same deformation; that of {} is a function of F: use one that "
                 "carries elastic strain (j2, drucker-prager, mohr-coulomb, cam-clay) or stress (jaumann-elastic), or let "
                 "gravity act in a [[stage]] with damping",
                 m.law->name));
    constexpr double tolerance = 1e-9;                        // round-off of a return map at a stress on the yield surface
    const double least         = 1e-12 * m.p_wave_modulus();  // round-off of strains
    const Mat<D> F             = Mat<D>::identity();
    double history[Material::most_history], fault = 0.0;
    start_history(m, F, history);
    if (!set_stress(m, F, sigma, history))
        fail(k, key_of(b.stress),
             fmt::format("gives {} at {}, which the elasticity of {} cannot have; take another stress or law", text_of(sigma),
                         place_text(x), m.law->name));
    const Stress<D> error = update_stress(m, Step<D>{F, {}, 0.0}, sigma, history, fault) + sigma * -1.0;
    if (fault > 0 || !(square(error) <= tolerance * tolerance * square(sigma) + least * least))
        fail(k, key_of(b.stress),
             fmt::format("gives {} at {}, outside the yield surface of {}; a ratio nearer to 1 or more strength lies inside",
                         text_of(sigma), place_text(x), m.law->name));
}

}  // namespace

template <int D>
Vertical vertical_of(const CaseSpec<D>& spec, int k)
{
    Vertical r;
    int count = 0;
    for (int a = 0; a < D; ++a)
        if (spec.gravity[a] != 0.0) {
            r = {a, spec.gravity[a] < 0 ? 1.0 : -1.0};
            ++count;
        }
    if (count != 1) fail(k, "k0", "needs gravity along one axis; give it, or initial_stress");
    return r;
}

template <int D>
Stress<D> initial_stress(const CaseSpec<D>& spec, int k, double top, const Vec<D>& x)
{
    const BodySpec<D>& b = spec.bodies[k];
    Stress<D> r{};
    if (b.stress.uniform) return *b.stress.uniform;
    const Vertical up    = vertical_of(spec, k);
    const double surface = b.stress.surface ? up.sign * *b.stress.surface : top, depth = surface - up.sign * x[up.axis];
    if (!(depth >= 0))
        fail(k, "surface",
             fmt::format("{} lies below the particle at {}; it is the ground above the body", up.sign * surface, place_text(x)));
    const double weight = spec.materials[b.material].density * std::fabs(spec.gravity[up.axis]) * depth;
    for (int a = 0; a < 3; ++a) r(a, a) = -(weight + b.stress.overburden) * (a == up.axis ? 1.0 : *b.stress.k0);
    return r;
}

template <int D>
void set_initial_stress(const CaseSpec<D>& spec, int k, double top, int begin, int end, Particles<D>& p)
{
    if (!spec.bodies[k].stress.is_given()) return;
    for (int i = begin; i < end; ++i) {
        p.sigma[i] = initial_stress(spec, k, top, p.x[i]);
        require_possible(spec, k, p.sigma[i], p.x[i]);
    }
}

#define ORDO_INITIAL_STRESS(D)                                                         \
    template Vertical vertical_of(const CaseSpec<D>&, int);                            \
    template Stress<D> initial_stress(const CaseSpec<D>&, int, double, const Vec<D>&); \
    template void set_initial_stress(const CaseSpec<D>&, int, double, int, int, Particles<D>&);
ORDO_INITIAL_STRESS(1)
ORDO_INITIAL_STRESS(2)
ORDO_INITIAL_STRESS(3)
#undef ORDO_INITIAL_STRESS

}  // namespace ordo::setup
