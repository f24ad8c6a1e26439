// Cases around a body whose file is the input, in each dimension and with methods of every kind of domain.
#pragma once

#include "fuzz.hpp"
#include "io/input.hpp"

#include <initializer_list>
#include <vector>

namespace ordo::fuzz {

/// Cases in D dimensions that differ by `variants`, tables of TOML; the body is of `shape`, the grid [-1, 2]^D.
inline std::vector<io::CaseInput> cases_of(int dim, std::string_view shape, std::initializer_list<std::string_view> variants)
{
    std::vector<io::CaseInput> cases;
    for (const std::string_view variant : variants) {
        const MemoryFile file(
            fmt::format("[grid]\ndim = {}\norigin = -1\nsize = 3\nspacing = 0.25\n[time]\nend = 1e-3\n"
                        "[[material]]\nname = 'm'\ndensity = 1\nyoung = 1\npoisson = 0.3\n"
                        "[[body]]\nname = 'b'\nmaterial = 'm'\nshape = '{}'\nfile = 'input'\nvelocity = 'x + t'\n{}",
                        dim, shape, variant));
        cases.push_back(io::read_case(file.path(), {}));
    }
    return cases;
}

/// Starts each case with this file.
template <int D>
void start_all(std::vector<io::CaseInput>& cases, const std::string& file)
{
    for (io::CaseInput& input : cases) {
        input.bodies[0].file = file;
        start<D>(input);
    }
}

}  // namespace ordo::fuzz
