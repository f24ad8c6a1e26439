// The extension module behind the package ordo: see python/ordo/__init__.py.
#include "base/error.hpp"
#include "case.hpp"
#include "law.hpp"
#include "material/branches.hpp"
#include "material/outside_law.hpp"
#include "method/tables.hpp"
#include "ordo_version.hpp"
#include "sim/output_fields.hpp"
#include "simulation.hpp"
#include "threads.hpp"
#include "verification/choice.hpp"
#include "verification/report.hpp"

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <filesystem>

namespace ordo::python {

namespace py = pybind11;

namespace {

py::list methods()
{
    py::list r;
    for (const Preset& p : presets()) {
        py::dict choices;
        for_each_axis([&](auto axis) {
            using A                              = Axis<std::decay_t<decltype(p.spec.*axis)>>;
            choices[std::string(A::key).c_str()] = name_of(p.spec.*axis);
        });
        for (const Setting& s : settings())
            if (p.spec.*s.value >= s.min) choices[std::string(s.name).c_str()] = p.spec.*s.value;
        py::dict one;
        one["name"]    = p.name;
        one["what"]    = p.what;
        one["choices"] = choices;
        r.append(one);
    }
    return r;
}

py::list materials()
{
    py::list r;
    for (const LawRow* law : all_laws()) {
        py::list parameters, history;
        for (const LawParameter& p : law->parameters) parameters.append(p.name);
        for (const HistoryColumn& c : law->history) history.append(c.name);
        py::dict one;
        one["name"]       = law->name;
        one["what"]       = law->what;
        one["parameters"] = parameters;
        one["history"]    = history;
        r.append(one);
    }
    return r;
}

py::list verification_cases()
{
    py::list r;
    for (const verification::Case& c : verification::cases()) {
        py::dict parameters;
        for (const verification::Parameter& p : c.parameters) parameters[p.name.c_str()] = p.value;
        py::dict one;
        one["name"]       = c.name;
        one["what"]       = c.what;
        one["dim"]        = c.dim;
        one["cells"]      = c.cells;
        one["parameters"] = parameters;
        r.append(one);
    }
    return r;
}

/// The JSON of `ordo verify --json`. Ctrl-C ends it between two meshes.
std::string verify(const std::string& name, std::vector<std::string> methods, std::vector<int> cells, std::optional<int> ppc,
                   std::vector<std::pair<std::string, std::string>> settings, std::optional<int> threads)
{
    const int count = threads_of(threads);
    using namespace verification;
    std::vector<Result> results;
    for (const Resolved& study : choose_studies({name, false, std::move(methods), std::move(cells), ppc, std::move(settings)})) {
        Result& result = results.emplace_back(Result{study, {}, {}});
        for (const int n : study.cells) {
            {
                const py::gil_scoped_release release;
                with_threads(count, [&] { result.rows.push_back(run_row(study, n, false)); });
            }
            if (PyErr_CheckSignals() != 0) throw py::error_already_set();
        }
        for (const Bar& bar : study.bars) result.verdicts.push_back(study.judge(bar, result.rows));
    }
    return to_json(results);
}

/// A class of errors of the package.
PyObject* error(const char* name) { return py::module_::import("ordo._errors").attr(name).cast<py::object>().release().ptr(); }

}  // namespace

PYBIND11_MODULE(_core, module)
{
    module.attr("__version__") = ORDO_VERSION;
    // Made in Python, so that each has a Python base and a place in the package. Never freed: the program may end in any order.
    static PyObject *input = error("InputError"), *numerical = error("NumericalError"), *output = error("OutputError");
    py::register_exception_translator([](std::exception_ptr p) {
        try {
            if (p) std::rethrow_exception(p);
        } catch (const InputError& e) {
            std::string text = e.what();
            if (text.find(".model: must be one of") != std::string::npos)
                text += "; a law of Python must be made first, by ordo.material: import the module that has it";
            PyErr_SetString(input, text.c_str());
        } catch (const NumericalError& e) {
            PyErr_SetString(numerical, e.what());
        } catch (const OutputError& e) {
            PyErr_SetString(output, e.what());
        } catch (const std::filesystem::filesystem_error& e) {
            PyErr_SetString(output, e.what());
        }
    });
    add_case(module);
    add_laws(module);
    add_simulation(module);
    module.def("methods", methods);
    module.def("materials", materials);
    module.def("verification_cases", verification_cases);
    module.def("verify", verify, py::arg("name"), py::arg("methods"), py::arg("cells"), py::arg("ppc"), py::arg("settings"),
               py::arg("threads"));
}

}  // namespace ordo::python
