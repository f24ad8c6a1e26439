// A CSV file of particles: read in each dimension, then built and started by methods with and without domains.
#include "bodies.hpp"
#include "io/particle_file.hpp"

namespace ordo::fuzz {
namespace {

template <int D>
void run_in(const MemoryFile& file)
{
    static std::vector<io::CaseInput> cases =
        cases_of(D, "particles",
                 {"[method]\npreset = 'mpm'\n", "[method]\npreset = 'cpdi1'\n", "[method]\npreset = 'cpdi2'\n",
                  "[method]\npreset = 'cpgimp'\n[[boundary]]\nface = 'x-max'\ntype = 'periodic'\n"});
    io::BodyInput body;
    body.file = file.path();
    if (accepts([&] { io::read_particles<D>(body); })) start_all<D>(cases, body.file);
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
