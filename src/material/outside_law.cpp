#include "material/outside_law.hpp"

#include "base/error.hpp"
#include "material/elastic_state.hpp"

#include <algorithm>
#include <set>

namespace ordo {

namespace {

/// Never destroyed: what a law holds of an interpreter must not outlive it at the end of the program. Guarded by the mutex.
std::vector<std::unique_ptr<const OutsideLaw>>& kept_laws()
{
    static auto* const laws = new std::vector<std::unique_ptr<const OutsideLaw>>;
    return *laws;
}
std::mutex& mutex_of_laws()
{
    static std::mutex mutex;
    return mutex;
}

/// The last one of this name; null if there is none.
const OutsideLaw* find_kept(std::string_view name)
{
    const auto& added = kept_laws();
    const auto last   = std::find_if(added.rbegin(), added.rend(), [&](const auto& law) { return law->row().name == name; });
    return last == added.rend() ? nullptr : last->get();
}

/// What is stored is the work of the stresses without what a column of that name says is lost to heat.
template <class T>
T stored(const Material& m, const T* history)
{
    T r = history[0];
    for (std::size_t k = 1; k < m.law->history.size(); ++k)
        if (m.law->history[k].name == kDissipated.name) r -= history[k];
    return r;
}

/// A simulation never calls `update`: StressUpdate gives such laws all their particles at once.
template <int D>
LawFunctions<D> functions()
{
    LawFunctions<D> r;
    r.initial_stress = [](const Material&, const Mat<D>&) { return Stress<D>{}; };
    r.start          = [](const Material& m, const Mat<D>&, double* history) {
        for (const HistoryColumn& c : m.law->history) *history++ = c.initial;
    };
    r.update = [](const Material&, const Step<D>&, const Stress<D>& sigma, double*, double&) { return sigma; };
    r.energy = [](const Material& m, const Mat<D>&, const Stress<D>&, double V0, double, const double* history) {
        return V0 * stored(m, history);
    };
    r.energy_of_eight = [](const Material& m, const Mat<D, Lanes>&, const Stress<D, Lanes>&, const Lanes& V0, const Lanes&,
                           const Lanes* history) { return V0 * stored(m, history); };
    return r;
}

}  // namespace

OutsideLaw::OutsideLaw(std::string name, std::string what, std::vector<std::pair<std::string, double>> history)
    : name_(std::move(name)), what_(std::move(what)), history_(std::move(history)), columns_{kWork}
{
    if (history_.size() >= static_cast<std::size_t>(Material::most_history))
        throw InputError(name_ + ": has more than " + std::to_string(Material::most_history - 1) + " columns of state");
    for (const auto& [column, initial] : history_) columns_.push_back({column, "state", initial});
    row_ = {.name            = name_,
            .what            = what_,
            .elasticity      = Elasticity::none,
            .max_dim         = 3,
            .is_hyperelastic = false,
            .carries_stress  = true,  // branches would be lost
            .keeps_volume    = false,
            .parameters      = {},
            .history         = columns_,
            .check           = nullptr,
            .complete        = nullptr,
            .in_1d           = functions<1>(),
            .in_2d           = functions<2>(),
            .in_3d           = functions<3>(),
            .outside         = this};
}

void add_law(std::unique_ptr<const OutsideLaw> law)
{
    for (const LawRow& row : laws())
        if (row.name == law->row().name)
            throw InputError(std::string(row.name) + ": is the name of a law of ordo; give yours another one");
    const std::lock_guard lock(mutex_of_laws());
    kept_laws().push_back(std::move(law));
}

std::vector<const LawRow*> all_laws()
{
    std::vector<const LawRow*> r;
    for (const LawRow& row : laws()) r.push_back(&row);
    const std::lock_guard lock(mutex_of_laws());
    for (const auto& law : kept_laws())
        if (find_kept(law->row().name) == law.get()) r.push_back(&law->row());
    return r;
}

std::size_t version_of_laws()
{
    const std::lock_guard lock(mutex_of_laws());
    return kept_laws().size();
}

const LawRow* find_law(std::string_view name)
{
    for (const LawRow& row : laws())
        if (row.name == name) return &row;
    const std::lock_guard lock(mutex_of_laws());
    const OutsideLaw* const added = find_kept(name);
    return added ? &added->row() : nullptr;
}

const NamedNumbers* keep_numbers(NamedNumbers numbers)
{
    static auto* const kept = new std::set<NamedNumbers>;
    const std::lock_guard lock(mutex_of_laws());
    return &*kept->insert(std::move(numbers)).first;
}

}  // namespace ordo
