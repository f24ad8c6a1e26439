// The stress update: stress and history from F and the displacement gradient of the step, which a gather has left. One pass
// per law, over the particles that have it.
#pragma once

#include "kernels/gather.hpp"
#include "material/law.hpp"

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

}  // namespace ordo
