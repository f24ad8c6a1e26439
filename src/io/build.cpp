#include "io/build.hpp"

#include "base/agree.hpp"
#include "io/expression.hpp"
#include "io/load.hpp"
#include "io/mesh_file.hpp"
#include "io/particle_file.hpp"
#include "io/stl.hpp"
#include "method/place.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace ordo::io {

namespace {

using setup::Part;

template <int D, class T = double>
Vec<D, T> to_vec(const std::vector<T>& v)
{
    Vec<D, T> r{};
    for (int a = 0; a < D; ++a) r[a] = v[a];
    return r;
}

// ---- input to structs -------------------------------------------------------------------------------------------------------

template <int D>
Tube<D> tube_of(const ShapeInput& b)
{
    constexpr double degree = std::numbers::pi / 180;
    Tube<D> tube{};
    tube.center = to_vec<D>(b.center);
    tube.inner  = b.inner_radius.value_or(0.0);
    tube.outer  = *b.radius;
    if (!b.angle.empty()) {
        tube.from = b.angle[0] * degree;
        tube.to   = b.angle[1] * degree;
    }
    if constexpr (D == 3) {
        tube.axis   = b.axis.empty() ? 2 : b.axis[0] - 'x';
        tube.bottom = tube.center[tube.axis] - *b.height / 2;
        tube.top    = tube.center[tube.axis] + *b.height / 2;
    }
    return tube;
}

template <int D>
Bounds<D> box_of(const ShapeInput& b)
{
    return {to_vec<D>(b.lower), to_vec<D>(b.upper)};
}
template <int D>
Ball<D> ball_of(const ShapeInput& b)
{
    return {to_vec<D>(b.center), *b.radius};
}

template <int D>
setup::MeshShape<D> mesh_of(const BodyInput& b)
{
    setup::MeshShape<D> shape{};
    try {
        shape.mesh = read_mesh<D>(b.file, b.group);
    } catch (const InputError& e) {
        b.fail("file", e.what());
    }
    if (!b.center.empty()) shape.center = to_vec<D>(b.center);
    if (!b.axis.empty()) shape.axis = b.axis[0] - 'x';
    return shape;
}

template <int D>
setup::BodyShape<D> shape_of(const BodyInput& b)
{
    if (b.shape == "particles") return read_particles<D>(b);
    if (b.shape == "mesh") return mesh_of<D>(b);
    if (b.shape == "box") return box_of<D>(b);
    if (b.shape == "ball" && b.cells == "polar") return setup::PolarBall<D>{ball_of<D>(b), b.radial, b.angular};
    if (b.shape == "ball") return ball_of<D>(b);
    return setup::TubeShape<D>{tube_of<D>(b), b.cells == "polar", b.radial, b.angular, b.layers};
}

template <int D>
setup::Region<D> region_of(const ShapeInput& b)
{
    if (b.shape == "box") return box_of<D>(b);
    if (b.shape == "ball") return ball_of<D>(b);
    return tube_of<D>(b);
}

/// The number of an item of this name.
template <class T>
int number_of(const std::string& name, const std::vector<T>& items)
{
    const auto item = std::find_if(items.begin(), items.end(), [&](const T& one) { return one.name == name; });
    return static_cast<int>(item - items.begin());
}
template <class T>
std::vector<int> numbers_of(const std::vector<std::string>& names, const std::vector<T>& items)
{
    std::vector<int> r;
    for (const std::string& name : names) r.push_back(number_of(name, items));
    return r;
}

template <int D>
setup::BodySpec<D> body_of(const BodyInput& b, const std::vector<MaterialInput>& materials)
{
    setup::BodySpec<D> body{.shape                 = shape_of<D>(b),
                            .name                  = b.name,
                            .material              = number_of(b.material, materials),
                            .gauss                 = b.seeding == "gauss",
                            .keeps_lattice_volumes = b.volumes == "lattice",
                            .velocity              = make_vector_field<D>(b.velocity),
                            .body_force            = make_vector_field<D>(b.body_force)};
    if (!b.particles_per_cell.empty()) body.particles_per_cell = to_vec<D, int>(b.particles_per_cell);
    body.stress = {.k0 = b.k0, .surface = b.surface, .overburden = b.overburden.value_or(0.0)};
    if (!b.initial_stress.empty()) {
        body.stress.uniform = Stress<D>{};
        std::copy(b.initial_stress.begin(), b.initial_stress.end(), body.stress.uniform->c);
    }
    return body;
}

setup::FaceType face_type(const std::string& type)
{
    if (type == "fixed") return setup::FaceType::fixed;
    if (type == "symmetry") return setup::FaceType::symmetry;
    if (type == "wall") return setup::FaceType::wall;
    if (type == "periodic") return setup::FaceType::periodic;
    if (type == "displacement") return setup::FaceType::displacement;
    return type == "free" ? setup::FaceType::free : setup::FaceType::velocity;
}

/// Boundary k of those of a table.
template <int D>
setup::BoundarySpec<D> boundary_of(const BoundaryInput& b, std::size_t k, const CaseInput& in)
{
    setup::BoundarySpec<D> r{
        .name = b.name, .type = face_type(b.type), .at = b.at_coordinate, .friction = b.friction.value_or(0.0)};
    if (!b.face.empty()) {
        r.axis     = b.face[k][0] - 'x';
        r.is_above = b.face[k].ends_with("max");
    }
    if (!b.normal.empty()) {
        r.normal = to_vec<D>(b.normal);
        r.point  = to_vec<D>(b.point);
    }
    if (b.region) r.region = region_of<D>(*b.region);
    if (!b.body.empty()) r.body = number_of(b.body, in.bodies);
    r.stages = numbers_of(b.stages, in.stages);
    for (int a = 0; a < D && !b.value.empty(); ++a)
        if (b.value[a].value != decltype(b.value[a].value){"free"}) r.value[a] = make_field(b.value[a]);
    return r;
}

setup::BodyFace body_face(const std::string& name)
{
    using setup::BodyFace;
    if (name == "all") return {BodyFace::all};
    if (name == "inner") return {BodyFace::inner};
    if (name == "outer") return {BodyFace::outer};
    return {BodyFace::along_axis, name[0] - 'x', name.ends_with("max")};
}

template <int D>
setup::TractionSpec<D> traction_of(const TractionInput& t, const CaseInput& in)
{
    setup::TractionSpec<D> r{.body     = number_of(t.body, in.bodies),
                             .faces    = {},
                             .traction = {.type  = t.type == "pressure"   ? TractionType::pressure
                                                   : t.type == "traction" ? TractionType::traction
                                                                          : TractionType::dead,
                                          .value = {}}};
    r.stages = numbers_of(t.stages, in.stages);
    for (const std::string& face : t.face) r.faces.push_back(body_face(face));
    for (std::size_t a = 0; a < t.value.size(); ++a) r.traction.value[a] = make_field(t.value[a]);
    return r;
}

/// The part that contacts and obstacles have in common.
template <class Input>
setup::ContactSpec contact_of(const Input& c, const CaseInput& in)
{
    const auto type = std::find(kContactNames.begin(), kContactNames.end(), c.type) - kContactNames.begin();
    return {.name     = c.name,
            .bodies   = is_of_all(c.bodies) ? std::vector<int>{} : numbers_of(c.bodies, in.bodies),
            .type     = static_cast<ContactType>(type),
            .friction = c.friction.value_or(0.0),
            .adhesion = c.adhesion.value_or(0.0),
            .sweeps   = c.sweeps,
            .on_faces = c.points == "faces"};
}

template <int D>
Solid<D> solid_of(const ObstacleInput& o)
{
    if (o.shape == "half-space") {
        const Vec<D> normal = to_vec<D>(o.normal);
        return HalfSpace<D>{to_vec<D>(o.point), (1 / norm(normal)) * normal};
    }
    if (o.shape == "box") return box_of<D>(o);
    if (o.shape == "ball") return ball_of<D>(o);
    if (o.shape == "cylinder")
        return Cylinder<D>{to_vec<D>(o.center), *o.radius, *o.height, o.axis.empty() ? 2 : o.axis[0] - 'x'};
    try {
        return TriangleSurface(read_stl(o.file, o.scale.value_or(1.0)));
    } catch (const InputError& e) {
        o.fail("file", e.what());
    }
}

template <int D>
setup::ObstacleSpec<D> obstacle_of(const ObstacleInput& o, const CaseInput& in)
{
    setup::ObstacleSpec<D> r{
        .contact = contact_of(o, in), .solid = solid_of<D>(o), .velocity = make_vector_field<D>(o.velocity), .mass = o.mass};
    if (!o.center.empty()) r.center = to_vec<D>(o.center);
    for (std::size_t a = 0; a < o.rotation.size(); ++a) r.spin[D == 3 ? a : 2] = make_field(o.rotation[a]);
    for (const std::string& one : o.held)
        if (one == "rotation")
            r.holds_spin = true;
        else
            r.held[one[0] - 'x'] = true;
    return r;
}

setup::StageSpec stage_of(const StageInput& s, const Damping& damping, const CaseInput& in)
{
    setup::StageSpec r{.name      = s.name,
                       .duration  = s.duration,
                       .residual  = s.residual,
                       .damping   = damping,
                       .materials = {},
                       .removed   = numbers_of(s.remove, in.bodies)};
    for (const auto& [body, material] : s.materials.all)
        r.materials.push_back({number_of(body, in.bodies), number_of(material, in.materials)});
    return r;
}

template <int D>
setup::CaseSpec<D> spec_of(const CaseInput& in)
{
    setup::CaseSpec<D> spec{.method    = in.spec,
                            .origin    = to_vec<D>(in.grid.origin),
                            .size      = to_vec<D>(in.grid.size),
                            .spacing   = to_vec<D>(in.grid.spacing),
                            .gravity   = to_vec<D>(in.gravity),
                            .materials = in.resolved_materials,
                            .time      = {.end = in.time.end, .dt = in.time.dt},
                            .damping   = in.resolved_damping};
    if (in.time.cfl) spec.time.cfl = *in.time.cfl;
    for (const BodyInput& b : in.bodies) spec.bodies.push_back(body_of<D>(b, in.materials));
    for (const BoundaryInput& b : in.boundaries)
        for (std::size_t k = 0; k < b.count(); ++k) spec.boundaries.push_back(boundary_of<D>(b, k, in));
    for (const TractionInput& t : in.tractions) spec.tractions.push_back(traction_of<D>(t, in));
    for (const ContactInput& c : in.contacts) spec.contacts.push_back(contact_of(c, in));
    for (const ObstacleInput& o : in.obstacles) spec.obstacles.push_back(obstacle_of<D>(o, in));
    for (std::size_t k = 0; k < in.stages.size(); ++k) spec.stages.push_back(stage_of(in.stages[k], in.damping_of_stages[k], in));
    return spec;
}

// ---- errors of setup, at their place in the file -------------------------------------------------------------------------------

/// Fails at the value of a component if it is one of a list of expressions.
[[noreturn]] void fail_at(const Located& table, const setup::SetupError& e, const std::vector<Expression>& components)
{
    if (e.component < 0) table.fail(e.key, e.why);
    const Expression& component = components.at(static_cast<std::size_t>(e.component));
    fail(component.place, component.key, e.why);
}

[[noreturn]] void fail_in_body(const BodyInput& b, const setup::SetupError& e)
{
    const bool is_of_file = !b.file.empty() && (e.key == "shape" || e.key == "particles_per_cell");
    if (is_of_file) b.fail("file", e.why);
    fail_at(b, e, e.key == "velocity" ? b.velocity : b.body_force);
}

/// The table that has boundary k of all tables.
const BoundaryInput& table_of(const std::vector<BoundaryInput>& boundaries, int k)
{
    auto b = boundaries.begin();
    while (k >= static_cast<int>(b->count())) k -= static_cast<int>((b++)->count());
    return *b;
}

[[noreturn]] void fail_in_file(const CaseInput& in, const setup::SetupError& e)
{
    const auto k = static_cast<std::size_t>(e.index);
    switch (e.part) {
    case Part::grid: in.grid.fail(e.key, e.why);
    case Part::method: in.method.fail(in.method.has(e.key) ? e.key : "preset", e.why);
    case Part::time: in.time.fail(e.key, e.why);
    case Part::damping: in.damping.fail(e.key, e.why);
    case Part::material: in.materials.at(k).fail(e.key, e.why);
    case Part::stage: in.stages.at(k).fail(e.key, e.why);
    case Part::traction: in.tractions.at(k).fail(e.key, e.why);
    case Part::contact: in.contacts.at(k).fail(e.key, e.why);
    case Part::obstacle: in.obstacles.at(k).fail(e.key, e.why);
    case Part::body: fail_in_body(in.bodies.at(k), e);
    case Part::boundary: break;
    }
    const BoundaryInput& b = table_of(in.boundaries, e.index);
    fail_at(b, e, b.value);
}

/// The nearest particle to a place, of several the first; -1 if there is none.
template <int D>
int nearest(const Particles<D>& p, const Vec<D>& at)
{
    int best     = -1;
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < p.count; ++i)
        if (const double d = norm(p.x[i] - at); d < least) {
            least = d;
            best  = i;
        }
    return best;
}

