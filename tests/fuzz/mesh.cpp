// A mesh as Gmsh's library hands it over, by plain_gmsh.cpp in its place: ordo's own checks, then bodies of the mesh.
#include "bodies.hpp"
#include "io/mesh_file.hpp"

namespace ordo::fuzz {
namespace {

template <int D>
void run_in(const MemoryFile& file)
{
    static std::vector<io::CaseInput> cases =
        cases_of(D, "mesh",
                 {"[method]\npreset = 'cpdi1'\n[[traction]]\nbody = 'b'\nface = 'all'\nvalue = 't'\n",
                  "[method]\npreset = 'fem'\n[[traction]]\nbody = 'b'\nface = 'x-max'\nvalue = 'x'\n",
                  "[method]\npreset = 'cpdi2t'\n[[boundary]]\nface = 'x-max'\ntype = 'periodic'\n"});
    accepts([&] { io::read_mesh<D>(file.path(), "part"); });
    if (accepts([&] { io::read_mesh<D>(file.path()); })) start_all<D>(cases, file.path());
}

void run(std::string_view text)
{
    static MemoryFile file;
    file.write(text);
    run_in<1>(file);
    run_in<2>(file);
    run_in<3>(file);
}

}  // namespace
}  // namespace ordo::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    ordo::fuzz::run({reinterpret_cast<const char*>(data), size});
    return 0;
}
