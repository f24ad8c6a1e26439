// The one-step operator of each method about a uniform lattice: its spectrum over wave number, the sharp limit of the time
// step, dispersion and damping of a wave, checked in the nonlinear code. Gong (2015) ch. 7, as corrected.
#include "base/error.hpp"
#include "method/diagnostics.hpp"
#include "method/planting.hpp"
#include "verification/cases.hpp"
#include "verification/energy_balance.hpp"
#include "verification/lattice_operator.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace ordo::verification {

namespace {

using Complex = std::complex<double>;

constexpr double kPi = std::numbers::pi, kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr int kCells      = 64;   ///< of the box of the studies
constexpr double kLargest = 4.0;  ///< Courant number up to which limits are searched

ParticleLattice lattice_of(const Request& r, double shift)
{
    return {r.method, r.per_axis, shift, r.cells, r.values.number("nu")};
}

/// Shifts from the requested one to half a spacing, where every cell face has particles; other shifts are mirror images.
std::vector<double> shifts_of(const Request& r)
{
    const double first = r.values.number("shift");
    const int count    = static_cast<int>(std::lround(r.values.number("shifts")));
    std::vector<double> shifts{first};
    for (int k = 1; k < count; ++k) shifts.push_back(first + (0.5 - first) * k / (count - 1));
    return shifts;
}

template <int D>
Vec<D> along_x(double theta)
{
    Vec<D> r{};
    r[0] = theta;
    return r;
}

/// The eigenvalue nearest to `to`.
Complex nearest(const std::vector<Complex>& values, const Complex& to)
{
    return *std::min_element(values.begin(), values.end(),
                             [&](const Complex& a, const Complex& b) { return std::abs(a - to) < std::abs(b - to); });
}

/// Eigenvalues of an assembled operator for waves along x: the largest modulus, and the one that corresponds to the wave of the
/// continuum, exp(-i C theta), followed from long waves on.
template <int D>
void add_curves(const LatticeOperator<D>& op, double courant, int intervals, Row& row)
{
    std::vector<double> thetas, growths, sizes, speeds;
    const double step = kPi / intervals;
    Complex wave      = 1.0;
    for (int k = 1; k <= intervals; ++k) {
        const double theta = k * step;
        const auto values  = op.eigenvalues(along_x<D>(theta));
        double largest     = 0.0;
        for (const Complex& v : values) largest = std::max(largest, std::abs(v));
        wave = nearest(values, wave * std::polar(1.0, -courant * step));
        thetas.push_back(theta);
        growths.push_back(largest);
        sizes.push_back(std::abs(wave));
        speeds.push_back(-std::arg(wave) / (courant * theta));
    }
    row.curves = {{"theta", thetas}, {"growth", growths}, {"wave_size", sizes}, {"wave_speed", speeds}};
}

/// The limit of hats at points with lumped mass, FLIP and stress last (Gong's errata, 40): the minimum over wave numbers of
/// 1/sqrt((2 - k) sin^2(theta/2)), with k the symbol of the map from nodes to particles and back. NaN for other methods.
double predicted_limit(const Request& r, double shift)
{
    const MethodSpec mpm, &m = r.method;
    const bool is_mpm = m.basis == mpm.basis && m.domain == mpm.domain && m.projection == mpm.projection &&
                        m.quadrature == mpm.quadrature && m.mass == mpm.mass && m.gradient == mpm.gradient &&
                        m.update == mpm.update && m.filter == mpm.filter && m.scheme == mpm.scheme &&
                        m.pic_fraction == mpm.pic_fraction;
    if (!is_mpm || r.values.word("dim") != "1") return kNaN;
    const int n = r.per_axis, count = 1000;
    double least = kLargest;
    for (int i = 1; i <= count; ++i) {
        const double theta = kPi * i / count;
        double k           = 0.0;
        for (int p = 0; p < n; ++p) {
            const double xi = std::fmod((p + 0.5 + shift) / n, 1.0);
            k += std::norm(1 - xi + xi * std::polar(1.0, theta)) / n;
        }
        least = std::min(least, 1 / std::sqrt((2 - k) * std::pow(std::sin(theta / 2), 2)));
    }
    return least;
}

template <int D>
double largest_speed(const Particles<D>& p)
{
    double r = 0.0;
    for (int i = 0; i < p.count; ++i) r = std::max(r, norm(p.v[i]));
    return r;
}

/// Equal steps without end.
setup::TimeSpec steps_of(double dt) { return {.end = std::numeric_limits<double>::infinity(), .dt = dt}; }

/// The nonlinear code on the lattice from small random velocities: the largest speed after `steps` steps over the initial one, or
/// a thousand as soon as that is reached.
template <int D>
double amplification(const Request& r, double shift, double courant, long steps)
{
    const ParticleLattice lattice = lattice_of(r, shift);
    const Model<D> model          = model_of<D>(lattice, "neo-hookean");
    Particles<D> p                = plant_all(model, seeds_of<D>(lattice));
    std::mt19937_64 random(1);
    for (int i = 0; i < p.count; ++i)
        for (int a = 0; a < D; ++a) p.v[i][a] = 1e-6 * (2.0 * static_cast<double>(random() >> 11) * 0x1p-53 - 1.0);
    const double first = largest_speed(p);
    Simulation<D> sim(
        model, [&](const Scheme<D>& scheme) { return scheme.start(std::move(p)); }, steps_of(courant));
    double largest = 1.0;
    try {
        for (long k = 0; k < steps && largest < 1e3; ++k) {
            sim.step();
            largest = std::max(largest, largest_speed(sim.state().particles) / first);
        }
    } catch (const NumericalError&) {
        return 1e3;
    }
    return std::min(largest, 1e3);
}

/// A standing wave over four periods of `period` steps: parts of the change of energy per period, relative to the initial energy.
template <int D>
void add_energies(const Request& r, double shift, double courant, double wave, double period, Row& row)
{
    constexpr int periods         = 4;
    const ParticleLattice lattice = lattice_of(r, shift);
    const Model<D> model          = model_of<D>(lattice, rate_law<D>);
    Particles<D> p                = plant_all(model, seeds_of<D>(lattice));
    set_velocities<D>(
        p, 0, p.count, [&](const Vec<D>& x) { return along_x<D>(1e-6 * std::sin(2 * kPi * x[0] / wave)); }, model.h);
    Simulation<D> sim(
        model, [&](const Scheme<D>& scheme) { return scheme.start(std::move(p)); }, steps_of(courant));
    const double first = totals(model, sim.state()).total_energy();
    const long steps   = std::lround(periods * period);
    EnergyBalance sum;
    double identity = 0.0;
    try {
        for (long k = 0; k < steps; ++k) {
            const EnergyBalance e = step_with_balance(sim);
            identity              = std::max(identity, std::fabs(e.motion - e.work) / first);
            sum += e;
        }
    } catch (const NumericalError&) {  // unbounded growth
        return;
    }
    const double change = totals(model, sim.state()).total_energy() / first - 1;
    row.quantities.insert(row.quantities.end(), {{"energy_change", change / periods},
                                                 {"energy_transfer", (sum.projection + sum.update) / first / periods},
                                                 {"energy_stress", sum.stress / first / periods},
                                                 {"energy_identity", identity}});
}

/// Cells per wave; the box holds a whole number of waves.
double wave_of(const Request& r) { return r.cells / std::ceil(r.cells / 16.0); }

/// The number of Courant numbers at which growth is measured; the last is that of the request.
constexpr int kCourants = 5;

/// Results from the operators of all lattices.
struct OperatorFigures {
    double courants[kCourants];
    double growth[kCourants] = {};     ///< of the worst lattice
    double from = 0.0, to = kLargest;  ///< stable on all lattices
    double predicted = kLargest;       ///< limit; NaN if there is no prediction
    double own_limit = 0.0;            ///< of the lattice of the request
    Complex value    = 1.0;            ///< eigenvalue of the wave on that lattice
};

/// Adds the number of particles and the curves to the row.
template <int D>
OperatorFigures figures_of(const Request& r, Row& row)
{
    constexpr int intervals = D == 1 ? 128 : D == 2 ? 8 : 4;
    const double cfl = r.values.number("cfl"), shift = r.values.number("shift");
    OperatorFigures s{.courants = {StableCourantNumbers::smallest, 0.1, 0.4, 1.0, cfl}};
    for (const double at : shifts_of(r)) {
        LatticeOperator<D> op(lattice_of(r, at));
        row.particles                     = op.particle_count();
        const StableCourantNumbers stable = find_stable(op, kLargest);
        s.from                            = std::max(s.from, stable.from);
        s.to                              = std::min(s.to, stable.to);
        s.predicted                       = std::min(s.predicted, predicted_limit(r, at));
        for (int k = 0; k < kCourants; ++k) {
            op.assemble(s.courants[k]);
            s.growth[k] = std::max(s.growth[k], op.growth(intervals));
        }
        if (at != shift) continue;
        s.own_limit        = stable.to;
        const double theta = 2 * kPi / wave_of(r);
        s.value            = nearest(op.eigenvalues(along_x<D>(theta)), std::polar(1.0, -cfl * theta));
        if (r.cells % 2 == 0) add_curves(op, cfl, D == 1 ? 64 : r.cells / 2, row);
    }
    if (std::isnan(predicted_limit(r, shift))) s.predicted = kNaN;
    return s;
}

/// The growth of the worst lattice, for splines fitted in 1D; else NaN.
template <int D>
double largest_frozen_growth(const Request& r)
{
    if (!has_stages_of_runge_kutta(r.method) || D != 1) return kNaN;
    constexpr int most = 32;  // cells: more would be too expensive for a dense matrix
    double frozen      = 0.0;
    for (const double at : shifts_of(r)) {
        ParticleLattice lattice = lattice_of(r, at);
        lattice.cells           = std::min(lattice.cells, most);
        frozen                  = std::max(frozen, frozen_growth(lattice));
    }
    return frozen;
}

/// By how much runs amplify noise just below and just above the limit.
template <int D>
void add_amplifications(const Request& r, double limit, Row& row)
{
    const double shift   = r.values.number("shift");
    const long steps     = std::lround(r.values.number("steps"));
    const bool has_limit = limit > 0 && limit < kLargest && steps > 0;
    row.quantities.insert(row.quantities.end(),
                          {{"amplification_below", has_limit ? amplification<D>(r, shift, 0.99 * limit, steps) : kNaN},
                           {"amplification_above", has_limit ? amplification<D>(r, shift, 1.01 * limit, steps) : kNaN}});
}

template <int D>
Row disperse(const Request& r)
{
    const auto begin = std::chrono::steady_clock::now();
    const double cfl = r.values.number("cfl"), wave = wave_of(r);
    Row row{};
    row.cells               = r.cells;
    row.h                   = 1.0 / r.cells;
    const OperatorFigures s = figures_of<D>(r, row);

    const double turn = -std::arg(s.value);
    row.quantities    = {{"limit", s.to > s.from ? s.to : 0.0},
                         {"stable_from", s.from},
                         {"limit_predicted", s.predicted},
                         {"growth_rate", std::log(s.growth[0]) / s.courants[0]},
                         {"growth_0.1", s.growth[1]},
                         {"growth_0.4", s.growth[2]},
                         {"growth_1", s.growth[3]},
                         {"growth", s.growth[4]},
                         {"phase_error", turn / (cfl * 2 * kPi / wave) - 1},
                         {"damping", 1 - std::abs(s.value)}};
    row.quantities.emplace_back("frozen_growth", largest_frozen_growth<D>(r));
    add_energies<D>(r, r.values.number("shift"), cfl, wave, 2 * kPi / turn, row);
    add_amplifications<D>(r, s.own_limit, row);
    std::erase_if(row.quantities, [](const auto& q) { return std::isnan(q.second); });  // undefined for the method
    row.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return row;
}

Row disperse(const Request& r)
{
    static constexpr Row (*of[])(const Request&) = {disperse<1>, disperse<2>, disperse<3>};
    try {
        return of[r.values.word("dim")[0] - '1'](r);
    } catch (const NumericalError& e) {  // a singular mass matrix
        Row row{};
        row.cells     = r.cells;
        row.h         = 1.0 / r.cells;
        row.particles = static_cast<int>(std::lround(std::pow(r.cells * r.per_axis, r.values.word("dim")[0] - '0')));
        row.failed    = e.what();
        return row;
    }
}

/// Measured limits of a preset for 1 to 4 particles per cell: with particles at sub-cell centres, and the smallest over their
/// positions. 0 if waves grow at any small time step, NaN if the mass matrix is singular.
struct Spectrum {
    const char* method;
    double centred[4], anywhere[4];
};

const std::vector<Spectrum>& measured_spectra()
{
    static const std::vector<Spectrum> rows = {
        {"mpm", {0.70711, 0.75593, 0.76613, 0.7698}, {0.70711, 0.75593, 0.76613, 0.7698}},
        {"ugimp", {0.70711, 0.75593, 0.76613, 0.7698}, {0.70711, 0.75593, 0.76613, 0.7698}},
        {"cpgimp", {0.70711, 0.75593, 0.76613, 0.7698}, {0.70711, 0.75593, 0.76613, 0.7698}},
        {"cpdi1", {0.70711, 0.75593, 0.76613, 0.7698}, {0.70711, 0.75593, 0.76613, 0.7698}},
        {"cpdi2", {0.70711, 0.75593, 0.76613, 0.7698}, {0.70711, 0.75593, 0.76613, 0.7698}},
        {"cpdi2t", {0.70711, 0.75593, 0.76613, 0.7698}, {0.70711, 0.75593, 0.76613, 0.7698}},
        {"bscpdi2", {1.49890, 1.31502, 1.27630, 1.26226}, {1.33947, 1.28801, 1.26740, 1.25832}},
        {"impm", {1, 1.18339, 1.21731, 1.22896}, {0, 0, 0, 0}},
        {"impm-adjoint", {1.37812, 1.527, 1.53668, 1.53906}, {0, 0, 1.53668, 1.53906}},
        {"icpdi1", {0.70711, 0.72828, 0.73053, 0.73119}, {0, 0, 0.73053, 0.73119}},
        {"icpdi2", {0.70711, 0.72828, 0.73053, 0.73119}, {0, 0, 0.73053, 0.73119}},
        {"cpls", {0.78174, 0.74413, 0.73734, 0.73497}, {0, 0, 0.73734, 0.73497}},
        {"imls-mpm", {0.70711, 0.72828, 0.73053, 0.73119}, {0, 0, 0.73053, 0.73119}},
        {"mls-bsmpm", {2.63483, 2.49032, 2.46074, 2.45052}, {0, 0, 0, 0}},
        {"wls", {0.70711, 0.74278, 0.74485, 0.746}, {0.70711, 0, 0.74485, 0.746}},
        {"bsmpm", {1.41422, 0.75, 0.67443, 0.65431}, {kNaN, 0.5, 0.56853, 0.59512}},
        {"ddmpm", {kNaN, 1.33327, 1.43589, 1.45739}, {kNaN, 1.33327, 1.43589, 1.45739}},
        {"tls-mpm", {1.15471, 0.57735, 0.57735, 0.57735}, {0, 0, 0, 0}},
        {"tls-ddmpm", {1.87861, 1.51017, 1.54278, 1.53889}, {0, 0, 0, 0}},
        {"tls-bsmpm", {1.28081, 0.54433, 0.56195, 0.56853}, {0, 0, 0, 0}},
        {"apic", {1.89241, 1.64777, 1.58461, 1.5612}, {1, 1.27475, 1.40984, 1.46454}},
        {"mls-mpm", {1.89241, 1.30637, 1.29339, 1.29168}, {1, 1.27475, 1.28833, 1.29022}},
        {"polypic", {1.89241, 1.64777, 1.58461, 1.5612}, {1, 1.27475, 1.40984, 1.46454}},
        {"spline3", {kNaN, 0.75957, 0.75957, 0.75957}, {kNaN, 0.75957, 0.75957, 0.75957}},
        {"spline4", {kNaN, 0.90025, 0.90025, 0.90025}, {kNaN, 0.90025, 0.90025, 0.90025}},
        {"spline5", {kNaN, 0.90031, 0.90031, 0.90031}, {kNaN, 0.90031, 0.90031, 0.90031}},
    };
    return rows;
}

/// The studies that run in CI: one of each family, with two particles per cell.
bool is_quick(const std::string& method, int n, bool anywhere)
{
    if (anywhere) return method == "impm" && n == 2;
    static const std::vector<std::string> some{"mpm", "cpdi1", "impm", "impm-adjoint", "cpls", "bsmpm", "tls-bsmpm", "apic"};
    return method == "mpm" || (n == 2 && std::find(some.begin(), some.end(), method) != some.end());
}

/// The study of `n` particles per cell, whose limit is `limit`; with `anywhere` that of the worst of five lattices.
Study limit_of(const char* method, int n, double limit, bool anywhere)
{
    const int cells = kCells;
    Study study{.method = method, .ppc = n, .set = {}, .cells = {cells}, .bars = {}};
    study.length = is_quick(method, n, anywhere) ? Study::quick : Study::night;
    if (anywhere) study.set = {{"shifts", 5.0}, {"steps", 0.0}};
    if (limit == 0) {
        study.bars = {value_between("growth_rate", cells, 1e-4, 10)};
        return study;
    }
    study.bars = {value_between("limit", cells, limit - 1e-4, limit + 1e-4)};
    if (method == std::string_view("mpm"))
        study.bars.push_back(value_between("limit_predicted", cells, limit - 1e-4, limit + 1e-4));
    for (const char* growth : {"growth_0.1", "growth_0.4"})
        study.bars.push_back(value_at_most(growth, cells, 1 + kGrowthTolerance));
    if (limit >= 1.1) study.bars.push_back(value_at_most("growth_1", cells, 1 + kGrowthTolerance));
    if (find_preset(method) && has_stages_of_runge_kutta(find_preset(method)->spec))
        study.bars.push_back(value_at_most("frozen_growth", cells, 1e-12));
    // TLS with one particle per cell grows as soon as noise has moved the particles.
    const bool is_steady = !(n == 1 && std::string_view(method).starts_with("tls"));
    if (!anywhere && is_steady)
        study.bars = study.bars + std::vector<Bar>{value_at_most("amplification_below", cells, 20),
                                                   {.name = "amplification_above", .from = cells, .low = 100}};
    return study;
}

void add_studies(const Spectrum& row, std::vector<Study>& studies)
{
    for (int n = 1; n <= 4; ++n)
        for (const bool anywhere : {false, true}) {
            const double limit = anywhere ? row.anywhere[n - 1] : row.centred[n - 1];
            if (!std::isnan(limit)) studies.push_back(limit_of(row.method, n, limit, anywhere));
        }
}

}  // namespace

