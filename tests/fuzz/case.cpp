// A whole case in TOML: read, echoed, built and started. Each part behind a zero byte is an override, as of --set.
#include "fuzz.hpp"
#include "io/input.hpp"

#include <algorithm>
#include <filesystem>
#include <vector>

namespace ordo::fuzz {
namespace {

constexpr const char* kParticles = "x,y,volume,r1x,r1y,r2x,r2y\n0.3,0.4,0.01,0.05,0,0,0.05\n0.4,0.4,0.01,0.05,0,0,0.05\n";
constexpr const char* kMesh =
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0.2 0.2 0\n2 0.4 0.2 0\n3 0.4 0.4 0\n4 0.2 0.4 0\n$EndNodes\n"
    "$Elements\n2\n1 2 2 1 1 1 2 3\n2 2 2 1 1 1 3 4\n$EndElements\n";

/// Bodies of files get those of this target; false where the case names others: what a path leads to is not the reader's.
bool use_own_files(io::CaseInput& input)
{
    static const MemoryFile particles(kParticles), mesh(kMesh);
    return std::all_of(input.bodies.begin(), input.bodies.end(), [](io::BodyInput& b) {
        const std::string name = std::filesystem::path(b.file).filename().string();
        if (name == "particles.csv") b.file = particles.path();
        if (name == "part.msh") b.file = mesh.path();
        return b.file.empty() || name == "particles.csv" || name == "part.msh";
    });
}

/// The resolved case gives itself when it is read again.
void require_echo(const io::CaseInput& input, MemoryFile& file)
{
    const std::string text = io::echo_case(input);
    file.write(text);
    try {
        if (io::echo_case(io::read_case(file.path(), {})) != text) fail("the echo is read as another case:\n" + text);
    } catch (const InputError& e) {
        fail(fmt::format("the echo is refused: {}\n{}", e.what(), text));
    }
}

/// Conditions are asked for at each node of their face, which of a large grid takes long.
bool is_quick(const io::CaseInput& input)
{
    for (int a = 0; a < input.grid.dim; ++a)
        if (input.grid.size[a] / input.grid.spacing[a] > 200)
            for (const io::BoundaryInput& b : input.boundaries)
                if (b.type == "velocity") return false;
    return true;
}

void run(std::string_view data)
{
    static MemoryFile file;
    const std::size_t end = std::min(data.find('\0'), data.size());
    file.write(data.substr(0, end));
    std::vector<std::string> overrides;
    for (std::size_t k = end; k < data.size();) {
        const std::size_t next = std::min(data.find('\0', k + 1), data.size());
        overrides.emplace_back(data.substr(k + 1, next - k - 1));
        k = next;
    }
    io::CaseInput input;
    if (!accepts([&] { input = io::read_case(file.path(), overrides); })) return;
    require_echo(input, file);
    if (!use_own_files(input) || !is_quick(input)) return;
    if (input.grid.dim == 1) start<1>(input);
    if (input.grid.dim == 2) start<2>(input);
    if (input.grid.dim == 3) start<3>(input);
}

}  // namespace
}  // namespace ordo::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    ordo::fuzz::run({reinterpret_cast<const char*>(data), size});
    return 0;
}
