// Two bars end to end, strips between planes of symmetry in 2D: a smooth wave runs through their contact, or they collide.
#include "base/error.hpp"
#include "verification/bar_waves.hpp"
#include "verification/cases.hpp"
#include "verification/contact_bodies.hpp"
#include "verification/motions.hpp"

#include <cmath>
#include <limits>
#include <memory>

namespace ordo::verification {

namespace {

constexpr int kRows = 4;  ///< cells across the strip

/// E of bar 0 and its density are 1; nu = 0, so that uniaxial strain needs no stress across.
std::array<WaveBar, 2> bars_of(const Values& v) { return {WaveBar{1.0, 1.0}, WaveBar{v.number("stiffness"), 1.0}}; }

/// The cells of a strip from x = `begin` to `end`.
CellMesh<2> strip(double begin, double end, double height, int along, int across)
{
    std::vector<CornerPoints<2>> cells;
    IndexBox<2>{{}, {along, across}}.for_each([&](const Index<2>& k) {
        CornerPoints<2> cell{};
        for (int c = 0; c < 4; ++c)
            cell.x[c] = {begin + (k[0] + (c & 1)) * (end - begin) / along, (k[1] + (c >> 1)) * height / across};
        cells.push_back(cell);
    });
    return weld(cells);
}

struct Strips {
    std::array<double, 2> length;  ///< m
    double gap;                    ///< m
    std::function<double(int body, double x)> velocity;
};

/// Bar 0 ends at x = 0, a part `shift` of a cell beyond a node; bar 1 has `faces` times as many faces at the contact.
Problem<2> strips_of(const Request& r, const Strips& strips)
{
    const Values& v = r.values;
    Problem<2> p    = problem_of<2>(r);
    const double h = 1.0 / r.cells, room = 0.25;
    const int below = static_cast<int>(std::ceil((strips.length[0] + room) / h));
    const int above = static_cast<int>(std::ceil((strips.length[1] + room) / h));
    p.model.h       = Vec<2>::filled(h);
    p.model.cells   = {below + above, kRows};
    p.model.origin  = {(-below - v.number("shift")) * h, 0.0};
    add_walls(p.model, 1, ConditionType::symmetry);
    const auto law = find_law("neo-hookean");
    for (const WaveBar& bar : bars_of(v)) p.model.materials.push_back(elastic_material(law, bar.density, bar.modulus, 0.0));
    p.model.body_forces.resize(2);
    add_contact(p.model, 0.0);
    p.dt = v.number("cfl") * h / p.model.contacts[0].wave_speed;
    if (v.word("contact") == "none") {
        p.model.contacts.clear();
        p.model.field_of_body.clear();
    }

    const int across[] = {kRows * r.per_axis, std::max(1, static_cast<int>(std::lround(v.number("faces") * kRows * r.per_axis)))};
    std::vector<CellMesh<2>> meshes;
    for (int k = 0; k < 2; ++k) {
        const double begin = k == 0 ? -strips.length[0] : strips.gap;
        const int along    = static_cast<int>(std::lround(strips.length[k] * r.cells * r.per_axis));
        meshes.push_back(strip(begin, begin + strips.length[k], kRows * h, along, across[k]));
    }
    p.plant = [meshes, velocity = strips.velocity](Model<2>& model) {
        std::vector<CellMesh<2>> cells = meshes;
        return plant_bodies(model, cells, [&](int body, const Vec<2>& x) { return Vec<2>{velocity(body, x[0]), 0.0}; });
    };
    return p;
}

/// Of the first bar on the second in the last step, over the height of the strip, Pa.
double contact_pressure(const State<2>& s, double height)
{
    return s.contacts.pairs.empty() ? std::numeric_limits<double>::quiet_NaN() : -s.contacts.pairs[0].force[0] / height;
}

void measure_wave(const PulseThroughContact& exact, double h, const State<2>& s, Row& row)
{
    const Particles<2>& p = s.particles;
    ErrorSum displacement, velocity, stress, near;
    for (int i = 0; i < p.count; ++i) {
        const double X = p.X[i][0], u = exact.displacement(X, s.t), w = exact.velocity(X, s.t_v), sigma = exact.stress(X, s.t_F);
        const Vec<2> off = p.x[i] - p.X[i] - Vec<2>{u, 0.0}, off_v = p.v[i] - Vec<2>{w, 0.0};
        displacement.add(dot(off, off), u * u, p.V[i]);
        velocity.add(dot(off_v, off_v), w * w, p.V[i]);
        Mat<2> wrong = in_plane(p.sigma[i]);
        wrong(0, 0) -= sigma;
        stress.add(ddot(wrong, wrong), sigma * sigma, p.V[i]);
        if (std::fabs(X) < h) near.add(ddot(wrong, wrong), sigma * sigma, p.V[i]);
    }
    row.error = {{"displacement", displacement.relative()},
                 {"velocity", velocity.relative()},
                 {"stress", stress.relative()},
                 {"stress_interface", near.relative()}};
}

/// The wave has a half width of 0.4 m, begins around x = -0.5 m and is at x = 0.1 m at t = 0.6 s, nowhere near the outer ends.
Row pass(const Request& r)
{
    const PulseThroughContact exact{bars_of(r.values), r.values.number("speed"), -0.5, 0.4};
    const double c1 = exact.bar[1].speed(), farthest = (0.9 - 0.4 + 0.4) * c1;
    const Problem<2> p = strips_of(r, {{2.0, std::ceil(2 * std::max(1.0, farthest)) / 2}, 0.0, [&exact](int body, double x) {
                                           return body == 0 ? exact.velocity(x, 0.0) : 0.0;
                                       }});
    if (!(p.end < 0.9)) throw InputError("--set end: waves reach the outer ends at t = 0.9 s");
    const double h = p.model.h[0], height = kRows * h;
    ErrorSum pressure;
    double overlap = 0, opening = 0;
    Row last, row               = follow<2>(p, [&](const State<2>&s) {
                  if (s.n == 0) return;
                  const double before = s.t - s.t / static_cast<double>(s.n), now = exact.contact_pressure(before);
                  const double off = contact_pressure(s, height) - now;
                  pressure.add(off * off, now * now, 1.0);
                  for (const ContactPoint<2>& q : s.contacts.points) {
                      overlap = std::max(overlap, -q.gap / h);
                      opening = std::max(opening, q.gap / h);
                  }
                  if (s.t > p.end - 1e-9) measure_wave(exact, h, s, last);
              });
    if (!row.failed.empty()) return row;
    row.error = last.error;
    row.error.emplace_back("pressure", pressure.relative());
    row.quantities = {{"overlap", overlap}, {"opening", opening}};
    return row;
}

/// Watches the contact of two bars.
class Collision {
  public:
    Collision(const BarImpact& exact, double h) : exact_(exact), h_(h) {}

