// Hill's thick-walled cylinder at finite strain: a quarter of a ring of j2 under a slow pressure inside.
#include "base/error.hpp"
#include "material/laws.hpp"
#include "verification/cases.hpp"
#include "verification/elastic.hpp"
#include "verification/polar.hpp"

#include <cmath>
#include <limits>
#include <span>

namespace ordo::verification {

namespace {

constexpr double kInner = 1.0, kOuter = 2.0, kYoung = 1000.0, kPoisson = 0.3, kYield = 10.0, kDensity = 1.0;

/// A state of equilibrium: displacement of the inner rim, m, pressure, Pa, displacement of the outer rim, m.
struct Equilibrium {
    double inner, pressure, outer;
};

// Of an independent program with 400 and 800 finite elements along the radius, extrapolated, to 1e-4; up to half of the strain there
// computed. Hill (1950), The mathematical theory of plasticity, ch. V, at finite strain.
constexpr Equilibrium kPerfect[] = {
    {0.0025, 1.3060549, 0.0015922806}, {0.0050, 2.6018953, 0.0031872962}, {0.0075, 3.8876004, 0.0047850351},
    {0.0100, 5.0381056, 0.0063531965}, {0.0125, 5.8130779, 0.007828103},  {0.0150, 6.3606489, 0.0092473336},
    {0.0175, 6.7615461, 0.010631696},  {0.0200, 7.0590598, 0.011992523},  {0.0225, 7.2793177, 0.013336768}};
constexpr Equilibrium kHardening[] = {{0.0050, 2.6018953, 0.0031872962}, {0.0100, 5.0448007, 0.0063549519},
                                      {0.0150, 6.4266894, 0.0092653311}, {0.0200, 7.2084863, 0.012034222},
                                      {0.0325, 8.0530319, 0.018736345},  {0.0425, 8.2273566, 0.024034765},
                                      {0.0525, 8.3666949, 0.029347565},  {0.0625, 8.4976794, 0.034682383},
                                      {0.0825, 8.7414504, 0.045431657},  {0.1025, 8.9660626, 0.05630043}};

/// Radial displacements of both rims: from the means over the two rings of particles next to each, extrapolated linearly.
struct Rims {
    double inner, outer;

    static Rims of(const Model<2>& model, const State<2>& s, double width)
    {
        double sum[4]{}, mass[4]{};
        for (int i = 0; i < s.particles.count; ++i) {
            const Vec<2> u = displacement(model, s.particles, i), X = s.particles.x[i] - u;
            const double R       = norm(X);
            const int from_inner = static_cast<int>((R - kInner) / width), from_outer = static_cast<int>((kOuter - R) / width);
            const int ring = from_inner < 2 ? from_inner : from_outer < 2 ? 2 + from_outer : -1;
            if (ring < 0) continue;
            sum[ring] += s.particles.m[i] * dot(u, X) / R;
            mass[ring] += s.particles.m[i];
        }
        auto mean = [&](int k) { return sum[k] / mass[k]; };
        return {1.5 * mean(0) - 0.5 * mean(1), 1.5 * mean(2) - 0.5 * mean(3)};
    }
};

/// Compares displacements at the pressures of the table, where the ramp passes them.
class PressureCurve {
  public:
    PressureCurve(std::span<const Equilibrium> table) : table_(table) {}

    void see(double pressure, const Rims& now)
    {
        for (; next_ < table_.size() && table_[next_].pressure <= pressure; ++next_) {
            const Equilibrium& e = table_[next_];
            const double part    = (e.pressure - pressure_) / (pressure - pressure_);
            const Rims at{last_.inner + part * (now.inner - last_.inner), last_.outer + part * (now.outer - last_.outer)};
            found_.emplace_back("inner_over_reference_" + std::to_string(next_ + 1), at.inner / e.inner);
            found_.emplace_back("outer_over_reference_" + std::to_string(next_ + 1), at.outer / e.outer);
            largest_ = std::fmax(largest_, std::fmax(std::fabs(at.inner / e.inner - 1), std::fabs(at.outer / e.outer - 1)));
        }
        pressure_ = pressure;
        last_     = now;
    }
    /// Ratios at each row of the table, and the largest deviation from 1; not a number if the ramp did not pass all of it.
    Named found() const
    {
        Named r = found_;
        r.emplace_back("largest_deviation", next_ == table_.size() ? largest_ : std::numeric_limits<double>::quiet_NaN());
        return r;
    }

