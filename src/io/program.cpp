#include "io/program.hpp"

#include "io/gmsh.hpp"
#include "io/hdf5.hpp"
#include "ordo_version.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace ordo::io {

std::string_view instructions()
{
#if defined(__AVX512F__)
    return "avx512";
#elif defined(__AVX2__)
    return "avx2";
#else
    return "any";
#endif
}

std::string this_program()
{
    std::string r = fmt::format("{}/{}/{}", ORDO_COMMIT, __VERSION__, instructions());
    std::replace(r.begin(), r.end(), ' ', '-');
    return r;
}

std::string version_text()
{
#ifdef ORDO_OPENMP
    constexpr bool has_openmp = true;
#else
    constexpr bool has_openmp      = false;
#endif
#ifdef __clang__
    constexpr const char* compiler = "";  // its version text begins with its name
#else
    constexpr const char* compiler = "g++ ";
#endif
    auto text = [](bool has) { return has ? "yes" : "no"; };
    return fmt::format("ordo {} ({})\ncompiler      {}{}\ninstructions  {}\nOpenMP        {}\nHDF5          {} (checkpoints)\n"
                       "Gmsh          {} (meshes)",
                       ORDO_VERSION, ORDO_COMMIT, compiler, __VERSION__, instructions(), text(has_openmp), text(has_hdf5()),
                       text(has_gmsh()));
}

}  // namespace ordo::io
