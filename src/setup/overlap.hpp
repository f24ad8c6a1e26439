// No particle centre may lie in the domain of another particle: the mass would be there twice. Used by set-up.
#pragma once

#include "setup/spec.hpp"

#include <vector>

namespace ordo::setup {

/// `body` has the number of each seed's body. Particles of one built-in shape cannot overlap; checked are those of lists, and those
/// near another body. Throws SetupError.
template <int D>
void require_apart(const std::vector<BodySpec<D>>& bodies, std::vector<Seed<D>> seeds, const std::vector<int>& body,
                   const Model<D>& model);

}  // namespace ordo::setup
