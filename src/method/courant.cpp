#include "method/courant.hpp"

#include "method/enrichment.hpp"
#include "method/state.hpp"
#include "method/stress_update.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ordo {

namespace {

/// The highest frequency, c/h, of splines that are fitted to particles, for degrees 1 to 5 of the velocity. `all` and
/// `removed`: 16 cells between walls, with all knots or without those next to the walls, the largest over degrees of the
/// stress. The functions at the walls are the fastest; between periodic faces it is 3.15 or less. `cut`: a bar with a free end,
/// the largest over positions of the end in its cell.
double highest_frequency(const MethodSpec& s, bool has_surface)
{
    static constexpr double all[] = {3.11, 3.17, 3.82, 4.96, 6.28}, removed[] = {3.08, 3.07, 3.05, 3.28, 4.04},
                            cut[] = {6.24, 4.45, 5.41, 7.49, 9.77};
    const int k                   = degree_of(s.basis) - 1;
    return has_surface ? cut[k] : s.removed_knots > 0 ? removed[k] : all[k];
}

/// By how much the filter multiplies the accelerations that the strain of the same step feels: those of what particles do not
/// receive, at free surfaces too.
double amplification(const MethodSpec& s)
{
    return s.filter == Filter::fmpm && updates_stress_last(s) ? std::max(s.filter_order * strain_velocity_of(s), 1.0) : 1.0;
}

/// Of hats or splines with all functions, without a filter.
double scale_of_basis(const MethodSpec& s, int dim)
{
    const bool lumped    = s.mass == MassMatrix::lumped;
    const double several = lumped ? 1.0 : 1.0 / std::sqrt(dim);
    switch (s.basis) {
    case Basis::hat:
    case Basis::ddmpm: return lumped ? 1.0 : 0.577 * several;
    case Basis::bspline2: return lumped ? 0.862 : 0.430 * several;
    case Basis::bspline3: return lumped ? 0.652 : 0.291 * several;
    case Basis::bspline4:
    case Basis::bspline5: break;
    }
    return 1.0;
}

}  // namespace

double courant_scale(const MethodSpec& s, int dim, bool has_surface)
{
    if (is_spline_fit(s)) {
        const double reach = s.scheme == TimeScheme::rk3 ? 1.732 : 2.828;  // the stability limit on the imaginary axis
        return reach / (highest_frequency(s, has_surface) * std::sqrt(dim));
    }
    return scale_of_basis(s, dim) / std::sqrt(amplification(s));
}

double stable_courant_number(const MethodSpec& s, int dim, bool has_surface)
{
    if (is_spline_fit(s)) return courant_scale(s, dim, has_surface);
    const bool is_point_spline = s.basis == Basis::bspline2 && s.domain == Domain::point;
    double limit               = scale_of_basis(s, dim);
    if (s.mass == MassMatrix::consistent && s.basis == Basis::hat) limit = std::min(limit, 0.5 / std::sqrt(dim));
    if (s.mass == MassMatrix::lumped && updates_stress_last(s)) {
        // One particle at the centre of each cell: the shortest wave moves no node, and the stress of a step is that of the
        // part of the advanced velocity alone, which FMPM multiplies by its order.
        const double part = strain_velocity_of(s) * (s.filter == Filter::fmpm ? s.filter_order : 1.0);
        const double mode = s.basis == Basis::hat || is_point_spline ? 2.0 : 0.5;
        if (mode * part > 1) limit = std::min(limit, 1 / std::sqrt(mode * part));
    }
    return std::min(limit, courant_scale(s, dim));
}

bool has_limit_of_strain(const MethodSpec& s)
{
    return s.mass == MassMatrix::consistent && !has_tls_velocity(s) && s.domain != Domain::point && s.domain != Domain::box;
}

std::string_view unit_of_limit(const MethodSpec& s)
{
    if (s.enrichment == Enrichment::all) return "times 2/w of the cells as they are now";
    if (has_enrichment(s)) return "h/(c + |v|) of the method, or times 2/w of enriched cells as they are now";
    return has_limit_of_strain(s) ? "h/(c + |v|) of the method, less where domains are longer than half a cell"
                                  : "h/(c + |v|) of the method";
}

double stable_number_of_domains(double w)
{
    constexpr double least = 0.05;  // there and beyond only lumped rows keep the matrix regular
    return w < 1 ? std::max((1 - w) * std::sqrt((1 + 2 * w) / (3 - 2 * w)), least) : least;
}

