// Positions in messages.
#pragma once

#include "base/vec.hpp"

#include <string>

namespace ordo {

/// The coordinates of a position, such as "(0.5, 0.25)".
std::string place_text(const double* x, int dim);

template <int D>
std::string place_text(const Vec<D>& x)
{
    return place_text(x.c, D);
}

}  // namespace ordo
