// The extension ordo._core of the package: hands over to the build of it that the processor can run, or that ORDO_ISA names.
#include <Python.h>

#include "builds.hpp"

#include <filesystem>

#include <dlfcn.h>

namespace {

std::filesystem::path folder_of_this_library()
{
    static const char here = 0;
    Dl_info library{};
    if (dladdr(&here, &library) == 0) throw std::runtime_error("the folder of its extension is not known");
    return std::filesystem::path(library.dli_fname).parent_path();
}

}  // namespace

PyMODINIT_FUNC PyInit__core()
{
    try {
        const std::string build = ordo::choose_build(folder_of_this_library() / "_core-", ".so");
        void* library           = dlopen(build.c_str(), RTLD_NOW | RTLD_LOCAL);
        void* start             = library ? dlsym(library, "PyInit__core") : nullptr;
        if (!start) throw std::runtime_error(dlerror());
        return reinterpret_cast<PyObject* (*)()>(start)();
    } catch (const std::exception& e) {
        return PyErr_Format(PyExc_ImportError, "ordo: %s", e.what());
    }
}