const std::vector<Instability>& instabilities()
{
    static const std::vector<Instability> rows = {
        {[](const MethodSpec& s) {
             return s.quadrature == Quadrature::cell ? s.gradient != Gradient::adjoint
                                                     : s.gradient == Gradient::adjoint && s.quadrature == Quadrature::particle;
         },
         "forces and particle gradients are not each other's transpose: quadrature cell and gradient adjoint belong together"},
        {has_tls_velocity,
         "velocities by Taylor least squares are not the transpose of the particles' increments; tls = \"stress\" is stable"},
        {[](const MethodSpec& s) {
             return fits_velocity(s) && !(s.limiter == Limiter::slope && s.mass == MassMatrix::lumped) && projects_again(s) &&
                    strain_velocity_of(s) < 0.1 && s.weight != Weight::hat;
         },
         "velocities by moving least squares are not the transpose of the particles' increments, and scheme musl with a "
         "strain_velocity below 0.1 does not damp what grows; 0.3 does, and with lumped mass limiter slope"},
        {[](const MethodSpec& s) { return fits_velocity(s) && s.filter != Filter::none && s.filter_order > 2; },
         "filters of least squares grow from the third order on, because what a projection leaves of a wave is not between 0 and "
         "1: set filter_order to 2"},
        {[](const MethodSpec& s) { return s.projection == Projection::gradient_enhanced && s.domain != Domain::point; },
         "projection gradient-enhanced with particle domains is not the transpose of the particles' increments; for points it is "
         "stable"},
    };
    return rows;
}

const Instability* instability_of(const MethodSpec& s)
{
    for (const Instability& row : instabilities())
        if (row.concerns(s)) return &row;
    return nullptr;
}

namespace {

/// Wave speeds, m/s, and kinematic viscosities, m^2/s, of particles at their current states.
template <int D>
class Speeds {
  public:
    Speeds(const Model<D>& model, const Particles<D>& p)
        : model_(model), p_(p), artificial_(artificial_viscosity(model.method, model.h)), is_constant_(!artificial_.is_on())
    {
        for (const Material& m : model.materials) {
            std::vector<const double*>& columns = columns_.emplace_back();
            at_rest_.push_back(m.wave_speed());
            is_constant_ = is_constant_ && !changes_stiffness<D>(m);
            for (const HistoryColumn& c : history_of(m, D)) columns.push_back(p.history[p.history_column(c.name)].data());
        }
    }

    /// Whether all materials keep the speeds that they have at rest, and none is viscous.
    bool is_constant() const { return is_constant_; }
    double wave(std::ptrdiff_t i) const
    {
        const Material& m = model_.materials[p_.material[i]];
        return changes_stiffness<D>(m) ? std::sqrt(of(m, i).modulus / m.density) : at_rest_[p_.material[i]];
    }
    double viscosity(std::ptrdiff_t i) const
    {
        const Material& m   = model_.materials[p_.material[i]];
        const double volume = (has_started(i) ? p_.V[i] : p_.V0[i]) / p_.m[i];
        return (changes_stiffness<D>(m) ? of(m, i).viscosity * volume : 0.0) + artificial(m, i, volume);
    }

  private:
    /// nu with the same limit as artificial viscosity, which acts on longitudinal waves, where nu counts 4/3; from the last q.
    double artificial(const Material& m, std::ptrdiff_t i, double volume) const
    {
        return p_.q.empty() ? 0.0 : 0.75 * artificial_.diffusivity(p_.q[i] * volume, m.wave_speed());
    }
    /// Before the start of a run, when a fixed time step is checked, particles have neither F nor history.
    bool has_started(std::ptrdiff_t i) const { return det(p_.F[i]) > 0; }
    Stiffness of(const Material& m, std::ptrdiff_t i) const
    {
        double history[Material::most_history];
        if (!has_started(i)) {
            start_history(m, Mat<D>::identity(), history);
            return stiffness(m, Mat<D>::identity(), history);
        }
        int k = 0;
        for (const double* column : columns_[p_.material[i]]) history[k++] = column[i];
        return stiffness(m, p_.F[i], history);
    }

