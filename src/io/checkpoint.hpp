// The state of a run in a file, from which it goes on bit for bit: particles in their order, what the last sort decided, times,
// and how far the output files had come. HDF5 behind a block of text with a checksum of everything (docs/output.md).
#pragma once

#include "io/input.hpp"
#include "method/state.hpp"

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ordo::io {

/// How far the files of a run have come.
struct Written {
    std::int64_t step = 0;                      ///< of the state
    std::vector<double> frames;                 ///< their times, s
    std::vector<std::int32_t> grid_frames;      ///< numbers of those that the grid has too
    std::vector<std::uint64_t> table_sizes;     ///< of the history and the probes, bytes
    std::vector<std::int32_t> probe_particles;  ///< ids, -1 for points
    std::int64_t row_step   = -1;               ///< of the last row
    std::int64_t frame_step = -1;
    double next_frame       = 0.0;  ///< s
    std::vector<double> watched;    ///< energies, see Watch
};

/// The step in the name of a checkpoint; nothing for other names.
std::optional<std::int64_t> step_of_checkpoint(const std::string& name);

template <int D>
class Checkpoints {
  public:
    Checkpoints(const CaseInput& input, const Model<D>& model);

    /// Whether [checkpoint] asks for any, and whether for one after this step.
    bool are_wanted() const { return input_.checkpoint.steps || input_.checkpoint.wall_minutes; }
    bool is_due(const State<D>& s) const;

    /// Writes the state, unless the step has a file, then removes the oldest beyond those that are kept. Throws OutputError.
    void write(State<D>& s, const Written& written);

    /// The state of a file, or of the newest in the output directory that can be used ("latest"). `s` is the state at the
    /// start of the case. Throws InputError where a file is damaged, or is of another case or version.
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
