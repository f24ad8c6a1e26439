#include "io/writer.hpp"

#include "base/agree.hpp"
#include "io/build.hpp"
#include "method/diagnostics.hpp"
#include "method/grid_sample.hpp"
#include "method/sharing.hpp"
#include "ordo_version.hpp"
#include "sim/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <functional>
#include <set>
#include <utility>

namespace ordo::io {

namespace {

constexpr std::string_view kResolvedHeader = "# The resolved case";

template <int D>
std::string columns(std::string_view stem)
{
    std::string r;
    for (int a = 0; a < D; ++a) r += fmt::format(",{}_{}", stem, "xyz"[a]);
    return r;
}

template <int D>
std::string values(const Vec<D>& v)
{
    std::string r;
    for (int a = 0; a < D; ++a) r += fmt::format(",{}", v[a]);
    return r;
}

}  // namespace

FrameStyle style_of(const OutputInput& in)
{
    return {in.fields, in.precision == "float32", in.compression == "zlib", in.particles == "points", in.every};
}

template <int D>
std::vector<std::int32_t> probe_particles(const CaseInput& input, const State<D>& start)
{
    std::vector<std::int32_t> r;
    for (const ProbeInput& p : input.probes) {
        Vec<D> at{};
        for (int a = 0; a < D && !p.particle.empty(); ++a) at[a] = p.particle[a];
        r.push_back(p.particle.empty() ? -1 : nearest_particle(start, at));
    }
    return r;
}

template <int D>
Writer<D>::Writer(const CaseInput& input, const Model<D>& model, RunDirectory& directory, Ranks& ranks,
                  std::vector<std::int32_t> probe_particles)
    : input_(input), model_(model), numbers_(input, model), directory_(directory), ranks_(ranks)
{
    written_.probe_particles = std::move(probe_particles);
    agree(ranks_, [&] { start_files(); });
}

template <int D>
Writer<D>::Writer(const CaseInput& input, const Model<D>& model, RunDirectory& directory, Ranks& ranks, const Written& written)
    : input_(input),
      model_(model),
      numbers_(input, model),
      directory_(directory),
      ranks_(ranks),
      written_(written),
      resumed_at_(written.step),
      last_frame_(written.frames.empty() ? 0.0 : written.frames.back())
{
    const bool goes_on = largest(ranks_, is_first() && has_results(directory_.path()) ? 1 : 0) > 0;
    if (!goes_on) {
        written_.frames.clear();
        written_.grid_frames.clear();
    }
    agree(ranks_, [&] { goes_on ? go_on_with_files() : start_files(); });
}

template <int D>
void Writer<D>::write_resolved_case() const
{
    // Without the directory, so that the files of a case are the same wherever they go.
    CaseInput portable        = input_;
    portable.output.directory = "";
    AtomicFile resolved(directory_.file("case.toml"));
    resolved.write(fmt::format("{}, with every default; `ordo run` takes it. Written by ordo {} ({}).\n{}", kResolvedHeader,
                               ORDO_VERSION, ORDO_COMMIT, echo_case(portable)));
    resolved.commit();
}

template <int D>
LineFile Writer<D>::start_table(const std::string& file, const std::string& header)
{
    return is_first() ? LineFile(directory_.file(file), header) : LineFile();
}

template <int D>
void Writer<D>::start_files()
{
    if (is_first()) directory_.remove(directory_.files());
    history_ = start_table("history.csv", fmt::format("{}", fmt::join(numbers_.columns(), ",")));
    make_probes();
    for (std::size_t k = 0; k < probes_.size(); ++k) {
        std::string header = "time";
        if (probes_[k].particle >= 0) {
            header += columns<D>("position") + columns<D>("displacement") + columns<D>("velocity");
            for (int a = 0; a < D; ++a)
                for (int b = a; b < D; ++b) header += fmt::format(",stress_{}{}", "xyz"[a], "xyz"[b]);
        } else {
            header += columns<D>("velocity");
        }
        probes_[k].file = start_table(probe_file(input_.probes[k]), header + ",density");
    }
    for (std::size_t k = 0; input_.output.per_body && k < input_.bodies.size(); ++k)
        bodies_.push_back(start_table(body_file(k),
                                      "time,mass,center_x,center_y,center_z,momentum_x,momentum_y,momentum_z,angular_momentum_x,"
                                      "angular_momentum_y,angular_momentum_z,kinetic_energy,strain_energy,potential_energy"));
    if (is_implicit(model_.method))
        newton_ = start_table(std::string(kNewtonFile), "time,dt,iteration,residual,linear_iterations,part");
    if (is_first()) write_resolved_case();  // last: it marks that the others exist
}

template <int D>
void Writer<D>::go_on_with_files()
{
    make_probes();
    bodies_.resize(input_.output.per_body ? input_.bodies.size() : 0);
    if (is_implicit(model_.method)) newton_.emplace();
    if (!is_first()) return;
    remove_later_files();
    write_resolved_case();
    const std::vector<std::string> tables = table_files(input_);
    std::size_t k                         = 0;
    for_each_table([&](LineFile& file) {
        file = LineFile(directory_.file(tables[k]), written_.table_sizes[k], written_.table_sums[k]);
        ++k;
    });
}

template <int D>
template <class F>
void Writer<D>::for_each_table(F&& f)
{
    f(history_);
    for (Probe& p : probes_) f(p.file);
    for (LineFile& b : bodies_) f(b);
    if (newton_) f(*newton_);
}

/// If the run is killed here at any moment, the lists name existing files only, and it can be restarted again.
template <int D>
void Writer<D>::remove_later_files()
{
    std::vector<std::string> kept = table_files(input_);
    kept.emplace_back("particles.pvd");
    if (!written_.grid_frames.empty()) kept.emplace_back("grid.pvd");
    for (std::size_t k = 0; k < written_.frames.size(); ++k) kept.push_back(frame_file("particles", k));
    for (const int k : written_.grid_frames) kept.push_back(frame_file("grid", k));
    if (!model_.contacts.empty()) kept.emplace_back("contact.pvd");
    for (std::size_t k = 0; k < written_.frames.size() && !model_.contacts.empty(); ++k) kept.push_back(frame_file("contact", k));

    std::set<std::int64_t, std::greater<>> later;  // newest first: each needs files that are removed after it
    for (const std::string& name : directory_.files())
        if (const auto step = step_of_checkpoint(name); step && *step > written_.step) later.insert(*step);
    for (const std::int64_t step : later) directory_.remove({checkpoint_file(step)});
    write_lists();
    std::set<std::string> rest = directory_.files();
    for (const std::string& name : kept) rest.erase(name);
    std::erase_if(rest, [&](const std::string& name) {
        return step_of_checkpoint(name) &&
               std::filesystem::exists(directory_.path() / name);  // else it was killed before it was made
    });
    directory_.remove(rest);
}

template <int D>
void Writer<D>::make_probes()
{
    for (std::size_t k = 0; k < input_.probes.size(); ++k) {
        const ProbeInput& p = input_.probes[k];
        Probe probe{{}, written_.probe_particles.at(k), {}};
        for (int a = 0; a < D && !p.point.empty(); ++a) probe.point[a] = p.point[a];
        probes_.push_back(std::move(probe));
    }
}

template <int D>
void Writer<D>::started(Simulation<D>& sim)
{
    if (resumed_at_) return;
    row(sim.state());
    frame(sim.state());
}

template <int D>
void Writer<D>::after_step(Simulation<D>& sim, const StepSize& step)
{
    add_iterations(sim.state().newton);
    write_if_due(sim.state(), step.dt, sim.is_stage_over());
}

template <int D>
void Writer<D>::failed(Simulation<D>& sim, const NumericalError&)
{
    add_iterations(sim.state().newton);
    const bool means_something = std::isfinite(totals(model_, sim.state()).total_energy());
    if (means_something && has_stepped(sim.state())) row(sim.state());
    last_frame(sim.state());
}

template <int D>
void Writer<D>::ended(Simulation<D>& sim)
{
    if (has_stepped(sim.state())) row(sim.state());
    last_frame(sim.state());
}

template <int D>
void Writer<D>::last_frame(State<D>& s)
{
    if (has_stepped(s)) frame(s);
    flush(LineFile::When::now);
}

template <int D>
void Writer<D>::write_if_due(State<D>& s, double dt, bool is_stage_over)
{
    if (s.n % input_.output.history_interval == 0) row(s);
    const double interval = *input_.output.interval, next = (std::floor(last_frame_ / interval + 1e-9) + 1) * interval;
    if (s.t < next - 1e-9 * dt && !is_stage_over) return;
    row(s);
    frame(s);
}

template <int D>
void Writer<D>::row(State<D>& s)
{
    if (written_.row_step == s.n) return;
    written_.row_step = s.n;
    row_              = numbers_.row(s);
    add(history_, fmt::format("{}", fmt::join(row_, ",")));
    for (std::size_t k = 0; k < bodies_.size(); ++k) {
        const BodyTotals b = totals_of_body(model_, s, static_cast<int>(k));
        if (b.mass == 0) continue;  // it was taken out
        add(bodies_[k], fmt::format("{},{}{}{}{},{},{},{}", s.t, b.mass, values(b.center), values(b.momentum), values(b.spin),
                                    b.kinetic_energy, b.strain_energy, b.potential));
    }
    for (Probe& probe : probes_)
        if (probe.particle >= 0)
            if (const std::string line = particle_line(probe, s); !line.empty()) add(probe.file, line);
    const bool has_points = std::any_of(probes_.begin(), probes_.end(), [](const Probe& one) { return one.particle < 0; });
    if (!has_points || s.n == 0) return;  // the grid holds nothing before the first step
    auto is_near_one = [&](const IndexBox<D>& nodes) {
        return std::any_of(probes_.begin(), probes_.end(),
                           [&](const Probe& one) { return one.particle < 0 && is_sampled(s, one.point, nodes); });
    };
    const Gathered<D> gathered(s, is_near_one);
    for (Probe& probe : probes_) {
        if (probe.particle >= 0 || !is_first()) continue;
        const GridSample<D> g = sample_grid(s, probe.point);
        add(probe.file, fmt::format("{}{},{}", s.t, values(g.velocity), g.density));
    }
}

template <int D>
void Writer<D>::add_iterations(const NewtonCounts& newton)
{
    if (!newton_ || std::exchange(newton_step_, newton.step) == newton.step) return;
    for (const NewtonReport& part : newton.of_step)
        for (std::size_t k = 0; k < part.iterations.size(); ++k) {
            const NewtonIteration& one = part.iterations[k];
            add(*newton_, fmt::format("{},{},{},{},{},{}", part.t, part.dt, k, one.residual, one.linear_iterations, one.part));
        }
}

/// Of a particle, on the rank that has it and on the first; empty if its body was taken out.
template <int D>
std::string Writer<D>::particle_line(const Probe& probe, const State<D>& s) const
{
    const Particles<D>& p = s.particles;
    int i                 = 0;
    while (i < p.count && p.id[i] != probe.particle) ++i;
    return text_of_first(ranks_, tile_of_particle(s, i), [&] {
        std::string line =
            fmt::format("{}", s.t) + values(place_in_period(model_, p, i)) + values(displacement(model_, p, i)) + values(p.v[i]);
        for (int a = 0; a < D; ++a)
            for (int b = a; b < D; ++b) line += fmt::format(",{}", p.sigma[i](a, b));
        return line + fmt::format(",{}", p.m[i] / p.V[i]);
    });
}

template <int D>
void Writer<D>::frame(State<D>& s)
{
    if (written_.frame_step == s.n && last_frame_ == s.t) return;  // parts of an implicit step that failed are no step
    const std::size_t number = written_.frames.size();
    const bool has_grid      = input_.output.grid && s.n > 0;
    std::filesystem::path file;
    on_first(ranks_, [&] { file = directory_.file(frame_file("particles", number)); });
    write_particles(file, model_, s, style_of(input_.output));
    {
        std::optional<Gathered<D>> gathered;
        if (has_grid) gathered.emplace(s, [](const IndexBox<D>&) { return true; });
        on_first(ranks_, [&] {
            if (has_grid) write_grid(directory_.file(frame_file("grid", number)), s);
            if (!model_.contacts.empty()) write_contacts(directory_.file(frame_file("contact", number)), model_, s);
        });
    }
    if (has_grid) written_.grid_frames.push_back(static_cast<std::int32_t>(number));
    written_.frames.push_back(s.t);
    written_.frame_step = s.n;
    last_frame_         = s.t;
    on_first(ranks_, [&] { write_lists(); });
    flush(LineFile::When::soon);
}

/// The PVDs of the frames.
template <int D>
void Writer<D>::write_lists() const
{
    std::vector<Frame> particles, grid, contacts;
    for (std::size_t k = 0; k < written_.frames.size(); ++k)
        particles.push_back({written_.frames[k], frame_file("particles", k)});
    for (std::size_t k = 0; k < written_.frames.size(); ++k) contacts.push_back({written_.frames[k], frame_file("contact", k)});
    for (const int k : written_.grid_frames) grid.push_back({written_.frames.at(k), frame_file("grid", k)});
    write_pvd(directory_.file("particles.pvd"), particles);
    if (!grid.empty()) write_pvd(directory_.file("grid.pvd"), grid);
    if (!model_.contacts.empty()) write_pvd(directory_.file("contact.pvd"), contacts);
}

template <int D>
Written Writer<D>::written()
{
    flush(LineFile::When::now);
    Written w = written_;
    w.table_sizes.clear();
    w.table_sums.clear();
    for_each_table([&](const LineFile& file) {
        w.table_sizes.push_back(file.size());
        w.table_sums.push_back(file.sum());
    });
    return w;
}

template <int D>
void Writer<D>::flush(LineFile::When when)
{
    on_first(ranks_, [&] { for_each_table([&](LineFile& file) { file.flush(when); }); });
}

template std::vector<std::int32_t> probe_particles(const CaseInput&, const State<1>&);
template std::vector<std::int32_t> probe_particles(const CaseInput&, const State<2>&);
template std::vector<std::int32_t> probe_particles(const CaseInput&, const State<3>&);
template class Writer<1>;
template class Writer<2>;
template class Writer<3>;

}  // namespace ordo::io
