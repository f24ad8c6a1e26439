#include "law.hpp"

#include "checks.hpp"
#include "material/outside_law.hpp"
#include "sim/output_fields.hpp"

#include <pybind11/stl.h>

#include <algorithm>
#include <cstring>

namespace ordo::python {

namespace {

/// Lives as long as the program, and so does the function.
class PythonLaw final : public OutsideLaw {
  public:
    PythonLaw(const std::string& name, const std::string& what, std::vector<std::pair<std::string, double>> state,
              py::object function, py::object speed)
        : OutsideLaw(name, what, std::move(state)), name_("law " + name), function_(std::move(function)), speed_(std::move(speed))
    {}

    double wave_speed(const NamedNumbers& parameters) const override
    {
        const py::gil_scoped_acquire gil;
        const py::object c = speed_(numbers(parameters));
        try {
            return c.cast<double>();
        } catch (const py::cast_error&) {
            throw InputError(name_ + ": wave_speed must return a number, m/s (got " + type_of(c) + ")");
        }
    }

    void update(const NamedNumbers& parameters, const OutsideStep& step) const override
    {
        const py::gil_scoped_acquire gil;
        const auto n = static_cast<py::ssize_t>(step.count);
        py::dict state;
        for (std::size_t c = 0; c < history().size(); ++c)
            state[history()[c].first.c_str()] = py::array_t<double>(n, step.history[c]);
        const py::object cauchy = function_(tensors(n, step.F), tensors(n, step.dF), step.dt, state, numbers(parameters));
        copy_numbers(name_, "cauchy", cauchy, {n, 3, 3}, step.cauchy);
        for (std::size_t c = 0; c < history().size(); ++c) {
            const std::string& column = history()[c].first;
            if (!state.contains(column))
                throw InputError(name_ + ": took state \"" + column + "\" out of the dict; change it in place");
            copy_numbers(name_, "state \"" + column + "\"", state[column.c_str()], {n}, step.history[c]);
        }
        for (const auto& [key, value] : state)
            if (std::none_of(history().begin(), history().end(), [&](const auto& c) { return py::str(c.first).equal(key); }))
                throw InputError(name_ + ": state " + std::string(py::repr(key)) +
                                 " was not declared; give it to ordo.material(state = ..)");
    }

  private:
    static py::dict numbers(const NamedNumbers& parameters)
    {
        py::dict r;
        for (const auto& [name, value] : parameters) r[name.c_str()] = value;
        return r;
    }
    static py::array_t<double> tensors(py::ssize_t n, const double* values)
    {
        return py::array_t<double>(std::vector<py::ssize_t>{n, 3, 3}, values);
    }

    std::string name_;
    py::object function_, speed_;
};

void add(const std::string& name, const std::string& what, const std::vector<std::pair<std::string, double>>& state,
         const py::object& function, const py::object& speed)
{
    for (const auto& [column, initial] : state)
        if (column == OutsideLaw::kWork.name || is_computed_field(column))
            throw InputError("law " + name + ": state \"" + column +
                             "\" is the name of another field of particles; take another one");
    add_law(std::make_unique<PythonLaw>(name, what, state, function, speed));
}

}  // namespace

void add_laws(py::module_& module)
{
    module.def("add_law", add, py::arg("name"), py::arg("what"), py::arg("state"), py::arg("function"), py::arg("wave_speed"));
}

}  // namespace ordo::python
