// The ranks of a run: one process, or those that a launcher such as mpiexec has started.
#pragma once

#include "base/ranks.hpp"
#include "setup/build.hpp"

#include <memory>

namespace ordo::app {

/// What the library of ranks has, see ranks/mpi.cpp.
using StartRanks = Ranks*();

/// Which of the processes that a launcher has started this is; the only one without a launcher.
setup::Share launched_share();

/// Throws InputError if there are several: for commands that run on one.
void require_one_process();

/// The ranks of this program. Before they start, processes other than the first leave messages to it.
class Launch {
  public:
    /// Loads MPI if a launcher has started several processes. Throws InputError if this ordo has no ranks.
    Launch();
    Launch(const Launch&) = delete;

    /// Starts MPI: from now on an error of one process must be one of all. Gmsh, which is forked, must have read its meshes.
    Ranks& start();
    Ranks& ranks() const { return ranks_ ? *ranks_ : alone(); }
    /// Shares the cores that this process may use with those beside it that may use the same.
    void divide_threads();
    /// An error is about to end this process. Before the ranks have started, processes other than the first say theirs if the first has
    /// not ended them by then. Afterwards an error that is not one of ordo's, which ranks agree on, ends all of them here.
    void fail(const std::exception& error);

  private:
    StartRanks* starter_ = nullptr;
    std::unique_ptr<Ranks> ranks_;
};

}  // namespace ordo::app
