#include "material/laws.hpp"

namespace ordo {

namespace {

/// Stored energy, J, of one particle or of eight, of volume V (initial V0).
template <class L, int D, class T>
T energy_of(const Material& m, const Mat<D, T>& F, const Stress<D, T>& sigma, const T& V0, const T& V, const T* history)
{
    const L law = L::of(m);
    if constexpr (Hyperelastic<L>)
        return V0 * law.energy(F);
    else if constexpr (Inelastic<L>)
        return V0 * law.energy(F, history);
    else
        return V * law.energy(sigma, history);
}

/// The initial values of the columns, then what the law makes of F.
template <class L, int D>
void start_of(const Material& m, const Mat<D>& F, double* history)
{
    int k = 0;
    for (const HistoryColumn& c : L::history)
        if (c.min_dim <= D) history[k++] = c.initial;
    if constexpr (Inelastic<L>) L::of(m).start(F, history);
}

template <class L, int D>
Stress<D> initial_stress_of(const Material& m, const Mat<D>& F)
{
    if constexpr (Hyperelastic<L>) {
        return L::of(m).cauchy(F);
    } else if constexpr (Inelastic<L>) {
        double history[Material::most_history];
        start_of<L>(m, F, history);
        return L::of(m).stress(F, history);
    } else {
        return {};
    }
}

template <class L, int D>
Stress<D> update_of(const Material& m, const Step<D>& step, const Stress<D>& sigma, double* history, double& fault)
{
    const L law = L::of(m);
    if constexpr (Hyperelastic<L>)
        return law.cauchy(step.F);
    else if constexpr (Inelastic<L>)
        return law.update(step, history, fault);
    else
        return law.update(step, sigma, history);
}

/// An inelastic law with an elasticity that finds the strain of a stress, and b_e from column kB on.
template <class L>
concept CarriesElasticStrain = Inelastic<L> && requires(const L law, const Symmetric<1>& tau)
{
    {
        law.elastic.strain(tau)
        } -> std::same_as<HenckyStrain<1>>;
    L::kB;
};

/// b_e = exp(2 eps) with the elastic strain eps of tau = J sigma.
template <class L, int D>
bool set_stress_of(const Material& m, const Mat<D>& F, const Stress<D>& sigma, double* history)
{
    constexpr double tolerance =
        1e-9;  // of the stress: round-off of strains far below 1 at stresses above this part of the moduli
    const L law = L::of(m);
    write_symmetric(stretched(law.elastic.strain(sigma * det(F))), history + L::kB);
    const Stress<D> error = law.stress(F, history) + sigma * -1.0;
    return square(error) <= tolerance * tolerance * square(sigma) + 1e-24 * m.p_wave_modulus() * m.p_wave_modulus();
}

template <class L, int D>
LawFunctions<D> functions_of()
{
    LawFunctions<D> r;
    if constexpr (D <= L::max_dim) {
        r.initial_stress = initial_stress_of<L, D>;
        r.start          = start_of<L, D>;
        r.update         = update_of<L, D>;
        if constexpr (Hyperelastic<L>)
            r.stress_rate = [](const Material&, const Stress<D>&, const Mat<D>&) { return Stress<D>{}; };
        else if constexpr (RateLaw<L>)
            r.stress_rate = [](const Material& m, const Stress<D>& sigma, const Mat<D>& gradient) {
                return L::of(m).rate(sigma, gradient);
            };
        if constexpr (CarriesElasticStrain<L>)
            r.set_stress = set_stress_of<L, D>;
        else if constexpr (Incremental<L>)
            r.set_stress = [](const Material&, const Mat<D>&, const Stress<D>&, double*) { return true; };
        if constexpr (ChangesStiffness<L>)
            r.stiffness = [](const Material& m, const Mat<D>& F, const double* history) {
                return L::of(m).stiffness(F, history);
            };
        r.energy = [](const Material& m, const Mat<D>& F, const Stress<D>& sigma, double V0, double V, const double* history) {
            return energy_of<L>(m, F, sigma, V0, V, history);
        };
        r.energy_of_eight = [](const Material& m, const Mat<D, Lanes>& F, const Stress<D, Lanes>& sigma, const Lanes& V0,
                               const Lanes& V, const Lanes* history) { return energy_of<L>(m, F, sigma, V0, V, history); };
    }
    return r;
}

template <class L>
constexpr int places_of_parameters()
{
    int n = 0;
    for (const LawParameter& p : L::parameters) n += p.places();
    return n;
}

/// Whether columns of components that only some dimensions have stand last, so that each dimension has the first ones.
template <class L>
constexpr bool has_columns_in_order()
{
    int dim = 1;
    for (const HistoryColumn& c : L::history) {
        if (c.min_dim < dim) return false;
        dim = c.min_dim;
    }
    return true;
}

template <class L>
LawRow row_of()
{
    static_assert(places_of_parameters<L>() <= Material::most_parameters && L::history.size() <= Material::most_history);
    static_assert(has_columns_in_order<L>());
    LawRow row{.name            = L::name,
               .what            = L::what,
               .elasticity      = L::elasticity,
               .max_dim         = L::max_dim,
               .is_hyperelastic = Hyperelastic<L>,
               .carries_stress  = Incremental<L>,
               .keeps_volume    = KeepsVolume<L>,
               .parameters      = L::parameters,
               .history         = L::history,
               .check           = nullptr,
               .complete        = nullptr,
               .in_1d           = functions_of<L, 1>(),
               .in_2d           = functions_of<L, 2>(),
               .in_3d           = functions_of<L, 3>()};
    if constexpr (CompletesMaterial<L>) row.complete = [](Material& m) { L::complete(m); };
    if constexpr (ChecksParameters<L>) row.check = [](const Material& m) { return L::check(m); };
    return row;
}

template <class... L>
std::span<const LawRow> rows_of(LawList<L...>)
{
    static const std::array rows{row_of<L>()...};
    return rows;
}

}  // namespace

std::span<const LawRow> laws() { return rows_of(Laws{}); }

}  // namespace ordo
