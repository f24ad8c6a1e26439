// Resident memory of this process, from Linux' /proc/self.
#pragma once

#include <optional>

namespace ordo::app {

/// Current and peak resident bytes; nothing if the system does not tell.
std::optional<double> resident_bytes();
std::optional<double> peak_resident_bytes();

/// Returns free memory to the system and resets the peak. False if the system cannot: the peak is then that of the whole
/// process.
bool reset_peak_resident_bytes();

}  // namespace ordo::app
