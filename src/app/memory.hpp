// Resident memory of this process, as Linux tells it in /proc/self.
#pragma once

#include <optional>

namespace ordo::app {

/// Resident bytes now and the most there were; nothing where the system does not say.
std::optional<double> resident_bytes();
std::optional<double> peak_resident_bytes();

/// Gives back what is free, and starts the peak anew from what remains. False where the system cannot: the peak is then
/// that of the whole process.
bool reset_peak_resident_bytes();

}  // namespace ordo::app
