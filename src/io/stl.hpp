// Surfaces of triangles from STL files, binary or text.
#pragma once

#include "base/vec.hpp"

#include <array>
#include <string>
#include <vector>

namespace ordo::io {

/// The triangles of a file, coordinates times `scale`, m. Their order of corners says which side is outside; the file's normals are not
/// used, because many programs write zeros. Throws InputError with the file, the line or triangle, and the remedy.
std::vector<std::array<Vec<3>, 3>> read_stl(const std::string& file, double scale = 1.0);

}  // namespace ordo::io
