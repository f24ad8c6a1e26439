// A plate that hits a rigid wall: elastic and plastic waves of j2, and the Hugoniot of johnson-cook with Mie-Gruneisen's pressure.
#include "verification/impact.hpp"
#include "base/error.hpp"
#include "material/laws.hpp"
#include "verification/cases.hpp"
#include "verification/elastic.hpp"

#include <cmath>

namespace ordo::verification {

namespace {

constexpr double kThickness = 1.0;  // m

/// Steel as in the benchmark of docs/verification.md, without hardening.
Material steel(const JumpOfJ2& jump)
{
    Material m{find_law("j2"), jump.density, jump.bulk - 2.0 / 3 * jump.shear, jump.shear, {}};
    m.parameters[0] = m.parameters[2] = jump.yield;
    return m;
}

/// Copper: Johnson & Cook (1983), table 1; Hugoniot of Marsh (1980), LASL shock Hugoniot data. `strength` scales A and B.
Material copper(const Hugoniot& line, double strength)
{
    constexpr double shear = 43.3e9;  // E = 117 GPa, nu = 0.35
    Material m{find_law("johnson-cook"), line.density, 0.0, shear, {}};
    const double numbers[] = {strength * 90e6, strength * 292e6, 0.31,  0.025, 1.09,       1.0,        298.0,
                              298.0,           1356.0,           383.0, 0.9,   line.sound, line.slope, 2.02};
    std::copy(std::begin(numbers), std::end(numbers), m.parameters.begin());
    m.law->complete(m);
    return m;
}

/// Integrals over initial length of a number of the particles, part by part.
class Profile {
  public:
    Profile(const State<1>& s, const std::function<double(int)>& number) : p_(s.particles), number_(number) {}

    /// The integral over X from `from` to `to`.
    double integral(double from, double to) const
    {
        double sum = 0;
        for (int i = 0; i < p_.count; ++i) sum += number_(i) * shared(i, from, to);
        return sum;
    }
    double mean(double from, double to) const { return integral(from, to) / (to - from); }

