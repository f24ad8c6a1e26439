// Two materials that meet inside of cells: the bar and the ring of Sadeghirad, Brannon & Guilkey (2013), sec. 5, in a geometry
// that the paper leaves open (docs/enrichment.md), and a sphere in a cube. Against one-dimensional references and finite
// elements on the same cells.
#include "shape/cell_planting.hpp"
#include "verification/cases.hpp"
#include "verification/elastic.hpp"
#include "verification/layered.hpp"
#include "verification/motions.hpp"
#include "verification/sphere_mesh.hpp"

#include <algorithm>
#include <cmath>

namespace ordo::verification {

namespace {

/// Neo-Hookean materials of bodies 0 and 1. The stiff one has Young's modulus `young`, the other so many times less.
std::vector<Material> two_materials(bool first_is_stiff, double young, double contrast, double density)
{
    auto of = [&](bool is_stiff) {
        return elastic_material(find_law("neo-hookean"), density, is_stiff ? young : young / contrast, 0.3);
    };
    return {of(first_is_stiff), of(!first_is_stiff)};
}

/// Of the bar and the ring; the first of `parts` is the stiff one by default.
std::vector<Parameter> layer_parameters(const std::vector<std::string>& parts, double dt, double end)
{
    return {{"stiff", parts[0], "the stiff part", 0, 0, parts},
            {"contrast", 2.0, "ratio of Young's moduli", 0},
            {"dt", dt, "time step, s", 0},
            {"end", end, "end time, s", 0}};
}

/// The step of a reference with elements of this size: a whole part of `dt` that is stable.
double reference_step(double dt, double size, const std::vector<Material>& materials)
{
    double c = 0;
    for (const Material& m : materials) c = std::max(c, m.wave_speed());
    return dt / std::ceil(dt * c / (0.5 * size));
}

/// What a run showed at its start and after each step, or each `stride` of them.
struct Seen {
    Row row;
    std::vector<std::vector<double>> values;
};

template <int D>
Seen run(const Problem<D>& p, long stride = 1)
{
    Seen seen;
    seen.row = follow<D>(p, [&](const State<D>& s) {
        if (s.n % stride == 0) seen.values.push_back(p.observed.values(s));
    });
    return seen;
}

/// Whether a run or the finite elements that it is compared with failed, with the reason in its row.
bool has_failed(Seen& seen, const Seen& fem)
{
    if (seen.row.failed.empty() && !fem.row.failed.empty()) seen.row.failed = "the finite elements: " + fem.row.failed;
    return !seen.row.failed.empty();
}

/// The same problem by finite elements on the cells of the method.
template <int D>
Problem<D> by_elements(Problem<D> p)
{
    const Domain domain   = p.model.method.domain;
    p.model.method        = find_preset("fem")->spec;
    p.model.method.domain = domain == Domain::simplex ? domain : Domain::cell;
    p.is_recorded         = false;
    return p;
}

double mean(const Seen& seen, int k)
{
    double sum = 0;
    for (const auto& v : seen.values) sum += v[k];
    return sum / static_cast<double>(seen.values.size());
}
double rms(const Seen& seen, const std::function<double(const std::vector<double>&)>& value)
{
    double sum = 0;
    for (const auto& v : seen.values) {
        const double one = value(v);
        sum += one * one;
    }
    return std::sqrt(sum / static_cast<double>(seen.values.size()));
}
double rms(const Seen& seen, int k)
{
    return rms(seen, [k](const auto& v) { return v[k]; });
}
/// Of the difference of two values, relative to the second.
double relative_error(const Seen& seen, int k, int reference)
{
    return rms(seen, [=](const auto& v) { return v[k] - v[reference]; }) / rms(seen, reference);
}

// ---- the bar ---------------------------------------------------------------------------------------------------------

/// Of the particles A at the free end, B above and C below the interface: what the case observes.
enum BarValue { kDisplacementA, kStressB, kStressC, kReferenceA, kReferenceB, kReferenceC };

/// The particle that starts nearest to X.
template <int D>
int particle_at(const Particles<D>& p, const Vec<D>& X)
{
    const auto nearest =
        std::min_element(p.X.begin(), p.X.end(), [&](const Vec<D>& a, const Vec<D>& b) { return norm(a - X) < norm(b - X); });
    return static_cast<int>(nearest - p.X.begin());
}

/// A column of one cell's width hangs from its top. Where cells have an odd number along a metre, the interface is in the
/// middle of one.
Row hang(const Request& r)
{
    constexpr double length = 9.0, middle = 4.5, room = 1.0, gravity = -10.0;
    const double h     = 1.0 / r.cells;
    Problem<2> p       = problem_of<2>(r);
    p.model.origin     = {0.0, -room};
    p.model.h          = Vec<2>::filled(h);
    p.model.cells      = {1, static_cast<int>(std::lround((length + room) * r.cells))};
    p.model.materials  = two_materials(r.values.word("stiff") == "bottom", 1e7, r.values.number("contrast"), 1050.0);
    p.model.gravity    = {0.0, gravity};
    p.model.boundaries = {{.axis = 0, .at = 0.0, .type = BoundaryType::symmetry, .value = {}},
                          {.axis = 0, .outer_is_above = true, .at = h, .type = BoundaryType::symmetry, .value = {}},
                          {.axis = 1, .outer_is_above = true, .at = length, .type = BoundaryType::fixed, .value = {}}};
    p.dt               = r.values.number("dt");
    p.seeds            = fill_box(Bounds<2>{{0.0, 0.0}, {h, length}}, SubCells<2>{{}, p.model.h, {1, r.per_axis}});
    p.body             = [](const Vec<2>& X) { return X[1] < middle ? 0 : 1; };

    const LayeredBody reference({.geometry   = LayeredBody::Geometry::column,
                                 .ends       = {0.0, middle, length},
                                 .materials  = {p.model.materials[0], p.model.materials[1]},
                                 .elements   = {144, 144},
                                 .dt         = reference_step(p.dt, middle / 144, p.model.materials),
                                 .fixed_end  = LayeredBody::FixedEnd::high,
                                 .body_force = [](double) { return gravity; }});
    const auto observe = [&] {
        const double x = 0.5 * h, half = 0.5 * h / r.per_axis;
        return [=, A = Vec<2>{x, half}, B = Vec<2>{x, middle + half}, C = Vec<2>{x, middle - half},
                column = std::make_shared<LayeredBody>(reference)](const State<2>& s) {
            const Particles<2>& q = s.particles;
            const int a           = particle_at(q, A);
            column->advance(s.t);
            return std::vector<double>{q.x[a][1] - q.X[a][1],
                                       q.sigma[particle_at(q, B)](1, 1),
                                       q.sigma[particle_at(q, C)](1, 1),
                                       column->displacement(A[1]),
                                       column->stress(B[1]),
                                       column->stress(C[1])};
        };
    };
    p.observed = {
        {"displacement_A", "stress_B", "stress_C", "displacement_A_reference", "stress_B_reference", "stress_C_reference"},
        observe()};
    Problem<2> elements = by_elements(p);
    elements.observed   = {{}, observe()};
    const Seen fem      = run(elements);
    Seen seen           = run(p);
    if (has_failed(seen, fem)) return seen.row;
    std::size_t step      = 0;
    const auto jump_error = rms(seen, [&](const auto& v) {
        const auto& e = fem.values[step++];
        return v[kStressB] - v[kStressC] - e[kStressB] + e[kStressC];
    });
    double largest        = 0;
    for (const auto& v : seen.values) largest = std::max(largest, std::fabs(v[kDisplacementA]));
    seen.row.quantities = {{"stress_B", mean(seen, kStressB)},
                           {"stress_C", mean(seen, kStressC)},
                           {"stress ratio B/C", mean(seen, kStressB) / mean(seen, kStressC)},
                           {"stress ratio B/C of elements", mean(fem, kStressB) / mean(fem, kStressC)},
                           {"stress ratio B/C of reference", mean(seen, kReferenceB) / mean(seen, kReferenceC)},
                           {"jump error", jump_error / rms(fem, kStressB)},
                           {"displacement error", relative_error(seen, kDisplacementA, kReferenceA)},
                           {"largest displacement", largest}};
    return seen.row;
}

// ---- the ring --------------------------------------------------------------------------------------------------------

/// Of the rows of particles A at the outer rim, B within and C without the interface, means over the angle: what the case
/// observes.
enum RingValue { kMeanA, kMeanB, kMeanC, kMeanAReference, kMeanBReference, kMeanCReference };

struct Statistics {
    double sum = 0, squares = 0;
    int count = 0;

