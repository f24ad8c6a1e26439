// What a user may not expect of a case that is allowed. Used by setup/build.cpp.
#pragma once

#include "setup/seeding.hpp"

#include <string>
#include <vector>

namespace ordo::setup {

/// One sentence each: boxes of one particle, conditions that hold no body at the start, bodies that stick together through the grid.
template <int D>
std::vector<std::string> notes_on(const CaseSpec<D>& spec, const std::vector<SeedWalk<D>>& seeds, const Model<D>& model);

}  // namespace ordo::setup
