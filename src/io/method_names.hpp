// Methods as options of the command line name them: a preset, then axes one by one. `ordo verify` and `ordo bench` share
// it; the files of `ordo run` go by the schema.
#pragma once

#include "method/tables.hpp"

#include <optional>
#include <string>

namespace ordo::io {

/// The whole text as a number; nothing where it is none.
std::optional<double> parse_number(const std::string& text);

/// The preset of `--method`. Throws InputError with the nearest right spelling.
const Preset& preset_called(const std::string& name);

/// Sets the axis or number `name` of a method to `choice`. Throws InputError with the nearest right spelling, or what may
/// stand there; `option` is what stood before the name, for the message.
void set_axis(MethodSpec& spec, const std::string& option, const std::string& name, const std::string& choice);

/// Throws InputError with the rule that a method, called `name`, breaks.
void require_allowed(const std::string& name, const MethodSpec& spec);

}  // namespace ordo::io
