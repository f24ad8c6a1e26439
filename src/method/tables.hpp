// The tables of methods: names and descriptions of choices, numbers, rules and presets. Input, error messages, `ordo list` and
// the tests use them; kernels do not.
#pragma once

#include "method/spec.hpp"

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ordo {

/// One choice of an axis: its value, its name in the input, a description.
template <class E>
struct Choice {
    E value;
    std::string_view name;
    std::string_view what;
};

// The types of all axes.
#define ORDO_AXES(AXIS)  \
    AXIS(Basis)          \
    AXIS(Domain)         \
    AXIS(CornerWeights)  \
    AXIS(Enrichment)     \
    AXIS(CornerVelocity) \
    AXIS(Projection)     \
    AXIS(Weight)         \
    AXIS(Samples)        \
    AXIS(Limiter)        \
    AXIS(Tls)            \
    AXIS(Quadrature)     \
    AXIS(CellVolume)     \
    AXIS(MassMatrix)     \
    AXIS(Gradient)       \
    AXIS(Update)         \
    AXIS(Filter)         \
    AXIS(TimeScheme)     \
    AXIS(Start)          \
    AXIS(Averaging)

/// An axis: its key in the input, its description and its choices. The rows are in tables.cpp.
template <class E>
struct Axis {
    static const std::string_view key, what;
    static const std::span<const Choice<E>> choices;
};

#define ORDO_AXIS(E) extern template struct Axis<E>;
ORDO_AXES(ORDO_AXIS)
#undef ORDO_AXIS

template <class E>
std::string_view name_of(E value)
{
    for (const auto& c : Axis<E>::choices)
        if (c.value == value) return c.name;
    return "?";
}

template <class E>
std::vector<std::string> choice_names()
{
    std::vector<std::string> r;
    for (const auto& c : Axis<E>::choices) r.emplace_back(c.name);
    return r;
}

/// The choice called `name`, which the input's schema has checked. Throws InputError.
template <class E>
E parse_choice(std::string_view name);

/// f(pointer to member) for each axis of a MethodSpec. This is the only list of axes.
template <class F>
void for_each_axis(F&& f)
{
    f(&MethodSpec::basis);
    f(&MethodSpec::domain);
    f(&MethodSpec::weights);
    f(&MethodSpec::enrichment);
    f(&MethodSpec::corner_velocity);
    f(&MethodSpec::projection);
    f(&MethodSpec::weight);
    f(&MethodSpec::samples);
    f(&MethodSpec::limiter);
    f(&MethodSpec::tls);
    f(&MethodSpec::quadrature);
    f(&MethodSpec::cell_volume);
    f(&MethodSpec::mass);
    f(&MethodSpec::gradient);
    f(&MethodSpec::update);
    f(&MethodSpec::filter);
    f(&MethodSpec::scheme);
    f(&MethodSpec::start);
    f(&MethodSpec::averaging);
}

/// A numeric parameter of a method.
struct Setting {
    std::string_view name;
    double MethodSpec::*value;
    double min, max;
    std::string_view what;
    bool is_integer               = false;
    std::string_view default_text = {};  ///< if the default depends on other choices
};
std::span<const Setting> settings();

/// A combination of choices that is forbidden, and the reason.
struct Rule {
    bool (*forbids)(const MethodSpec&);
    std::string_view what;  ///< the combination, in names of choices
    std::string_view why;
};

const std::vector<Rule>& rules();

/// The rule that a combination breaks; null if it is allowed.
const Rule* broken_rule(const MethodSpec& s);
/// Throws InputError if the combination breaks a rule.
void require_allowed(const MethodSpec& s);

/// A named method.
struct Preset {
    std::string_view name;
    std::string_view what;
    MethodSpec spec;
};

/// The presets, in the order of `ordo list methods`.
const std::vector<Preset>& presets();

/// The preset with this name; null if there is none.
const Preset* find_preset(std::string_view name);
std::vector<std::string> preset_names();

}  // namespace ordo
