#include "io/method_names.hpp"

#include "base/error.hpp"
#include "io/schema.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <vector>

namespace ordo::io {

std::optional<double> parse_number(const std::string& text)
{
    double number       = 0;
    const char* first   = text.data() + (text.starts_with('+') ? 1 : 0);
    const auto [end, e] = std::from_chars(first, text.data() + text.size(), number);
    if (e != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return number;
}

const Preset& preset_called(const std::string& name)
{
    if (const Preset* preset = find_preset(name)) return *preset;
    throw InputError(fmt::format("--method {}: there is no such preset. {}", name, suggestion(name, preset_names())));
}

namespace {

/// Sets a number of a method; returns false if there is none called `name`.
bool set_number(MethodSpec& spec, const std::string& option, const std::string& name, const std::string& choice)
{
    const auto all     = settings();
    const auto setting = std::find_if(all.begin(), all.end(), [&](const Setting& s) { return s.name == name; });
    if (setting == all.end()) return false;
    const auto number = parse_number(choice);
    if (!number || !(*number >= setting->min && *number <= setting->max))
        throw InputError(
            fmt::format("{}{}={}: it must be a number from {} to {}", option, name, choice, setting->min, setting->max));
    if (setting->is_integer && *number != std::floor(*number))
        throw InputError(fmt::format("{}{}={}: it must be an integer", option, name, choice));
    spec.*(setting->value) = *number;
    return true;
}

}  // namespace

void set_axis(MethodSpec& spec, const std::string& option, const std::string& name, const std::string& choice)
{
    if (set_number(spec, option, name, choice)) return;
    bool found = false;
    std::vector<std::string> axes;
    for (const Setting& setting : settings()) axes.emplace_back(setting.name);
    for_each_axis([&](auto member) {
        using E = std::decay_t<decltype(spec.*member)>;
        axes.emplace_back(Axis<E>::key);
        if (Axis<E>::key != name) return;
        const std::vector<std::string> names = choice_names<E>();
        if (std::find(names.begin(), names.end(), choice) == names.end())
            throw InputError(
                fmt::format("{}{}={}: there is no such choice. {}", option, name, choice, suggestion(choice, names)));
        spec.*member = parse_choice<E>(choice);
        found        = true;
    });
    if (!found)
        throw InputError(fmt::format("{}{}: {}", option, name,
                                     name == "preset" ? "the preset is chosen by --method"
                                                      : "there is no such axis. " + suggestion(name, axes)));
}

void require_allowed(const std::string& name, const MethodSpec& spec)
{
    if (const Rule* rule = broken_rule(spec))
        throw InputError(fmt::format("--method {}: {} is not allowed: {}", name, rule->what, rule->why));
}

}  // namespace ordo::io
