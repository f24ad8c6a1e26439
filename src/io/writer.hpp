// All files of a run: particle and grid frames, history, probes, the resolved case.
#pragma once

#include "io/file.hpp"
#include "io/history.hpp"
#include "io/input.hpp"
#include "io/run_directory.hpp"
#include "io/run_files.hpp"
#include "io/vtk.hpp"
#include "method/state.hpp"
#include "sim/observer.hpp"

#include <filesystem>
#include <optional>
#include <vector>

namespace ordo::io {

/// What [output] says of files of particles.
FrameStyle style_of(const OutputInput& input);

/// The ids of the particles that the probes of a case follow, -1 for points; from the state at its start.
template <int D>
std::vector<std::int32_t> probe_particles(const CaseInput& input, const State<D>& start);

/// Writes rows and frames when they are due, at the start, at the end of a stage and of the run, and after a failure. Of several ranks
/// the first writes; all call the same functions.
template <int D>
class Writer : public Observer<D> {
  public:
    /// Removes the files of an earlier run, writes the resolved case and the headers.
    Writer(const CaseInput& input, const Model<D>& model, RunDirectory& directory, Ranks& ranks,
           std::vector<std::int32_t> probe_particles);
    /// Continues the files of an interrupted run, cut back to the lengths in `written`; require_files has checked them. Starts new
    /// files if the directory has none.
    Writer(const CaseInput& input, const Model<D>& model, RunDirectory& directory, Ranks& ranks, const Written& written);

    void started(Simulation<D>& sim) override;
    void after_step(Simulation<D>& sim, const StepSize& step) override;
    void failed(Simulation<D>& sim, const NumericalError&) override;
    void ended(Simulation<D>& sim) override;

    /// Also writes all pending rows to the tables, whose sizes only the first rank knows.
    Written written();
    /// The numbers of the row of this step; nothing if it has none.
    const std::vector<double>* row_of(const State<D>& s) const { return written_.row_step == s.n ? &row_ : nullptr; }
    std::size_t frame_count() const { return written_.frames.size(); }
    const std::filesystem::path& directory() const { return directory_.path(); }

  private:
    struct Probe {
        LineFile file;
        int particle = -1;  ///< id, or -1 for a point
        Vec<D> point{};
    };
    void write_if_due(State<D>& s, double dt, bool is_stage_over);
    /// Adds a row to the history and to each probe, unless this step has one.
    void row(State<D>& s);
    /// Writes particles (and grid), the PVD, and from time to time the tables, unless this step has a frame.
    void frame(State<D>& s);
    /// Adds what Newton's method did in the last step, unless it is there.
    void add_iterations(const NewtonCounts& newton);
    void last_frame(State<D>& s);
    /// Before the first step after a restart there are no nodes and no projection to write.
    bool has_stepped(const State<D>& s) const { return !resumed_at_ || s.n > *resumed_at_; }
    void start_files();
    LineFile start_table(const std::string& file, const std::string& header);
    void go_on_with_files();
    void remove_later_files();
    void make_probes();
    void write_resolved_case() const;
    void write_lists() const;
    void flush(LineFile::When when);
    /// f(file) for the tables, in the order of table_files.
    template <class F>
    void for_each_table(F&& f);
    std::string particle_line(const Probe& probe, const State<D>& s) const;
    bool is_first() const { return ranks_.index() == 0; }
    void add(LineFile& file, std::string_view line)
    {
        if (is_first()) file.add(line);
    }

    const CaseInput& input_;
    const Model<D>& model_;
    const History<D> numbers_;
    RunDirectory& directory_;
    Ranks& ranks_;
    LineFile history_;
    std::vector<Probe> probes_;
    std::vector<LineFile> bodies_;    ///< none if they are not wanted
    std::optional<LineFile> newton_;  ///< of implicit schemes
    long newton_step_ = 0;            ///< the last one in that file, see NewtonCounts
    Written written_;
    std::vector<double> row_;                 ///< of history.csv, the last one
    std::optional<std::int64_t> resumed_at_;  ///< the step of a restart
    double last_frame_ = 0.0;                 ///< its time, s
};

}  // namespace ordo::io
