// Checks that no particle centre lies in the domain of another particle: mass would be there twice. Used by set-up.
#pragma once

#include "setup/spec.hpp"

#include <vector>

namespace ordo::setup {

/// `body` has the number of each seed's body. Checks the particles of lists and those near another body; particles of one
/// built-in shape cannot overlap. Throws SetupError.
template <int D>
void require_apart(const std::vector<BodySpec<D>>& bodies, std::vector<Seed<D>> seeds, const std::vector<int>& body,
                   const Model<D>& model);

}  // namespace ordo::setup
