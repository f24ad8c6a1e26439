#include "io/gmsh.hpp"

#include "io/schema.hpp"

#if defined(ORDO_GMSH)
#include "base/error.hpp"

#include <dlfcn.h>
#include <fcntl.h>
#include <gmshc.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <memory>
#include <type_traits>
#endif

namespace ordo::io {

#if defined(ORDO_GMSH)

namespace {

#define ORDO_TEXT(x) ORDO_TEXT_OF(x)
#define ORDO_TEXT_OF(x) #x
constexpr const char* kLibrary = "libgmsh.so." ORDO_TEXT(GMSH_API_VERSION_MAJOR) "." ORDO_TEXT(GMSH_API_VERSION_MINOR);

/// The library, loaded for the first mesh and kept. If it were linked, its 90 libraries would slow down `ordo --version` from 4
/// to 146 ms (4.8.4 of Debian 12, 2026-11; main starts twice), and ordo's binaries would fall under Gmsh's licence, the GPL.
void* library()
{
    for (const std::string& name : {std::string(kLibrary), std::string(ORDO_GMSH_FOLDER "/") + kLibrary})
        if (void* handle = dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE)) return handle;
    throw InputError(
        fmt::format("{}: cannot be loaded ({}); meshes need it: install the package libgmsh-dev", kLibrary, dlerror()));
}

template <class F>
F* function_of(void* handle, const char* name)
{
    void* address = dlsym(handle, name);
    if (!address) throw InputError(fmt::format("{}: has no function {}; install the package libgmsh-dev again", kLibrary, name));
    return reinterpret_cast<F*>(address);
}

/// The functions in use: types from Gmsh's header, addresses from the library.
struct Functions {
    void* handle = library();
#define ORDO_GMSH_FUNCTION(name) decltype(gmsh##name)* name = function_of<decltype(gmsh##name)>(handle, "gmsh" #name);
    ORDO_GMSH_FUNCTION(Initialize)
    ORDO_GMSH_FUNCTION(Free)
    ORDO_GMSH_FUNCTION(OptionSetNumber)
    ORDO_GMSH_FUNCTION(LoggerGetLastError)
    ORDO_GMSH_FUNCTION(Merge)
    ORDO_GMSH_FUNCTION(ModelGetEntities)
    ORDO_GMSH_FUNCTION(ModelGetPhysicalGroups)
    ORDO_GMSH_FUNCTION(ModelGetPhysicalName)
    ORDO_GMSH_FUNCTION(ModelGetEntitiesForPhysicalGroup)
    ORDO_GMSH_FUNCTION(ModelMeshGetNodes)
    ORDO_GMSH_FUNCTION(ModelMeshGetElements)
    ORDO_GMSH_FUNCTION(ModelMeshGetElementProperties)
#undef ORDO_GMSH_FUNCTION
};

/// A Gmsh session, which neither reads configuration files nor prints. Gmsh changes the locale and the number of OpenMP threads
/// (seen in 4.8.4). It is never finalized: the process ends with it.
class Session {
  public:
    Session(const Functions& functions, std::string file) : f(functions), file_(std::move(file))
    {
        initialize(f.Initialize);
        call(f.OptionSetNumber, "General.Terminal", 0.0);
    }
    Session(const Session&) = delete;

    /// Calls a function whose last argument is its error code; throws InputError with Gmsh's message.
    template <class F, class... Args>
    void call(F* function, Args... args) const
    {
        int error = 0;
        function(args..., &error);
        if (error == 0) return;
        char* text = nullptr;
        f.LoggerGetLastError(&text, &error);
        fail({file_}, "mesh", fmt::format("Gmsh cannot read it: {}; save it again as format 4.1", take(text)));
    }
    /// Takes over an array or text that Gmsh allocated in a call.
    template <class T>
    std::vector<T> take(T* data, std::size_t size) const
    {
        std::vector<T> values(data, data + size);
        f.Free(data);
        return values;
    }
    std::string take(char* text) const
    {
        std::string copy(text ? text : "");
        f.Free(text);
        return copy;
    }
    /// The integers that `find(&data, &size)` returns.
    template <class Find>
    std::vector<int> integers(Find&& find) const
    {
        int* data        = nullptr;
        std::size_t size = 0;
        find(&data, &size);
        return take(data, size);
    }

