#include "method/stress_update.hpp"

#include "method/state.hpp"

#include <algorithm>

namespace ordo {

template <int D>
StressUpdate<D>::StressUpdate(const std::vector<Material>& materials)
{
    const std::vector<std::string> columns = history_columns(materials, D);
    for (const Material& m : materials) {
        if (std::any_of(laws_.begin(), laws_.end(), [&](const OfLaw& other) { return other.law == m.law; })) continue;
        OfLaw& one = laws_.emplace_back(OfLaw{m.law, find_stress_pass<D>(*m.law), {}});
        for (const HistoryColumn& c : m.law->history.first(column_count(m.law->history, D)))
            one.columns.push_back(static_cast<int>(std::find(columns.begin(), columns.end(), c.name) - columns.begin()));
        needs_increments_ = needs_increments_ || !m.law->is_hyperelastic;
    }
}

template <int D>
void StressUpdate<D>::operator()(typename Passes<D>::Gather deform, const Sweep<D>& sweep, int begin, int end,
                                 TileReport& report) const
{
    constexpr int piece = 16 * Batch::size;  // F and increments of a piece fit in first-level cache
    Mat<D> increments[piece];
    Sweep<D> s = sweep;
    if (needs_increments_) s.increments = increments;
    for (int first = begin; first < end; first += piece) {
        const int last    = std::min(first + piece, end);
        s.increment_first = first;
        deform(s, first, last, report);
        for (const OfLaw& one : laws_) one.pass(s, *one.law, one.columns.data(), first, last, report);
    }
}

template <int D>
void start_stresses(const std::vector<Material>& materials, Particles<D>& p)
{
    for (int i = 0; i < p.count; ++i) {
        const Material& m          = materials[p.material[i]];
        const LawFunctions<D>& law = m.law->in<D>();
        double history[Material::most_history];
        law.start(m, p.F[i], history);
        const bool is_given = !(p.sigma[i] == Stress<D>{}) && law.set_stress && law.set_stress(m, p.F[i], p.sigma[i], history);
        if (!is_given) p.sigma[i] = law.initial_stress(m, p.F[i]);
        int k = 0;
        for (const HistoryColumn& c : m.law->history.first(column_count(m.law->history, D)))
            p.history[p.history_column(c.name)][i] = history[k++];
    }
}

#define ORDO_STRESS_UPDATE(D)       \
    template class StressUpdate<D>; \
    template void start_stresses(const std::vector<Material>&, Particles<D>&);
ORDO_STRESS_UPDATE(1)
ORDO_STRESS_UPDATE(2)
ORDO_STRESS_UPDATE(3)
#undef ORDO_STRESS_UPDATE

}  // namespace ordo
