// A mesh file through Gmsh's library itself. Its code is not instrumented, so that mutations go by luck, and it crashes on
// some of them: in the process of its own that src/io/gmsh.cpp gives it, which is what this target tests.
#include "io/mesh_file.hpp"
#include "fuzz.hpp"

namespace ordo::fuzz {
namespace {

void run(std::string_view text)
{
    static MemoryFile file;
    file.write(text);
    accepts([] { io::read_mesh<2>(file.path()); });
}

}  // namespace
}  // namespace ordo::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    ordo::fuzz::run({reinterpret_cast<const char*>(data), size});
    return 0;
}
