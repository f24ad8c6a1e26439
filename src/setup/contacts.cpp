#include "setup/contacts.hpp"

#include "method/contact_points.hpp"
#include "setup/obstacles.hpp"
#include "shape/face_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace ordo::setup {

namespace {

[[noreturn]] void fail(std::size_t k, std::string_view key, std::string_view why)
{
    throw SetupError(Part::contact, static_cast<int>(k), key, why);
}

}  // namespace

bool has_faces(const MethodSpec& m) { return m.domain == Domain::parallelepiped || has_cells(m); }

const char* refusal_of_contact(const MethodSpec& m, int dim, bool with_obstacles)
{
    if (dim == 1) return "needs faces, which bodies have in 2D and 3D: use a strip in 2D between planes of symmetry";
    if (is_spline_fit(m)) return "cannot be with spline fits, which have one velocity field: use bscpdi2";
    if (!has_faces(m) && !with_obstacles)
        return "needs particles with corners, whose faces meet: use cpdi1, cpdi2 or another method with domain parallelepiped, "
               "cell or simplex";
    if (has_enrichment(m)) return "cannot be with enriched corners, which bodies share: use cpdi2";
    if (m.mass == MassMatrix::consistent && !is_implicit(m))
        return "cannot be with a consistent mass matrix: impulses act on the masses of single nodes; set mass = \"lumped\"";
    if (m.quadrature != Quadrature::particle || m.projection == Projection::tls || m.gradient == Gradient::adjoint)
        return "cannot be with fits in the cells of the grid, which all bodies in a cell share: set "
               "quadrature = \"particle\", and a projection other than tls";
    if (!has_faces(m) && with_obstacles && !(projects_again(m) && strain_velocity_of(m) == 0))
        return "with domain point or box needs scheme = \"musl\" with strain_velocity 0: with others the particles on the "
               "obstacle turn inside out; or "
               "use cpdi1, cpdi2 or another method with domain parallelepiped, cell or simplex, whose faces meet it with any "
               "scheme";
    return nullptr;
}

std::vector<int> bodies_of(const ContactSpec& contact, std::size_t count)
{
    std::vector<int> r = contact.bodies;
    for (std::size_t b = 0; contact.bodies.empty() && b < count; ++b) r.push_back(static_cast<int>(b));
    std::sort(r.begin(), r.end());
    return r;
}

template <int D>
void require_faces(const CaseSpec<D>& spec, int b, Part part, std::size_t k)
{
    if (std::holds_alternative<std::vector<Seed<D>>>(spec.bodies[b].shape))
        throw SetupError(
            part, static_cast<int>(k), "bodies",
            fmt::format("body \"{}\" is a list of particles, whose outer faces are not known; give a mesh or a shape",
                        spec.bodies[b].name));
}

void require_law(const ContactSpec& c, Part part, std::size_t k, std::size_t bodies)
{
    auto refuse = [&](const char* key, const std::string& why) { throw SetupError(part, static_cast<int>(k), key, why); };
    const std::vector<int> all = bodies_of(c, bodies);
    for (const int b : all)
        if (!(b >= 0 && b < static_cast<int>(bodies))) refuse("bodies", fmt::format("there is no body {}", b));
    if (std::adjacent_find(all.begin(), all.end()) != all.end())
        refuse("bodies", part == Part::contact ? "names a body twice: a body does not meet itself; folds of one body stick where "
                                                 "they touch; where they must not, make it of several bodies"
                                               : "names a body twice");
    if (!(c.friction >= 0)) refuse("friction", fmt::format("must be zero or positive (got {})", c.friction));
    if (!(c.adhesion >= 0)) refuse("adhesion", fmt::format("must be zero or positive (got {})", c.adhesion));
    if (c.sweeps < 1) refuse("sweeps", fmt::format("must be one or more (got {})", c.sweeps));
    if (c.type != ContactType::frictional && (c.friction > 0 || c.adhesion > 0))
        refuse(c.friction > 0 ? "friction" : "adhesion", "is of type \"frictional\"; remove it");
}

namespace {

/// A name as a part of one of a column.
std::string plain(std::string name)
{
    for (char& c : name)
        if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
    return name;
}

void require_contact(const ContactSpec& c, std::size_t k, std::size_t bodies)
{
    require_law(c, Part::contact, k, bodies);
    if (bodies_of(c, bodies).size() < 2) fail(k, "bodies", "must name at least two bodies");
}

/// Whether more than a tenth of a body's outline is within a cell of its opposite side.
template <int D>
bool is_thin(const Outline<D>& outline, const std::vector<Vec<D>>& x, double h)
{
    const auto normals = corner_normals(outline, x.data());
    const FaceSearch<D> search(outline, x.data(), normals.data(), h);
    std::vector<char> thin(x.size(), 0);
    parallel_for_each(static_cast<std::ptrdiff_t>(x.size()), [&](std::ptrdiff_t v) {
        const auto [face, corner]                = outline.around[outline.first[v]];
        const std::optional<Nearest<D>> opposite = search.nearest(x[v], normals[face][corner]);
        const double gap                         = opposite ? opposite->foot.gap : 0.0;
        thin[v]                                  = gap < 0 && -gap < (1 - 1e-9) * h;
    });
    return 10 * std::count(thin.begin(), thin.end(), 1) > static_cast<std::ptrdiff_t>(x.size());
}

}  // namespace

