// The state of a run in a file, from which it continues bit for bit: particles in their order, the result of the last sort,
// times, and how much of the output files was written. HDF5 after a block of text with a checksum of everything
// (docs/output.md).
#pragma once

#include "io/input.hpp"
#include "io/run_directory.hpp"
#include "io/run_files.hpp"
#include "method/state.hpp"
#include "sim/simulation.hpp"

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

namespace ordo::io {

template <int D>
class Checkpoints {
  public:
    Checkpoints(const CaseInput& input, const Model<D>& model, RunDirectory& directory);

    /// Whether [checkpoint] asks for any, and whether one is due after this step.
    bool are_wanted() const { return input_.checkpoint.steps || input_.checkpoint.wall_minutes; }
    bool is_due(const State<D>& s) const;  ///< of several ranks the clock of the first counts

    /// Writes the state, unless this step has a checkpoint, then removes old ones beyond [checkpoint] keep. Of several ranks the first
    /// writes that of all. Throws OutputError.
    void write(State<D>& s, const Written& written);

    /// Reads the state from a file, or from the newest usable one in the output directory ("latest"), into `s`, the state at the
    /// start of the case. Of ranks each reads a part. Throws InputError if the file is damaged or of another case or version, or if the directory has results
    /// of another run.
    Written read(const std::string& which, Simulation<D>& sim) const;

  private:
    using Clock = std::chrono::steady_clock;

    void write_file(State<D>& s, const Written& written);
    /// Of the checkpoints up to a step, those beyond the number to keep.
    void remove_older(std::int64_t step);
    Written read_file(const std::filesystem::path& file, Simulation<D>& sim) const;
    std::vector<std::int64_t> steps() const;  ///< of those in the directory, newest first
    std::vector<std::int64_t> steps_for(Ranks& ranks) const;

    const CaseInput& input_;
    const Model<D>& model_;
    RunDirectory& directory_;
    std::string identity_;  ///< must be the same in all parts of a run
    Clock::time_point last_ = Clock::now();
    long last_step_         = -1;  ///< of the last one written
};

/// Writes one checkpoint to a file of any name. Throws OutputError.
template <int D>
void save_state(const std::filesystem::path& file, const CaseInput& input, Simulation<D>& sim, const Written& written);

/// Reads a checkpoint into a simulation at the start of its case. Throws InputError as Checkpoints::read does.
template <int D>
Written restore_state(const std::filesystem::path& file, const CaseInput& input, Simulation<D>& sim);

/// The case of a checkpoint; files of bodies are looked for where the run found them.
CaseInput case_of_checkpoint(const std::filesystem::path& file);

}  // namespace ordo::io
