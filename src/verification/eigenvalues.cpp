#include "verification/eigenvalues.hpp"

#include "base/error.hpp"

#include <Eigen/Eigenvalues>

#include <cmath>

namespace ordo::verification {

std::vector<std::complex<double>> eigenvalues_of(const std::vector<std::complex<double>>& matrix)
{
    using Matrix = Eigen::Matrix<std::complex<double>, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const long n = std::lround(std::sqrt(matrix.size()));
    const Eigen::Map<const Matrix> m(matrix.data(), n, n);
    const Eigen::ComplexEigenSolver<Matrix> solver(m, false);
    if (solver.info() != Eigen::Success) throw NumericalError("the eigenvalues of a matrix were not found");
    const auto& values = solver.eigenvalues();
    return {values.data(), values.data() + values.size()};
}

}  // namespace ordo::verification
