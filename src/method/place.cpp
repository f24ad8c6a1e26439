#include "method/place.hpp"

#include <fmt/format.h>

namespace ordo {

std::string place_text(const double* x, int dim)
{
    std::string r = "(";
    for (int a = 0; a < dim; ++a) r += fmt::format("{}{:.6g}", a ? ", " : "", x[a]);
    return r + ")";
}

}  // namespace ordo