Case dispersion()
{
    std::vector<Study> studies;
    for (const Spectrum& row : measured_spectra()) add_studies(row, studies);
    // The purpose of the adjoint gradient: no growth for any particle positions; with one per cell not below C = 0.11.
    for (int n = 2; n <= 4; ++n) {
        Study study{.method = "impm-adjoint", .ppc = n, .set = {{"shifts", 5.0}, {"steps", 0.0}}, .cells = {kCells}, .bars = {}};
        for (const char* growth : {"growth_0.1", "growth_0.4", "growth_1"})
            study.bars.push_back(value_at_most(growth, kCells, 1 + kGrowthTolerance));
        studies.push_back(study);
    }
    return {"dispersion",
            "the step as a linear map about a uniform lattice of particles: spectrum, limit of the time step, Gong ch. 7",
            1,
            2,
            {kCells},
            {{"shift", 0.0, "of the particles along each axis, in their spacing; 0: sub-cell centres", -1e-9, 0.5 + 1e-9},
             {"shifts", 1.0, "lattices, from `shift` to 0.5; limits and growths are those of the worst", 0, 100},
             {"cfl", 0.4, "dt c/h with the P-wave speed", 0, 10},
             {"nu", 0.0, "Poisson's ratio", -1, 0.5},
             {"steps", 1000.0, "of the nonlinear code at 0.99 and 1.01 of the limit", -1},
             {"dim", "1", "dimensions", 0, 0, {"1", "2", "3"}}},
            disperse,
            std::move(studies)};
}

}  // namespace ordo::verification
