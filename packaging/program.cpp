// /usr/bin/ordo of the package: becomes the build of ordo that the processor can run, or that ORDO_ISA names, with the same arguments,
// environment and process id.
#include "builds.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include <unistd.h>

int main(int, char** argv)
{
    try {
        const std::filesystem::path here = std::filesystem::read_symlink("/proc/self/exe").parent_path();
        const std::string build          = ordo::choose_build(here.parent_path() / "libexec" / "ordo-", "");
        execv(build.c_str(), argv);
        std::fprintf(stderr, "ordo: error: %s: %s; install the package again\n", build.c_str(), std::strerror(errno));
    } catch (const std::exception& e) {
        std::fprintf(stderr, "ordo: error: %s\n", e.what());
    }
    return 2;
}
