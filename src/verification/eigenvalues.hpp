// Eigenvalues of dense complex matrices.
#pragma once

#include <complex>
#include <vector>

namespace ordo::verification {

/// Those of a square matrix, row by row. Throws NumericalError where they are not found.
std::vector<std::complex<double>> eigenvalues_of(const std::vector<std::complex<double>>& matrix);

}  // namespace ordo::verification
