// Loads a case from its file, for programs. Does not need the TOML headers of io/input.hpp.
#pragma once

#include "setup/spec.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace ordo::io {

/// Reads a case of dimension D, with `key=value` overrides, and sets it up with the checks of `ordo run`. Throws InputError with
/// the place in the file.
template <int D>
setup::Built<D> load(const std::filesystem::path& file, const std::vector<std::string>& overrides = {});

}  // namespace ordo::io
