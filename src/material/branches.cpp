#include "material/branches.hpp"

#include <algorithm>
#include <array>

namespace ordo {

namespace {

/// The columns of branch k, which live as long as the program.
std::span<const HistoryColumn> columns_of_branch(int k)
{
    constexpr std::size_t most = Branches::most, size = kElasticColumns.size();
    static const auto names = [] {
        std::array<std::array<std::string, size>, most> r;
        for (std::size_t n = 0; n < most; ++n)
            for (std::size_t c = 0; c < size; ++c)
                r[n][c] = "branch_" + std::to_string(n + 1) + "_" +
                          std::string(kElasticColumns[c].name.substr(std::string_view("elastic_").size()));
        return r;
    }();
    static const auto columns = [] {
        std::array<std::array<HistoryColumn, size>, most> r;
        for (std::size_t n = 0; n < most; ++n)
            for (std::size_t c = 0; c < size; ++c) {
                r[n][c]      = kElasticColumns[c];
                r[n][c].name = names[n][c];
                r[n][c].what = "left Cauchy-Green tensor of a Maxwell branch";
            }
        return r;
    }();
    return columns[static_cast<std::size_t>(k)];
}

}  // namespace

std::vector<HistoryColumn> history_of(const Material& m, int dim)
{
    const auto own = m.law->history.first(static_cast<std::size_t>(column_count(m.law->history, dim)));
    std::vector<HistoryColumn> r(own.begin(), own.end());
    const bool is_lossy = std::any_of(r.begin(), r.end(), [](const HistoryColumn& c) { return c.name == kDissipated.name; });
    if (m.branches.count > 0 && !is_lossy) r.push_back(kDissipated);
    for (int k = 0; k < m.branches.count; ++k)
        for (const HistoryColumn& c : columns_of_branch(k))
            if (c.min_dim <= dim) r.push_back(c);
    return r;
}

template <int D>
void start_history(const Material& m, const Mat<D>& F, double* history)
{
    const HistoryLayout at = history_layout<D>(m);
    std::fill_n(history, at.size, 0.0);
    m.law->in<D>().start(m, F, history);
    for (int k = 0; k < m.branches.count; ++k)
        write_symmetric(left_cauchy_green(F), history + at.first_branch + k * Symmetric<D>::size);
}

template <int D>
Stress<D> initial_stress(const Material& m, const Mat<D>& F)
{
    Stress<D> r = m.law->in<D>().initial_stress(m, F);
    for (int k = 0; k < m.branches.count; ++k)
        r += cauchy_of(2 * m.branches.shear[static_cast<std::size_t>(k)] * hencky_strain(left_cauchy_green(F)).dev, F);
    return r;
}

template <int D>
bool set_stress(const Material& m, const Mat<D>& F, const Stress<D>& sigma, double* history)
{
    const HistoryLayout at = history_layout<D>(m);
    Stress<D> own          = sigma;
    for (int k = 0; k < m.branches.count; ++k) {
        const HenckyStrain<D> e = hencky_strain(read_symmetric<D>(history + at.first_branch + k * Symmetric<D>::size));
        own += cauchy_of(-2 * m.branches.shear[static_cast<std::size_t>(k)] * e.dev, F);
    }
    return m.law->in<D>().set_stress(m, F, own, history);
}

template <int D>
Stress<D> update_stress(const Material& m, const Step<D>& step, const Stress<D>& sigma, double* history, double& fault)
{
    const HistoryLayout at = history_layout<D>(m);
    Stress<D> r            = m.law->in<D>().update(m, step, sigma, history, fault);
    for (int k = 0; k < m.branches.count; ++k) {
        const auto n = static_cast<std::size_t>(k);
        r += cauchy_of(relax(m.branches.shear[n], m.branches.time[n], step, history + at.first_branch + k * Symmetric<D>::size,
                             history[at.dissipated]),
                       step.F);
    }
    return r;
}

template <int D, class T>
T stored_energy(const Material& m, const Mat<D, T>& F, const Stress<D, T>& sigma, const T& V0, const T& V, const T* history)
{
    T r;
    if constexpr (std::is_same_v<T, double>)
        r = m.law->in<D>().energy(m, F, sigma, V0, V, history);
    else
        r = m.law->in<D>().energy_of_eight(m, F, sigma, V0, V, history);
    if (m.branches.count == 0) return r;
    const HistoryLayout at = history_layout<D>(m);
    for (int k = 0; k < m.branches.count; ++k)
        r += V0 * T(m.branches.shear[static_cast<std::size_t>(k)]) *
             square(hencky_strain(read_symmetric<D>(history + at.first_branch + k * Symmetric<D>::size)).dev);
    return r;
}

template <int D>
Stiffness stiffness(const Material& m, const Mat<D>& F, const double* history)
{
    if (!changes_stiffness<D>(m)) return {m.p_wave_modulus(), 0.0};
    Stiffness r = m.law->in<D>().stiffness(m, F, history);
    r.modulus += 4.0 / 3 * m.branches.total_shear();
    return r;
}

#define ORDO_RESPONSE(D)                                                                                                     \
    template void start_history(const Material&, const Mat<D>&, double*);                                                    \
    template Stress<D> initial_stress(const Material&, const Mat<D>&);                                                       \
    template bool set_stress(const Material&, const Mat<D>&, const Stress<D>&, double*);                                     \
    template Stress<D> update_stress(const Material&, const Step<D>&, const Stress<D>&, double*, double&);                   \
    template double stored_energy(const Material&, const Mat<D>&, const Stress<D>&, const double&, const double&,            \
                                  const double*);                                                                            \
    template Lanes stored_energy(const Material&, const Mat<D, Lanes>&, const Stress<D, Lanes>&, const Lanes&, const Lanes&, \
                                 const Lanes*);                                                                              \
    template Stiffness stiffness(const Material&, const Mat<D>&, const double*);
ORDO_RESPONSE(1)
ORDO_RESPONSE(2)
ORDO_RESPONSE(3)
#undef ORDO_RESPONSE

}  // namespace ordo
