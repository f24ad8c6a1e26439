// The stress update: stress and history from F and the displacement gradient of the step, which a gather has left. One pass
// per law, over the particles that have it.
#pragma once

#include "kernels/gather.hpp"
#include "material/branches.hpp"

#include <vector>

namespace ordo {

/// The pass of a law, for those particles of [begin, end) whose material has it. `columns` are the numbers of its history columns.
template <int D>
using StressPass = void (*)(const Sweep<D>&, const LawRow& law, const int* columns, int begin, int end, TileReport&);

/// The pass of a law of the table.
template <int D>
StressPass<D> find_stress_pass(const LawRow& law);

/// Up to eight particles of one material, from `first` on.
ORDO_FLAT inline Batch batch_of_material(const std::int32_t* material, int first, int end)
{
    const Batch b = Batch::of(first, end);
    int count     = 1;
    while (count < b.count && material[first + count] == material[first]) ++count;
    return {first, count};
}

/// sigma_p and the history of the particles [begin, end) whose material has the law L.
template <Law L, int D>
void update_stress(const Sweep<D>& sweep, const LawRow& row, const int* columns, int begin, int end, TileReport& out)
{
    constexpr int columns_of_law = column_count(L::history, D);
    const Sweep<D> s             = sweep;
    TileReport report            = out;
    Batch b{};
    for (int first = begin; first < end; first += b.count) {
        b                 = batch_of_material(s.p.material, first, end);
        const Material& m = s.materials[s.p.material[first]];
        if (m.law != &row) continue;
        const L law           = L::of(m);
        const Mat<D, Lanes> F = load(s.p.F, b);
        Stress<D, Lanes> sigma;
        if constexpr (Hyperelastic<L>) {
            sigma = law.cauchy(F);
        } else {
            const Mat<D, Lanes> G = load(s.increments, Batch{b.first - s.increment_first, b.count});
            Lanes history[columns_of_law + 1];  // C++ has no arrays of length 0
            for (int k = 0; k < columns_of_law; ++k) history[k] = load(s.p.history[columns[k]].data(), b);
            const Step<D, Lanes> step{F, G, s.dt, s.p.q ? load(s.p.q, b) : Lanes{}};
            if constexpr (Inelastic<L>) {
                Lanes fault(0.0);
                sigma = law.update(step, history, fault);
                report_lanes(-1.0 * fault, b, report, [](int) { return Fault::not_solved; });
            } else {
                sigma = law.update(step, load(s.p.sigma, b), history);
            }
            for (int k = 0; k < columns_of_law; ++k) store(s.p.history[columns[k]].data(), b, history[k]);
        }
        store(s.p.sigma, b, sigma);
        report_lanes(0.0 * trace(sigma), b, report, [](int) { return Fault::not_finite; });
    }
    out = report;
}

/// Adds the stresses of a material's branches to sigma_p of its particles in [begin, end). `columns`: the numbers of the column
/// `dissipated` and of those of b_e.
template <int D>
void update_branches(const Sweep<D>& sweep, const Branches& branches, int material, const int* columns, int begin, int end)
{
    constexpr int size = Symmetric<D>::size;
    const Sweep<D> s   = sweep;
    Batch b{};
    for (int first = begin; first < end; first += b.count) {
        b = batch_of_material(s.p.material, first, end);
        if (s.p.material[first] != material) continue;
        const Step<D, Lanes> step{load(s.p.F, b), load(s.increments, Batch{b.first - s.increment_first, b.count}), s.dt};
        Lanes dissipated        = load(s.p.history[columns[0]].data(), b), state[size];
        Symmetric<D, Lanes> tau = isotropic<D>(Lanes(0.0));
        for (int k = 0; k < branches.count; ++k) {
            const int* own = columns + 1 + k * size;
            for (int c = 0; c < size; ++c) state[c] = load(s.p.history[own[c]].data(), b);
            tau += relax(branches.shear[k], branches.time[k], step, state, dissipated);
            for (int c = 0; c < size; ++c) store(s.p.history[own[c]].data(), b, state[c]);
        }
        store(s.p.history[columns[0]].data(), b, dissipated);
        store(s.p.sigma, b, load(s.p.sigma, b) + cauchy_of(tau, step.F));
    }
}

}  // namespace ordo
