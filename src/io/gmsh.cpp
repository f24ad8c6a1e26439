#include "io/gmsh.hpp"

#include "io/schema.hpp"

#if defined(ORDO_GMSH)
#include "base/parallel.hpp"

#include <dlfcn.h>
#include <gmshc.h>

#include <clocale>
#include <cstdio>
#include <cstring>
#include <memory>
#endif

namespace ordo::io {

#if defined(ORDO_GMSH)

namespace {

#define ORDO_TEXT(x) ORDO_TEXT_OF(x)
#define ORDO_TEXT_OF(x) #x
constexpr const char* kLibrary = "libgmsh.so." ORDO_TEXT(GMSH_API_VERSION_MAJOR) "." ORDO_TEXT(GMSH_API_VERSION_MINOR);

/// The library, loaded for the first mesh and kept. Linked, its 90 libraries would raise `ordo --version` from 4 to 146 ms
/// (4.8.4 of Debian 12, 2026-11; main starts twice), and ordo's binaries would fall under Gmsh's licence, the GPL.
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
    ORDO_GMSH_FUNCTION(Finalize)
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

/// Gmsh between its start and its end. It sets the locale and the number of OpenMP's threads (seen in 4.8.4), which get
/// their values back; it neither reads configuration files nor prints.
class Session {
  public:
    explicit Session(std::string file) : file_(std::move(file)), locale_(std::setlocale(LC_ALL, nullptr))
    {
        initialize(f.Initialize);
        call(f.OptionSetNumber, "General.Terminal", 0.0);
    }
    ~Session()
    {
        int error = 0;
        f.Finalize(&error);
        std::setlocale(LC_ALL, locale_.c_str());
        set_thread_count(threads_);
    }
    Session(const Session&) = delete;

    /// Calls a function with a last argument for its error; throws InputError with what Gmsh says of it.
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
    /// The array or text that a call has left, which Gmsh allocated.
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
    /// The integers that `find(&data, &size)` leaves.
    template <class Find>
    std::vector<int> integers(Find&& find) const
    {
        int* data        = nullptr;
        std::size_t size = 0;
        find(&data, &size);
        return take(data, size);
    }

    Functions f;

  private:
    /// Without configuration files; from 4.9 on there is an argument for its window too.
    template <class F>
    void initialize(F* start) const
    {
        if constexpr (std::is_invocable_v<F*, int, char**, int, int*>)
            call(start, 0, nullptr, 0);
        else
            call(start, 0, nullptr, 0, 0);
    }

    std::string file_, locale_;
    int threads_ = thread_count();
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

struct Close {
    void operator()(std::FILE* f) const { std::fclose(f); }
};
using File = std::unique_ptr<std::FILE, Close>;

/// The file, when it starts as a mesh of a known format. Gmsh would take anything else as a script.
File open(const std::string& name)
{
    File file(std::fopen(name.c_str(), "rb"));
    char line[64] = "", version[16] = "";
    if (!file || std::filesystem::is_directory(name))
        fail({name}, "mesh", "cannot be opened; paths are relative to the case file");
    if (!std::fgets(line, sizeof line, file.get()) || !std::string_view(line).starts_with("$MeshFormat"))
        fail({name}, "mesh", "is not a mesh of Gmsh, which starts with $MeshFormat; make one: gmsh -3 part.geo -o part.msh");
    if (std::fscanf(file.get(), "%15s", version) != 1 || (std::strcmp(version, "2.2") != 0 && std::strcmp(version, "4.1") != 0))
        fail({name}, "mesh",
             fmt::format("has format version {}; save it as 2.2 or 4.1: gmsh part.msh -save -format msh41 -o part41.msh",
                         version));
    std::rewind(file.get());
    return file;
}

}  // namespace

bool has_gmsh() { return true; }

GmshMesh load_gmsh(const std::filesystem::path& path)
{
    const std::string name = path.string();
    const File file        = open(name);
    const Session gmsh(name);
    // By its descriptor: beside part.msh Gmsh would run part.msh.opt, whatever commands are in it.
    gmsh.call(gmsh.f.Merge, fmt::format("/dev/fd/{}", fileno(file.get())).c_str());

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

#else

bool has_gmsh() { return false; }

GmshMesh load_gmsh(const std::filesystem::path& file)
{
    fail({file.string()}, "mesh",
         "this ordo was built without Gmsh, which reads meshes; install the package libgmsh-dev, run cmake again and build");
}

#endif

}  // namespace ordo::io