template <int D>
void require_probes_in_bodies(const CaseInput& in, const Built<D>& built, Ranks& ranks)
{
    const Particles<D>& p = built.particles;
    for (const ProbeInput& probe : in.probes) {
        if (probe.particle.empty()) continue;
        const Vec<D> at   = to_vec<D>(probe.particle);
        const int i       = nearest(p, at);
        const double mine = i < 0 ? kNowhere : norm(p.x[i] - at);
        const auto why    = text_of_first(ranks, mine, [&]() -> std::string {
            for (int a = 0; a < D; ++a)
                if (std::fabs(p.x[i][a] - at[a]) > 1.001 * std::max(built.model.h[a], std::pow(p.V0[i], 1.0 / D)))
                    return fmt::format(
                           "lies outside every body: the nearest particle is at {}; give a place in a body, or point to "
                              "watch a fixed place",
                           place_text(p.x[i]));
            return {};
        });
        if (!why.empty()) probe.fail("particle", why);
    }
}

/// f(), whose errors of setup become errors at their place in the file.
template <class F>
auto at_its_place(const CaseInput& in, const F& f)
{
    try {
        return f();
    } catch (const setup::SetupError& e) {
        fail_in_file(in, e);
    }
}

}  // namespace

template <int D>
Built<D> build(const CaseInput& in, double most_particles, const setup::Share& share)
{
    Built<D> built = at_its_place(in, [&] { return setup::build(spec_of<D>(in), most_particles, share); });
    if (share.count == 1) require_probes_in_bodies(in, built, alone());
    return built;
}

