// The state of a run in a file, from which it goes on bit for bit: particles in their order, what the last sort decided, times,
// and how far the output files had come. HDF5 behind a block of text with a checksum of everything (docs/output.md).
#pragma once

#include "io/input.hpp"
#include "io/run_files.hpp"
#include "method/state.hpp"

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

namespace ordo::io {

template <int D>
class Checkpoints {
  public:
    Checkpoints(const CaseInput& input, const Model<D>& model);

    /// Whether [checkpoint] asks for any, and whether for one after this step.
    bool are_wanted() const { return input_.checkpoint.steps || input_.checkpoint.wall_minutes; }
    bool is_due(const State<D>& s) const;

    /// Writes the state, unless the step has a file, then removes earlier ones beyond those that are kept. Throws OutputError.
    void write(State<D>& s, Written written);

    /// The state of a file, or of the newest in the output directory that can be used ("latest"). `s` is the state at the
    /// start of the case. Throws InputError where a file is damaged, or is of another case or version, or where there are results
    /// of another run.
    Written read(const std::string& which, State<D>& s) const;

  private:
    using Clock = std::chrono::steady_clock;

    Written read_file(const std::filesystem::path& file, State<D>& s) const;
    std::vector<std::filesystem::path> files() const;  ///< newest first

    const CaseInput& input_;
    const Model<D>& model_;
    std::filesystem::path directory_;
    std::string identity_;  ///< what must be the same in all parts of a run
    Clock::time_point last_ = Clock::now();
    long last_step_         = -1;  ///< of the last that was written
};

}  // namespace ordo::io
