// Checks of what Python functions return.
#pragma once

#include "base/error.hpp"

#include <pybind11/numpy.h>

#include <string>
#include <vector>

namespace ordo::python {

namespace py = pybind11;

inline std::string type_of(const py::handle& object) { return py::str(py::type::handle_of(object).attr("__name__")); }

/// The shape in words, such as (100, 3, 3).
inline std::string shape_text(const std::vector<py::ssize_t>& shape) { return py::str(py::tuple(py::cast(shape))); }

using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// The numbers of an array of real numbers. Throws InputError that names the function and the array for another type or shape. `called`
/// is such as "law my-law".
inline Numbers numbers_of(const std::string& called, const std::string& what, const py::handle& object,
                          const std::vector<py::ssize_t>& shape)
{
    auto fail = [&](const std::string& got) {
        throw InputError(called + ": " + what + " must be an array of real numbers of shape " + shape_text(shape) + " (got " +
                         got + ")");
    };
    const auto found = py::array::ensure(object);
    if (!found || object.is_none()) {
        PyErr_Clear();
        fail(type_of(object));
    }
    const char kind = found.dtype().kind();
    if (kind != 'f' && kind != 'i' && kind != 'u') fail("dtype " + std::string(py::str(found.dtype())));
    const std::vector<py::ssize_t> has(found.shape(), found.shape() + found.ndim());
    if (has != shape) fail("shape " + shape_text(has));
    Numbers numbers = Numbers::ensure(found);
    if (!numbers) throw py::error_already_set();
    return numbers;
}

}  // namespace ordo::python
