// An STL file: read, and asked for the distances of points in and around it.
#include "io/stl.hpp"
#include "fuzz.hpp"
#include "shape/solid.hpp"

namespace ordo::fuzz {
namespace {

void ask(const Solid<3>& solid)
{
    const Bounds<3> bounds = bounds_of<3>(solid);
    const Vec<3> down{0, 0, -1};
    for (int k = 0; k < 8; ++k) {
        Vec<3> x{};
        for (int a = 0; a < 3; ++a) x[a] = bounds.lower[a] + (0.3 + 0.9 * (k >> a & 1)) * (bounds.upper[a] - bounds.lower[a]);
        for (const Vec<3>* n : {static_cast<const Vec<3>*>(nullptr), &down}) {
            const auto at = clearance(solid, x, n, 0.5 * norm(bounds.upper - bounds.lower));
            if (at && !(std::fabs(norm(at->normal) - 1) < 1e-9)) fail("a normal is not of length 1");
            if (at && !std::isfinite(at->gap)) fail("a gap is not finite");
        }
    }
    if (const auto bulk = bulk_of<3>(solid); bulk && !(bulk->volume > 0)) fail("a volume is not positive");
}

void run(std::string_view text)
{
    static MemoryFile file;
    file.write(text);
    std::vector<std::array<Vec<3>, 3>> triangles;
    if (!accepts([&] { triangles = io::read_stl(file.path()); })) return;
    const TriangleSurface surface(triangles);
    if (!surface.triangles().empty()) ask(surface);
}

}  // namespace
}  // namespace ordo::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    ordo::fuzz::run({reinterpret_cast<const char*>(data), size});
    return 0;
}
