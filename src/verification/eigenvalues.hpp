// Eigenvalues of dense complex matrices.
#pragma once

#include <complex>
#include <vector>

namespace ordo::verification {

/// The eigenvalues of a square matrix, stored by rows. Throws NumericalError if they are not found.
std::vector<std::complex<double>> eigenvalues_of(const std::vector<std::complex<double>>& matrix);

}  // namespace ordo::verification
