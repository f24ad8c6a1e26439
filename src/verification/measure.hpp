// Runs a problem with an exact or a reference solution, and measures its errors in the norms of docs/verification.md.
#pragma once

#include "method/scheme.hpp"
#include "particles/cell_seeding.hpp"
#include "particles/seeding.hpp"
#include "verification/solution.hpp"
#include "verification/study.hpp"

#include <functional>
#include <memory>

namespace ordo::verification {

/// Numbers of a state that a case observes, by name.
template <int D>
struct Observed {
    std::vector<std::string> names;
    std::function<std::vector<double>(const State<D>&)> values;
};

/// A problem ready to run, with particles in the reference configuration.
template <int D>
struct Problem {
    Model<D> model;
    std::vector<Seed<D>> seeds;
    std::vector<CornerPoints<D>> corners;          ///< of the seeds' cells, if they are not parallelepipeds
    std::function<int(const Vec<D>& X)> body;      ///< number of body and material of a particle; without it 0
    std::function<Particles<D>(Model<D>&)> plant;  ///< if given, takes the place of seeds, corners, body and velocity
    std::function<int(const Vec<D>& normal, const Vec<D>& center)> load;  ///< the traction of a face of the body, or -1
    double dt  = 0;                                                       ///< at most, s; steps are equal
    double end = 0;                                                       ///< s

    std::shared_ptr<const Solution<D>> solution;    ///< for `measure`
    std::function<bool(const Vec<D>& X)> contains;  ///< whether the body contains the material point X
    bool is_reference = false;                      ///< the solution is computed, and known at 0 and `end` only
    bool is_recorded  = false;                      ///< whether the row gets its tables

    std::function<void(State<D>&)> at_start;          ///< changes the state at the start, such as history and stress
    std::function<Vec<D>(const Vec<D>& X)> velocity;  ///< at the start, for `follow` and `watch`, m/s; without it zero
    Observed<D> observed;                             ///< additional columns of the history
    std::function<Named(const State<D>&)> at_end;     ///< additional quantities, from the state at the end
};

/// The parts of a problem that come from the request; the case adds the rest.
template <int D>
Problem<D> problem_of(const Request& r)
{
    Problem<D> p{};
    p.is_recorded  = r.is_recorded;
    p.model.method = r.method;
    p.model.body_forces.resize(1);
    p.end = r.values.number("end");
    return p;
}

/// Runs to the end. The row of a failed run has the reason.
template <int D>
Row measure(const Problem<D>& problem);

/// Runs without a solution; calls `see(s)` at the start and after each step.
template <int D>
Row follow(const Problem<D>& problem, const std::function<void(const State<D>&)>& see);

/// Runs without a solution and watches sums over all particles: the final and the largest total energy relative to the initial
/// one, and the change of momentum relative to the initial sum of m |v|.
template <int D>
Row watch(const Problem<D>& problem);

}  // namespace ordo::verification
