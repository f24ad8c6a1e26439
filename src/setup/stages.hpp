// The stages of a case, with every check that they need.
#pragma once

#include "setup/spec.hpp"

namespace ordo::setup {

/// The stages for a model that has the conditions, walls and tractions of all of them; none if the case has none. Throws SetupError.
template <int D>
std::vector<Stage<D>> stages_of(const CaseSpec<D>& spec, const Model<D>& model);

}  // namespace ordo::setup
