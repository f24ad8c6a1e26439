// Two layers that press on each other and slide or stick along an interface at an angle to the grid: manufactured, with exact
// tractions of Coulomb's law at the interface.
#include "verification/cases.hpp"
#include "verification/contact_bodies.hpp"
#include "verification/elastic.hpp"
#include "verification/motions.hpp"

#include <cmath>

namespace ordo::verification {

namespace {

/// The geometry and the load of both layers. In their own axes S runs along the interface and N across it, A lies below (-H < N < 0)
/// and B above.
struct Layers {
    static constexpr double height = 0.5, width = 0.55, period = 2.0, half_length = 0.625, poisson = 0.3, young = 0.742857142857;

    Material below, above;
    double angle, amplitude, friction, speed, share;  ///< share: of the friction limit that is the shear stress
    Vec<2> pivot;                                     ///< on the interface, m

    Vec<2> to_axes(const Vec<2>& x) const
    {
        const Vec<2> d = x - pivot;
        return {std::cos(angle) * d[0] + std::sin(angle) * d[1], -std::sin(angle) * d[0] + std::cos(angle) * d[1]};
    }
    Vec<2> from_axes(const Vec<2>& s) const
    {
        return pivot + Vec<2>{std::cos(angle) * s[0] - std::sin(angle) * s[1], std::sin(angle) * s[0] + std::cos(angle) * s[1]};
    }
    Vec<2> along() const { return {std::cos(angle), std::sin(angle)}; }
};

/// The motion of one layer: at N = 0 its normal stress is -Q and its shear stress `share` mu_f Q, with the same Q(S, t) for both;
/// layer B has slid by d = V t. Far from the interface and at the outer faces it is at rest and free of stress.
struct Layer {
    Layers of;
    bool is_above;

    double slip(double t) const { return is_above ? of.speed * t : 0.0; }

    template <class T>
    ORDO_FLAT static T pressure(const Material& m, const T& J)
    {
        return -1.0 * (m.mu * (J * J - 1.0) + m.lambda * log(J)) / J;
    }

    template <int D, class T>
    ORDO_FLAT Vec<D, T> operator()(const Vec<D, T>& X, const T& t) const
    {
        const double c = std::cos(of.angle), s = std::sin(of.angle);
        const T dx = X[0] - of.pivot[0], dy = X[1] - of.pivot[1];
        const T S = c * dx + s * dy, N = c * dy - s * dx;
        const T d = is_above ? of.speed * t : T(0.0);
        // The load is a bump of the place on layer A.
        T place      = S + d;
        place        = choose(place + Layers::width, place, T(-Layers::width));
        place        = choose(place - Layers::width, T(Layers::width), place);
        T bump       = cos((0.5 * kPi / Layers::width) * place);
        bump         = bump * bump;
        bump         = bump * bump;
        const T wave = sin((kPi / Layers::period) * t), amp = of.amplitude * (wave * wave);
        T J       = T(1.0) - amp * bump;
        const T Q = pressure(of.below, J);
        if (is_above) {  // Newton's method for the same Q; derivatives converge with the value
            const Material& m = of.above;
            J                 = T(1.0) - (1 / m.p_wave_modulus()) * Q;
            for (int k = 0; k < 5; ++k) {
                const T value = pressure(m, J);
                const T slope = -1.0 * (T(2 * m.mu) + m.lambda / J / J) - value / J;
                J             = J - (value - Q) / slope;
            }
        }
        const T fall       = is_above ? T(1.0) - (1 / Layers::height) * N : T(1.0) + (1 / Layers::height) * N;
        const T psi        = N * fall * fall;
        const double shear = of.share * of.friction / (is_above ? of.above.mu : of.below.mu);
        const T x = S + d + shear * (Q * psi), y = N - (T(1.0) - J) * psi;
        Vec<D, T> r = X;
        r[0]        = of.pivot[0] + (c * x - s * y);
        r[1]        = of.pivot[1] + (s * x + c * y);
        return r;
    }
};

using LayerSolution = Manufactured<2, Layer, AnyLaw<2>>;

struct Solutions {
    LayerSolution below, above;

