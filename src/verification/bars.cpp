// A bar of the linear rate law that is set swinging: Wobbes et al. (2020) sec. 5.
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
            {"method.scheme", "musl", "the paper's scheme", 0, 0, choice_names<Scheme>()}};
}

/// The bar between fixed ends; solution and body force are the caller's.
Problem<1> bar(const Request& r)
{
    Problem<1> p{};
    p.model.method    = r.method;
    p.model.h         = {kLength / r.cells};
    p.model.cells     = {r.cells};
    p.model.materials = {{MaterialModel::linear_rate_1d, kDensity, 0.0, r.values.number("young") / 2}};
    p.model.body_forces.resize(1);
    p.model.boundaries = {Boundary<1>{.at = 0.0, .value = {}}, Boundary<1>{.outer_is_above = true, .at = kLength, .value = {}}};
    p.dt               = r.values.number("dt");
    p.end              = r.values.number("end");
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
                      orders_between("stress", {5, 10, 20, 40}, 0.95, 1.05)}}};
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
              .bars   = orders_at_least("displacement", {20, 40, 80}, 1.9) + orders_at_least("stress", {20, 40, 80}, 1.8)}}};
}

}  // namespace ordo::verification