    void see(const State<2>& s)
    {
        if (s.n == 0) return;
        const double pressure = contact_pressure(s, kRows * h_);
        // The places of the points are those before the step that the force belongs to.
        if (has_met_ && std::isnan(first_gap_)) {
            first_gap_ = 0;
            for (const ContactPoint<2>& q : s.contacts.points) first_gap_ = std::max(first_gap_, std::fabs(q.gap) / h_);
        }
        has_met_       = has_met_ || pressure > 0;
        const double t = s.t_v, level = 0.5 * exact_.pressure();
        impulse_ += pressure * (t - t_);
        if ((pressure >= level) != (pressure_ >= level)) {
            const double at = t_ + (level - pressure_) / (pressure - pressure_) * (t - t_);
            if (std::isnan(begin_)) begin_ = at;
            end_ = at;
        }
        t_        = t;
        pressure_ = pressure;
    }
    double duration() const { return end_ - begin_; }
    double first_gap() const { return first_gap_; }
    double impulse() const { return impulse_; }  ///< an area, N s/m
    bool has_parted() const { return has_met_ && !(pressure_ > 0); }

  private:
    static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

    BarImpact exact_;
    double h_;
    bool has_met_     = false;
    double first_gap_ = kNone, begin_ = kNone, end_ = kNone;
    double t_ = 0, pressure_ = 0, impulse_ = 0;
};

/// Mean velocity of a body along the bars, m/s.
double mean_velocity(const State<2>& s, int body)
{
    double m = 0, mv = 0;
    for (int i = 0; i < s.particles.count; ++i)
        if (s.particles.body[i] == body) {
            m += s.particles.m[i];
            mv += s.particles.m[i] * s.particles.v[i][0];
        }
    return mv / m;
}

/// Bar 0 of length 1 m hits bar 1 at rest, of a length that waves run along in the same time.
Row collide(const Request& r)
{
    const std::array<WaveBar, 2> bars = bars_of(r.values);
    const BarImpact exact{bars, {r.values.number("speed"), 0.0}};
    const double length = bars[1].speed() / bars[0].speed(), contact = 2 / bars[0].speed();
    const double gap = r.values.number("gap") / r.cells;
    Problem<2> p     = strips_of(r, {{1.0, length}, gap, [&exact](int body, double) { return exact.speeds[body]; }});
    p.end += gap / exact.speeds[0];
    Collision seen(exact, p.model.h[0]);
    std::array<double, 2> first{}, last{};
    Row row = follow<2>(p, [&](const State<2>& s) {
        seen.see(s);
        for (int body = 0; body < 2; ++body) (s.n == 0 ? first : last)[body] = mean_velocity(s, body);
    });
    if (!row.failed.empty()) return row;
    double off = 0, momentum = 0;
    for (int k = 0; k < 2; ++k) {
        off = std::max(off, std::fabs(last[k] - exact.speed_after(k)) / exact.speeds[0]);
        momentum += (last[k] - first[k]) * bars[k].density * (k == 0 ? 1.0 : length) / exact.speeds[0];
    }
    row.error      = {{"velocities", off}};
    row.quantities = {{"duration_over_exact", seen.duration() / contact},
                      {"impulse_over_exact", seen.impulse() / (exact.pressure() * contact)},
                      {"velocity_0_over_speed", last[0] / exact.speeds[0]},
                      {"velocity_1_over_speed", last[1] / exact.speeds[0]},
                      {"first_gap", seen.first_gap()},
                      {"has_parted", seen.has_parted() ? 1.0 : 0.0},
                      {"momentum_change", std::fabs(momentum)}};
    return row;
}

Row run_bars(const Request& r) { return r.values.word("mode") == "collide" ? collide(r) : pass(r); }

/// A wave through the contact: second order in all. With unlike faces splines lose this next to the ends of the contact, at the walls.
Study wave_study(const std::string& method, std::vector<std::pair<std::string, Value>> set, double velocity,
                 Study::Length length = Study::night)
{
    const std::vector<int> meshes{32, 64, 128};
    return {.method = method,
            .set    = std::move(set),
            .cells  = meshes,
            .bars   = orders_at_least("displacement", meshes, 1.9) + orders_at_least("velocity", meshes, velocity) +
                    orders_at_least("stress", meshes, 1.8) + orders_at_least("pressure", meshes, 1.8),
            .length = length};
}

/// Waves of a push that starts at once have fronts that widen: errors fall with h^(2/3).
Study collision_study(const std::string& method, double stiffness, Study::Length length = Study::night)
{
    return {.method = method,
            .set    = {{"mode", "collide"}, {"stiffness", stiffness}, {"speed", 0.01}, {"end", 3.0}},
            .cells  = {32, 64},
            .bars   = orders_at_least("velocities", {32, 64}, 0.6) +
                    std::vector<Bar>{value_between("impulse_over_exact", 64, 0.98, 1.02),
                                     value_between("duration_over_exact", 64, 0.98, 1.02), value_at_most("velocities", 64, 0.02),
                                     value_at_most("first_gap", 64, 0.02), value_between("has_parted", 64, 1, 1),
                                     value_at_most("momentum_change", 64, 1e-12)},
            .length = length};
}

}  // namespace

Case contact_bars()
{
    const std::vector<int> meshes{32, 64, 128};
    const auto next_to = orders_at_least("stress_interface", meshes, 1.8);
    std::vector<Study> studies{wave_study("icpdi2", {}, 1.9, Study::quick),
                               wave_study("icpdi2", {{"stiffness", 4.0}}, 1.9),
                               wave_study("cpls", {}, 1.9),
                               wave_study("bscpdi2", {}, 1.8),
                               wave_study("bscpls", {{"stiffness", 4.0}, {"faces", 1.0}}, 1.9),
                               collision_study("icpdi2", 1.0, Study::quick),
                               collision_study("icpdi2", 4.0),
                               collision_study("bscpdi2", 1.0),
                               // Negative control: on one grid they meet early and stick.
                               {.method = "icpdi2",
                                .set    = {{"contact", "none"}, {"mode", "collide"}, {"speed", 0.01}, {"end", 3.0}},
                                .cells  = {32},
                                .bars   = {{.name = "velocities", .from = 32, .low = 0.3}}}};
    for (const std::size_t k : {0, 1, 2, 4}) studies[k].bars = studies[k].bars + next_to;
    return {
        "contact-bars",
        "two bars end to end: a smooth wave runs through their contact (d'Alembert), or one hits the other and they part again",
        2,
        2,
        {16, 32, 64, 128},
        {{"mode", "wave", "a wave through the contact, or a collision", 0, 0, {"wave", "collide"}},
         {"contact", "impulses", "or none: both on one grid", 0, 0, {"impulses", "none"}},
         {"stiffness", 1.0, "Young's modulus of the second bar over that of the first, which is 1 Pa; the density is 1", 0},
         {"faces", 1.5, "number of faces of the second bar at the contact over that of the first", 0},
         {"shift", 0.3, "of the contact from a node at the start, cells", -1, 1},
         {"speed", 1e-5, "largest initial velocity, m/s; waves of the first bar have 1 m/s", 0},
         {"gap", 0.3, "before a collision, cells", -1e-300},
         {"cfl", 0.2, "dt c/h with the faster P wave", 0},
         {"end", 0.6, "end time, s; in a collision since the bars meet", 0}},
        run_bars,
        studies};
}

}  // namespace ordo::verification
