// Two rings with unlike numbers of faces: pressed together against Lame's solution, or one that spins brakes on the other.
#include "base/error.hpp"
#include "shape/cell_planting.hpp"
#include "verification/cases.hpp"
#include "verification/contact_bodies.hpp"
#include "verification/motions.hpp"
#include "verification/polar.hpp"
#include "verification/pressed_rings.hpp"

#include <cmath>
#include <memory>

namespace ordo::verification {

namespace {

/// From 0 to 1 over the time 1, with rate and acceleration zero at both ends; then 1.
double smooth_ramp(double s) { return s >= 1 ? 1.0 : s - std::sin(2 * kPi * s) / (2 * kPi); }

/// Cells of about a square; the outer ring has `faces` times as many around as the inner one.
std::vector<CellMesh<2>> ring_meshes(const PressedRings& rings, double to, int per_metre, double faces)
{
    std::vector<CellMesh<2>> r;
    const ElasticRing& inner = rings.ring[0];
    const int around         = cells_along(0.5 * to * (inner.inner + inner.outer), per_metre);
    for (const ElasticRing& ring : rings.ring) {
        const int radial  = cells_along(ring.outer - ring.inner, per_metre);
        const int angular = r.empty() ? around : std::max(2, static_cast<int>(std::lround(faces * around)));
        r.push_back(weld(polar_cells(Tube<2>{.inner = ring.inner, .outer = ring.outer, .to = to}, radial, angular, 1)));
    }
    return r;
}

/// Whole rings on a grid that is not aligned with their axis, or a quarter between planes of symmetry. The pressure inside grows to `largest`. Without contact the exact pressure acts
/// on both surfaces.
Problem<2> rings_of(const Request& r, const PressedRings& rings, double spin)
{
    const Values& v     = r.values;
    Problem<2> p        = problem_of<2>(r);
    const double h      = 1.0 / r.cells;
    const int half      = static_cast<int>(std::ceil(1.05 * rings.ring[1].outer / h)) + 1;
    const bool is_whole = v.word("part") == "whole";
    p.model.h           = Vec<2>::filled(h);
    p.model.cells       = Index<2>::filled(is_whole ? 2 * half : half);
    if (is_whole)
        p.model.origin = {(-half + 0.137) * h, (-half + 0.3) * h};
    else
        add_symmetry_planes(p);
    const auto law = find_law("neo-hookean");
    for (const ElasticRing& ring : rings.ring)
        p.model.materials.push_back(ordo::elastic_material(law, ring.density, ring.young, ring.poisson));
    p.model.body_forces.resize(2);
    add_contact(p.model, v.number("friction"), v.word("points") == "faces");
    p.dt = v.number("cfl") * h / p.model.contacts[0].wave_speed;

    const bool has_contact = v.word("contact") == "impulses";
    if (!has_contact) p.model.contacts.clear();
    const double inside = v.number("pressure");
    for (const double most : {inside, has_contact ? 0.0 : rings.contact_pressure(inside)})
        p.model.tractions.push_back(
            {.type  = TractionType::pressure,
             .value = {Field([=, ramp = v.number("ramp")](const FieldPoint& at) { return most * smooth_ramp(at.t / ramp); })}});
    p.plant = [meshes = ring_meshes(rings, is_whole ? 2 * kPi : kPi / 2, r.per_axis * r.cells, v.number("faces")), spin,
               has_contact](Model<2>& model) {
        std::vector<CellMesh<2>> cells = meshes;
        Particles<2> q                 = plant_bodies(model, cells, [spin](int body, const Vec<2>& x) {
            return body == 0 ? Vec<2>{-spin * x[1], spin * x[0]} : Vec<2>{};
        });
        const auto load                = [&](int body, int traction, double side) {
            add_loads<2>(model.loads, q, cells[body], body == 0 ? 0 : static_cast<int>(cells[0].cells.size()), traction,
                         [&](const Vec<2>& normal, const Vec<2>& center) {
                             return side * dot(normal, center) > 0.5 * norm(center) ? 1.0 : 0.0;
                         });
        };
        load(0, 0, -1.0);
        if (!has_contact) load(0, 1, 1.0);
        if (!has_contact) load(1, 1, -1.0);
        return q;
    };
    return p;
}

/// The mean of the contact pressure over that of the solution, and its scatter over the points.
Named pressures(const State<2>& s, double exact)
{
    double area = 0, sum = 0, squares = 0;
    for (const ContactPoint<2>& q : s.contacts.points) {
        const double p = q.p / s.contacts.dt / exact;
        area += q.area;
        sum += q.area * p;
        squares += q.area * p * p;
    }
    const double mean = sum / area;
    return {{"pressure_over_exact", mean}, {"pressure_scatter", std::sqrt(std::max(0.0, squares / area - mean * mean))}};
}

void measure_rest(const PressedRings& rings, double inside, double h, const State<2>& s, Row& row)
{
    const Particles<2>& p = s.particles;
    ErrorSum displacement, stress, near;
    for (int i = 0; i < p.count; ++i) {
        const ElasticRing& ring = rings.ring[p.body[i]];
        const auto load         = rings.load(p.body[i], inside);
        const double R          = norm(p.X[i]);
        const Vec<2> radial = p.X[i] * (1 / R), u = ring.displacement(R, load) * radial, off = p.x[i] - p.X[i] - u;
        displacement.add(dot(off, off), dot(u, u), p.V[i]);
        const auto [along, around] = ring.stresses(R, load);
        Mat<2> exact               = around * Mat<2>::identity();
        for (int a = 0; a < 2; ++a)
            for (int b = 0; b < 2; ++b) exact(a, b) += (along - around) * radial[a] * radial[b];
        const Mat<2> wrong = in_plane(p.sigma[i]) - exact;
        stress.add(ddot(wrong, wrong), ddot(exact, exact), p.V[i]);
        if (std::fabs(R - rings.common_radius()) < h) near.add(ddot(wrong, wrong), ddot(exact, exact), p.V[i]);
    }
    row.quantities = pressures(s, rings.contact_pressure(inside));
    row.error      = {{"displacement", displacement.relative()},
                      {"stress", stress.relative()},
                      {"stress_interface", near.relative()},
                      {"pressure", std::fabs(find(row.quantities, "pressure_over_exact") - 1)}};
    row.quantities.emplace_back("overlap", largest_overlap(s, h));
}

Row press(const Request& r)
{
    const PressedRings rings = PressedRings::of(r.values.number("stiffness"));
    const double largest     = r.values.number("pressure");
    Problem<2> p             = rings_of(r, rings, 0.0);
    p.model.damping          = {.type = DampingType::viscous, .rate = r.values.number("damping")};
    Row last;
    Row row        = follow<2>(p, [&](const State<2>& s) {
        if (s.t > p.end - 1e-9) measure_rest(rings, largest, p.model.h[0], s, last);
    });
    row.error      = last.error;
    row.quantities = last.quantities;
    return row;
}

/// Angular momentum of a body over its moment of inertia.
double angular_speed(const PressedRings& rings, const State<2>& s, int body)
{
    const Particles<2>& p = s.particles;
    double sum            = 0;
    for (int i = 0; i < p.count; ++i)
        if (p.body[i] == body) sum += p.m[i] * (p.x[i][0] * p.v[i][1] - p.x[i][1] * p.v[i][0]);
    return sum / rings.ring[body].inertia();
}

Row spin(const Request& r)
{
    const PressedRings rings = PressedRings::of(r.values.number("stiffness"));
    const double largest = r.values.number("pressure"), ramp = r.values.number("ramp"), friction = r.values.number("friction");
    const double speed = r.values.number("spin");
    if (r.values.word("part") != "whole") throw InputError("--set mode=spin: planes of symmetry hold the rings; set part=whole");
    if (!(friction > 0)) throw InputError("--set mode=spin: rings without friction do not brake; set friction");
    const auto inside  = [=](double t) { return largest * smooth_ramp(t / ramp); };
    const Problem<2> p = rings_of(r, rings, speed);

    SpinningRings exact(rings, friction, speed);
    double t = 0;
    std::array<double, 2> first{}, last{};
    Row row = follow<2>(p, [&](const State<2>& s) {
        if (s.n > 0) exact.step(t, s.t_v - t, inside);
        t = s.t_v;
        for (int body = 0; body < 2; ++body) (s.n == 0 ? first : last)[body] = angular_speed(rings, s, body);
    });
    if (!row.failed.empty()) return row;
    const std::array<double, 2>& w = exact.speeds();
    if (!(w[0] > w[1])) throw InputError("--set mode=spin: the rings stop sliding before the end; increase spin or reduce end");
    const double inner = (last[0] - first[0]) / (w[0] - speed), outer = (last[1] - first[1]) / w[1];
    const double kept = rings.ring[0].inertia() * (last[0] - first[0]) + rings.ring[1].inertia() * (last[1] - first[1]);
    row.error         = {{"braking", std::max(std::fabs(inner - 1), std::fabs(outer - 1))}};
    row.quantities    = {{"inner_over_exact", inner},
                         {"outer_over_exact", outer},
                         {"angular_momentum_change", std::fabs(kept) / (rings.ring[0].inertia() * speed)}};
    return row;
}

Row run_rings(const Request& r) { return r.values.word("mode") == "spin" ? spin(r) : press(r); }

/// The pressure of the contact, the displacement and their orders.
Study press_study(const std::string& method, double stiffness, const std::vector<int>& meshes, Study::Length length)
{
    return {.method = method,
            .set    = {{"stiffness", stiffness}},
            .cells  = meshes,
            .bars   = {value_at_most("pressure", 16, 0.01),
                       value_at_most("displacement", 16, 1.5e-3),
                       {.name = "displacement", .from = 8, .to = 16, .low = 1.9},
                       {.name = "pressure", .from = 8, .to = 16, .low = 1.9},
                       value_at_most("overlap", 16, 1e-3)},
            .length = length};
}

/// With points on the faces those of the other side matter less: the stress next to the interface has less than 2/3 of the error.
Study press_on_faces(const std::string& method, const std::vector<int>& meshes, Study::Length length)
{
    Study r = press_study(method, 1.0, meshes, length);
    r.set.emplace_back("points", "faces");
    r.bars.push_back(value_at_most("pressure_scatter", 16, 1e-3));
    r.bars.push_back(value_at_most("stress_interface", 16, 3e-3));
    return r;
}

/// With as many faces on both sides the stress next to the interface is as good as elsewhere. The displacements are those of small
/// strains up to about 1e-4 of them.
Study conforming_study(const std::string& method, const std::string& part, Study::Length length)
{
    const std::vector<int> meshes{8, 16, 32};
    return {.method = method,
            .set    = {{"part", part}, {"faces", 1.0}, {"pressure", 1e-5}},
            .cells  = meshes,
            .bars   = orders_at_least("displacement", meshes, 1.9) + orders_at_least("pressure", meshes, 1.9) +
                    orders_at_least("stress", meshes, 1.8) + orders_at_least("stress_interface", meshes, 1.5) +
                    std::vector<Bar>{value_at_most("pressure_scatter", 32, 4e-4)},
            .length = length};
}

Study spin_study(const std::string& method, const std::vector<Bar>& bars, const std::vector<int>& meshes, Study::Length length)
{
    return {.method = method,
            .set    = {{"mode", "spin"}, {"friction", 0.3}, {"end", 10.0}},
            .cells  = meshes,
            .bars   = bars,
            .length = length};
}

}  // namespace

Case contact_ring()
{
    const std::vector<int> coarse{8, 16}, all{8, 16, 32};
    const Bar at_16 = value_at_most("braking", 16, 0.02), at_32 = value_at_most("braking", 32, 0.006);
    const std::vector<Study> studies{press_study("bscpdi2", 1.0, coarse, Study::quick),
                                     press_study("bscpdi2", 10.0, coarse, Study::night),
                                     press_study("cpdi2", 1.0, all, Study::night),
                                     press_study("icpdi2", 10.0, all, Study::night),
                                     press_on_faces("bscpdi2", coarse, Study::quick),
                                     conforming_study("bscpls", "quarter", Study::quick),
                                     conforming_study("bscpdi2", "quarter", Study::night),
                                     conforming_study("bscpdi2", "whole", Study::night),
                                     spin_study("icpdi2", {at_16}, {16}, Study::quick),
                                     spin_study("icpdi2", {at_32}, {32}, Study::night),
                                     spin_study("bscpdi2", {at_16, at_32}, {16, 32}, Study::night)};
    return {"contact-ring",
            "two rings with unlike numbers of faces pressed together by a pressure inside, or one that spins brakes on the "
            "other: Lame",
            2,
            2,
            {8, 16, 32},
            {{"mode", "press", "whether the rings come to rest, or the inner one spins", 0, 0, {"press", "spin"}},
             {"contact", "impulses", "or the exact pressure on both surfaces, without contact", 0, 0, {"impulses", "given"}},
             {"points", "vertices", "where contact acts", 0, 0, {"vertices", "faces"}},
             {"part", "whole", "or a quarter between planes of symmetry", 0, 0, {"whole", "quarter"}},
             {"stiffness", 1.0, "Young's modulus of the outer ring over that of the inner, which is 1 Pa", 0},
             {"faces", 1.44, "number of cells around the outer ring over that of the inner", 0},
             {"pressure", 1e-4, "inside, after the ramp, Pa", 0},
             {"friction", 0.0, "Coulomb's coefficient", -1e-300},
             {"ramp", 6.0, "time over which the pressure grows, s; breathing takes 3.7 s", 0},
             {"damping", 2.0, "rate at which velocities decay in mode press, 1/s", -1e-300},
             {"spin", 1.6e-3, "angular speed of the inner ring at the start in mode spin, rad/s", 0},
             {"cfl", 0.2, "dt c/h with the faster P wave", 0},
             {"end", 14.0, "end time, s", 0}},
            run_rings,
            studies};
}

}  // namespace ordo::verification