  private:
    std::span<const Equilibrium> table_;
    std::size_t next_ = 0;
    double pressure_ = 0, largest_ = 0;
    Rims last_{};
    Named found_;
};

/// From 0 to 1 over the time 1, with rate and acceleration zero at both ends.
double smooth_ramp(double s) { return s - std::sin(2 * kPi * s) / (2 * kPi); }

Row press(const Request& r)
{
    const double hardening = r.values.number("hardening");
    if (hardening != 0 && hardening != 50) throw InputError("--set hardening: there are references for 0 and 50 Pa");
    const std::span<const Equilibrium> table = hardening == 0 ? std::span<const Equilibrium>(kPerfect) : kHardening;
    Problem<2> p                             = problem_of<2>(r);
    Material m                               = ordo::elastic_material(find_law("j2"), kDensity, kYoung, kPoisson);
    m.parameters[0] = m.parameters[2] = kYield;
    m.parameters[1]                   = hardening;
    p.model.h                         = Vec<2>::filled(1.0 / r.cells);
    p.model.cells                     = Index<2>::filled(static_cast<int>(std::ceil(1.1 * kOuter * r.cells)) + 1);
    p.model.materials                 = {m};
    p.dt                              = r.values.number("cfl") * p.model.h[0] / m.wave_speed();
    const int n                       = r.per_axis * r.cells;
    add_symmetry_planes(p);
    fill_tube(p, Tube<2>{.inner = kInner, .outer = kOuter, .to = kPi / 2}, n, cells_along(kPi / 4 * (kInner + kOuter), n), 1);
    const double largest = 1.001 * table.back().pressure;
    const auto pressure  = [largest, end = p.end](double t) { return largest * smooth_ramp(t / end); };
    load_rims(p, Field([=](const FieldPoint& at) { return pressure(at.t); }), Field(0.0));

    PressureCurve curve(table);
    Row row = follow<2>(p, [&](const State<2>& s) { curve.see(pressure(s.t), Rims::of(p.model, s, 1.0 / n)); });
    if (row.failed.empty()) row.quantities = curve.found();
    return row;
}

}  // namespace

Case thick_cylinder()
{
    return {"thick-cylinder",
            "a thick-walled cylinder of j2 under a slowly growing pressure, beyond its first yield: Hill (1950), finite strain",
            2,
            2,
            {4, 8, 16},
            {{"hardening", 0.0, "slope of the yield stress, Pa: 0 or 50", -1e-9},
             {"cfl", 0.4, "dt c/h with the P-wave speed", 0},
             {"end", 3.0, "time of the ramp, s; the slowest radial vibration takes 0.3 s", 0}},
            press,
            {{.method = "cpdi2",
              .set    = {},
              .cells  = {4, 8},
              .bars   = {value_at_most("largest_deviation", 4, 0.035), value_at_most("largest_deviation", 8, 0.02)}},
             {.method = "cpdi2t", .set = {}, .cells = {8}, .bars = {value_at_most("largest_deviation", 8, 0.02)}},
             // Fully plastic, 40 times softer: the vibration takes 1.9 s.
             {.method = "cpdi2",
              .set    = {{"hardening", 50.0}, {"end", 60.0}},
              .cells  = {8, 12},
              .bars   = {value_at_most("largest_deviation", 8, 0.03), value_at_most("largest_deviation", 12, 0.02)},
              .length = Study::night},
             // Negative control: a ramp as fast as the slowest vibration.
             {.method = "cpdi2",
              .set    = {{"end", 0.3}},
              .cells  = {4},
              .bars   = {{.name = "largest_deviation", .from = 4, .low = 0.2}}}}};
}

}  // namespace ordo::verification