  private:
    double shared(int i, double from, double to) const
    {
        const double half = p_.V0[i] / 2;
        return std::fmax(0.0, std::fmin(to, p_.X[i][0] + half) - std::fmax(from, p_.X[i][0] - half));
    }
    const Particles<1>& p_;
    std::function<double(int)> number_;
};

/// Plateaus between fronts, measured on their middle halves, and fronts: a step with the same plateaus and the same integral. So
/// oscillations at the fronts count little in either.
Named measure_fronts(const State<1>& s, const SteppedWave& wave)
{
    const Profile stress(s, [&](int i) { return s.particles.sigma[i](0, 0); });
    const std::vector<WaveFront>& fronts = wave.fronts();
    std::vector<double> ends{0.0};
    for (const WaveFront& f : fronts) ends.push_back(f.speed * s.t);
    ends.push_back(kThickness);
    std::vector<double> middles, plateaus;
    for (std::size_t k = 0; k + 1 < ends.size(); ++k) {
        const double width = ends[k + 1] - ends[k];
        middles.push_back(ends[k] + width / 2);
        plateaus.push_back(k < fronts.size() ? stress.mean(ends[k] + width / 4, ends[k + 1] - width / 4) : 0.0);
    }
    Named found;
    for (std::size_t k = 0; k < fronts.size(); ++k) {
        const double area      = stress.integral(middles[k], middles[k + 1]) - plateaus[k + 1] * (middles[k + 1] - middles[k]);
        const double speed     = (middles[k] + area / (plateaus[k] - plateaus[k + 1])) / s.t;
        const std::string name = fronts.size() == 1 ? "shock" : k == 0 ? "plastic" : "precursor";
        found.emplace_back(name + "_speed", speed);
        found.emplace_back(name + "_speed_over_exact", speed / fronts[k].speed);
        found.emplace_back(name + "_stress", -plateaus[k]);
        found.emplace_back(name + "_stress_over_exact", plateaus[k] / fronts[k].stress);
    }
    double difference = 0, size = 0;
    for (int i = 0; i < s.particles.count; ++i) {
        const double exact = wave.stress(s.particles.X[i], s.t_F)(0, 0);
        difference += s.particles.V0[i] * std::fabs(s.particles.sigma[i](0, 0) - exact);
        size += s.particles.V0[i] * std::fabs(exact);
    }
    found.emplace_back("stress_l1", difference / size);
    return found;
}

/// Pressure, internal energy and volume ratio of Mie and Gruneisen, on the middle half between wall and shock. Behind a shock
/// the internal energy per initial volume is that of Hugoniot, p (1 - J)/2.
void add_hugoniot(Named& found, const State<1>& s, const WaveFront& shock)
{
    const Particles<1>& p = s.particles;
    const double end      = shock.speed * s.t;
    auto mean             = [&](auto&& number) { return Profile(s, number).mean(end / 4, 3 * end / 4); };
    auto history          = [&](const char* name) {
        const Array<double>& column = p.history[p.history_column(name)];
        return mean([&](int i) { return column[i]; });
    };
    const double J        = mean([&](int i) { return p.F[i](0, 0); });
    const double pressure = history("shock_pressure"), energy = history("internal_energy");
    found.insert(found.end(), {{"pressure", pressure},
                               {"pressure_over_exact", pressure / -shock.stress},
                               {"volume_ratio", J},
                               {"volume_ratio_over_exact", J / shock.F},
                               {"internal_energy", energy},
                               {"internal_energy_over_exact", energy / (-0.5 * shock.stress * (1 - shock.F))}});
}

Row hit(const Request& r)
{
    const double speed = r.values.number("speed");
    const JumpOfJ2 jump{};
    const Hugoniot line{};
    const bool is_steel = r.values.word("law") == "j2";
    Problem<1> p        = problem_of<1>(r);
    p.model.h           = {1.0 / r.cells};
    p.model.cells       = {r.cells + 1};
    p.model.materials   = {is_steel ? steel(jump) : copper(line, r.values.number("strength"))};
    p.model.conditions  = {Condition<1>{.at = 0.0, .value = {}}};
    p.dt                = r.values.number("cfl") * p.model.h[0] / p.model.materials[0].wave_speed();
    p.seeds             = fill_box(Bounds<1>{{0.0}, {kThickness}}, SubCells<1>{{}, p.model.h, {r.per_axis}});
    p.contains          = [](const Vec<1>& X) { return X[0] >= -1e-12 && X[0] <= kThickness + 1e-12; };
    const auto wave     = std::make_shared<SteppedWave>(is_steel ? jump.fronts(speed) : line.fronts(speed), speed);
    if (wave->fronts().back().speed * p.end > 0.95 * kThickness)
        throw InputError("--set end: the first wave must not reach the free side, at 95 % of its time");
    p.solution = wave;
    p.at_end   = [=](const State<1>& s) {
        Named found = measure_fronts(s, *wave);
        if (!is_steel) add_hugoniot(found, s, wave->fronts()[0]);
        return found;
    };
    return measure(p);
}

/// Both speeds on all meshes, in `speeds` relative to exact ones; the precursor's stress on the finest, in `precursor`.
Study steel_study(const std::string& method, const std::vector<int>& cells, std::pair<double, double> speeds,
                  std::pair<double, double> precursor, Study::Length length = Study::quick)
{
    std::vector<Bar> bars = orders_at_least("stress_l1", cells, 0.5);
    bars.push_back(value_between("precursor_stress_over_exact", cells.back(), precursor.first, precursor.second));
    for (const int n : cells) {
        bars.push_back(value_between("precursor_speed_over_exact", n, 0.99, 1.01));
        bars.push_back(value_between("plastic_speed_over_exact", n, n < 400 ? 0.98 : speeds.first, speeds.second));
        bars.push_back(value_between("plastic_stress_over_exact", n, n < 400 ? 0.99 : 0.995, 1.005));
    }
    return {.method = method, .set = {}, .cells = cells, .bars = bars, .length = length};
}

/// The energy that a shock dissipates stays as oscillation of the particles, so the pressure is 0.5 % low on all meshes.
Study copper_study(double strength)
{
    std::vector<Bar> bars;
    for (const int n : {200, 400})
        for (const char* name : {"shock_speed", "shock_stress", "pressure", "volume_ratio"})
            bars.push_back(value_between(std::string(name) + "_over_exact", n, 0.99, 1.01));
    return {.method = "cpdi1",
            .set    = {{"law", "johnson-cook"}, {"speed", 500.0}, {"strength", strength}},
            .cells  = {200, 400},
            .bars   = bars};
}

}  // namespace

Case plate_impact()
{
    return {"plate-impact",
            "a plate hits a rigid wall: elastic precursor and plastic wave of j2, or the Hugoniot of johnson-cook",
            1,
            2,
            {100, 200, 400},
            {{"law", "j2", "steel (j2) or copper (johnson-cook)", 0, 0, {"j2", "johnson-cook"}},
             {"speed", 40.0, "of the plate before, m/s", 0},
             {"strength", 1.0, "factor of A and B of johnson-cook", 0},
             {"cfl", 0.3, "dt c/h with the P-wave speed at rest", 0},
             {"end", 1.3e-4, "end time, s", 0}},
            hit,
            {steel_study("cpdi1", {200, 400}, {0.99, 1.0}, {1.0, 1.02}),
             steel_study("cpdi1", {400, 800, 1600}, {0.99, 1.0}, {1.0, 1.01}, Study::night),
             steel_study("apic", {200, 400, 800}, {0.99, 1.0}, {1.0, 1.011}),
             steel_study("bsmpm", {200, 400}, {0.995, 1.002}, {0.98, 1.0}),
             // Negative control: particles cross cells, two of them on 400 cells.
             {.method = "mpm", .set = {}, .cells = {200, 400}, .bars = orders_at_most("stress_l1", {200, 400}, 0.2)},
             copper_study(1.0),
             copper_study(0.01),
             // Artificial viscosity takes what particles keep as oscillations without it, a tenth of the internal energy.
             {.method = "cpdi1",
              .set    = {{"law", "johnson-cook"},
                         {"speed", 500.0},
                         {"strength", 0.01},
                         {"method.linear_viscosity", 0.3},
                         {"method.quadratic_viscosity", 1.5}},
              .cells  = {200, 400},
              .bars   = {value_between("shock_speed_over_exact", 400, 0.997, 1.001),
                         value_between("pressure_over_exact", 400, 0.999, 1.001),
                         value_between("volume_ratio_over_exact", 400, 0.9995, 1.0005),
                         value_between("internal_energy_over_exact", 200, 0.99, 1.01),
                         value_between("internal_energy_over_exact", 400, 0.99, 1.01)}}}};
}

}  // namespace ordo::verification