    explicit Solutions(const Layers& of)
        : below({of, false}, AnyLaw<2>(of.below), of.below.density), above({of, true}, AnyLaw<2>(of.above), of.above.density)
    {}
    const LayerSolution& of(int body) const { return body == 0 ? below : above; }
};

/// The cells of a box in the layers' axes, turned to those of the grid.
CellMesh<2> turned_box(const Layers& of, const Vec<2>& lower, const Vec<2>& upper, double size)
{
    Index<2> n{};
    for (int a = 0; a < 2; ++a) n[a] = static_cast<int>(std::lround((upper[a] - lower[a]) / size));
    std::vector<CornerPoints<2>> cells;
    IndexBox<2>{{}, n}.for_each([&](const Index<2>& k) {
        CornerPoints<2> cell{};
        for (int c = 0; c < 4; ++c) {
            Vec<2> s{};
            for (int a = 0; a < 2; ++a) s[a] = lower[a] + (k[a] + (c >> a & 1)) * (upper[a] - lower[a]) / n[a];
            cell.x[c] = of.from_axes(s);
        }
        cells.push_back(cell);
    });
    return weld(cells);
}

Layers layers_of(const Request& r, const Model<2>& model)
{
    const Values& v    = r.values;
    const bool slides  = v.word("mode") == "slip";
    const double young = Layers::young;
    const auto law     = find_law("neo-hookean");
    return {.below     = elastic_material(law, 1.0, young, Layers::poisson),
            .above     = elastic_material(law, 1.0, young * v.number("stiffness"), Layers::poisson),
            .angle     = v.number("angle"),
            .amplitude = v.number("amplitude"),
            .friction  = v.number("friction"),
            .speed     = slides ? 0.2 : 0.0,
            .share     = slides ? 1.0 : 0.5,
            .pivot     = {0.137 * model.h[0], 0.3 * model.h[1]}};
}

/// Both layers, the upper one longer by what it slides.
std::vector<CellMesh<2>> meshes_of(const Layers& layers, double size, double end)
{
    const double room = size * std::ceil(layers.speed * end / size * (1 - 1e-12));
    return {turned_box(layers, {-Layers::half_length, -Layers::height}, {Layers::half_length, 0.0}, size),
            turned_box(layers, {-Layers::half_length - room, 0.0}, {Layers::half_length + room, Layers::height}, size)};
}

void measure_layers(const Layers& layers, const Solutions& exact, const State<2>& s, double h, Row& row)
{
    const Particles<2>& p = s.particles;
    ErrorSum displacement, stress, near;
    double velocity = 0, volume = 0;
    for (int i = 0; i < p.count; ++i) {
        const LayerSolution& of = exact.of(p.body[i]);
        const Vec<2> x = of.position(p.X[i], s.t), v = of.velocity(p.X[i], s.t_v);
        const Vec<2> u = x - p.X[i] - (p.body[i] == 1 ? layers.speed * s.t : 0.0) * layers.along();
        displacement.add(dot(p.x[i] - x, p.x[i] - x), dot(u, u), p.V[i]);
        velocity += p.V[i] * dot(p.v[i] - v, p.v[i] - v);
        volume += p.V[i];
        const Mat<2> sigma = of.stress(p.X[i], s.t_F), off = in_plane(p.sigma[i]) - sigma;
        stress.add(ddot(off, off), ddot(sigma, sigma), p.V[i]);
        if (std::fabs(layers.to_axes(p.X[i])[1]) < h) near.add(ddot(off, off), ddot(sigma, sigma), p.V[i]);
    }
    row.error      = {{"displacement", displacement.relative()},
                      {"velocity", std::sqrt(velocity / volume) / (0.3 * layers.amplitude * Layers::height)},
                      {"stress", stress.relative()},
                      {"stress_interface", near.relative()}};
    row.quantities = {{"overlap", largest_overlap(s, h)}};
}

Row slide(const Request& r)
{
    const bool has_contact = r.values.word("contact") == "impulses";
    Problem<2> p           = problem_of<2>(r);
    const double h         = 1.0 / r.cells;
    p.model.h              = Vec<2>::filled(h);
    const int half         = static_cast<int>(std::ceil(1.2 * r.cells));
    p.model.cells          = Index<2>::filled(2 * half);
    p.model.origin         = Vec<2>::filled(-half * h);
    const Layers layers    = layers_of(r, p.model);
    const auto exact       = std::make_shared<const Solutions>(layers);
    p.model.materials      = {layers.below, layers.above};
    p.model.body_forces.resize(2);
    p.model.body_force_kernel = [exact](const ParticleView<2>& q, std::ptrdiff_t begin, std::ptrdiff_t end, double t) {
        for (std::ptrdiff_t last; begin < end; begin = last) {
            for (last = begin + 1; last < end && q.body[last] == q.body[begin];) ++last;
            exact->of(q.body[begin]).fill_body_force(q, begin, last, t);
        }
    };
    if (has_contact) add_contact(p.model, layers.friction, r.values.word("points") == "faces");
    p.dt    = r.values.number("cfl") * h / std::max(layers.below.wave_speed(), layers.above.wave_speed());
    p.plant = [=, size = h / r.per_axis, end = p.end](Model<2>& model) {
        std::vector<CellMesh<2>> meshes = meshes_of(layers, size, end);
        return plant_bodies(model, meshes, [&](int body, const Vec<2>& x) { return exact->of(body).velocity(x, 0.0); });
    };
    const double end = p.end;
    Row row, last;
    row            = follow<2>(p, [&](const State<2>& s) {
        if (s.t > end - 1e-9) measure_layers(layers, *exact, s, h, last);
    });
    row.error      = last.error;
    row.quantities = last.quantities;
    return row;
}

/// Of second order with bscpls, in the stress next to the interface too: with slip and stick, along the grid and askew. On hats the
/// stress has first order. On one grid the stress next to the interface does not converge.
std::vector<Study> layer_studies()
{
    const std::vector<int> quick{16, 32}, all{16, 32, 64}, fine{64, 128};
    auto bars = [](const std::vector<int>& cells, double next_to_it) {
        return all_orders_at_least(cells, 1.9) + orders_at_least("stress_interface", cells, next_to_it);
    };
    std::vector<Study> studies;
    for (const char* mode : {"slip", "stick"}) {
        studies.push_back({.method = "bscpls", .set = {{"mode", mode}}, .cells = quick, .bars = bars(quick, 1.8)});
        for (const double angle : {0.4, 0.0})
            for (const double stiffness : {10.0, 1.0})
                studies.push_back({.method = "bscpls",
                                   .set    = {{"mode", mode}, {"angle", angle}, {"stiffness", stiffness}},
                                   .cells  = all,
                                   .bars   = bars(all, 1.8),
                                   .length = Study::night});
        for (const char* method : {"cpdi1", "cpdi2", "cpls"})
            studies.push_back({.method = method,
                               .set    = {{"mode", mode}},
                               .cells  = all,
                               .bars   = orders_at_least("displacement", all, 1.9) + orders_at_least("stress", all, 0.9),
                               .length = Study::night});
    }
    studies.push_back({.method = "bscpls", .set = {}, .cells = fine, .bars = bars(fine, 1.4), .length = Study::night});
    studies.push_back({.method = "bscpls",
                       .set    = {{"mode", "stick"}, {"contact", "none"}},
                       .cells  = quick,
                       .bars   = orders_at_most("stress_interface", quick, 0.5)});
    return studies;
}

}  // namespace

Case contact_layers()
{
    return {"contact-layers",
            "two layers pressed together slide or stick along an interface that cuts the grid's cells: exact tractions of "
            "Coulomb's law (ours)",
            2,
            2,
            {16, 32, 64},
            {{"mode", "slip", "whether the layers slide, or stick at half the limit", 0, 0, {"slip", "stick"}},
             {"contact", "impulses", "or none: both on one grid", 0, 0, {"impulses", "none"}},
             {"points", "vertices", "where contact acts", 0, 0, {"vertices", "faces"}},
             {"angle", 0.4, "of the interface to the grid, rad"},
             {"friction", 0.3, "Coulomb's coefficient", 0},
             {"stiffness", 10.0, "Young's modulus of the upper layer over that of the lower", 0},
             {"amplitude", 0.02, "largest compression at the interface", 0, 0.3},
             {"cfl", 0.2, "dt c/h with the faster P wave", 0},
             {"end", 0.7, "end time, s", 0}},
            slide,
            layer_studies()};
}

}  // namespace ordo::verification
