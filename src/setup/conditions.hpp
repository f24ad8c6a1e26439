// Conditions on faces and planes of the grid, and numbers that fields must give at the start. Used by setup/build.cpp.
#pragma once

#include "setup/spec.hpp"

#include <string_view>

namespace ordo::setup {

/// Sets periodic axes and boundaries of the model. Throws SetupError.
template <int D>
void set_up_conditions(const CaseSpec<D>& spec, Model<D>& model);

/// Throws SetupError where a field does not give numbers at the start.
template <int D>
void require_finite(const Vec<D>& value, Part part, int index, std::string_view key, const Vec<D>& at);

}  // namespace ordo::setup
