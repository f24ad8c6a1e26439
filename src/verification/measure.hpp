// Runs a problem that has an exact or a reference solution, and measures its errors in the norms of docs/verification.md.
#pragma once

#include "method/scheme.hpp"
#include "particles/cell_seeding.hpp"
#include "particles/seeding.hpp"
#include "verification/solution.hpp"
#include "verification/study.hpp"

#include <functional>
#include <memory>

namespace ordo::verification {

/// Numbers of a state that a case watches, by name.
template <int D>
struct Observed {
    std::vector<std::string> names;
    std::function<std::vector<double>(const State<D>&)> values;
};

/// A problem ready to run, its particles given in the reference configuration.
template <int D>
struct Problem {
    Model<D> model;
    std::vector<Seed<D>> seeds;
    std::vector<CornerPoints<D>> corners;      ///< of the seeds' cells, where they are no parallelepipeds
    std::function<int(const Vec<D>& X)> body;  ///< of a particle, and its material; without it all are of body and material 0
    std::function<int(const Vec<D>& normal, const Vec<D>& center)> load;  ///< the traction of a face of the body, or -1
    double dt  = 0;                                                       ///< at most, s; steps are equal
    double end = 0;                                                       ///< s

    std::shared_ptr<const Solution<D>> solution;    ///< for `measure`
    std::function<bool(const Vec<D>& X)> contains;  ///< whether the body has the material point X
    bool is_reference = false;                      ///< the solution is a computed one, known at 0 and `end` only
    bool is_recorded  = false;                      ///< whether the row gets its tables

    std::function<Vec<D>(const Vec<D>& X)> velocity;  ///< at the start, for `follow` and `watch`, m/s; without it none
    Observed<D> observed;                             ///< what the history has besides
};

/// What all problems take from a request; the rest is the case's.
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

/// Runs to the end. A run that fails is a row with its reason.
template <int D>
Row measure(const Problem<D>& problem);

/// Runs without a solution; `see(s)` gets the state of the start and those after each step.
template <int D>
Row follow(const Problem<D>& problem, const std::function<void(const State<D>&)>& see);

/// Runs without a solution and watches the sums over all particles: total energy at the end and its largest value over
/// the first one, and the change of momentum over the first sum of m |v|.
template <int D>
Row watch(const Problem<D>& problem);

}  // namespace ordo::verification
