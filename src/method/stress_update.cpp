#include "method/stress_update.hpp"

#include "base/error.hpp"
#include "method/place.hpp"
#include "method/state.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <string_view>

namespace ordo {

template <int D>
StressUpdate<D>::StressUpdate(const std::vector<Material>& materials, const ArtificialViscosity& viscosity)
    : viscosity_(viscosity), needs_increments_(viscosity.is_on())
{
    const std::vector<std::string> columns = history_columns(materials, D);
    auto number_of                         = [&](std::string_view column) {
        return static_cast<int>(std::find(columns.begin(), columns.end(), column) - columns.begin());
    };
    for (std::size_t k = 0; k < materials.size(); ++k) {
        const Material& m = materials[k];
        if (m.law->outside) {
            OfOutside& one = outside_.emplace_back(
                OfOutside{m.law->outside, m.named, static_cast<int>(k), number_of(OutsideLaw::kWork.name), {}});
            for (const auto& column : m.law->outside->history()) one.columns.push_back(number_of(column.first));
            continue;
        }
        if (std::any_of(laws_.begin(), laws_.end(), [&](const OfLaw& other) { return other.law == m.law; })) continue;
        OfLaw& one = laws_.emplace_back(OfLaw{m.law, find_stress_pass<D>(*m.law), {}});
        for (const HistoryColumn& c : m.law->history.first(column_count(m.law->history, D)))
            one.columns.push_back(number_of(c.name));
        needs_increments_ = needs_increments_ || !m.law->is_hyperelastic;
    }
    for (std::size_t k = 0; k < materials.size(); ++k) {
        const Material& m = materials[k];
        if (m.branches.count == 0) continue;
        const std::vector<HistoryColumn> own = history_of(m, D);
        const HistoryLayout at               = history_layout<D>(m);
        OfBranches& one                      = branches_.emplace_back(OfBranches{m.branches, static_cast<int>(k), {}});
        auto add = [&](int place) { one.columns.push_back(number_of(own[static_cast<std::size_t>(place)].name)); };
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

namespace {

/// Throws for the first particle whose stress cannot be one: the law says which of them.
template <int D>
void require_stresses(const LawRow& law, const Particles<D>& p, const std::vector<int>& own, const Array<double>& cauchy)
{
    constexpr double rounding = 1e-8;  // of the largest component
    for (std::size_t k = 0; k < own.size(); ++k) {
        const double* const s = &cauchy[9 * k];
        double largest = 0.0, skew = 0.0, across = 0.0;
        bool is_finite = true;
        for (int a = 0; a < 3; ++a)
            for (int b = 0; b < 3; ++b) {
                const double one = std::fabs(s[3 * a + b]);
                is_finite        = is_finite && std::isfinite(one);
                largest          = std::max(largest, one);
                skew             = std::max(skew, std::fabs(s[3 * a + b] - s[3 * b + a]));
                if (a != b && (a >= D || b >= D)) across = std::max(across, one);
            }
        auto fail = [&](const std::string& why) {
            throw NumericalError(fmt::format("law {}: cauchy of particle {} of body {} at {} {}", law.name, p.id[own[k]],
                                             p.body[own[k]], place_text(p.x[own[k]]), why));
        };
        if (!is_finite) fail("is not finite");
        if (skew > rounding * largest) fail("is not symmetric");
        if (across > rounding * largest) fail(fmt::format("has a shear that a problem in {}D cannot have", D));
    }
}
template <int D>
void require_finite(const LawRow& law, const Particles<D>& p, const std::vector<int>& own, const std::string& column,
                    const Array<double>& values)
{
    for (std::size_t k = 0; k < own.size(); ++k)
        if (!std::isfinite(values[k]))
            throw NumericalError(fmt::format("law {}: state \"{}\" of particle {} of body {} at {} is not finite", law.name,
                                             column, p.id[own[k]], p.body[own[k]], place_text(p.x[own[k]])));
}

/// The 3 x 3 tensor of A, with ones where the problem has no axis.
template <int D>
void put_full(const Mat<D>& A, double* out)
{
    for (int c = 0; c < 9; ++c) out[c] = c / 3 < D && c % 3 < D ? A(c / 3, c % 3) : c % 4 == 0 ? 1.0 : 0.0;
}

template <int D>
Stress<D> stress_of(const double* full)
{
    Stress<D> r;
    for (int a = 0; a < 3; ++a) r(a, a) = full[4 * a];
    for (int a = 0; a < D; ++a)
        for (int b = 0; b < a; ++b) r(a, b) = 0.5 * (full[3 * a + b] + full[3 * b + a]);
    return r;
}

/// What stresses did in a step, per initial volume: (P_old + P)/2 : (F - F_old), with P = J sigma F^-T.
template <int D>
double work_of(const Mat<D>& F, const Mat<D>& G, const Stress<D>& before, const Stress<D>& after)
{
    const Mat<D> back = inverse(Mat<D>::identity() + G);  // F_old F^-1
    const double J    = det(F);
    double r          = 0.0;
    for (int a = 0; a < D; ++a)
        for (int b = 0; b < D; ++b)
            r += 0.5 * J * (det(back) * before(a, b) * G(a, b) + after(a, b) * ((a == b ? 1.0 : 0.0) - back(a, b)));
    return r;
}

}  // namespace

template <int D>
void StressUpdate<D>::update_outside(State<D>& s, double dt) const
{
    for (const OfOutside& one : outside_)
        if (dt > 0) update_outside(one, s, dt);  // the first step of USF has no step before it
}

template <int D>
void StressUpdate<D>::update_outside(const OfOutside& one, State<D>& s, double dt) const
{
    Particles<D>& p = s.particles;
    std::vector<int> own;
    for (int i = 0; i < p.count; ++i)
        if (p.material[i] == one.material) own.push_back(i);
    const std::size_t n = own.size();
    if (n == 0) return;
    Array<double> F(9 * n), dF(9 * n), cauchy(9 * n);
    std::vector<Array<double>> history;
    std::vector<double*> columns;
    for (std::size_t c = 0; c < one.columns.size(); ++c) columns.push_back(history.emplace_back(n).data());
    parallel_for_each(static_cast<std::ptrdiff_t>(n), [&](std::ptrdiff_t k) {
        const int i = own[static_cast<std::size_t>(k)];
        put_full(p.F[i], &F[9 * static_cast<std::size_t>(k)]);
        put_full(Mat<D>::identity() + s.increments[i], &dF[9 * static_cast<std::size_t>(k)]);
        for (std::size_t c = 0; c < columns.size(); ++c) columns[c][k] = p.history[one.columns[c]][i];
    });
    one.law->update(*one.parameters, {n, F.data(), dF.data(), dt, columns, cauchy.data()});
    require_stresses(one.law->row(), p, own, cauchy);
    for (std::size_t c = 0; c < columns.size(); ++c)
        require_finite(one.law->row(), p, own, one.law->history()[c].first, history[c]);
    parallel_for_each(static_cast<std::ptrdiff_t>(n), [&](std::ptrdiff_t k) {
        const int i           = own[static_cast<std::size_t>(k)];
        const Stress<D> sigma = stress_of<D>(&cauchy[9 * static_cast<std::size_t>(k)]);
        p.history[one.work][i] += work_of(p.F[i], s.increments[i], p.sigma[i], sigma);
        p.sigma[i] = sigma;
        for (std::size_t c = 0; c < columns.size(); ++c) p.history[one.columns[c]][i] = columns[c][k];
    });
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
