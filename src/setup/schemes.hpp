// The schemes that step a model, chosen by its method.
#pragma once

#include "method/scheme.hpp"
#include "setup/spec.hpp"

#include <memory>

namespace ordo {

/// The scheme of the model's method. Throws InputError for a model that it cannot hold.
template <int D>
std::unique_ptr<Scheme<D>> make_scheme(Model<D> model);

namespace setup {

/// What the scheme of a case wants from its model besides, for so many particles. Throws SetupError.
template <int D>
void set_up_scheme(const CaseSpec<D>& spec, Model<D>& model, int particles);

}  // namespace setup

}  // namespace ordo
