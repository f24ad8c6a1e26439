// Vibrating bars of the linear rate law: Wobbes et al. (2020) sec. 5.
#include "verification/cases.hpp"
#include "verification/fem.hpp"
#include "verification/measure.hpp"
#include "verification/motions.hpp"

namespace ordo::verification {

namespace {

constexpr double kLength = 1.0, kDensity = 2000.0;

std::vector<Parameter> bar_parameters(double young, double speed, double dt, double end)
{
    return {{"young", young, "Young's modulus, Pa", 0},
            {"speed", speed, "largest initial velocity, m/s"},
            {"dt", dt, "time step, s", 0},
            {"end", end, "end time, s", 0},
            {"method.scheme", "musl", "the paper's scheme", 0, 0, choice_names<TimeScheme>()}};
}

/// The bar between fixed ends; solution and body force are the caller's.
Problem<1> bar(const Request& r)
{
    Problem<1> p       = problem_of<1>(r);
    p.model.h          = {kLength / r.cells};
    p.model.cells      = {r.cells};
    p.model.materials  = {{find_law("linear-rate-1d"), kDensity, 0.0, r.values.number("young") / 2}};
    p.model.conditions = {Condition<1>{.at = 0.0, .value = {}}, Condition<1>{.outer_is_above = true, .at = kLength, .value = {}}};
    p.dt               = r.values.number("dt");
    p.seeds            = fill_box(Bounds<1>{{0.0}, {kLength}}, SubCells<1>{{}, p.model.h, {r.per_axis}});
    p.contains         = [](const Vec<1>& X) { return X[0] >= -1e-12 && X[0] <= kLength + 1e-12; };
    return p;
}

/// The linear wave u = A sin(pi X) sin(c pi t), Wobbes eq. 15: exact for small strains, where no body force is needed.
class LinearWave final : public Solution<1> {
  public:
    LinearWave(double young, double speed)
        : young_(young),
          frequency_(kPi * std::sqrt(young / kDensity) / kLength),
          motion_{speed / frequency_, kPi / kLength, frequency_}
    {}
    Vec<1> position(const Vec<1>& X, double t) const override { return kinematics(motion_, X, t).x; }
    Vec<1> velocity(const Vec<1>& X, double t) const override { return kinematics(motion_, X, t).v; }
    Mat<1> deformation(const Vec<1>& X, double t) const override { return {{{kinematics(motion_, X, t).F(0, 0).value}}}; }
    Mat<1> stress(const Vec<1>& X, double t) const override { return young_ * (deformation(X, t) - Mat<1>::identity()); }

  private:
    double young_, frequency_;
    StandingWave motion_;
};

/// A bar held at 0 and pulled at its end by g(t): waves are reflected at both ends. With S = int g,
/// u = c/E sum_n (-1)^n [S(t - ((2n + 1) L - X)/c) - S(t - ((2n + 1) L + X)/c)]; small strains (d'Alembert).
class PulledBar final : public Solution<1> {
  public:
    PulledBar(double young, double density, double traction, double rise)
        : young_(young), traction_(traction), rise_(rise), c_(std::sqrt(young / density))
    {}
    /// g(t): a step, or sin^2 over the time `rise`.
    double load(double t) const
    {
        if (t <= 0) return 0.0;
        if (t >= rise_) return traction_;
        const double s = std::sin(0.5 * kPi * t / rise_);
        return traction_ * s * s;
    }
    Vec<1> position(const Vec<1>& X, double t) const override
    {
        return {X[0] + c_ / young_ * sum(X[0], t, -1, [&](double s) { return impulse(s); })};
    }
    Vec<1> velocity(const Vec<1>& X, double t) const override
    {
        return {c_ / young_ * sum(X[0], t, -1, [&](double s) { return load(s); })};
    }
    Mat<1> deformation(const Vec<1>& X, double t) const override { return {{{1 + stress(X, t)(0, 0) / young_}}}; }
    Mat<1> stress(const Vec<1>& X, double t) const override
    {
        return {{{sum(X[0], t, 1, [&](double s) { return load(s); })}}};
    }

