#include "io/writer.hpp"

#include "io/build.hpp"
#include "method/diagnostics.hpp"
#include "ordo_version.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>


namespace ordo::io {

namespace {

constexpr std::string_view kResolvedHeader = "# The resolved case";

void remove_earlier_run(const std::filesystem::path& directory)
{
    if (!std::filesystem::exists(directory / "case.toml")) return;  // require_writable has seen that it is ours
    auto is_ours = [](const std::string& name) {
        for (const auto& [start, end] : {std::pair{"particles_", ".vtu"},
                                         {"grid_", ".vti"},
                                         {"probe_", ".csv"},
                                         {"particles.pvd", ""},
                                         {"grid.pvd", ""},
                                         {"history.csv", ""},
                                         {"", ".part"}})
            if (name.starts_with(start) && name.ends_with(end)) return true;
        return false;
    };
    std::vector<std::filesystem::path> old;
    for (const auto& entry : std::filesystem::directory_iterator(directory))
        if (is_ours(entry.path().filename().string())) old.push_back(entry.path());
    // The lists of frames first: a run killed here must not leave a list of files that are gone.
    std::stable_partition(old.begin(), old.end(), [](const auto& path) { return path.extension() == ".pvd"; });
    for (const auto& path : old) std::filesystem::remove(path);
}

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

void require_writable(const OutputInput& output)
{
    const std::filesystem::path directory(output.directory);
    std::filesystem::path existing = std::filesystem::absolute(directory).lexically_normal();
    std::error_code none;
    while (!std::filesystem::exists(existing, none) && existing.has_relative_path()) existing = existing.parent_path();
    if (!std::filesystem::is_directory(existing, none))
        output.fail("directory", fmt::format("{} cannot be made, for {} is not a directory; choose another with --output",
                                             directory.string(), existing.string()));
    if (::access(existing.c_str(), W_OK | X_OK) != 0)
        output.fail("directory", fmt::format("{} cannot be written, for {} is not writable; choose another with --output",
                                             directory.string(), existing.string()));
    std::ifstream there(directory / "case.toml");
    std::string line;
    std::getline(there, line);
    if (there.is_open() && !line.starts_with(kResolvedHeader))
        output.fail("directory",
                    fmt::format("{} holds a case.toml that no run has written, and would lose it; choose another with --output",
                                directory.string()));
}

template <int D>
Writer<D>::Writer(const CaseInput& input, const Model<D>& model, const Particles<D>& particles)
    : input_(input), model_(model), directory_(input.output.directory)
{
    std::error_code failure;
    std::filesystem::create_directories(directory_, failure);
    if (failure) throw OutputError(fmt::format("{}: cannot be made: {}", directory_.string(), failure.message()));
    remove_earlier_run(directory_);

    // Without the directory, so that the files of a case are the same wherever they go.
    CaseInput portable        = input;
    portable.output.directory = "";
    AtomicFile resolved(directory_ / "case.toml");
    resolved.write(fmt::format("{}, with every default; `ordo run` takes it. Written by ordo {} ({}).\n{}", kResolvedHeader,
                               ORDO_VERSION, ORDO_COMMIT, echo_case(portable)));
    resolved.commit();

    history_ =
        LineFile(directory_ / "history.csv",
                 "time,dt,mass,momentum_x,momentum_y,momentum_z,kinetic_energy,strain_energy,total_energy,potential_energy,"
                 "projection_mass_before,projection_mass_after,projection_momentum_x_before,projection_momentum_y_before,"
                 "projection_momentum_z_before,projection_momentum_x_after,projection_momentum_y_after,"
                 "projection_momentum_z_after,dropped_pivots,fallback_nodes");
    for (const ProbeInput& p : input.probes) {
        Probe probe{};
        const std::filesystem::path file = directory_ / ("probe_" + p.name + ".csv");
        Vec<D> at{};
        for (int a = 0; a < D; ++a) at[a] = p.particle.empty() ? p.point[a] : p.particle[a];
        if (!p.particle.empty()) {
            probe.particle     = nearest_particle(particles, at);
            std::string header = "time" + columns<D>("position") + columns<D>("displacement") + columns<D>("velocity");
            for (int a = 0; a < D; ++a)
                for (int b = a; b < D; ++b) header += fmt::format(",stress_{}{}", "xyz"[a], "xyz"[b]);
            probe.file = LineFile(file, header + ",density");
        } else {
            probe.point = at;
            probe.file  = LineFile(file, "time" + columns<D>("velocity") + ",density");
        }
        probes_.push_back(std::move(probe));
    }
}

template <int D>
void Writer<D>::row(State<D>& s, double dt)
{
    const Totals e            = totals(model_, s.particles);
    const ProjectionReport& p = s.projection;
    history_.add(fmt::format("{},{},{}{},{},{},{},{},{},{}{}{},{},{}", s.t, dt, e.mass, values(e.momentum), e.kinetic_energy,
                             e.strain_energy, e.total_energy(), e.potential, p.mass_before, p.mass_after,
                             values(p.momentum_before), values(p.momentum_after), p.fit.dropped, p.fit.fallback));
    for (Probe& probe : probes_)
        if (probe.particle >= 0 || s.n > 0) probe_row(probe, s);  // the grid holds nothing before the first step
}

template <int D>
void Writer<D>::probe_row(Probe& probe, State<D>& s)
{
    const Particles<D>& p = s.particles;
    std::string line      = fmt::format("{}", s.t);
    if (probe.particle >= 0) {
        int i = 0;
        while (p.id[i] != probe.particle) ++i;
        line += values(place_in_period(model_, p, i)) + values(displacement(model_, p, i)) + values(p.v[i]);
        for (int a = 0; a < D; ++a)
            for (int b = a; b < D; ++b) line += fmt::format(",{}", p.sigma[i](a, b));
        line += fmt::format(",{}", p.m[i] / p.V[i]);
    } else {
        const GridSample<D> g = sample_grid(s, probe.point);
        line += values(g.velocity) + fmt::format(",{}", g.density);
    }
    probe.file.add(line);
}

template <int D>
void Writer<D>::frame(State<D>& s)
{
    const std::string number = fmt::format("{:06}", particle_frames_.size());
    particle_frames_.push_back({s.t, "particles_" + number + ".vtu"});
    write_particles(directory_ / particle_frames_.back().file, model_, s, input_.output.fields);
    write_pvd(directory_ / "particles.pvd", particle_frames_);
    if (input_.output.grid && s.n > 0) {
        grid_frames_.push_back({s.t, "grid_" + number + ".vti"});
        write_grid(directory_ / grid_frames_.back().file, s);
        write_pvd(directory_ / "grid.pvd", grid_frames_);
    }
    flush(LineFile::When::soon);
}

template <int D>
void Writer<D>::finish()
{
    flush(LineFile::When::now);
}

template <int D>
void Writer<D>::flush(LineFile::When when)
{
    history_.flush(when);
    for (Probe& p : probes_) p.file.flush(when);
}

template class Writer<1>;
template class Writer<2>;
template class Writer<3>;

}  // namespace ordo::io
