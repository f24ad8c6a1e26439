// Newton's method for the equations of a step, with linear solves as accurate as they need to be and a line search.
#pragma once

#include "method/state.hpp"
#include "solve/grid_multigrid.hpp"

#include <string>
#include <vector>

namespace ordo {

template <int D>
class StepEquations;

/// How Newton's method ended.
struct NewtonResult {
    std::string why;                 ///< it did not converge
    bool is_singular = false;        ///< because the tangent is
    int particle     = -1;           ///< because the volume of this one changes too much ..
    double change    = 1.0;          ///< .. by this factor
    std::vector<double> u, missing;  ///< displacements, m, and the residual there, N
    NewtonReport report;
};

template <int D>
MultigridChoices multigrid_choices(const MethodSpec& method);

/// @param multigrid with these choices. Kept from step to step it need not find out again how to eliminate unknowns where those of the last
///                  step were the same; results do not depend on that.
template <int D>
NewtonResult solve_step(StepEquations<D>& equations, const MethodSpec& method, const Vec<D, bool>& periodic,
                        const Index<D>& cells, GridMultigrid<D>& multigrid);

}  // namespace ordo
