// The step as a linear map about a uniform lattice of particles at rest and without stress, and its spectrum over wave number.
// The map is found exactly by running the solver's own step. Used by the case dispersion and its tests; knows no method by name.
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
    double shift   = 0.0;  ///< of all particles along each axis, in their spacing: 0: sub-cell centres; 0.5: on every cell face
    int cells      = 64;   ///< of the box along each axis
    double poisson = 0.0;
};

/// The law that carries the stress itself: its energy is quadratic, so small stresses do not cancel.
template <int D>
inline constexpr std::string_view rate_law = D == 1 ? "linear-rate-1d" : "jaumann-elastic";

/// The model of a lattice and its seeds, cell by cell, the first axis fastest.
template <int D>
Model<D> model_of(const ParticleLattice& lattice, std::string_view law);
template <int D>
std::vector<Seed<D>> seeds_of(const ParticleLattice& lattice);

/// The map of one step of a lattice: velocity, stress and all else that particles carry after the step, as a linear function of
/// the same before it. Positions do not matter to first order: their changes are first order, and so are the stresses on which
/// a change of positions would act.
template <int D>
class LatticeOperator {
  public:
    explicit LatticeOperator(const ParticleLattice& lattice);

    /// Finds the map for a Courant number, by one step for each degree of freedom of one cell.
    void assemble(double courant);

    /// Degrees of freedom of a cell: for each particle the components of v, of sigma (xx, xy, .., yy, ..) and, if the method has
    /// them, of L_p row by row and of the modes from the second on.
    int size() const { return particles_ * static_cast<int>(fields_.size()); }

    int particle_count() const { return static_cast<int>(of_id_.size()); }  ///< in the box

    /// The map of states that vary by exp(i theta k) over cells k, size() x size(), row by row.
    std::vector<std::complex<double>> symbol(const Vec<D>& theta) const;
    std::vector<std::complex<double>> eigenvalues(const Vec<D>& theta) const;

    /// Wave numbers of a half space, `intervals` from 0 to pi. If a cell acts on cells half a box away, the wave numbers of the
    /// box.
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
    std::vector<int> of_id_;        ///< place of the particle with this number
    std::vector<double> blocks_;    ///< size() x size() for each cell: the influence of cell 0 on it
    std::vector<char> is_reached_;  ///< whether the block of a cell is not zero
    bool wraps_ = false;            ///< cell 0 acts on cells half a box away
};

/// The eigenvalues of v' = a_h, sigma' = L_h for particles that do not move, in 1/s; for projection spline-fit with density 1.
/// Overwrites the particles' fields.
std::vector<std::complex<double>> frozen_spectrum(const SplineScheme<1>& scheme, State<1>& s);

/// The largest real part of the spectrum of v' = a_h, sigma' = E L_h for a lattice that does not move, in c/h; for projection
/// spline-fit in 1D.
double frozen_growth(const ParticleLattice& lattice);

/// A growth per step below this counts as none: a defective eigenvalue 1 moves by the square root of round-off.
constexpr double kGrowthTolerance = 1e-6;

/// Courant numbers at which all waves of a lattice are bounded: from `from` (0: from the smallest steps on) to `to`.
struct StableCourantNumbers {
    static constexpr double smallest = 0.005;  ///< the smallest that is tried
    double from = 0.0, to = 0.0;               ///< both 0 if there are none
};

/// The first interval of stable Courant numbers up to `largest`; its ends are accurate to 1e-6.
template <int D>
StableCourantNumbers find_stable(LatticeOperator<D>& lattice, double largest);

}  // namespace ordo::verification
