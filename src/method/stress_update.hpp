// The stress passes of a model's laws, chosen once at set-up.
#pragma once

#include "kernels/artificial_viscosity.hpp"
#include "kernels/stress.hpp"
#include "material/outside_law.hpp"
#include "method/passes.hpp"

#include <algorithm>
#include <vector>

namespace ordo {

template <int D>
struct State;

/// That of a method on a grid of spacing h, m.
template <int D>
ArtificialViscosity artificial_viscosity(const MethodSpec& method, const Vec<D>& h)
{
    return {method.linear_viscosity, method.quadratic_viscosity, *std::min_element(h.c, h.c + D)};
}

template <int D>
class StressUpdate {
  public:
    explicit StressUpdate(const std::vector<Material>& materials, const ArtificialViscosity& viscosity = {});

    /// Runs the gather `deform` on particles [begin, end) piece by piece, and after each piece, while it is in cache, updates
    /// its stresses and history.
    void operator()(typename Passes<D>::Gather deform, const Sweep<D>& sweep, int begin, int end, TileReport& report) const;

    /// Stresses and history of particles whose F and displacement gradients of the step are set, and their artificial pressures.
    void update(const Sweep<D>& sweep, int begin, int end, TileReport& report) const;

    /// Whether some particles have laws from outside, which `update` leaves out.
    bool has_outside_laws() const { return !outside_.empty(); }
    /// The stresses and history of these particles, all at once, by the increments of the step. Throws NumericalError for results that are
    /// no stresses, and what the laws throw.
    void update_outside(State<D>& s, double dt) const;

  private:
    struct OfLaw {
        const LawRow* law;
        StressPass<D> pass;
        std::vector<int> columns;  ///< history columns, in the order of the law
    };
    /// Branches of a material.
    struct OfBranches {
        Branches branches;
        int material;
        std::vector<int> columns;  ///< `dissipated`, then those of b_e
    };
    /// A material with a law from outside.
    struct OfOutside {
        const OutsideLaw* law;
        const NamedNumbers* parameters;
        int material;
        int work;                  ///< the column of OutsideLaw::kWork
        std::vector<int> columns;  ///< those that the law changes
    };
    std::vector<OfLaw> laws_;
    std::vector<OfOutside> outside_;
    std::vector<OfBranches> branches_;
    ArtificialViscosity viscosity_;
    bool needs_increments_ = false;
};

/// Sets the initial history of particles, and their stress from F, except where they have one already and their law can have it.
template <int D>
void start_stresses(const std::vector<Material>& materials, Particles<D>& particles);

}  // namespace ordo
