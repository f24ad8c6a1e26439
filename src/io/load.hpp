// A case from its file, for programs: without the headers of TOML that io/input.hpp needs.
#pragma once

#include "setup/spec.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace ordo::io {

/// Reads a case of dimension D, with `key=value` changes, and sets it up with the checks of `ordo run`. Throws InputError with the
/// place in the file.
template <int D>
setup::Built<D> load(const std::filesystem::path& file, const std::vector<std::string>& overrides = {});

}  // namespace ordo::io