    const Functions& f;

  private:
    /// Without configuration files; since 4.9 there is one more argument, for its window.
    template <class F>
    void initialize(F* start) const
    {
        if constexpr (std::is_invocable_v<F*, int, char**, int, int*>)
            call(start, 0, nullptr, 0);
        else
            call(start, 0, nullptr, 0, 0);
    }

    std::string file_;
};

std::vector<GmshMesh::Group> groups_of(const Session& gmsh)
{
    std::vector<GmshMesh::Group> groups;
    const std::vector<int> pairs =
        gmsh.integers([&](int** list, std::size_t* size) { gmsh.call(gmsh.f.ModelGetPhysicalGroups, list, size, -1); });
    for (std::size_t k = 0; k + 1 < pairs.size(); k += 2) {
        const int dim = pairs[k], number = pairs[k + 1];
        char* text = nullptr;
        gmsh.call(gmsh.f.ModelGetPhysicalName, dim, number, &text);
        const std::string name          = gmsh.take(text);
        const std::vector<int> entities = gmsh.integers(
            [&](int** list, std::size_t* size) { gmsh.call(gmsh.f.ModelGetEntitiesForPhysicalGroup, dim, number, list, size); });
        groups.push_back({dim, name.empty() ? fmt::format("{}", number) : name, entities});
    }
    return groups;
}

GmshMesh::Block block_of(const Session& gmsh, int dim, int entity, int type)
{
    GmshMesh::Block block{dim, entity, type, 0, {}, {}, {}};
    char* name  = nullptr;
    int own_dim = 0, order = 0, primary = 0;
    double* local     = nullptr;
    std::size_t count = 0;
    gmsh.call(gmsh.f.ModelMeshGetElementProperties, type, &name, &own_dim, &order, &block.nodes_per_element, &local, &count,
              &primary);
    gmsh.take(local, count);
    block.name = gmsh.take(name);
    return block;
}

void add_blocks(const Session& gmsh, int dim, int entity, std::vector<GmshMesh::Block>& blocks)
{
    int* types             = nullptr;
    std::size_t type_count = 0, element_lists = 0, node_lists = 0;
    std::size_t **elements = nullptr, **nodes = nullptr, *element_counts = nullptr, *node_counts = nullptr;
    gmsh.call(gmsh.f.ModelMeshGetElements, &types, &type_count, &elements, &element_counts, &element_lists, &nodes, &node_counts,
              &node_lists, dim, entity);
    for (std::size_t k = 0; k < type_count; ++k) {
        GmshMesh::Block& block = blocks.emplace_back(block_of(gmsh, dim, entity, types[k]));
        block.elements         = gmsh.take(elements[k], element_counts[k]);
        block.nodes            = gmsh.take(nodes[k], node_counts[k]);
    }
    for (void* list : {static_cast<void*>(types), static_cast<void*>(elements), static_cast<void*>(element_counts),
                       static_cast<void*>(nodes), static_cast<void*>(node_counts)})
        gmsh.f.Free(list);
}

GmshMesh mesh_of(const Session& gmsh, std::FILE* file)
{
    // By its descriptor: for part.msh Gmsh would also run the commands in part.msh.opt.
    gmsh.call(gmsh.f.Merge, fmt::format("/dev/fd/{}", fileno(file)).c_str());

    GmshMesh mesh;
    mesh.groups        = groups_of(gmsh);
    std::size_t *nodes = nullptr, count = 0, x_count = 0, local_count = 0;
    double *x = nullptr, *local = nullptr;
    gmsh.call(gmsh.f.ModelMeshGetNodes, &nodes, &count, &x, &x_count, &local, &local_count, -1, -1, 0, 0);
    mesh.nodes = gmsh.take(nodes, count);
    mesh.x     = gmsh.take(x, x_count);
    gmsh.take(local, local_count);
    const std::vector<int> entities =
        gmsh.integers([&](int** list, std::size_t* size) { gmsh.call(gmsh.f.ModelGetEntities, list, size, -1); });
    for (std::size_t k = 0; k + 1 < entities.size(); k += 2) add_blocks(gmsh, entities[k], entities[k + 1], mesh.blocks);
    return mesh;
}

struct Close {
    void operator()(std::FILE* f) const { std::fclose(f); }
};
using File = std::unique_ptr<std::FILE, Close>;

/// One end of a pipe: the same calls write values to it or read them from it.
class PipeEnd {
  public:
    PipeEnd(int descriptor, bool is_writer) : file_(fdopen(descriptor, is_writer ? "wb" : "rb")), is_writer_(is_writer) {}

