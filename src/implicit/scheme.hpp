// Implicit steps: the midpoint rule, Newmark's method and static equilibrium, by Newton's method with exact tangents (docs/implicit.md).
#pragma once

#include "implicit/newton.hpp"
#include "implicit/step_equations.hpp"
#include "method/pass_scheme.hpp"

#include <string>
#include <vector>

namespace ordo {

template <int D>
class Implicit final : public PassScheme<D> {
  public:
    /// Throws InputError for models that it cannot treat.
    explicit Implicit(Model<D> of);

    using Scheme<D>::model;

  private:
    using PassScheme<D>::method;
    using PassScheme<D>::passes;
    using PassScheme<D>::mass_solver;
    using PassScheme<D>::sweep;
    using PassScheme<D>::gather;
    using PassScheme<D>::deform;
    using PassScheme<D>::move_corners;

    void find_projection(State<D>& s) const override;
    void take_step(State<D>& s, double dt) const override;

    bool try_step(State<D>& s, double dt, std::string& why) const;
    void finish(State<D>& s, StepEquations<D>& equations, const std::vector<double>& u, const std::vector<double>& missing,
                double dt) const;
    void account_for(State<D>& s, StepEquations<D>& equations, const std::vector<double>& u, const std::vector<double>& missing,
                     double dt) const;
    TileReport move_of_cells(State<D>& s, const StepEquations<D>& equations, const std::vector<double>& u, double dt) const;
    std::string particle_text(const State<D>& s, int i) const;
    std::string blame(State<D>& s, const StepEquations<D>& equations, const std::vector<double>& residual) const;
    std::string loose_body(State<D>& s, const StepEquations<D>& equations) const;

    mutable GridMultigrid<D> multigrid_;
};

/// Throws InputError for models that the schemes cannot treat, with the reason.
template <int D>
void require_implicit_model(const Model<D>& model);

}  // namespace ordo
