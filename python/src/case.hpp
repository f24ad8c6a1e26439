// A case for Python.
#pragma once

#include "io/input.hpp"

#include <pybind11/pybind11.h>

namespace ordo::python {

/// A resolved case.
struct CaseOf {
    io::CaseInput input;
};

void add_case(pybind11::module_& module);

}  // namespace ordo::python
