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

/// Why these numbers are no stress in D dimensions; null if they are one.
template <int D>
const char* fault_of_stress(const double* s)
{
    constexpr double rounding = 1e-8;  // of the largest component
    double largest = 0.0, skew = 0.0, across = 0.0;
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) {
            const double one = std::fabs(s[3 * a + b]);
            if (!std::isfinite(one)) return "is not finite";
            largest = std::max(largest, one);
            skew    = std::max(skew, std::fabs(s[3 * a + b] - s[3 * b + a]));
            if (a != b && (a >= D || b >= D)) across = std::max(across, one);
        }
    if (skew > rounding * largest) return "is not symmetric";
    return across > rounding * largest
               ? D == 2 ? "has a shear that a problem in 2D cannot have" : "has a shear that a problem in 1D cannot have"
               : nullptr;
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

/// The particles of a material, for its law.
template <int D>
class ParticlesOfLaw final : public OutsideParticles {
  public:
    ParticlesOfLaw(const OutsideLaw& law, int work, const std::vector<int>& columns, int material, State<D>& s, double dt)
        : law_(law), work_(work), columns_(columns), p_(s.particles), increments_(s.increments), dt_(dt)
    {
        for (int i = 0; i < p_.count; ++i)
            if (p_.material[i] == material) own_.push_back(i);
    }

    std::size_t count() const override { return own_.size(); }
    double dt() const override { return dt_; }
    void read_F(double* out) const override
    {
        for_each([&](std::size_t k, int i) { put_full(p_.F[i], out + 9 * k); });
    }
    void read_dF(double* out) const override
    {
        for_each([&](std::size_t k, int i) { put_full(Mat<D>::identity() + increments_[i], out + 9 * k); });
    }
    void read_history(std::size_t column, double* out) const override
    {
        for_each([&](std::size_t k, int i) { out[k] = p_.history[columns_[column]][i]; });
    }
    void set(const double* cauchy, const std::vector<const double*>& history) override
    {
        require("cauchy", [&](std::size_t k) { return fault_of_stress<D>(cauchy + 9 * k); });
        for (std::size_t c = 0; c < columns_.size(); ++c)
            require(fmt::format("state \"{}\"", law_.history()[c].first),
                    [&](std::size_t k) { return std::isfinite(history[c][k]) ? nullptr : "is not finite"; });
        for_each([&](std::size_t k, int i) {
            const Stress<D> sigma = stress_of<D>(cauchy + 9 * k);
            p_.history[work_][i] += work_of(p_.F[i], increments_[i], p_.sigma[i], sigma);
            p_.sigma[i] = sigma;
            for (std::size_t c = 0; c < columns_.size(); ++c) p_.history[columns_[c]][i] = history[c][k];
        });
    }

  private:
    template <class F>
    void for_each(const F& f) const
    {
        parallel_for_each(static_cast<std::ptrdiff_t>(own_.size()),
                          [&](std::ptrdiff_t k) { f(static_cast<std::size_t>(k), own_[static_cast<std::size_t>(k)]); });
    }
    /// Throws for the first particle with a fault, which fault(k) names.
    template <class Fault>
    void require(const std::string& what, const Fault& fault) const
    {
        const auto n     = static_cast<std::ptrdiff_t>(own_.size());
        const auto first = parallel_reduce(
            n, n, [&](std::ptrdiff_t k) { return fault(static_cast<std::size_t>(k)) ? k : n; },
            [](std::ptrdiff_t& least, std::ptrdiff_t one) { least = std::min(least, one); });
        if (first == n) return;
        const int i = own_[static_cast<std::size_t>(first)];
        throw NumericalError(fmt::format("law {}: {} of particle {} of body {} at {} {}", law_.row().name, what, p_.id[i],
                                         p_.body[i], place_text(p_.x[i]), fault(static_cast<std::size_t>(first))));
    }

    const OutsideLaw& law_;
    int work_;
    const std::vector<int>& columns_;
    Particles<D>& p_;
    const Array<Mat<D>>& increments_;
    double dt_;
    std::vector<int> own_;
};

}  // namespace

template <int D>
void StressUpdate<D>::update_outside(State<D>& s, double dt) const
{
    if (!(dt > 0)) return;  // the first step of USF has no step before it
    for (const OfOutside& one : outside_) {
        ParticlesOfLaw<D> particles(*one.law, one.work, one.columns, one.material, s, dt);
        if (particles.count() > 0) one.law->update(*one.parameters, particles);
    }
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