    const Model<D>& model_;
    const Particles<D>& p_;
    std::vector<std::vector<const double*>> columns_;  ///< [material]
    std::vector<double> at_rest_;                      ///< [material]
    ArtificialViscosity artificial_;
    bool is_constant_;
};

/// The largest rate(i) of n particles here and those of other ranks; 0 if there is none.
template <class Rate>
double largest_over(Ranks& ranks, std::ptrdiff_t n, const Rate& rate)
{
    return largest(ranks, parallel_reduce(n, 0.0, rate, [](double& total, double one) { total = std::max(total, one); }));
}

/// How long a particle's domain is along axis a, cells. Before the start of a run F is 0.
template <int D>
double cells_along(const Model<D>& model, const Particles<D>& p, std::ptrdiff_t i, int a)
{
    if (has_cells(model.method)) {
        const CornerIds<D>& cell = p.cell[i];
        double low = p.corner[cell[0]][a], high = low;
        for (int c = 1; c < cell.count(); ++c) {
            low  = std::min(low, p.corner[cell[c]][a]);
            high = std::max(high, p.corner[cell[c]][a]);
        }
        return (high - low) / model.h[a];
    }
    const Mat<D> F = det(p.F[i]) > 0 ? p.F[i] : Mat<D>::identity();
    if (model.method.domain == Domain::stretched_box) return 2 * F(a, a) * p.half0[i][a] / model.h[a];
    const Mat<D> edges = F * p.edges0[i];
    double square      = 0.0;
    for (int b = 0; b < D; ++b) square += edges(a, b) * edges(a, b);
    return 2 * std::sqrt(square) / model.h[a];
}

/// The shortest time in which a wave crosses a cell, s: h over (P-wave speed + |v|) for particles that spread to the grid, and
/// 2/w of enriched cells, see enriched_time_step. `of_domains`: divided by what strain takes from the stable Courant number.
template <int D>
double crossing_time(const Model<D>& model, const Particles<D>& particles, Ranks& ranks, bool of_domains = false)
{
    const double full     = stable_courant_number(model.method, 1);
    const bool strains    = of_domains && has_limit_of_strain(model.method);
    const double enriched = enriched_time_step(model, particles);
    if (model.method.enrichment == Enrichment::all) return enriched;
    const Speeds<D> speeds(model, particles);
    const double rate = largest_over(ranks, particles.count, [&](std::ptrdiff_t i) {
        const double speed = speeds.wave(i) + norm(particles.v[i]);
        double r           = 0.0;
        for (int a = 0; a < D; ++a) {
            const double taken =
                strains ? std::max(full / stable_number_of_domains(cells_along(model, particles, i, a)), 1.0) : 1.0;
            r = std::max(r, taken * speed / model.h[a]);
        }
        return r;
    });
    return std::min(enriched, rate > 0 ? 1 / rate : std::numeric_limits<double>::infinity());
}

/// The largest stable step of explicit viscous forces alone, s: rho/(2 (4/3) eta sum 1/h^2), the limit of central differences in
/// space. The fastest mode is longitudinal: 2 eta dev d is (4/3) eta d_xx there. Where waves of the grid are faster than those of
/// hats with lumped mass, by 1/courant_scale along one axis, the same mode decays faster by the square of that.
template <int D>
double viscous_time_step(const Model<D>& model, const Particles<D>& particles, Ranks& ranks)
{
    constexpr double no_limit = std::numeric_limits<double>::infinity();
    const Speeds<D> speeds(model, particles);
    if (speeds.is_constant()) return no_limit;
    const double viscosity = largest_over(ranks, particles.count, [&](std::ptrdiff_t i) { return speeds.viscosity(i); });
    double curvature       = 0.0;
    for (int a = 0; a < D; ++a) curvature += 1 / (model.h[a] * model.h[a]);
    const double scale = std::min(courant_scale(model.method, 1, !model.surface.empty()), 1.0);
    return viscosity > 0 ? scale * scale / (2 * (4.0 / 3) * viscosity * curvature) : no_limit;
}

/// The step, s, that waves and viscosity allow together. Viscous forces of the velocity before the step: an oscillator of
/// frequency w and damping rate c is stable if (w dt)^2 + 2 c dt <= 4, with the limits 2/w and 2/c alone; the sum of rates
/// is below that.
double combined(double of_waves, double of_viscosity)
{
    return std::isinf(of_viscosity) ? of_waves : 1 / (1 / of_waves + 1 / of_viscosity);
}

template <int D>
double courant_scale(const Model<D>& model)
{
    return courant_scale(model.method, D, !model.surface.empty());
}

}  // namespace

template <int D>
double stable_courant_number(const Model<D>& model)
{
    return stable_courant_number(model.method, D, !model.surface.empty());
}

template <int D>
double courant_time_step(const Model<D>& model, const Particles<D>& particles, Ranks& ranks)
{
    return courant_scale(model) * crossing_time(model, particles, ranks);
}

template <int D>
double stable_time_step(const Model<D>& model, const Particles<D>& particles, Ranks& ranks)
{
    if (is_implicit(model.method)) return std::numeric_limits<double>::infinity();
    return combined(stable_courant_number(model) * crossing_time(model, particles, ranks, true),
                    viscous_time_step(model, particles, ranks));
}

template <int D>
double automatic_time_step(const Model<D>& model, const Particles<D>& particles, double cfl, Ranks& ranks)
{
    if (is_implicit(model.method)) return cfl * courant_time_step(model, particles, ranks);
    const double crossing = crossing_time(model, particles, ranks);
    const double strained = has_limit_of_strain(model.method) ? crossing_time(model, particles, ranks, true) : crossing;
    const double limit    = std::min(cfl * courant_scale(model) * crossing, stable_courant_number(model) * strained);
    return combined(limit, viscous_time_step(model, particles, ranks));
}

#define ORDO_TIME_STEPS(D)                                                           \
    template double stable_courant_number(const Model<D>&);                          \
    template double courant_time_step(const Model<D>&, const Particles<D>&, Ranks&); \
    template double stable_time_step(const Model<D>&, const Particles<D>&, Ranks&);  \
    template double automatic_time_step(const Model<D>&, const Particles<D>&, double, Ranks&);
ORDO_TIME_STEPS(1)
ORDO_TIME_STEPS(2)
ORDO_TIME_STEPS(3)
#undef ORDO_TIME_STEPS

}  // namespace ordo
