#include "setup/schemes.hpp"

#include "implicit/scheme.hpp"
#include "method/explicit.hpp"
#include "setup/surface.hpp"
#include "spline/scheme.hpp"

#include <fmt/format.h>

#include <array>

namespace ordo {

namespace setup {
namespace {

/// Projection spline-fit takes bodies that fill the grid between walls, or one built-in shape, which may end inside the grid.
template <int D>
void set_up_splines(const CaseSpec<D>& spec, Model<D>& model, int particles)
{
    auto fail = [](std::string_view why) { throw SetupError(Part::method, 0, "projection", why); };
    if (spec.bodies.size() == 1) model.surface = free_surface(spec.bodies[0].shape, model);
    double cells = 1;
    for (int a = 0; a < D; ++a) cells *= model.cells[a];
    if (model.surface.empty() && cells > particles)
        fail(fmt::format("fits splines on {} cells to {} particles, but needs two or more per cell along each axis: let the "
                         "bodies fill the grid, or use a single body of shape box, ball, ring or cylinder",
                         cells, particles));
    try {
        require_spline_model(model);
    } catch (const InputError& e) {
        fail(e.what());
    }
}

template <int D>
void set_up_implicit(const CaseSpec<D>&, Model<D>& model, int)
{
    try {
        require_implicit_model(model);
    } catch (const InputError& e) {
        throw SetupError(Part::method, 0, "scheme", e.what());
    }
}

template <int D>
void set_up_nothing(const CaseSpec<D>&, Model<D>&, int)
{}

}  // namespace
}  // namespace setup

namespace {

template <int D>
struct SchemeRow {
    bool (*is_of)(const MethodSpec&);
    std::unique_ptr<Scheme<D>> (*make)(Model<D>);
    void (*set_up)(const setup::CaseSpec<D>&, Model<D>&, int particles);
};

template <class S, int D>
std::unique_ptr<Scheme<D>> make(Model<D> model)
{
    return std::make_unique<S>(std::move(model));
}

/// The first row whose `is_of` is true gives the scheme.
template <int D>
constexpr SchemeRow<D> kSchemes[] = {
    {is_spline_fit, make<SplineScheme<D>, D>, setup::set_up_splines<D>},
    {is_implicit, make<Implicit<D>, D>, setup::set_up_implicit<D>},
    {[](const MethodSpec&) { return true; }, make<Explicit<D>, D>, setup::set_up_nothing<D>},
};

template <int D>
const SchemeRow<D>& scheme_of(const MethodSpec& method)
{
    const SchemeRow<D>* row = kSchemes<D>;
    while (!row->is_of(method)) ++row;
    return *row;
}

}  // namespace

template <int D>
std::unique_ptr<Scheme<D>> make_scheme(Model<D> model)
{
    const SchemeRow<D>& row = scheme_of<D>(model.method);
    return row.make(std::move(model));
}

template <int D>
void setup::set_up_scheme(const CaseSpec<D>& spec, Model<D>& model, int particles)
{
    scheme_of<D>(model.method).set_up(spec, model, particles);
}

double setup::default_lump_below(const MethodSpec& method, bool moves_nodes)
{
    if (method.mass != MassMatrix::consistent) return method.lump_below;
    constexpr double of_moved_nodes = 0.02;  // from 0.001 on runs were stable (docs/implicit.md)
    return is_implicit(method) && moves_nodes ? of_moved_nodes : lump_below_of(method);
}

#define ORDO_SCHEMES(D)                                        \
    template std::unique_ptr<Scheme<D>> make_scheme(Model<D>); \
    template void setup::set_up_scheme(const CaseSpec<D>&, Model<D>&, int);
ORDO_SCHEMES(1)
ORDO_SCHEMES(2)
ORDO_SCHEMES(3)
#undef ORDO_SCHEMES

}  // namespace ordo