    void add(double x)
    {
        sum += x;
        squares += x * x;
        ++count;
    }
    double mean() const { return sum / count; }
    double deviation() const { return std::sqrt(std::max(0.0, squares / count - mean() * mean())); }
};

/// A quarter of a ring that suddenly feels the force of its rotation.
Row spin(const Request& r)
{
    constexpr double inner = 3.0, middle = 3.1, outer = 3.2, frequency = 1.0;
    constexpr double angular_per_metre = 193.0 / 20 / 2;  // the paper's 1544 particles have 193 around, 20 cells a metre
    const auto force                   = [](double x) { return frequency * frequency * x; };
    const int per_metre = r.cells * r.per_axis, radial = static_cast<int>(std::lround((outer - inner) * per_metre));
    const int angular = static_cast<int>(std::lround(angular_per_metre * per_metre));
    Problem<2> p      = problem_of<2>(r);
    p.model.h         = Vec<2>::filled(1.0 / r.cells);
    p.model.cells     = Index<2>::filled(static_cast<int>(std::ceil((outer + 0.1) * r.cells)));
    p.model.materials = two_materials(r.values.word("stiff") == "inner", 1e9, r.values.number("contrast"), 1000.0);
    for (const int a : {0, 1}) p.model.boundaries.push_back({.axis = a, .at = 0.0, .type = BoundaryType::symmetry, .value = {}});
    const VectorField<2> body_force{Field([=](const FieldPoint& at) { return force(at.x[0]); }),
                                    Field([=](const FieldPoint& at) { return force(at.x[1]); })};
    p.model.body_forces = {body_force, body_force};
    p.dt                = r.values.number("dt");
    const Tube<2> tube{.inner = inner, .outer = outer, .to = kPi / 2};
    p.seeds   = fill_polar(tube, radial, angular, 1);
    p.corners = polar_cells(tube, radial, angular, 1);
    p.body    = [](const Vec<2>& X) { return norm(X) < middle ? 0 : 1; };

    const auto ring =
        std::make_shared<LayeredBody>(LayeredBody::Setting{.geometry  = LayeredBody::Geometry::ring,
                                                           .ends      = {inner, middle, outer},
                                                           .materials = {p.model.materials[0], p.model.materials[1]},
                                                           .elements  = {32, 32},
                                                           .dt = reference_step(p.dt, (middle - inner) / 32, p.model.materials),
                                                           .fixed_end  = LayeredBody::FixedEnd::none,
                                                           .body_force = force});
    // f(A, B or C) for the rows of a particle, by its initial place.
    const double width   = (outer - inner) / radial;
    const auto with_rows = [=](const Vec<2>& X, auto&& f) {
        const double R = norm(X);
        if (R > outer - width) f(0);
        if (std::fabs(R - middle) < width) f(R < middle ? 1 : 2);
    };
    const auto radial_stress = [](const Particles<2>& q, int i) {
        return dot(q.X[i], in_plane(q.sigma[i]) * q.X[i]) / dot(q.X[i], q.X[i]);
    };
    std::vector<Statistics> over_time(p.seeds.size() * 2);  // of each particle, also where a method makes two of a cell
    std::vector<int> row_of(over_time.size(), 0);
    long counted = -1;
    p.observed   = {
          {"displacement_A", "stress_B", "stress_C", "displacement_A_reference", "stress_B_reference", "stress_C_reference"},
          [&](const State<2>& s) {
            ring->advance(s.t);
            Statistics rows[3];
            const Particles<2>& q = s.particles;
            for (int i = 0; i < q.count; ++i)
                with_rows(q.X[i], [&](int row) {
                    const double u = dot(q.X[i], q.x[i] - q.X[i]) / norm(q.X[i]), stress = radial_stress(q, i);
                    rows[row].add(row == 0 ? u : stress);
                    if (s.n == counted) return;  // a state is asked for once more where it is recorded
                    row_of[q.id[i]] = row;
                    over_time[q.id[i]].add(stress);
                });
            counted = s.n;
            return std::vector<double>{rows[0].mean(),
                                       rows[1].mean(),
                                       rows[2].mean(),
                                       ring->displacement(outer - width / 2),
                                       ring->stress(middle - width / 2),
                                       ring->stress(middle + width / 2)};
        }};
    Seen seen = run(p);
    if (!seen.row.failed.empty()) return seen.row;
    const auto scatter = [&](int row) {
        Statistics all;
        for (std::size_t k = 0; k < over_time.size(); ++k)
            if (row_of[k] == row) all.add(over_time[k].mean());
        return all.deviation();
    };
    auto difference     = [&](int k, int l) { return std::fabs(mean(seen, k) - mean(seen, l)); };
    seen.row.quantities = {{"stress_B", mean(seen, kMeanB)},
                           {"stress_C", mean(seen, kMeanC)},
                           {"error of stress_B", difference(kMeanB, kMeanBReference)},
                           {"error of stress_C", difference(kMeanC, kMeanCReference)},
                           {"scatter of stress_B", scatter(1)},
                           {"scatter of stress_C", scatter(2)},
                           {"displacement error", relative_error(seen, kMeanA, kMeanAReference)}};
    return seen.row;
}

// ---- the sphere ------------------------------------------------------------------------------------------------------

/// The error of a run's stresses, relative to those of another, over times and the particles k that are `chosen`.
template <class Chosen>
double stress_error(const Seen& seen, const Seen& fem, const Chosen& chosen)
{
    double error = 0, size = 0;
    for (std::size_t step = 0; step < seen.values.size(); ++step)
        for (std::size_t k = 0; k < seen.values[step].size(); ++k) {
            if (!chosen(k / 9)) continue;
            const double exact = fem.values[step][k], e = seen.values[step][k] - exact;
            error += e * e;
            size += exact * exact;
        }
    return std::sqrt(error / size);
}

/// One eighth of a stiff sphere in the middle of a soft cube that is pulled smoothly along x.
Row pull_sphere(const Request& r)
{
    constexpr double room = 1.25;
    const int refined     = static_cast<int>(r.values.number("refined"));
    const double contrast = r.values.number("contrast"), traction = r.values.number("traction");
    Problem<3> p      = problem_of<3>(r);
    p.model.h         = Vec<3>::filled(1.0 / r.cells);
    p.model.cells     = Index<3>::filled(static_cast<int>(std::ceil(room * r.cells)));
    p.model.materials = two_materials(true, 1e6 * contrast, contrast, 1000.0);
    for (int a = 0; a < 3; ++a) p.model.boundaries.push_back({.axis = a, .at = 0.0, .type = BoundaryType::symmetry, .value = {}});
    p.dt = r.values.number("dt");
    const SphereMesh mesh{.n = 5 * refined, .inner = 3 * refined, .outer = 7 * refined};
    p.corners         = mesh.cells();
    p.seeds           = seeds_of(p.corners);
    p.body            = [](const Vec<3>& X) { return norm(X) < SphereMesh::radius ? 0 : 1; };
    p.load            = [](const Vec<3>& normal, const Vec<3>& center) { return normal[0] > 0.99 && center[0] > 0.99 ? 0 : -1; };
    p.model.tractions = {{.type  = TractionType::dead,
                          .value = {Field([=, end = p.end](const FieldPoint& at) {
                                        const double s = std::sin(0.5 * kPi * at.t / end);
                                        return traction * s * s;
                                    }),
                                    Field(0.0), Field(0.0)}}};

    // Stresses by number of the particle; those of one layer of cells within and without the interface are judged.
    std::vector<double> distance;
    p.observed.values = [&](const State<3>& s) {
        const Particles<3>& q = s.particles;
        std::vector<double> stresses(9 * q.x.size());
        distance.resize(q.x.size());
        for (int i = 0; i < q.count; ++i) {
            distance[q.id[i]] = norm(q.X[i]) - SphereMesh::radius;
            for (int a = 0; a < 9; ++a) stresses[9 * q.id[i] + a] = q.sigma[i](a / 3, a % 3);
        }
        return stresses;
    };
    const auto stride = static_cast<long>(std::ceil(p.end / p.dt / 200));  // 200 times: of fine meshes all would not fit
    const Seen fem    = run(by_elements(p), stride);
    Seen seen         = run(p, stride);
    if (has_failed(seen, fem)) return seen.row;
    const double layer  = 0.06 / refined;
    seen.row.quantities = {
        {"stress error within", stress_error(seen, fem, [&](auto k) { return distance[k] < 0 && distance[k] > -layer; })},
        {"stress error without", stress_error(seen, fem, [&](auto k) { return distance[k] > 0 && distance[k] < layer; })},
        {"interface stress error", stress_error(seen, fem, [&](auto k) { return std::fabs(distance[k]) < layer; })},
        {"stress error", stress_error(seen, fem, [](auto) { return true; })}};
    return seen.row;
}

}  // namespace

Case bimaterial_bar()
{
    auto study = [](const std::string& method, const std::string& stiff, std::vector<Bar> bars) {
        return Study{.method = method, .set = {{"stiff", stiff}}, .cells = {1}, .bars = std::move(bars)};
    };
    auto ratio_in  = [](double low, double high) { return value_between("stress ratio B/C", 1, low, high); };
    auto swings_on = [](const std::string& method) {
        return Study{.method = method,
                     .set    = {{"end", 10.0}},
                     .cells  = {1},
                     .bars   = {value_at_most("largest displacement", 1, 0.085), value_at_most("jump error", 1, 0.07)},
                     .length = Study::night};
    };
    return {"bimaterial-bar",
            "a bar of two materials that meet inside a cell, hung up suddenly: Sadeghirad et al. (2013), sec. 5.1",
            2,
            2,
            {1},
            layer_parameters({"top", "bottom"}, 5e-5, 1.0),
            hang,
            {// Negative control: corners of both materials spread to the nodes of one cell.
             study("cpdi2", "top", {ratio_in(1.957, 1.977), value_between("jump error", 1, 0.51, 0.54)}),
             study("cpdi2e", "top", {ratio_in(1.106, 1.126), value_at_most("jump error", 1, 0.07)}),
             study("fem", "top", {ratio_in(1.106, 1.126)}), study("cpdi2", "bottom", {ratio_in(0.51, 0.53)}),
             study("cpdi2e", "bottom", {ratio_in(1.109, 1.129), value_at_most("jump error", 1, 0.07)}),
             study("fem", "bottom", {ratio_in(1.109, 1.129)}), swings_on("cpdi2e"), swings_on("fem")}};
}

Case bimaterial_ring()
{
    auto study = [](double dt, Study::Length length) {
        return Study{.method = "cpdi2e",
                     .set    = {{"dt", dt}},
                     .cells  = {20},
                     .bars   = {value_at_most("error of stress_B", 20, 1.0), value_at_most("error of stress_C", 20, 1.0),
                                value_at_most("scatter of stress_B", 20, 6.0), value_at_most("scatter of stress_C", 20, 6.0),
                                value_at_most("displacement error", 20, 5e-4)},
                     .length = length};
    };
    return {
        "bimaterial-ring",
        "a ring of two materials that meet inside cells, set turning suddenly: Sadeghirad et al. (2013), sec. 5.2",
        2,
        2,
        {20},
        layer_parameters({"inner", "outer"}, 1e-6, 0.02),
        spin,
        {study(1e-5, Study::quick),
         study(1e-6, Study::night),
         // Negative control.
         {.method = "cpdi2", .set = {{"dt", 1e-5}}, .cells = {20}, .bars = {value_between("scatter of stress_B", 20, 30, 35)}}}};
}

Case bimaterial_sphere()
{
    auto study = [](const std::string& method, const std::string& enrichment, double low, double high, Study::Length length) {
        Study s{.method = method,
                .set    = {{"method.enrichment", enrichment}},
                .cells  = {8},
                .bars   = {value_between("interface stress error", 8, low, high)},
                .length = length};
        if (length == Study::quick) s.set.emplace_back("end", 0.05);
        return s;
    };
    return {"bimaterial-sphere",
            "one eighth of a stiff sphere in a soft cube that is pulled, against finite elements on the same cells",
            3,
            1,
            {8},
            {{"contrast", 10.0, "ratio of Young's moduli", 0},
             {"traction", 5e4, "at the end, Pa"},
             {"refined", 1.0, "how many times finer the cells of the particles are", 0.5, 10.0},
             {"dt", 1e-4, "time step, s", 0},
             {"end", 0.2, "end time, s", 0}},
            pull_sphere,
            {study("cpdi2", "none", 0.6, 0.8, Study::night), study("cpdi2e", "interface", 0.0, 0.2, Study::night),
             study("cpdi2e", "adjacent", 0.0, 0.04, Study::night), study("cpdi2e", "adjacent", 0.0, 0.1, Study::quick)}};
}

}  // namespace ordo::verification