template <int D>
void set_up_contacts(const CaseSpec<D>& spec, Model<D>& model)
{
    if (spec.contacts.empty()) return;
    const std::size_t count = spec.bodies.size();
    if (const char* why = refusal_of_contact(spec.method, D, false)) fail(0, "bodies", why);
    std::map<std::pair<int, int>, std::size_t> taken;
    std::vector<bool> is_in(count, false);
    for (std::size_t k = 0; k < spec.contacts.size(); ++k) {
        const ContactSpec& c = spec.contacts[k];
        require_contact(c, k, count);
        const std::vector<int> bodies = bodies_of(c, count);
        for (std::size_t i = 0; i < bodies.size(); ++i) {
            const int one = bodies[i];
            is_in[one]    = true;
            require_faces(spec, one, Part::contact, k);
            for (std::size_t j = i + 1; j < bodies.size(); ++j) {
                const int other = bodies[j];
                if (!taken.emplace(std::pair{one, other}, k).second)
                    fail(k, "bodies",
                         fmt::format("bodies \"{}\" and \"{}\" are in an earlier contact already; each pair has one",
                                     spec.bodies[one].name, spec.bodies[other].name));
                ContactPair<D> pair = pair_of(spec, c, one, other);
                pair.surface        = {one, other};
                pair.name           = c.name.empty() ? fmt::format("contact_{}", k) : c.name;
                if (bodies.size() > 2)
                    pair.name += fmt::format("_{}_{}", plain(spec.bodies[one].name), plain(spec.bodies[other].name));
                model.contacts.push_back(std::move(pair));
            }
        }
    }
    // Bodies without contact share the first field; without any of them it is that of the first body in contact.
    int field = std::find(is_in.begin(), is_in.end(), false) == is_in.end() ? 0 : 1;
    for (std::size_t b = 0; b < count; ++b) model.field_of_body.push_back(is_in[b] ? field++ : 0);
}

template <int D>
ContactPair<D> pair_of(const CaseSpec<D>& spec, const ContactSpec& c, int body, int other)
{
    ContactPair<D> r{
        .type = c.type, .friction = c.friction, .adhesion = c.adhesion, .sweeps = c.sweeps, .on_faces = c.on_faces, .body = body};
    for (const int b : {body, other})
        if (b >= 0) r.wave_speed = std::max(r.wave_speed, spec.materials[spec.bodies[b].material].wave_speed());
    return r;
}

template <int D>
bool is_in_contact(const Model<D>& model, int body)
{
    return std::any_of(model.contacts.begin(), model.contacts.end(),
                       [&](const ContactPair<D>& c) { return c.surface[0] == body || c.surface[1] == body; });
}

template <int D>
void find_surfaces(const std::vector<CellMesh<D>>& meshes, const std::vector<int>& first, const Particles<D>& p, Model<D>& model)
{
    if constexpr (D > 1) {
        if (model.contacts.empty()) return;
        const double h = *std::min_element(model.h.c, model.h.c + D);
        std::vector<int> number(meshes.size(), -1);  // of the surface of each body
        std::vector<std::vector<Vec<D>>> vertices;
        for (std::size_t b = 0; b < meshes.size(); ++b) {
            const int body = static_cast<int>(b);
            if (!is_in_contact(model, body)) continue;
            number[b] = static_cast<int>(model.surfaces.size());
            model.surfaces.push_back(surface_of(body, meshes[b], p, first[b], period_of(model)));
            find_planes_of_symmetry(model, meshes[b], model.surfaces.back());
            const Outline<D>& outline = model.surfaces.back().outline;
            auto& x                   = vertices.emplace_back();
            for (const int corner : outline.corners) x.push_back(meshes[b].corners[corner]);
            const bool meets_bodies = std::any_of(model.contacts.begin(), model.contacts.end(), [&](const ContactPair<D>& c) {
                return c.obstacle < 0 && (c.surface[0] == body || c.surface[1] == body);
            });
            if (meets_bodies && is_thin(outline, x, h))
                throw SetupError(
                    Part::body, body, "shape",
                    "is thinner than a cell of the grid, and in contact: one side would feel what touches the other; "
                    "refine [grid] spacing");
        }
        for (std::size_t k = 0; k < model.contacts.size(); ++k) {
            ContactPair<D>& pair = model.contacts[k];
            for (int& s : pair.surface)
                if (s >= 0) s = number[s];
            if (pair.obstacle >= 0)
                settle_on_obstacle(model, static_cast<int>(k), vertices);
            else if (pair.type == ContactType::tied)
                pair.tied = find_tied_points(pair, static_cast<int>(k), model.surfaces, vertices, 0.05 * h, period_of(model));
        }
    }
}

#define ORDO_CONTACTS(D)                                                               \
    template void require_faces(const CaseSpec<D>&, int, Part, std::size_t);           \
    template void set_up_contacts(const CaseSpec<D>&, Model<D>&);                      \
    template ContactPair<D> pair_of(const CaseSpec<D>&, const ContactSpec&, int, int); \
    template bool is_in_contact(const Model<D>&, int);                                 \
    template void find_surfaces(const std::vector<CellMesh<D>>&, const std::vector<int>&, const Particles<D>&, Model<D>&);
ORDO_CONTACTS(1)
ORDO_CONTACTS(2)
ORDO_CONTACTS(3)
#undef ORDO_CONTACTS

}  // namespace ordo::setup
