// Two materials with an interface inside cells: the bar and the ring of Sadeghirad, Brannon & Guilkey (2013), sec. 5, in a
// geometry that the paper does not specify (docs/enrichment.md), and a sphere in a cube. Compared with one-dimensional
// references and with finite elements on the same cells.
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

/// Neo-Hookean materials of bodies 0 and 1. The stiff one has Young's modulus `young`, the other young/contrast.
std::vector<Material> two_materials(bool first_is_stiff, double young, double contrast, double density)
{
    auto of = [&](bool is_stiff) {
        return elastic_material(find_law("neo-hookean"), density, is_stiff ? young : young / contrast, 0.3);
    };
    return {of(first_is_stiff), of(!first_is_stiff)};
}

/// Parameters of the bar and the ring; the first of `parts` is the stiff one by default.
std::vector<Parameter> layer_parameters(const std::vector<std::string>& parts, double dt, double end)
{
    return {{"stiff", parts[0], "the stiff part", 0, 0, parts},
            {"contrast", 2.0, "ratio of Young's moduli", 0},
            {"dt", dt, "time step, s", 0},
            {"end", end, "end time, s", 0}};
}

/// The stable step of a reference with elements of this size: `dt` divided by a whole number.
double reference_step(double dt, double size, const std::vector<Material>& materials)
{
    double c = 0;
    for (const Material& m : materials) c = std::max(c, m.wave_speed());
    return dt / std::ceil(dt * c / (0.5 * size));
}

/// The observed values of a run at its start and after each step, or each `stride` steps.
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

/// Whether a run or the finite elements for comparison failed; the reason goes to its row.
bool has_failed(Seen& seen, const Seen& fem)
{
    if (seen.row.failed.empty() && !fem.row.failed.empty()) seen.row.failed = "the finite elements: " + fem.row.failed;
    return !seen.row.failed.empty();
}

/// The same problem with finite elements on the cells of the method.
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
/// The RMS of the difference of two values, relative to that of the second.
double relative_error(const Seen& seen, int k, int reference)
{
    return rms(seen, [=](const auto& v) { return v[k] - v[reference]; }) / rms(seen, reference);
}

// ---- the bar ---------------------------------------------------------------------------------------------------------

/// The observed values: of particles A at the free end, B above and C below the interface.
enum BarValue { kDisplacementA, kStressB, kStressC, kReferenceA, kReferenceB, kReferenceC };

const std::vector<std::string> kObserved = {"displacement_A",           "stress_B",           "stress_C",
                                            "displacement_A_reference", "stress_B_reference", "stress_C_reference"};

/// The lower end is at 0.
struct Column {
    static constexpr double length = 9.0, middle = 4.5, gravity = -10.0;
};

/// The particle that starts nearest to X.
template <int D>
int particle_at(const Particles<D>& p, const Vec<D>& X)
{
    const auto nearest =
        std::min_element(p.X.begin(), p.X.end(), [&](const Vec<D>& a, const Vec<D>& b) { return norm(a - X) < norm(b - X); });
    return static_cast<int>(nearest - p.X.begin());
}

/// A column one cell wide that hangs from its top. The interface is in the middle of a cell if the number of cells per metre is
/// odd.
Problem<2> hanging_bar(const Request& r)
{
    constexpr double room = 1.0;  // below the free end
    const double h        = 1.0 / r.cells;
    Problem<2> p          = problem_of<2>(r);
    p.model.origin        = {0.0, -room};
    p.model.h             = Vec<2>::filled(h);
    p.model.cells         = {1, static_cast<int>(std::lround((Column::length + room) * r.cells))};
    p.model.materials     = two_materials(r.values.word("stiff") == "bottom", 1e7, r.values.number("contrast"), 1050.0);
    p.model.gravity       = {0.0, Column::gravity};
    p.model.conditions    = {{.axis = 0, .at = 0.0, .type = ConditionType::symmetry, .value = {}},
                             {.axis = 0, .outer_is_above = true, .at = h, .type = ConditionType::symmetry, .value = {}},
                             {.axis = 1, .outer_is_above = true, .at = Column::length, .type = ConditionType::fixed, .value = {}}};
    p.dt                  = r.values.number("dt");
    p.seeds               = fill_box(Bounds<2>{{0.0, 0.0}, {h, Column::length}}, SubCells<2>{{}, p.model.h, {1, r.per_axis}});
    p.body                = [](const Vec<2>& X) { return X[1] < Column::middle ? 0 : 1; };
    return p;
}

