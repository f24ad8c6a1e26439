#include "case.hpp"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <cmath>

namespace ordo::python {

namespace py = pybind11;

namespace {

py::dict described(const io::SectionText& section)
{
    py::dict keys;
    for (const io::KeyText& k : section.keys) {
        py::dict one;
        one["what"]     = k.info.what;
        one["type"]     = k.type;
        one["unit"]     = k.info.unit;
        one["default"]  = k.default_value;
        one["required"] = k.info.required;
        if (std::isfinite(k.info.min)) one["min"] = k.info.min;
        if (std::isfinite(k.info.max)) one["max"] = k.info.max;
        if (!k.info.choices.empty()) one["choices"] = k.info.choices;
        keys[k.info.name.c_str()] = one;
    }
    py::dict r;
    r["what"]     = section.what;
    r["repeated"] = section.repeated;
    r["keys"]     = keys;
    return r;
}

}  // namespace

void add_case(py::module_& module)
{
    py::class_<CaseOf>(module, "Case")
        .def_static(
            "read",
            [](const std::filesystem::path& file, const std::vector<std::string>& overrides) {
                return CaseOf{io::read_case(file, overrides)};
            },
            py::arg("file"), py::arg("overrides"))
        .def_static(
            "parse",
            [](const std::string& text, const std::filesystem::path& file, const std::vector<std::string>& overrides) {
                return CaseOf{io::read_case_text(text, file, overrides)};
            },
            py::arg("text"), py::arg("file"), py::arg("overrides"))
        .def("text", [](const CaseOf& of) { return io::echo_case(of.input); })
        .def_property_readonly("dim", [](const CaseOf& of) { return of.input.grid.dim; })
        .def_property_readonly("name", [](const CaseOf& of) { return of.input.name; })
        .def_property_readonly("title", [](const CaseOf& of) { return of.input.title; })
        .def_property_readonly("end", [](const CaseOf& of) { return of.input.time.end; });
    module.def("schema", [] {
        py::dict r;
        for (const io::SectionText& section : io::input_schema()) r[section.name.c_str()] = described(section);
        return r;
    });
}

}  // namespace ordo::python