  private:
    double impulse(double t) const
    {
        if (t <= 0) return 0.0;
        if (t >= rise_) return traction_ * (t - rise_ / 2);
        return traction_ * (t / 2 - rise_ / (2 * kPi) * std::sin(kPi * t / rise_));
    }
    template <class F>
    double sum(double X, double t, int sign_of_returning, F&& f) const
    {
        double total = 0.0;
        for (int n = 0; (2 * n + 1) * kLength - X <= c_ * t; ++n) {
            const double way = (2 * n + 1) * kLength;
            total += (n % 2 ? -1 : 1) * (f(t - (way - X) / c_) + sign_of_returning * f(t - (way + X) / c_));
        }
        return total;
    }
    double young_, traction_, rise_, c_;
};

/// The free end lies inside a cell or on its face, depending on `cells`; beyond it the grid is empty.
Row pull(const Request& r)
{
    const double young = r.values.number("young"), density = r.values.number("density");
    const double period = kLength / std::sqrt(young / density);
    Problem<1> p        = problem_of<1>(r);
    p.model.h           = {kLength / r.cells};
    p.model.cells       = {r.cells + r.cells / 4 + 1};
    p.model.materials   = {{find_law("linear-rate-1d"), density, 0.0, young / 2}};
    p.model.conditions  = {Condition<1>{.at = 0.0, .value = {}}};
    p.dt                = r.values.number("cfl") * p.model.h[0] / kLength * period;
    p.seeds             = fill_box(Bounds<1>{{0.0}, {kLength}}, SubCells<1>{{}, p.model.h, {r.per_axis}});
    p.contains          = [](const Vec<1>& X) { return X[0] >= -1e-12 && X[0] <= kLength + 1e-12; };
    const auto bar      = std::make_shared<PulledBar>(young, density, r.values.number("traction"), r.values.number("rise"));
    p.solution          = bar;
    p.model.tractions.push_back(
        {.type = TractionType::dead, .value = {Field([bar](const FieldPoint& at) { return bar->load(at.t); })}});
    p.load = [](const Vec<1>& normal, const Vec<1>&) { return normal[0] > 0 ? 0 : -1; };
    return measure(p);
}

Row small_strain(const Request& r)
{
    Problem<1> p = bar(r);
    p.solution   = std::make_shared<LinearWave>(r.values.number("young"), r.values.number("speed"));
    return measure(p);
}

Row large_strain(const Request& r)
{
    constexpr int elements = 4000;
    Problem<1> p           = bar(r);
    p.solution             = std::make_shared<FiniteElementBar>(
        FiniteElementBar::Setting{kLength, kDensity, r.values.number("young"), r.values.number("speed"), elements, p.dt, p.end});
    p.is_reference = true;
    return measure(p);
}

}  // namespace

Case bar_small_strain()
{
    return {"bar-small-strain",
            "a bar between fixed ends after a push of 0.28 m/s, against the linear wave: Wobbes sec. 5, Table 1",
            1,
            12,
            {5, 10, 20, 40},
            bar_parameters(7e6, 0.28, 1e-7, 1.9e-6),
            small_strain,
            {{.method = "mpm",
              .set    = {},
              .cells  = {5, 10, 20, 40},
              .bars   = orders_between("displacement", {5, 10, 20, 40}, 1.95, 2.05) +
                      orders_between("l2 velocity_grid", {5, 10, 20, 40}, 1.95, 2.05) +
                      orders_between("stress", {5, 10, 20, 40}, 0.95, 1.05)},
             {.method = "mpm",
              .set    = {{"method.mass", "consistent"}},
              .cells  = {10, 20, 40},
              .bars   = orders_between("displacement", {10, 20, 40}, 1.95, 2.05)},
             {.method = "bsmpm",
              .set    = {},
              .cells  = {5, 10, 20, 40},
              .bars   = orders_between("displacement", {20, 40}, 2.95, 3.05) +
                      orders_between("l2 velocity_grid", {20, 40}, 3.95, 4.05)},
             // Negative control: with row sums splines lose more than one order.
             {.method = "bsmpm",
              .set    = {{"method.mass", "lumped"}},
              .cells  = {10, 20, 40},
              .bars   = orders_between("displacement", {20, 40}, 1.5, 1.7)},
             {.method = "ddmpm",
              .set    = {},
              .cells  = {10, 20, 40},
              .bars   = orders_between("displacement", {10, 20, 40}, 1.95, 2.05)}}};
}

/// Fig. 4 of the paper: the stress; and Table 3: conservation by the projection over the run.
Study tls_study(const std::string& method, const std::string& tls, double stress)
{
    return {.method = method,
            .set    = {{"method.tls", tls}},
            .cells  = {20},
            .bars   = {value_at_most("relative stress", 20, stress), value_at_most("largest_mass_defect", 20, 2e-14),
                       value_at_most("largest_momentum_defect", 20, 1e-14)},
            .length = Study::night};
}

Case bar_large_strain()
{
    return {"bar-large-strain",
            "a soft bar between fixed ends after a push of 0.8 m/s, against updated-Lagrangian finite elements: Wobbes sec. 5, "
            "Table 2",
            1,
            8,
            {20, 40, 80},
            bar_parameters(4e4, 0.8, 1e-5, 0.1),
            large_strain,
            {{.method = "mpm",
              .set    = {},
              .cells  = {20, 40, 80},
              .bars   = orders_at_most("displacement", {20, 40, 80}, 0.5) + orders_at_most("stress", {20, 40, 80}, 0.5)},
             {.method = "cpgimp", .set = {}, .cells = {20, 40, 80}, .bars = orders_at_least("displacement", {20, 40, 80}, 1.9)},
             {.method = "cpdi1",
              .set    = {},
              .cells  = {20, 40, 80},
              .bars   = orders_at_least("displacement", {20, 40, 80}, 1.9) + orders_at_least("stress", {20, 40, 80}, 1.8)},
             tls_study("tls-mpm", "both", 1.2e-2),
             tls_study("tls-ddmpm", "both", 5e-3),
             tls_study("tls-bsmpm", "both", 8e-3),
             tls_study("tls-bsmpm", "stress", 7e-4)}};
}

Case bar_traction()
{
    return {"bar-traction",
            "a bar held at one end and pulled at the other, at once or smoothly; waves of small strain (d'Alembert)",
            1,
            2,
            {16, 32, 64, 128},
            {{"young", 7e6, "Young's modulus, Pa", 0},
             {"density", kDensity, "initial density, kg/m^3", 0},
             {"traction", 7.0, "on the free end, Pa"},
             {"rise", 0.0, "time over which it grows, s", -1e-300},
             {"cfl", 0.4, "dt c/h", 0},
             {"end", 0.025, "end time, s", 0}},
            pull,
            {{.method = "mpm",
              .set    = {},
              .cells  = {16, 32, 64, 128},
              .bars   = orders_between("displacement", {16, 32, 64, 128}, 0.9, 1.1)},
             {.method = "cpdi2",
              .set    = {{"rise", 0.008}},
              .cells  = {16, 32, 64, 128},
              .bars   = orders_at_least("displacement", {32, 64, 128}, 1.85)},
             {.method = "bsmpm",
              .set    = {{"rise", 0.008}, {"cfl", 0.2}},
              .cells  = {16, 32, 64},
              .bars   = {value_at_most("displacement", 64, 1e-10)}}}};
}

}  // namespace ordo::verification