    template <class T>
    void pass(T& number)
    {
        static_assert(std::is_arithmetic_v<T>);
        pass(&number, 1);
    }
    void pass(std::string& text) { pass_list(text); }
    template <class T>
    void pass(std::vector<T>& list)
    {
        pass_list(list);
    }
    void pass(GmshMesh::Block& block)
    {
        for (int* number : {&block.dim, &block.entity, &block.type, &block.nodes_per_element}) pass(*number);
        pass(block.name);
        pass(block.elements);
        pass(block.nodes);
    }
    void pass(GmshMesh::Group& group)
    {
        pass(group.dim);
        pass(group.name);
        pass(group.entities);
    }
    void pass(GmshMesh& mesh)
    {
        pass(mesh.nodes);
        pass(mesh.x);
        pass(mesh.blocks);
        pass(mesh.groups);
    }
    /// Whether everything was transferred.
    bool finish() { return std::fflush(file_.get()) == 0 && is_whole_; }

  private:
    template <class T>
    void pass(T* values, std::size_t count)
    {
        const std::size_t done = !is_whole_   ? 0
                                 : is_writer_ ? std::fwrite(values, sizeof(T), count, file_.get())
                                              : std::fread(values, sizeof(T), count, file_.get());
        is_whole_              = done == count;
    }
    /// A list grows while it is read: its length may be damaged.
    template <class List>
    void pass_list(List& list)
    {
        using T             = typename List::value_type;
        std::uint64_t count = list.size();
        pass(count);
        for (std::uint64_t k = 0; k < count && is_whole_;) {
            const std::uint64_t n = std::min<std::uint64_t>(count - k, 1 << 16);
            if (!is_writer_) list.resize(k + n);
            if constexpr (std::is_arithmetic_v<T>)
                pass(list.data() + k, n);
            else
                for (std::uint64_t i = k; i < k + n; ++i) pass(list[i]);
            k += n;
        }
    }

    File file_;
    bool is_writer_, is_whole_ = true;
};

/// Prepares the process that reads a mesh for crashes: default signal handlers, no core file, no output. Reading has a limit of
/// processor time far above that of a sound file (0.1 s and 50 MB/s).
void prepare_to_crash(std::FILE* file)
{
    for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGXCPU}) std::signal(signal, SIG_DFL);
    if (const int nowhere = ::open("/dev/null", O_WRONLY); nowhere >= 0)
        for (const int stream : {STDOUT_FILENO, STDERR_FILENO}) dup2(nowhere, stream);
    std::fseek(file, 0, SEEK_END);
    const rlim_t seconds = 10 + static_cast<rlim_t>(std::max(std::ftell(file), 0L)) / 1'000'000;
    std::rewind(file);
    const rlimit no_core{0, 0}, time{seconds, seconds};
    setrlimit(RLIMIT_CORE, &no_core);
    setrlimit(RLIMIT_CPU, &time);
}