template <int D>
void require_runnable(const CaseInput& in, const Built<D>& built, Ranks& ranks)
{
    at_its_place(in, [&] { setup::require_runnable(built, ranks); });
    require_probes_in_bodies(in, built, ranks);
}

template <int D>
Built<D> load(const std::filesystem::path& file, const std::vector<std::string>& overrides)
{
    const CaseInput input = read_case(file, overrides);
    if (input.grid.dim != D) input.grid.fail("dim", fmt::format("is {}; the program needs a case in {}D", input.grid.dim, D));
    return build<D>(input);
}

template <int D>
int nearest_particle(const State<D>& s, const Vec<D>& at)
{
    const Particles<D>& p = s.particles;
    const int i           = nearest(p, at);
    const double mine     = i < 0 ? kNowhere : norm(p.x[i] - at);
    const bool is_nearest = mine == -largest(*s.ranks, -mine);
    const Bytes id        = bytes_of_first(*s.ranks, is_nearest ? tile_of_particle(s, i) : kNowhere, [&] {
        Bytes bytes;
        put(bytes, p.id[i]);
        return bytes;
    });
    return values_of<int>(id).front();
}

#define ORDO_BUILD(D)                                                                      \
    template Built<D> build(const CaseInput&, double, const setup::Share&);                \
    template void require_runnable(const CaseInput&, const Built<D>&, Ranks&);             \
    template Built<D> load(const std::filesystem::path&, const std::vector<std::string>&); \
    template int nearest_particle(const State<D>&, const Vec<D>&);
ORDO_BUILD(1)
ORDO_BUILD(2)
ORDO_BUILD(3)
#undef ORDO_BUILD

}  // namespace ordo::io
