#include "method/stress_update.hpp"

#include "method/state.hpp"

#include <algorithm>

namespace ordo {

template <int D>
StressUpdate<D>::StressUpdate(const std::vector<Material>& materials, const ArtificialViscosity& viscosity)
    : viscosity_(viscosity), needs_increments_(viscosity.is_on())
{
    const std::vector<std::string> columns = history_columns(materials, D);
    for (const Material& m : materials) {
        if (std::any_of(laws_.begin(), laws_.end(), [&](const OfLaw& other) { return other.law == m.law; })) continue;
        OfLaw& one = laws_.emplace_back(OfLaw{m.law, find_stress_pass<D>(*m.law), {}});
        for (const HistoryColumn& c : m.law->history.first(column_count(m.law->history, D)))
            one.columns.push_back(static_cast<int>(std::find(columns.begin(), columns.end(), c.name) - columns.begin()));
        needs_increments_ = needs_increments_ || !m.law->is_hyperelastic;
    }
    for (std::size_t k = 0; k < materials.size(); ++k) {
        const Material& m = materials[k];
        if (m.branches.count == 0) continue;
        const std::vector<HistoryColumn> own = history_of(m, D);
        const HistoryLayout at               = history_layout<D>(m);
        OfBranches& one                      = branches_.emplace_back(OfBranches{m.branches, static_cast<int>(k), {}});
        auto add                             = [&](int place) {
            const auto found = std::find(columns.begin(), columns.end(), own[static_cast<std::size_t>(place)].name);
            one.columns.push_back(static_cast<int>(found - columns.begin()));
        };
        add(at.dissipated);
        for (int place = at.first_branch; place < at.size; ++place) add(place);
        needs_increments_ = true;
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
        update(s, first, last, report);
    }
}

template <int D>
void StressUpdate<D>::update(const Sweep<D>& s, int begin, int end, TileReport& report) const
{
    for (const OfLaw& one : laws_) one.pass(s, *one.law, one.columns.data(), begin, end, report);
    for (const OfBranches& one : branches_) update_branches(s, one.branches, one.material, one.columns.data(), begin, end);
    if (viscosity_.is_on() && s.dt > 0)
        update_artificial_pressure(s, viscosity_, begin, end);  // after the laws, which take the old one
}

template <int D>
void start_stresses(const std::vector<Material>& materials, Particles<D>& p)
{
    parallel_for_each(p.count, [&](std::ptrdiff_t i) {
        const Material& m = materials[p.material[i]];
        double history[Material::most_history];
        start_history(m, p.F[i], history);
        const bool is_given = !(p.sigma[i] == Stress<D>{}) && can_have_stress<D>(m) && set_stress(m, p.F[i], p.sigma[i], history);
        if (!is_given) p.sigma[i] = initial_stress(m, p.F[i]);
        int k = 0;
        for (const HistoryColumn& c : history_of(m, D)) p.history[p.history_column(c.name)][i] = history[k++];
    });
}

#define ORDO_STRESS_UPDATE(D)       \
    template class StressUpdate<D>; \
    template void start_stresses(const std::vector<Material>&, Particles<D>&);
ORDO_STRESS_UPDATE(1)
ORDO_STRESS_UPDATE(2)
ORDO_STRESS_UPDATE(3)
#undef ORDO_STRESS_UPDATE

}  // namespace ordo
