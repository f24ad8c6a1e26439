#include "io/checkpoint.hpp"

#include "base/agree.hpp"
#include "io/file.hpp"
#include "io/hdf5.hpp"
#include "io/message.hpp"
#include "io/program.hpp"
#include "io/schema.hpp"
#include "method/layout.hpp"
#include "method/sharing.hpp"
#include "ordo_version.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <optional>
#include <sstream>
#include <type_traits>

namespace ordo::io {

namespace {

constexpr int kFormat             = 13;   ///< of the file; raise it with every change of its content
constexpr std::size_t kHead       = 512;  ///< bytes of text before HDF5 begins (HDF5's user block)
constexpr std::string_view kFirst = "ordo checkpoint\n";

// ---- the file as a whole ----------------------------------------------------------------------------------------------

/// The text at the start, padded with zeros.
struct Head {
    int format          = kFormat;
    std::string version = ORDO_VERSION, program = this_program();
    std::uintmax_t bytes = 0;  ///< of the whole file

    std::string text() const
    {
        return fmt::format("{}format {}\nversion {}\nprogram {}\nbytes {}\n", kFirst, format, version, program, bytes);
    }
    /// With the checksum of the text before it and of everything after the head.
    std::string block(std::uint64_t sum_behind) const
    {
        std::string r = fmt::format("{}checksum {:016x}\n", text(), checksum(text(), sum_behind));
        r.resize(kHead, '\0');
        return r;
    }
};

/// The checksum of everything after the head of a file of `bytes` bytes; nothing if it cannot be read.
std::optional<std::uint64_t> sum_behind_head(const std::filesystem::path& path, std::uintmax_t bytes)
{
    return bytes < kHead ? std::nullopt : checksum_of(path, bytes - kHead, kHead);
}

/// Writes the head, when the rest of the file is complete.
void seal(const std::filesystem::path& path)
{
    std::error_code failure;
    Head head;
    head.bytes     = std::filesystem::file_size(path, failure);
    const auto sum = sum_behind_head(path, head.bytes);
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    if (!failure && sum) file << head.block(*sum) << std::flush;
    if (failure || !sum || !file) throw OutputError(fmt::format("{}: cannot be written: is the disk full?", path.string()));
}

/// Throws InputError if a file is not whole or of another version. Returns the program that wrote it.
std::string require_whole(const std::filesystem::path& path)
{
    std::error_code failure;
    if (std::filesystem::is_directory(path, failure))
        throw InputError("it is a directory; give a checkpoint in it, or --output " + path.string() + " --restart latest");
    if (!std::filesystem::is_regular_file(path, failure)) throw InputError("there is no such file");
    std::ifstream file(path, std::ios::binary);
    if (!file) throw InputError("it cannot be read");
    std::string block(kHead, '\0');
    file.read(block.data(), static_cast<std::streamsize>(kHead));
    if (!block.starts_with(kFirst)) throw InputError("it is not a checkpoint of ordo");
    std::istringstream words(block.substr(kFirst.size()));
    Head head;
    std::string key;
    words >> key >> head.format >> key >> head.version >> key >> head.program >> key >> head.bytes;
    const auto there = std::filesystem::file_size(path, failure);
    if (failure || there < std::max<std::uintmax_t>(head.bytes, kHead))
        throw InputError(fmt::format("it is truncated: it has {} of {} bytes", there, head.bytes));
    if (head.format != kFormat)
        throw InputError(
            fmt::format("its format is {}, and this ordo reads {}: it was written by another version", head.format, kFormat));
    if (head.version != ORDO_VERSION)
        throw InputError(fmt::format("it was written by ordo {}, and this is {}; continue with that version, or start anew",
                                     head.version, ORDO_VERSION));
    const auto sum = sum_behind_head(path, there);
    if (there != head.bytes || !sum || block != head.block(*sum))
        throw InputError("it is corrupted: its checksum does not match its contents");
    return head.program;
}

// ---- its content ------------------------------------------------------------------------------------------------------

/// The entry of a particle or mesh file in a checkpoint, after the header of a table.
std::string identity_of_file(const std::filesystem::path& file)
{
    std::error_code failure;
    const std::uintmax_t bytes = std::filesystem::file_size(file, failure);
    const auto sum             = failure ? std::nullopt : checksum_of(file, bytes);
    if (!sum) throw InputError(fmt::format("{}: cannot be read again, for checkpoints", file.string()));
    return fmt::format("[file]\n{}, {} bytes, checksum {:016x}\n", file.filename().string(), bytes, *sum);
}

/// The input without what may differ between parts of a run, and the identities of its files.
std::string identity_of(CaseInput input)
{
    input.title.clear();
    input.time.end = 0;
    if (!input.stages.empty()) input.stages.back().duration = 0;
    input.output     = OutputInput();
    input.checkpoint = CheckpointInput();
    input.watch      = WatchInput();
    if (is_implicit(input.spec)) {
        input.time = TimeInput();
        for (const char* one : {"newton_tolerance", "newton_iterations", "step_halvings"}) input.method.numbers[one] = 0;
    }
    std::string files;
    for (BodyInput& b : input.bodies) {
        if (b.file.empty()) continue;
        files += identity_of_file(b.file);
        b.file = std::filesystem::path(b.file).filename().string();
    }
    for (ObstacleInput& o : input.obstacles) {
        if (o.file.empty()) continue;
        files += identity_of_file(o.file);
        o.file = std::filesystem::path(o.file).filename().string();
    }
    return echo_case(input) + files;
}

std::vector<std::string> lines_of(const std::string& text)
{
    std::istringstream in(text);
    std::vector<std::string> r;
    for (std::string line; std::getline(in, line);) r.push_back(line);
    return r;
}

/// The first difference between two inputs, in words.
std::string difference(const std::string& before, const std::string& now)
{
    std::vector<std::string> a = lines_of(before), b = lines_of(now);
    const std::size_t count = std::max(a.size(), b.size());
    a.resize(count);
    b.resize(count);
    std::string table;
    std::size_t k = 0;
    for (; k + 1 < count && a[k] == b[k]; ++k)
        if (a[k].starts_with("[")) table = a[k] + " ";
    return fmt::format("{}`{}` then, `{}` now", table, a[k], b[k]);
}

/// The numbers that a field is made of.
template <class T>
struct Scalar {
    using Type =
        std::conditional_t<std::is_integral_v<T>, std::conditional_t<sizeof(T) == 4, std::int32_t, std::uint64_t>, double>;
};
template <int D>
struct Scalar<CornerIds<D>> {
    using Type = std::int32_t;
};
template <int D>
struct Scalar<Turns<D>> {
    using Type = std::int32_t;
};

enum class RowsOf { particles, corners };

/// f(name, array of numbers, whose rows they are) for the fields of particles and corners that steps or sorts change.
template <int D, class F>
void for_each_array(const Model<D>& model, Particles<D>& p, F&& f)
{
    auto visit = [&](const std::string& name, auto& field, RowsOf rows) {
        using Number         = typename Scalar<std::remove_reference_t<decltype(field[0])>>::Type;
        constexpr auto bytes = sizeof(field[0]);
        static_assert(bytes % sizeof(Number) == 0);
        f(name, ArrayOf<Number>{reinterpret_cast<Number*>(field.data()), field.size(), bytes / sizeof(Number)}, rows);
    };
    p.for_each_named_field_of(field_groups(model), [&](const char* name, auto& field) {
        visit(std::string("particle_") + name, field, RowsOf::particles);
    });
    visit("corner", p.corner, RowsOf::corners);
    visit("corner_velocity", p.corner_velocity, RowsOf::corners);
}

/// f(name, number) for the single numbers of a state.
template <int D, class F>
void for_each_number(State<D>& s, F&& f)
{
    f("t", s.t);
    f("t_rest", s.t_rest);
    f("t_v", s.t_v);
    f("t_F", s.t_F);
    f("dt_prev", s.dt_prev);
    f("drift", s.drift);
    f("reach", s.reach);
    f("move", s.move);
    for (std::size_t k = 0; k < s.wall_shifts.size(); ++k)
        for (int a = 0; a < D; ++a) f(fmt::format("wall_shift_{}_{}", k, a).c_str(), s.wall_shifts[k][a]);
    f("kinetic_energy", s.kinetic_energy);
    f("body_force_work", s.account.body_force_work);
    f("nodes_work", s.account.nodes_work);
    f("damped_energy", s.account.damped);
    f("filtered_energy", s.account.filtered);
    f("nodal_kinetic_energy", s.account.nodal_kinetic);
    f("start_kinetic", s.account.start.kinetic);
    f("start_stored", s.account.start.stored);
    f("start_potential", s.account.start.potential);
    f("nodal_work_stresses", s.account.nodes.stresses);
    f("nodal_work_loads", s.account.nodes.loads);
    f("nodal_work_gravity", s.account.nodes.gravity);
    f("nodal_work_constraints", s.account.nodes.constraints);
    f("stage_energy", s.account.staged);
    f("residual", s.residual);
    if (s.newton.is_wanted) {
        f("newton_iterations", s.newton.iterations);
        f("linear_iterations", s.newton.linear_iterations);
        f("step_halvings", s.newton.halvings);
        f("newton_residual", s.newton.residual);
    }
    for (std::size_t k = 0; k < s.account.boundaries.size(); ++k)
        f(fmt::format("boundary_work_{}", k).c_str(), s.account.boundaries[k].work);
    for (std::size_t k = 0; k < s.account.tractions.size(); ++k)
        f(fmt::format("traction_work_{}", k).c_str(), s.account.tractions[k].work);
    for (std::size_t k = 0; k < s.contacts.pairs.size(); ++k) {
        f(fmt::format("contact_friction_{}", k).c_str(), s.contacts.pairs[k].friction);
        f(fmt::format("contact_dissipation_{}", k).c_str(), s.contacts.pairs[k].dissipated);
    }
    for (std::size_t k = 0; k < s.contacts.obstacles.size(); ++k) {
        ObstacleMotion<D>& o = s.contacts.obstacles[k];
        auto visit           = [&](std::string_view what, double& x) { f(fmt::format("obstacle_{}_{}", k, what).c_str(), x); };
        for (int a = 0; a < D; ++a) visit(fmt::format("center_{}", a), o.center[a]);
        for (std::size_t a = 0; a < 4; ++a) visit(fmt::format("turn_{}", a), o.turn[a]);
        for (int a = 0; a < D; ++a) visit(fmt::format("velocity_{}", a), o.velocity[a]);
        for (int a = 0; a < 3; ++a) visit(fmt::format("spin_{}", a), o.spin[a]);
        visit("friction", o.exchange.friction);
        visit("dissipation", o.exchange.dissipated);
        visit("work", o.work);
    }
}

/// Makes the fields those of `count` particles, which are to be read; they have no values yet.
template <int D>
void make_room(Particles<D>& p, const FieldGroups& groups, int count)
{
    if (count == p.count) return;
    p.for_each_field_of(groups, [&]<class T>(Array<T>& field) { field = Array<T>(static_cast<std::size_t>(count)); });
    p.count = count;
}

/// The points that press or are tied: keys as four whole numbers; normals, anchors and impulses as 2 D + 1 real ones.
template <int D>
void add_anchors(Hdf5Writer& out, const std::vector<ContactPoint<D>>& points)
{
    std::vector<std::int32_t> keys;
    std::vector<double> numbers;
    for (const ContactPoint<D>& q : points) {
        if (!(q.p > 0 || q.is_tied)) continue;
        keys.insert(keys.end(), {q.key.pair, q.key.side, q.key.of, q.key.ordinal});
        numbers.insert(numbers.end(), q.normal.c, q.normal.c + D);
        numbers.insert(numbers.end(), q.anchor.c, q.anchor.c + D);
        numbers.push_back(q.p);
    }
    out.add("contact_keys", keys);
    out.add("contact_anchors", numbers);
}
template <int D>
std::vector<ContactPoint<D>> read_anchors(const Hdf5Reader& in)
{
    const auto keys               = in.list<std::int32_t>("contact_keys");
    const auto numbers            = in.list<double>("contact_anchors");
    constexpr std::size_t columns = 2 * D + 1;
    if (keys.size() % 4 != 0 || numbers.size() != keys.size() / 4 * columns) throw InputError("its contacts do not match");
    std::vector<ContactPoint<D>> r(keys.size() / 4);
    for (std::size_t k = 0; k < r.size(); ++k) {
        r[k].key = {keys[4 * k], keys[4 * k + 1], keys[4 * k + 2], keys[4 * k + 3]};
        std::copy_n(&numbers[columns * k], D, r[k].normal.c);
        std::copy_n(&numbers[columns * k + D], D, r[k].anchor.c);
        r[k].p = numbers[columns * k + 2 * D];
    }
    return r;
}

/// Places of nodes as D whole numbers, velocities as D real ones.
template <int D>
void add_load_step(Hdf5Writer& out, const std::vector<NodeMotion<D>>& motion)
{
    std::vector<std::int32_t> nodes;
    std::vector<double> velocities;
    for (const NodeMotion<D>& one : motion) {
        nodes.insert(nodes.end(), one.node.c, one.node.c + D);
        velocities.insert(velocities.end(), one.velocity.c, one.velocity.c + D);
    }
    out.add("load_step_nodes", nodes);
    out.add("load_step_velocities", velocities);
}
template <int D>
std::vector<NodeMotion<D>> read_load_step(const Hdf5Reader& in)
{
    const auto nodes      = in.list<std::int32_t>("load_step_nodes");
    const auto velocities = in.list<double>("load_step_velocities");
    if (nodes.size() % D != 0 || velocities.size() != nodes.size()) throw InputError("its last load step does not match");
    std::vector<NodeMotion<D>> r(nodes.size() / D);
    for (std::size_t k = 0; k < r.size(); ++k) {
        std::copy_n(&nodes[D * k], D, r[k].node.c);
        std::copy_n(&velocities[D * k], D, r[k].velocity.c);
    }
    return r;
}

/// f(name, list) for the lists of `w`, f(name, step) for its steps.
template <class F>
void for_each_list(Written& w, F&& f)
{
    f("written_frames", w.frames);
    f("written_grid_frames", w.grid_frames);
    f("written_table_sizes", w.table_sizes);
    f("written_table_sums", w.table_sums);
    f("written_probe_particles", w.probe_particles);
    f("watched_energies", w.watched);
}
template <class F>
void for_each_step(Written& w, F&& f)
{
    f("step", w.step);
    f("stage", w.stage);
    f("written_row_step", w.row_step);
    f("written_frame_step", w.frame_step);
}

/// Adds the fields of the particles and corners of all ranks. if_first(f) calls f(writer) on the first of them.
template <int D, class IfFirst>
void add_arrays(const Model<D>& model, State<D>& s, const IfFirst& if_first)
{
    const JoinedRows particles = joined_particles(s), corners = joined_corners(s);
    for_each_array(model, s.particles, [&]<class T>(const std::string& name, const ArrayOf<T>& array, RowsOf of) {
        const bool is_of_corners = of == RowsOf::corners;
        const JoinedRows& rows   = is_of_corners ? corners : particles;
        const bool has_none      = is_of_corners && array.rows == 0;
        if_first(
            [&](Hdf5Writer& out) { out.begin<T>(name, has_none ? 0 : static_cast<std::size_t>(rows.count()), array.columns); });
        if (has_none) return;
        rows.for_each_block<T>([&](std::size_t) { return array.columns; },
                               [&](std::size_t k, T* to) {
                                   const std::size_t row = is_of_corners ? static_cast<std::size_t>(rows.place(k)) : k;
                                   std::copy_n(array.data + row * array.columns, array.columns, to);
                               },
                               [&](std::span<const T> numbers) { if_first([&](Hdf5Writer& out) { out.append(numbers); }); });
    });
}

/// The rest of a state, with the tiles of all ranks.
template <int D>
void add_state(Hdf5Writer& out, State<D>& s)
{
    if (s.contacts.are_there()) add_anchors(out, s.contacts.points);
    if (s.newton.is_wanted) add_load_step(out, s.load_step);
    const TileRecord layout = s.field.tiles.record();
    out.add("layout_tiles", layout.tiles);
    out.add("layout_ends", layout.ends);
    out.add("layout_blocks", layout.blocks);
    out.add("layout_halo", std::vector<std::int32_t>{s.field.tiles.halo()});
    for_each_number(s, [&](const char* name, double x) { out.add(name, std::vector<double>{x}); });
}

/// Reads a state; of particles each rank reads a part, and gets those of its tiles.
template <int D>
void read_state(const Hdf5Reader& in, const Model<D>& model, State<D>& s)
{
    Ranks& ranks       = *s.ranks;
    std::int64_t total = s.particles.count;
    ranks.add({&total, 1});
    const std::pair part = part_of(total, ranks.index(), ranks.count());
    TileRecord layout;
    std::int32_t halo = 0;
    agree(ranks, [&] {
        make_room(s.particles, field_groups(model), static_cast<int>(part.second - part.first));
        for_each_array(model, s.particles, [&](const std::string& name, const auto& array, RowsOf of) {
            if (of == RowsOf::corners)
                in.read(name, array);
            else
                in.read_rows(name, array, static_cast<std::size_t>(part.first), static_cast<std::size_t>(total));
        });
        for_each_number(s, [&](const char* name, double& x) { in.read(name, ArrayOf<double>{&x, 1, 1}); });
        if (s.contacts.are_there()) s.contacts.points = read_anchors<D>(in);
        if (s.newton.is_wanted) s.load_step = read_load_step<D>(in);
        in.read("layout_halo", ArrayOf<std::int32_t>{&halo, 1, 1});
        layout = {in.list<std::uint64_t>("layout_tiles"), in.list<std::int32_t>("layout_ends"),
                  in.list<std::uint64_t>("layout_blocks")};
    });
    if (!restore_layout(model, s, std::move(layout), halo, part.first)) throw InputError("its tiles do not match its particles");
}

// ---- the file with its content ------------------------------------------------------------------------------------------

/// The first rank writes, with what all have. `identity` must be that of the reader.
template <int D>
void write_state_file(const std::filesystem::path& path, CaseInput input, const std::string& identity, const Model<D>& model,
                      State<D>& s, Written written)
{
    input.output.directory.clear();  // files of a case are the same wherever they go
    std::optional<PartName> file;
    std::optional<Hdf5Writer> writer;
    KeptFailure failure;
    auto if_first = [&](const auto& f) {
        if (s.ranks->index() == 0) failure.run([&] { f(*writer); });
    };
    if (s.ranks->index() == 0)
        failure.run([&] {
            file.emplace(path);
            writer.emplace(file->part(), kHead);
            writer->add_text("case", identity);
            writer->add_text("input", echo_case(input));
        });
    add_arrays(model, s, if_first);
    const Gathered<D> gathered(s);
    if_first([&](Hdf5Writer& out) {
        add_state(out, s);
        for_each_list(written, [&](const char* name, const auto& list) { out.add(name, list); });
        for_each_step(written, [&](const char* name, std::int64_t step) { out.add(name, std::vector<std::int64_t>{step}); });
        out.close();
        writer.reset();
        seal(file->part());
        file->commit();
    });
    agree(*s.ranks, [&] { failure.rethrow(); });
}

/// Reads a state into a simulation at its start. check(written) may throw, before anything has changed.
template <int D, class Check>
Written read_state_file(const std::filesystem::path& file, const std::string& identity, Simulation<D>& sim, const Check& check)
{
    State<D>& s  = sim.state();
    Ranks& ranks = *s.ranks;
    std::string program;
    on_first(ranks, [&] { program = require_whole(file); });
    std::optional<Hdf5Reader> in;
    Written w;
    agree(ranks, [&] {
        in.emplace(file);
        const std::string was = in->text("case");
        if (was != identity) throw InputError(fmt::format("it is of another case: {}", difference(was, identity)));
        for_each_list(w, [&]<class T>(const char* name, std::vector<T>& list) { list = in->list<T>(name); });
        for_each_step(w, [&](const char* name, std::int64_t& step) { in->read(name, ArrayOf<std::int64_t>{&step, 1, 1}); });
        check(std::as_const(w));
        if (w.stage < s.stage)
            throw InputError("it is of an earlier stage than one that was tried before; name it with --restart");
    });
    sim.prepare_stage(static_cast<int>(w.stage));
    read_state(*in, sim.model(), s);
    s.n = static_cast<long>(w.step);
    if (ranks.index() == 0 && program != this_program())
        say("ordo: warning: {} was written by {} (commit, compiler, instructions), and this is {}: numbers may differ in their "
            "last digits\n",
            file.string(), program, this_program());
    return w;
}

}  // namespace

template <int D>
void save_state(const std::filesystem::path& file, const CaseInput& input, Simulation<D>& sim, const Written& written)
{
    if (!has_hdf5()) throw InputError(std::string(kNoHdf5));
    write_state_file(file, input, identity_of(input), sim.model(), sim.state(), written);
}

template <int D>
Written restore_state(const std::filesystem::path& file, const CaseInput& input, Simulation<D>& sim)
{
    if (!has_hdf5()) throw InputError(std::string(kNoHdf5));
    try {
        return read_state_file(file, identity_of(input), sim, [](const Written&) {});
    } catch (const InputError& e) {
        throw InputError(one_line(fmt::format("{}: {}", file.string(), e.what())));
    }
}

CaseInput case_of_checkpoint(const std::filesystem::path& file)
{
    if (!has_hdf5()) throw InputError(std::string(kNoHdf5));
    try {
        require_whole(file);
        return read_case_text(Hdf5Reader(file).text("input"), "case in " + file.filename().string(), {});
    } catch (const InputError& e) {
        throw InputError(one_line(fmt::format("{}: {}", file.string(), e.what())));
    }
}

template <int D>
Checkpoints<D>::Checkpoints(const CaseInput& input, const Model<D>& model, RunDirectory& directory)
    : input_(input), model_(model), directory_(directory), identity_(identity_of(input))
{}

template <int D>
bool Checkpoints<D>::is_due(const State<D>& s) const
{
    const CheckpointInput& wanted = input_.checkpoint;
    if (wanted.steps && s.n % *wanted.steps == 0) return true;
    if (!wanted.wall_minutes) return false;
    const double minutes = std::chrono::duration<double>(Clock::now() - last_).count() / 60;
    return largest(*s.ranks, s.ranks->index() == 0 ? minutes : 0.0) >= *wanted.wall_minutes;
}

/// The first rank looks: others may not see yet what it has written.
template <int D>
std::vector<std::int64_t> Checkpoints<D>::steps_for(Ranks& ranks) const
{
    Bytes bytes;
    on_first(ranks, [&] {
        const std::vector<std::int64_t> mine = steps();
        put_all(bytes, std::span<const std::int64_t>(mine));
    });
    ranks.share(bytes, 0);
    return values_of<std::int64_t>(bytes);
}

template <int D>
std::vector<std::int64_t> Checkpoints<D>::steps() const
{
    std::vector<std::int64_t> r;
    for (const auto& entry : std::filesystem::directory_iterator(directory_.path()))
        if (const auto step = step_of_checkpoint(entry.path().filename().string())) r.push_back(*step);
    std::sort(r.begin(), r.end(), std::greater<>());
    return r;
}

template <int D>
void Checkpoints<D>::write(State<D>& s, const Written& written)
{
    if (last_step_ == s.n) return;
    write_file(s, written);
    last_      = Clock::now();
    last_step_ = s.n;
}

template <int D>
void Checkpoints<D>::write_file(State<D>& s, const Written& written)
{
    std::filesystem::path file;
    on_first(*s.ranks, [&] { file = directory_.file(checkpoint_file(s.n)); });
    write_state_file(file, input_, identity_, model_, s, written);
    on_first(*s.ranks, [&] { remove_older(s.n); });
}

template <int D>
void Checkpoints<D>::remove_older(std::int64_t step)
{
    int kept = 0;
    for (const std::int64_t one : steps())
        if (one <= step && ++kept > input_.checkpoint.keep) directory_.remove({checkpoint_file(one)});
}

template <int D>
Written Checkpoints<D>::read_file(const std::filesystem::path& file, Simulation<D>& sim) const
{
    return read_state_file(file, identity_, sim, [&](const Written& w) {
        if (has_results(directory_.path())) require_files(input_, w);
    });
}

template <int D>
Written Checkpoints<D>::read(const std::string& which, Simulation<D>& sim) const
{
    if (!has_hdf5()) throw InputError("--restart: " + std::string(kNoHdf5));
    if (which != "latest") {
        try {
            return read_file(which, sim);
        } catch (const InputError& e) {
            throw InputError(one_line(fmt::format("--restart {}: {}", which, e.what())));
        }
    }
    std::string reasons;
    for (const std::int64_t step : steps_for(*sim.state().ranks)) {
        const std::filesystem::path file = directory_.path() / checkpoint_file(step);
        try {
            Written w = read_file(file, sim);
            if (!reasons.empty()) say("ordo: warning: checkpoints that cannot be used:{}\n", reasons);
            return w;
        } catch (const InputError& e) {
            reasons += fmt::format("\n  {}: {}", file.string(), one_line(e.what()));
        }
    }
    throw InputError(fmt::format("--restart latest: there is no checkpoint in {}{}{}", directory_.path().string(),
                                 reasons.empty() ? "; write some with [checkpoint] steps or wall_minutes, or name a file"
                                                 : " that can be used:",
                                 reasons));
}

#define ORDO_CHECKPOINT(D)                                                                                    \
    template class Checkpoints<D>;                                                                            \
    template void save_state(const std::filesystem::path&, const CaseInput&, Simulation<D>&, const Written&); \
    template Written restore_state(const std::filesystem::path&, const CaseInput&, Simulation<D>&);
ORDO_CHECKPOINT(1)
ORDO_CHECKPOINT(2)
ORDO_CHECKPOINT(3)
#undef ORDO_CHECKPOINT

}  // namespace ordo::io
