// Stresses of a trial step and their derivatives, for implicit steps. The laws are templates on their scalar, so that dual numbers give the
// exact tangent, also of return maps (docs/implicit.md). Nothing is stored with the particles: a step is tried several times.
#pragma once

#include "base/dual.hpp"
#include "kernels/stress.hpp"

namespace ordo {

/// d Pi : d f of a particle, J.
template <int D>
struct Tangent {
    double c[D * D][D * D];  ///< row D a + b of Pi_ab, column D c + d of f_cd

    Mat<D> operator*(const Mat<D>& df) const
    {
        Mat<D> r{};
        for (int i = 0; i < D * D; ++i)
            for (int j = 0; j < D * D; ++j) r(i / D, i % D) += c[i][j] * df(j / D, j % D);
        return r;
    }
};

/// A trial step of all particles.
template <int D>
struct TrialStep {
    ParticleView<D> p;  ///< at the start of the step
    const Material* materials;
    double dt;            ///< s
    bool is_middle;       ///< stresses over the step that do the work which the material takes, else those at its end
    const Mat<D>* f;      ///< deformation gradients of the step
    Mat<D>* stress;       ///< Pi = V P, J, with the nominal stress P with respect to the start of the step and the volume V there
    Tangent<D>* tangent;  ///< its derivatives, if not null
};

/// The columns of a material's history in the particles, in its order, see history_of.
template <int D>
using NominalPass = void (*)(const TrialStep<D>&, int material, const int* columns, int begin, int end, TileReport&);

/// The pass for a law of the table; null for laws from outside, which have no derivatives.
template <int D>
NominalPass<D> find_nominal_pass(const LawRow& law);

/// Stress and energy after a step of a material, with its branches: `history` becomes that after the step.
template <Law L, int D>
struct MaterialStep {
    L law;
    Branches branches;
    HistoryLayout at;
    /// Whether the law tells what it stores and what is lost, so that their sum is the work of stresses.
    static constexpr bool has_energy = !Incremental<L>;

    template <class T>
    ORDO_FLAT Stress<D, T> stress(const Step<D, T>& step, const Stress<D, T>& before, T* history, T& fault) const
    {
        Stress<D, T> sigma;
        if constexpr (Hyperelastic<L>)
            sigma = law.cauchy(step.F);
        else if constexpr (Inelastic<L>)
            sigma = law.update(step, history, fault);
        else
            sigma = law.update(step, before, history);
        if (branches.count == 0) return sigma;
        Symmetric<D, T> tau = isotropic<D>(T(0.0));
        for (int k = 0; k < branches.count; ++k)
            tau += relax(branches.shear[k], branches.time[k], step, history + at.first_branch + k * Symmetric<D>::size,
                         history[at.dissipated]);
        return sigma + cauchy_of(tau, step.F);
    }
    /// What is stored and what has been lost, per initial volume, J/m^D.
    template <class T>
    ORDO_FLAT T energy(const Mat<D, T>& F, const T* history) const
    {
        T r(0.0);
        if constexpr (Hyperelastic<L>) r = law.energy(F);
        if constexpr (Inelastic<L>) r = law.energy(F, history);
        if (at.dissipated < at.size) r += history[at.dissipated];
        for (int k = 0; k < branches.count; ++k) {
            const T* b = history + at.first_branch + k * Symmetric<D>::size;
            r += T(branches.shear[k]) * square(hencky_strain(read_symmetric<D>(b)).dev);
        }
        return r;
    }
};

/// The stress of a step with respect to its start, per volume there, that acts on x_n + u/2: half of those before and after, both as second
/// Piola-Kirchhoff stresses, and the multiple of the strain E = (f^T f - I)/2 that makes its work what the material takes (Gonzalez 2000,
/// CMAME 190:1763). Symmetric between x_n and x_n + u, so angular momentum is kept too (Simo & Tarnow 1992, ZAMP 43:757).
template <int D, class T>
ORDO_FLAT inline Mat<D, T> mean_stress(const Mat<D, T>& f, const Mat<D, T>& before, const Mat<D, T>& after, const T& taken,
                                       bool has_energy)
{
    constexpr double least =
        1e-10;  // squared strain of a step: below it energies do not tell their difference, and the mean is good to 1e-10
    const Mat<D, T> cof = cofactor(f), I = Mat<D, T>::identity();
    Mat<D, T> S       = T(0.5) * (before + T(1.0) / det(f) * (transpose(cof) * after * cof));
    const Mat<D, T> E = T(0.5) * (transpose(f) * f - I);
    if (has_energy) {
        const T square = ddot(E, E), large = square - T(least);
        S += choose(large, (taken - ddot(S, E)) / choose(large, square, T(1.0)), T(0.0)) * E;
    }
    return T(0.5) * (I + f) * S;
}

/// Pi of a batch of particles of one material with the history `had`, for a seeded f.
template <Law L, int D>
Mat<D, Dual<Lanes>> nominal_stress(const TrialStep<D>& s, const MaterialStep<L, D>& m, const Batch& b, const Dual<Lanes>* had,
                                   const Mat<D, Dual<Lanes>>& f, Dual<Lanes>& fault)
{
    using T                       = Dual<Lanes>;
    const Mat<D, Lanes> F_n       = load(s.p.F, b);
    const Stress<D, Lanes> before = load(s.p.sigma, b);
    Mat<D, T> F_old;
    for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) F_old(i, j) = T(F_n(i, j));
    Stress<D, T> sigma_old;
    for (int k = 0; k < sigma_old.size; ++k) sigma_old.c[k] = T(before.c[k]);
    T history[Material::most_history + 1];
    for (int k = 0; k < m.at.size; ++k) history[k] = had[k];
    const T J(det(F_n)), volume = T(load(s.p.V0, b)) * J;
    const Step<D, T> step{f * F_old, f - Mat<D, T>::identity(), s.dt};
    const Mat<D, T> after = in_plane(m.stress(step, sigma_old, history, fault));
    if (!s.is_middle) return volume * (after * cofactor(f));
    const T taken = (m.energy(step.F, history) - m.energy(F_old, had)) / J;
    return volume * mean_stress(f, in_plane(sigma_old), after, taken, m.has_energy);
}

