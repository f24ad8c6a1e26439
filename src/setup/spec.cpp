#include "setup/spec.hpp"

#include <fmt/format.h>

namespace ordo::setup {

namespace {

/// The path of a key, as in the input file.
std::string path_of(Part part, int index, std::string_view key)
{
    static constexpr std::string_view names[] = {"grid",     "method",  "time",     "damping", "material", "boundary",
                                                 "traction", "contact", "obstacle", "body",    "stage"};
    std::string path(names[static_cast<int>(part)]);
    if (part >= Part::material) path += fmt::format("[{}]", index);
    return key.empty() ? path : fmt::format("{}.{}", path, key);
}

}  // namespace

SetupError::SetupError(Part p, int k, std::string_view which, std::string_view reason, int a)
    : InputError(fmt::format("{}: {}", path_of(p, k, which), reason)), part(p), index(k), key(which), why(reason), component(a)
{}

std::string face_name(int axis, bool is_above) { return fmt::format("{}-{}", "xyz"[axis], is_above ? "max" : "min"); }

std::string BodyFace::name() const
{
    switch (kind) {
    case all: return "all";
    case inner: return "inner";
    case outer: return "outer";
    case along_axis: break;
    }
    return face_name(axis, is_above);
}

}  // namespace ordo::setup
