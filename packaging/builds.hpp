// Chooses between builds of ordo for several instruction sets, for the package (cmake/package.cmake). Runs on every x86-64 processor, so it
// includes nothing of ordo's library, whose flags are those of one build.
#pragma once

#include <array>
#include <cstdlib>
#include <stdexcept>
#include <string>

#include <unistd.h>

namespace ordo {

/// A level of the x86-64 psABI for which there may be a build.
struct Level {
    const char *name, *what;
    bool runs;  ///< on this processor, under this kernel
};

/// The preferred first: with AVX-512 most methods are slower on the processor that was measured, see docs/packages.md.
inline std::array<Level, 2> levels()
{
    return {{{"x86-64-v3", "AVX2 and FMA", __builtin_cpu_supports("x86-64-v3") != 0},
             {"x86-64-v4", "AVX-512", __builtin_cpu_supports("x86-64-v4") != 0}}};
}

/// The file `before` + level + `after` of the first build that runs here, or of the level that ORDO_ISA names.
inline std::string choose_build(const std::string& before, const std::string& after)
{
    const char* given        = std::getenv("ORDO_ISA");
    const std::string wanted = given ? given : "";
    std::string built;
    for (const Level& level : levels()) {
        const std::string file = before + level.name + after;
        if (access(file.c_str(), R_OK) != 0) continue;
        built += std::string(built.empty() ? "" : ", ") + level.name;
        if (!wanted.empty() && wanted != level.name) continue;
        if (level.runs) return file;
        if (!wanted.empty())
            throw std::runtime_error("ORDO_ISA=" + wanted + ": this processor has no " + level.what + "; unset ORDO_ISA");
    }
    if (built.empty()) throw std::runtime_error("there is no " + before + "*" + after + "; install the package again");
    if (!wanted.empty()) throw std::runtime_error("ORDO_ISA=" + wanted + ": there is no such build; there is " + built);
    throw std::runtime_error(
        "this processor has no AVX2 and FMA, which the package needs; build ordo on this machine (README.md)");
}

}  // namespace ordo
