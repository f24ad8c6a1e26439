// Maxwell branches beside a law: viscoelastic deviatoric stresses, each with an elastic state of its own that relaxes. And what
// methods need of a material as a whole, its law and its branches: history, stress, energy, stiffness.
#pragma once

#include "material/elastic_state.hpp"

#include <string>
#include <vector>

namespace ordo {

/// The places of a material's numbers in its history: those of the law, then, with branches, a place for `dissipated` if the law has
/// none, then b_e of each branch.
struct HistoryLayout {
    int of_law, dissipated, first_branch, size;
};
template <int D>
HistoryLayout history_layout(const Material& m)
{
    HistoryLayout r{};
    r.of_law     = column_count(m.law->history, D);
    r.dissipated = 0;
    while (r.dissipated < r.of_law && m.law->history[static_cast<std::size_t>(r.dissipated)].name != kDissipated.name)
        ++r.dissipated;
    const bool has_own = r.dissipated < r.of_law;
    r.first_branch     = r.of_law + (m.branches.count > 0 && !has_own ? 1 : 0);
    r.size             = r.first_branch + m.branches.count * Symmetric<D>::size;
    return r;
}

/// The columns of a material's history in D dimensions, in this order.
std::vector<HistoryColumn> history_of(const Material& m, int dim);

/// A branch over a step: its Kirchhoff stress 2 G dev eps, Pa, at the end. eps = (ln b)/2 follows the deformation and its deviator
/// relaxes, eps' = -dev eps/T: by half of the step before the deformation and by half after it (Strang 1968), which is of second
/// order, exact at rest and objective. Adds what is lost to `dissipated`. Reese & Govindjee (1998), IJSS 35:3455, with the logarithmic
/// strain.
template <int D, class T>
ORDO_FLAT inline Symmetric<D, T> relax(double shear, double time, const Step<D, T>& step, T* b, T& dissipated)
{
    const double keep     = std::exp(-step.dt / (2 * time));
    HenckyStrain<D, T> e  = hencky_strain(read_symmetric<D>(b));
    const T before        = square(e.dev);
    e.dev                 = T(keep) * e.dev;
    HenckyStrain<D, T> at = hencky_strain(pushed(step.G, stretched(e)));
    dissipated += T(shear * (1 - keep * keep)) * (before + square(at.dev));
    at.dev = T(keep) * at.dev;
    write_symmetric(stretched(at), b);
    return T(2 * shear) * at.dev;
}

/// Sets the history at the start, at a deformation F: branches have not relaxed.
template <int D>
void start_history(const Material& m, const Mat<D>& F, double* history);
/// The initial stress at a deformation F, Pa.
template <int D>
Stress<D> initial_stress(const Material& m, const Mat<D>& F);
/// Whether a stress may be given at the same F, see set_stress.
template <int D>
bool can_have_stress(const Material& m)
{
    return m.law->in<D>().set_stress != nullptr;
}
/// Changes the history of the law so that law and branches together have the stress sigma, Pa, at F; false if the law cannot.
template <int D>
bool set_stress(const Material& m, const Mat<D>& F, const Stress<D>& sigma, double* history);
/// The stress after a step of one particle, see LawFunctions::update.
template <int D>
Stress<D> update_stress(const Material& m, const Step<D>& step, const Stress<D>& sigma, double* history, double& fault);
/// Stored energy, J, of one particle or of eight, of volume V (initial V0).
template <int D, class T>
T stored_energy(const Material& m, const Mat<D, T>& F, const Stress<D, T>& sigma, const T& V0, const T& V, const T* history);
/// The current stiffness.
template <int D>
Stiffness stiffness(const Material& m, const Mat<D>& F, const double* history);
/// Whether that may differ from the stiffness at rest.
template <int D>
bool changes_stiffness(const Material& m)
{
    return m.law->in<D>().stiffness != nullptr;
}

}  // namespace ordo
