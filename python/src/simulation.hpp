// A simulation of any dimension, for Python.
#pragma once

#include <pybind11/pybind11.h>

namespace ordo::python {

void add_simulation(pybind11::module_& module);

}  // namespace ordo::python
