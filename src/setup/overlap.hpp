// Checks that no particle centre lies in the domain of another particle: mass would be there twice. Used by set-up.
#pragma once

#include "setup/seeding.hpp"

#include <vector>

namespace ordo::setup {

/// Checks the particles of lists and those near another body; particles of one built-in shape cannot overlap. Throws SetupError.
template <int D>
void require_apart(const std::vector<BodySpec<D>>& bodies, std::vector<SeedWalk<D>> seeds, const Model<D>& model);

}  // namespace ordo::setup
