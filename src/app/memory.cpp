#include "app/memory.hpp"

#include <fstream>
#include <string>

#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace ordo::app {

namespace {

std::optional<double> status_entry(const std::string& key)
{
    std::ifstream status("/proc/self/status");
    for (std::string name; status >> name;) {
        double kibibytes = 0;
        if (name == key + ":" && status >> kibibytes) return kibibytes * 1024;
        std::string rest;
        std::getline(status, rest);
    }
    return std::nullopt;
}

}  // namespace

std::optional<double> resident_bytes() { return status_entry("VmRSS"); }
std::optional<double> peak_resident_bytes() { return status_entry("VmHWM"); }

bool reset_peak_resident_bytes()
{
#if defined(__GLIBC__)
    malloc_trim(0);
#endif
    std::ofstream clear("/proc/self/clear_refs");  // 5 resets the peak to the resident memory, see proc(5)
    return static_cast<bool>(clear << 5 << std::flush);
}

}  // namespace ordo::app
