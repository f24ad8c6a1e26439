// Constitutive laws that are Python functions.
#pragma once

#include <pybind11/pybind11.h>

namespace ordo::python {

void add_laws(pybind11::module_& module);

}  // namespace ordo::python
