// The stress passes of a model's laws, chosen once at set-up.
#pragma once

#include "kernels/stress.hpp"
#include "method/passes.hpp"

#include <vector>

namespace ordo {

template <int D>
class StressUpdate {
  public:
    explicit StressUpdate(const std::vector<Material>& materials);

    /// The gather `deform` of particles [begin, end), and after each piece of it, while that is in cache, their stresses and
    /// history.
    void operator()(typename Passes<D>::Gather deform, const Sweep<D>& sweep, int begin, int end, TileReport& report) const;

  private:
    struct OfLaw {
        const LawRow* law;
        StressPass<D> pass;
        std::vector<int> columns;  ///< of history, in the order of the law
    };
    std::vector<OfLaw> laws_;
    bool needs_increments_ = false;
};

/// Stress and history of particles that no step has led to, from their F.
template <int D>
void start_stresses(const std::vector<Material>& materials, Particles<D>& particles);

}  // namespace ordo
