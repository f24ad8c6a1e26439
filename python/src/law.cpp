#include "law.hpp"

#include "checks.hpp"
#include "material/outside_law.hpp"
#include "sim/output_fields.hpp"

#include <pybind11/stl.h>

#include <algorithm>

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

    void update(const NamedNumbers& parameters, OutsideParticles& particles) const override
    {
        const py::gil_scoped_acquire gil;
        const auto n = static_cast<py::ssize_t>(particles.count());
        py::array_t<double> F({n, py::ssize_t{3}, py::ssize_t{3}}), dF({n, py::ssize_t{3}, py::ssize_t{3}});
        particles.read_F(F.mutable_data());
        particles.read_dF(dF.mutable_data());
        py::dict state;
        for (std::size_t c = 0; c < history().size(); ++c) {
            py::array_t<double> column(n);
            particles.read_history(c, column.mutable_data());
            state[history()[c].first.c_str()] = column;
        }
        const py::object given = function_(F, dF, particles.dt(), state, numbers(parameters));
        const Numbers cauchy   = numbers_of(name_, "cauchy", given, {n, 3, 3});
        std::vector<Numbers> columns;
        std::vector<const double*> values;
        for (const auto& [name, initial] : history()) {
            if (!state.contains(name))
                throw InputError(name_ + ": took state \"" + name + "\" out of the dict; change it in place");
            columns.push_back(numbers_of(name_, "state \"" + name + "\"", state[name.c_str()], {n}));
            values.push_back(columns.back().data());
        }
        for (const auto& column : state) {
            const py::handle key = column.first;
            if (std::none_of(history().begin(), history().end(), [&](const auto& c) { return py::str(c.first).equal(key); }))
                throw InputError(name_ + ": state " + std::string(py::repr(key)) +
                                 " was not declared; give it to ordo.material(state = ..)");
        }
        particles.set(cauchy.data(), values);
    }

  private:
    static py::dict numbers(const NamedNumbers& parameters)
    {
        py::dict r;
        for (const auto& [name, value] : parameters) r[name.c_str()] = value;
        return r;
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
