// The step as a linear map: about a uniform lattice of particles at rest and without stress, found exactly by driving the
// solver's own step, with its spectrum over wave number. Used by the case dispersion and its tests; knows no method by name.
#pragma once

#include "method/scheme.hpp"
#include "particles/seeding.hpp"
#include "spline/scheme.hpp"

#include <complex>
#include <memory>
#include <vector>

namespace ordo::verification {

/// A lattice of particles in a periodic box. Lengths are in cells, density and P-wave speed are 1: the time step is the
/// Courant number c dt/h.
struct ParticleLattice {
    MethodSpec method;
    int per_axis   = 1;    ///< particles per cell along each axis
    double shift   = 0.0;  ///< of all along each axis, in their spacing: 0 sub-cell centres, 0.5 every cell face has particles
    int cells      = 64;   ///< of the box along each axis
    double poisson = 0.0;
};

/// The law that carries the stress itself: its energy is quadratic, and small stresses do not cancel in it.
template <int D>
inline constexpr std::string_view rate_law = D == 1 ? "linear-rate-1d" : "jaumann-elastic";

/// The model of a lattice and its seeds, those of one cell after those of another, cells with the first axis fastest.
template <int D>
Model<D> model_of(const ParticleLattice& lattice, std::string_view law);
template <int D>
std::vector<Seed<D>> seeds_of(const ParticleLattice& lattice);

/// Velocity, stress and what else particles carry from step to step after one step of a lattice, as a linear function of
/// what they carry before it. Positions do not matter to first order: they change by velocities, which are first order
/// themselves as the stresses are that a change of positions would act on.
template <int D>
class LatticeOperator {
  public:
    explicit LatticeOperator(const ParticleLattice& lattice);

    /// Finds the map of a step of this Courant number: one step for each degree of freedom of one cell.
    void assemble(double courant);

    /// Degrees of freedom of a cell: by particle the components of v, of sigma (xx, xy, .., yy, ..), of L_p row by row and of
    /// the modes from the second on, where the method has them.
    int size() const { return particles_ * static_cast<int>(fields_.size()); }

    int particle_count() const { return static_cast<int>(of_id_.size()); }  ///< of the box

    /// The map of what is exp(i theta k) from cell to cell k, size() x size(), row by row.
    std::vector<std::complex<double>> symbol(const Vec<D>& theta) const;
    std::vector<std::complex<double>> eigenvalues(const Vec<D>& theta) const;

    /// Wave numbers of a half space, `intervals` from 0 to pi. Where one cell acts on those half a box away they are those
    /// of the box.
    std::vector<Vec<D>> wave_numbers(int intervals) const;

    /// The largest |eigenvalue| over wave numbers.
    double growth(int intervals) const;

  private:
    struct Field {
        enum Kind { velocity, stress, gradient, mode } kind;
        int a, b;
    };
    double& at(int particle, const Field& field);
    void rest();

    std::unique_ptr<Scheme<D>> scheme_;
    State<D> state_;
    int cells_;
    int particles_;                 ///< in a cell
    std::vector<Field> fields_;     ///< of a particle
    std::vector<int> of_id_;        ///< where the particle with this number is
    std::vector<double> blocks_;    ///< size() x size() a cell: what it gains from cell 0
    std::vector<char> is_reached_;  ///< whether its block is not zero
    bool wraps_ = false;            ///< cell 0 acts on cells half a box away
};

/// The eigenvalues of v' = a_h, sigma' = L_h for particles that do not move, in 1/s; of projection spline-fit with density 1. The
/// particles' fields are lost.
std::vector<std::complex<double>> frozen_spectrum(const SplineScheme<1>& scheme, State<1>& s);

/// The largest real part of the spectrum of v' = a_h, sigma' = E L_h for a lattice that does not move, in c/h; of projection
/// spline-fit in 1D.
double frozen_growth(const ParticleLattice& lattice);

/// A growth of less than this a step counts as none: an eigenvalue 1 that is defective moves by the square root of round-off.
constexpr double kGrowthTolerance = 1e-6;

/// Courant numbers at which all waves of a lattice are bounded: from `from` (0: from the smallest steps on) to `to`.
struct StableCourantNumbers {
    static constexpr double smallest = 0.005;  ///< that is tried
    double from = 0.0, to = 0.0;               ///< both 0 where there are none
};

/// The first interval of stable Courant numbers, its ends found to 1e-6; up to `largest`.
template <int D>
StableCourantNumbers find_stable(LatticeOperator<D>& lattice, double largest);

}  // namespace ordo::verification
