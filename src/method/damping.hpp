// How velocities are damped, for states at rest under loads; see method/step_damping.hpp.
#pragma once

#include <array>
#include <string_view>

namespace ordo {

enum class DampingType {
    none,
    local,    ///< against the velocity, by a part of the force out of balance (Cundall 1987)
    viscous,  ///< in proportion to the velocity
    kinetic   ///< all velocities become zero when the kinetic energy has passed a peak (Cundall 1982)
};

/// Their names in the input, in the same order.
inline constexpr std::array<std::string_view, 4> kDampingNames{"none", "local", "viscous", "kinetic"};

struct Damping {
    DampingType type = DampingType::none;
    double factor    = 0.0;  ///< local: part of the velocity increment of a step, above 0 and at most 1
    double rate      = 0.0;  ///< viscous: velocities decay by exp(-rate t), 1/s
};

}  // namespace ordo