/// Pi, and its derivatives if they are wanted, of those particles of [begin, end) that have the material. Values are those of dual numbers
/// too: the same functions with Lanes are those of the explicit step, which is compiled for speed.
template <Law L, int D>
void find_nominal_stress(const TrialStep<D>& trial, int material, const int* columns, int begin, int end, TileReport& out)
{
    const TrialStep<D> s   = trial;
    const Material& m      = s.materials[material];
    const HistoryLayout at = history_layout<D>(m);
    const MaterialStep<L, D> step{L::of(m), m.branches, at};
    TileReport report = out;
    Batch b{};
    for (int first = begin; first < end; first += b.count) {
        b = batch_of_material(s.p.material, first, end);
        if (s.p.material[first] != material) continue;
        Dual<Lanes> had[Material::most_history + 1];
        for (int k = 0; k < at.size; ++k) had[k] = Dual<Lanes>(load(s.p.history[columns[k]].data(), b));
        const Mat<D, Lanes> f = load(s.f, b);
        for (int j = 0; j < (s.tangent ? D * D : 1); ++j) {
            Mat<D, Dual<Lanes>> seeded;
            for (int i = 0; i < D * D; ++i) seeded(i / D, i % D) = {f(i / D, i % D), Lanes(i == j ? 1.0 : 0.0)};
            Dual<Lanes> fault(0.0);
            const Mat<D, Dual<Lanes>> Pi = nominal_stress(s, step, b, had, seeded, fault);
            if (s.tangent)
                for (int k = 0; k < b.count; ++k)
                    for (int i = 0; i < D * D; ++i) s.tangent[b.first + k].c[i][j] = Pi(i / D, i % D).slope[k];
            if (j > 0) continue;
            Mat<D, Lanes> value;
            for (int i = 0; i < D * D; ++i) value(i / D, i % D) = Pi(i / D, i % D).value;
            store(s.stress, b, value);
            report_lanes(-1.0 * fault.value, b, report, [](int) { return Fault::not_solved; });
            report_lanes(0.0 * ddot(value, value), b, report, [](int) { return Fault::not_finite; });
        }
    }
    out = report;
}

}  // namespace ordo
