// The files of a run: their names, and how much of them was written, for restarts.
#pragma once

#include "io/input.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ordo::io {

/// `what` is particles, contact or grid.
std::string frame_file(std::string_view what, std::size_t number);
std::string probe_file(const ProbeInput& probe);
std::string body_file(std::size_t body);
inline constexpr std::string_view kNewtonFile = "newton.csv";
std::string checkpoint_file(std::int64_t step);
/// The step in the name of a checkpoint; nothing for other names.
std::optional<std::int64_t> step_of_checkpoint(const std::string& name);
/// Whether a run may give a file this name.
bool is_run_file(const std::string& name);
/// The history, the probes, bodies if they are wanted, and with implicit schemes the iterations.
std::vector<std::string> table_files(const CaseInput& input);

/// How much of the files of a run was written.
struct Written {
    std::int64_t step  = 0;                     ///< of the state
    std::int64_t stage = 0;                     ///< of the run
    std::vector<double> frames;                 ///< their times, s
    std::vector<std::int32_t> grid_frames;      ///< numbers of frames that include the grid
    std::vector<std::uint64_t> table_sizes;     ///< of table_files(), bytes
    std::vector<std::uint64_t> table_sums;      ///< their checksums
    std::vector<std::int32_t> probe_particles;  ///< ids, -1 for points
    std::int64_t row_step   = -1;               ///< of the last row
    std::int64_t frame_step = -1;
    std::vector<double> watched;  ///< energies, see Watch
};

/// Throws InputError if the tables in the directory do not begin with those of `written`, or frames are missing.
void require_files(const CaseInput& input, const Written& written);

}  // namespace ordo::io
