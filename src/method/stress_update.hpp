// The stress passes of a model's laws, chosen once at set-up.
#pragma once

#include "kernels/artificial_viscosity.hpp"
#include "kernels/stress.hpp"
#include "method/passes.hpp"

#include <algorithm>
#include <vector>

namespace ordo {

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
    std::vector<OfLaw> laws_;
    std::vector<OfBranches> branches_;
    ArtificialViscosity viscosity_;
    bool needs_increments_ = false;
};

/// Sets the initial history of particles, and their stress from F, except where they have one already and their law can have it.
template <int D>
void start_stresses(const std::vector<Material>& materials, Particles<D>& particles);

}  // namespace ordo
