// Methods in command-line options: a preset, then axes one by one. Shared by `ordo verify` and `ordo bench`; files of
// `ordo run` are read by the schema.
#pragma once

#include "method/tables.hpp"

#include <optional>
#include <string>

namespace ordo::io {

/// The whole text as a number; nothing if it is not one.
std::optional<double> parse_number(const std::string& text);

/// The preset of `--method`. Throws InputError with the nearest right spelling.
const Preset& preset_called(const std::string& name);

/// Sets the axis or number `name` of a method to `choice`. Throws InputError with the nearest right spelling or the allowed
/// values; `option` is the text before the name, for the message.
void set_axis(MethodSpec& spec, const std::string& option, const std::string& name, const std::string& choice);

/// Throws InputError with the rule that method `name` breaks, if any.
void require_allowed(const std::string& name, const MethodSpec& spec);

}  // namespace ordo::io
