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
    else
        return V * law.energy(sigma, history);
}

template <class L, int D>
LawFunctions<D> functions_of()
{
    LawFunctions<D> r;
    if constexpr (D <= L::max_dim) {
        r.initial_stress = [](const Material& m, const Mat<D>& F) {
            if constexpr (Hyperelastic<L>)
                return L::of(m).cauchy(F);
            else
                return Stress<D>{};
        };
        if constexpr (Hyperelastic<L>)
            r.stress_rate = [](const Material&, const Stress<D>&, const Mat<D>&) { return Stress<D>{}; };
        else if constexpr (RateLaw<L>)
            r.stress_rate = [](const Material& m, const Stress<D>& sigma, const Mat<D>& gradient) {
                return L::of(m).rate(sigma, gradient);
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
LawRow row_of()
{
    static_assert(L::parameters.size() <= Material::most_parameters && L::history.size() <= Material::most_history);
    return {.name            = L::name,
            .what            = L::what,
            .elasticity      = L::elasticity,
            .max_dim         = L::max_dim,
            .is_hyperelastic = Hyperelastic<L>,
            .parameters      = L::parameters,
            .history         = L::history,
            .in_1d           = functions_of<L, 1>(),
            .in_2d           = functions_of<L, 2>(),
            .in_3d           = functions_of<L, 3>()};
}

template <class... L>
std::span<const LawRow> rows_of(LawList<L...>)
{
    static const std::array rows{row_of<L>()...};
    return rows;
}

}  // namespace

std::span<const LawRow> laws() { return rows_of(Laws{}); }

const LawRow* find_law(std::string_view name)
{
    for (const LawRow& row : laws())
        if (row.name == name) return &row;
    return nullptr;
}

}  // namespace ordo