LayeredBody column_of(const Problem<2>& p)
{
    return LayeredBody({.geometry   = LayeredBody::Geometry::column,
                        .ends       = {0.0, Column::middle, Column::length},
                        .materials  = {p.model.materials[0], p.model.materials[1]},
                        .elements   = {144, 144},
                        .dt         = reference_step(p.dt, Column::middle / 144, p.model.materials),
                        .fixed_end  = LayeredBody::FixedEnd::high,
                        .body_force = [](double) { return Column::gravity; }});
}

/// The values of BarValue at a state. Each call makes an observer with its own reference, which advances with its run.
auto bar_observer(const LayeredBody& reference, double h, int per_axis)
{
    const double x = 0.5 * h, half = 0.5 * h / per_axis;
    return [=, A = Vec<2>{x, half}, B = Vec<2>{x, Column::middle + half}, C = Vec<2>{x, Column::middle - half},
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
}

/// Adds the results of the bar to the row of a run.
void judge_bar(Seen& seen, const Seen& fem)
{
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
}

Row hang(const Request& r)
{
    Problem<2> p                = hanging_bar(r);
    const LayeredBody reference = column_of(p);
    const double h              = 1.0 / r.cells;
    p.observed                  = {kObserved, bar_observer(reference, h, r.per_axis)};
    Problem<2> elements         = by_elements(p);
    elements.observed           = {{}, bar_observer(reference, h, r.per_axis)};
    const Seen fem              = run(elements);
    Seen seen                   = run(p);
    if (!has_failed(seen, fem)) judge_bar(seen, fem);
    return seen.row;
}

// ---- the ring --------------------------------------------------------------------------------------------------------

/// The observed values, means over the angle of rows of particles: A at the outer rim, B inside and C outside the interface.
enum RingValue { kMeanA, kMeanB, kMeanC, kMeanAReference, kMeanBReference, kMeanCReference };

struct Ring {
    static constexpr double inner = 3.0, middle = 3.1, outer = 3.2, frequency = 1.0;
    /// Particles along the angle per particle along a metre: of the paper's 1544 particles 193 are around, with 20 cells per metre.
    static constexpr double angular_per_metre = 193.0 / 20 / 2;

    /// Body force per mass at the radius or coordinate x.
    static double force(double x) { return frequency * frequency * x; }
    /// Particles along the radius.
    static int radial(const Request& r) { return static_cast<int>(std::lround((outer - inner) * (r.cells * r.per_axis))); }
};

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

/// A quarter of a ring under the suddenly applied centrifugal force of its rotation.
Problem<2> spinning_ring(const Request& r)
{
    const int radial = Ring::radial(r), angular = static_cast<int>(std::lround(Ring::angular_per_metre * (r.cells * r.per_axis)));
    Problem<2> p      = problem_of<2>(r);
    p.model.h         = Vec<2>::filled(1.0 / r.cells);
    p.model.cells     = Index<2>::filled(static_cast<int>(std::ceil((Ring::outer + 0.1) * r.cells)));
    p.model.materials = two_materials(r.values.word("stiff") == "inner", 1e9, r.values.number("contrast"), 1000.0);
    for (const int a : {0, 1}) p.model.conditions.push_back({.axis = a, .at = 0.0, .type = ConditionType::symmetry, .value = {}});
    const VectorField<2> body_force{Field([](const FieldPoint& at) { return Ring::force(at.x[0]); }),
                                    Field([](const FieldPoint& at) { return Ring::force(at.x[1]); })};
    p.model.body_forces = {body_force, body_force};
    p.dt                = r.values.number("dt");
    const Tube<2> tube{.inner = Ring::inner, .outer = Ring::outer, .to = kPi / 2};
    p.seeds   = fill_polar(tube, radial, angular, 1);
    p.corners = polar_cells(tube, radial, angular, 1);
    p.body    = [](const Vec<2>& X) { return norm(X) < Ring::middle ? 0 : 1; };
    return p;
}

LayeredBody layered_ring(const Problem<2>& p)
{
    return LayeredBody({.geometry   = LayeredBody::Geometry::ring,
                        .ends       = {Ring::inner, Ring::middle, Ring::outer},
                        .materials  = {p.model.materials[0], p.model.materials[1]},
                        .elements   = {32, 32},
                        .dt         = reference_step(p.dt, (Ring::middle - Ring::inner) / 32, p.model.materials),
                        .fixed_end  = LayeredBody::FixedEnd::none,
                        .body_force = Ring::force});
}

/// Observes the values of RingValue, and the radial stress of each particle of the rows over time.
class RingObserver {
  public:
    RingObserver(LayeredBody reference, double width, std::size_t particles)
        : reference_(std::move(reference)), width_(width), over_time_(particles), row_of_(particles, 0)
    {}

    std::vector<double> operator()(const State<2>& s)
    {
        reference_.advance(s.t);
        Statistics rows[3];
        const Particles<2>& q = s.particles;
        for (int i = 0; i < q.count; ++i)
            with_rows(q.X[i], [&](int row) {
                const double u      = dot(q.X[i], q.x[i] - q.X[i]) / norm(q.X[i]);
                const double stress = dot(q.X[i], in_plane(q.sigma[i]) * q.X[i]) / dot(q.X[i], q.X[i]);
                rows[row].add(row == 0 ? u : stress);
                if (s.n == counted_) return;  // recording observes a state once more
                row_of_[q.id[i]] = row;
                over_time_[q.id[i]].add(stress);
            });
        counted_ = s.n;
        return {rows[0].mean(),
                rows[1].mean(),
                rows[2].mean(),
                reference_.displacement(Ring::outer - width_ / 2),
                reference_.stress(Ring::middle - width_ / 2),
                reference_.stress(Ring::middle + width_ / 2)};
    }

    /// The standard deviation, within a row, of the particles' means over time.
    double scatter(int row) const
    {
        Statistics all;
        for (std::size_t k = 0; k < over_time_.size(); ++k)
            if (row_of_[k] == row) all.add(over_time_[k].mean());
        return all.deviation();
    }

  private:
    /// f(0, 1 or 2) for the rows A, B and C that contain a particle, by its initial position.
    template <class F>
    void with_rows(const Vec<2>& X, const F& f) const
    {
        const double R = norm(X);
        if (R > Ring::outer - width_) f(0);
        if (std::fabs(R - Ring::middle) < width_) f(R < Ring::middle ? 1 : 2);
    }

    LayeredBody reference_;
    double width_;  ///< of a row
    std::vector<Statistics> over_time_;
    std::vector<int> row_of_;
    long counted_ = -1;  ///< the last step in `over_time_`
};

Row spin(const Request& r)
{
    Problem<2> p       = spinning_ring(r);
    const double width = (Ring::outer - Ring::inner) / Ring::radial(r);
    // Twice as many particles as seeds, for methods that make two particles of a cell.
    const auto observer = std::make_shared<RingObserver>(layered_ring(p), width, p.seeds.size() * 2);
    p.observed          = {kObserved, [observer](const State<2>& s) { return (*observer)(s); }};
    Seen seen           = run(p);
    if (!seen.row.failed.empty()) return seen.row;
    auto difference     = [&](int k, int l) { return std::fabs(mean(seen, k) - mean(seen, l)); };
    seen.row.quantities = {{"stress_B", mean(seen, kMeanB)},
                           {"stress_C", mean(seen, kMeanC)},
                           {"error of stress_B", difference(kMeanB, kMeanBReference)},
                           {"error of stress_C", difference(kMeanC, kMeanCReference)},
                           {"scatter of stress_B", observer->scatter(1)},
                           {"scatter of stress_C", observer->scatter(2)},
                           {"displacement error", relative_error(seen, kMeanA, kMeanAReference)}};
    return seen.row;
}

// ---- the sphere ------------------------------------------------------------------------------------------------------

/// The error of a run's stresses relative to those of another run, over times and `chosen` particles.
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
    for (int a = 0; a < 3; ++a)
        p.model.conditions.push_back({.axis = a, .at = 0.0, .type = ConditionType::symmetry, .value = {}});
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

    // Stresses by particle number; those in one layer of cells inside and outside the interface are judged.
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
    const auto stride = static_cast<long>(std::ceil(p.end / p.dt / 200));  // 200 times: more would not fit for fine meshes
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