/// Reads the file, writes the mesh or an error to `out`, and ends the process.
[[noreturn]] void read_for(PipeEnd out, const Functions& functions, const std::string& name, std::FILE* file)
{
    prepare_to_crash(file);
    std::string error;
    GmshMesh mesh;
    try {
        mesh = mesh_of(Session(functions, name), file);
    } catch (const InputError& e) {
        error = e.what();
    } catch (const std::exception& e) {
        error = fmt::format("{}: mesh: Gmsh cannot read it: {}; save it again as format 4.1", name, e.what());
    }
    out.pass(error);
    out.pass(mesh);
    out.finish();
    _exit(0);
}

/// Opens the file if it starts like a mesh of a known format. Gmsh would run anything else as a script.
File open(const std::string& name)
{
    File file(std::fopen(name.c_str(), "rb"));
    char line[64] = "", version[16] = "";
    if (!file || std::filesystem::is_directory(name))
        fail({name}, "mesh", "cannot be opened; paths are relative to the case file");
    if (!std::fgets(line, sizeof line, file.get()) || !std::string_view(line).starts_with("$MeshFormat"))
        fail({name}, "mesh", "is not a Gmsh mesh, which starts with $MeshFormat; make one: gmsh -3 part.geo -o part.msh");
    if (std::fscanf(file.get(), "%15s", version) != 1 || (std::strcmp(version, "2.2") != 0 && std::strcmp(version, "4.1") != 0))
        fail({name}, "mesh",
             fmt::format("has format version {}; save it as 2.2 or 4.1: gmsh part.msh -save -format msh41 -o part41.msh",
                         version));
    std::rewind(file.get());
    return file;
}

/// Whether there are as many coordinates and corners as nodes and elements.
bool is_consistent(const GmshMesh& mesh)
{
    return mesh.x.size() == 3 * mesh.nodes.size() &&
           std::all_of(mesh.blocks.begin(), mesh.blocks.end(), [](const GmshMesh::Block& b) {
               return b.nodes_per_element >= 0 &&
                      b.nodes.size() == b.elements.size() * static_cast<std::size_t>(b.nodes_per_element);
           });
}

}  // namespace

bool has_gmsh() { return true; }

GmshMesh load_gmsh(const std::filesystem::path& path)
{
    const std::string name = path.string();
    const File file        = open(name);
    const Functions functions;
    int ends[2];
    if (pipe(ends) != 0) fail({name}, "mesh", fmt::format("cannot make a pipe to read it: {}", std::strerror(errno)));
    const pid_t reader = fork();
    if (reader == 0) {
        close(ends[0]);
        read_for(PipeEnd(ends[1], true), functions, name, file.get());
    }
    close(ends[1]);
    PipeEnd in(ends[0], false);
    if (reader < 0) fail({name}, "mesh", fmt::format("cannot start a process to read it: {}", std::strerror(errno)));
    std::string error;
    GmshMesh mesh;
    in.pass(error);
    in.pass(mesh);
    const bool is_whole = in.finish();
    int status          = 0;
    while (waitpid(reader, &status, 0) < 0 && errno == EINTR) {}
    if (!error.empty()) throw InputError(error);
    if (!is_whole || !is_consistent(mesh))
        fail({name}, "mesh",
             fmt::format("Gmsh {} while reading it: the file is damaged; save it again as format 4.1",
                         WIFSIGNALED(status) ? fmt::format("crashed (signal {})", WTERMSIG(status)) : "failed"));
    return mesh;
}

#else

bool has_gmsh() { return false; }

GmshMesh load_gmsh(const std::filesystem::path& file)
{
    fail({file.string()}, "mesh",
         "this ordo was built without Gmsh, which reads meshes; install the package libgmsh-dev, run cmake again and build");
}

#endif

}  // namespace ordo::io
