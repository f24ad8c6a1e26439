// The scheme that steps a model, chosen by its method.
#pragma once

#include "method/scheme.hpp"
#include "setup/spec.hpp"

#include <memory>

namespace ordo {

/// The scheme of the model's method. Throws InputError for a model that it cannot treat.
template <int D>
std::unique_ptr<Scheme<D>> make_scheme(Model<D> model);

namespace setup {

/// `lump_below` where it is not given. Implicit steps do best with little, but where conditions move nodes, slivers of bodies beside them would gain
/// energy with the consistent mass. With lumped mass there is none: as it is.
double default_lump_below(const MethodSpec& method, bool moves_nodes);

/// Adds to the model what the scheme of a case needs, and checks the number of particles. Throws SetupError.
template <int D>
void set_up_scheme(const CaseSpec<D>& spec, Model<D>& model, int particles);

}  // namespace setup

}  // namespace ordo
