// All files of a run: particle and grid frames, history, probes, the resolved case.
#pragma once

#include "io/file.hpp"
#include "io/input.hpp"
#include "io/vtk.hpp"
#include "method/state.hpp"

#include <filesystem>
#include <vector>

namespace ordo::io {

/// Throws InputError when the output directory cannot be used; writes nothing.
void require_writable(const OutputInput& output);

template <int D>
class Writer {
  public:
    /// Creates the directory, removes the files of an earlier run in it, writes the resolved case and the headers.
    Writer(const CaseInput& input, const Model<D>& model, const Particles<D>& particles);

    /// Adds a row to the history and to each probe. dt is the size of the step that led here.
    void row(State<D>& s, double dt);
    /// Writes particles (and grid), the PVD, and from time to time the tables.
    void frame(State<D>& s);
    /// Writes what the tables still hold back.
    void finish();

    std::size_t frame_count() const { return particle_frames_.size(); }
    const std::filesystem::path& directory() const { return directory_; }

  private:
    struct Probe {
        LineFile file;
        int particle = -1;  ///< id, or -1 for a point
        Vec<D> point{};
    };
    void flush(LineFile::When when);
    void probe_row(Probe& probe, State<D>& s);

    const CaseInput& input_;
    const Model<D>& model_;
    std::filesystem::path directory_;
    LineFile history_;
    std::vector<Probe> probes_;
    std::vector<Frame> particle_frames_, grid_frames_;
};

}  // namespace ordo::io
