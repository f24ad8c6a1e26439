#include "io/checkpoint.hpp"

#include "io/file.hpp"
#include "io/hdf5.hpp"
#include "io/message.hpp"
#include "method/layout.hpp"
#include "ordo_version.hpp"

#include <fmt/format.h>

#if defined(ORDO_HDF5)
#include <unistd.h>
#include <zlib.h>
#endif

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <memory>
#include <sstream>
#include <type_traits>

namespace ordo::io {

namespace {

constexpr int kFormat              = 1;    ///< of the file; to be raised with every change of what is in it
constexpr std::size_t kHead        = 512;  ///< bytes of text before HDF5 begins, a user block in its terms
constexpr std::string_view kFirst  = "ordo checkpoint\n";
constexpr std::string_view kBefore = "checkpoint_", kAfter = ".h5";

// ---- the file as a whole ----------------------------------------------------------------------------------------------

struct Close {
    void operator()(std::FILE* f) const { std::fclose(f); }
};
using File = std::unique_ptr<std::FILE, Close>;

/// The text at the start, filled up with zeros. `sum` is that of the bytes behind it and of the text before it.
struct Head {
    int format = kFormat;
    std::string version{ORDO_VERSION};
    std::uint64_t bytes = 0;  ///< of the whole file

    std::string text() const { return fmt::format("{}format {}\nversion {}\nbytes {}\n", kFirst, format, version, bytes); }
    std::string block(unsigned long sum) const
    {
        std::string r = fmt::format("{}crc32 {:08x}\n", text(), sum);
        r.resize(kHead, '\0');
        return r;
    }
};

#if defined(ORDO_HDF5)
/// The checksum of what follows the head, and of the head's text.
unsigned long sum_of(std::FILE* file, const Head& head)
{
    std::vector<unsigned char> bytes(1 << 20);
    unsigned long sum = crc32(0, nullptr, 0);
    std::fseek(file, static_cast<long>(kHead), SEEK_SET);
    while (const std::size_t n = std::fread(bytes.data(), 1, bytes.size(), file))
        sum = crc32(sum, bytes.data(), static_cast<unsigned>(n));
    const std::string text = head.text();
    return crc32(sum, reinterpret_cast<const unsigned char*>(text.data()), static_cast<unsigned>(text.size()));
}

/// Writes the head of a file that is complete but for it, and waits until the disk has all of it.
void seal(const std::filesystem::path& path)
{
    const File file(std::fopen(path.c_str(), "r+b"));
    Head head;
    head.bytes = std::filesystem::file_size(path);
    if (file) {
        const std::string block = head.block(sum_of(file.get(), head));
        std::rewind(file.get());
        if (std::fwrite(block.data(), 1, block.size(), file.get()) == block.size() && std::fflush(file.get()) == 0 &&
            ::fsync(::fileno(file.get())) == 0)
            return;
    }
    throw OutputError(fmt::format("{}: cannot be written: is the disk full?", path.string()));
}

/// Throws InputError where a file is not whole, or not of this version.
void require_whole(const std::filesystem::path& path)
{
    if (!std::filesystem::is_regular_file(path)) throw InputError("there is no such file");
    const File file(std::fopen(path.c_str(), "rb"));
    if (!file) throw InputError("it cannot be read");
    std::string block(kHead, '\0');
    const std::size_t count = std::fread(block.data(), 1, kHead, file.get());
    if (count < kFirst.size() || !block.starts_with(kFirst)) throw InputError("it is no checkpoint of ordo");
    std::istringstream words(block.substr(kFirst.size()));
    Head head;
    std::string key;
    words >> key >> head.format >> key >> head.version >> key >> head.bytes;
    if (count == kHead && head.format != kFormat)
        throw InputError(
            fmt::format("its format is {}, and this ordo reads {}: it was written by another version", head.format, kFormat));
    if (count == kHead && head.version != ORDO_VERSION)
        throw InputError(fmt::format("it was written by ordo {}, and this is {}; go on with that version, or start anew",
                                     head.version, ORDO_VERSION));
    const auto there = std::filesystem::file_size(path);
    if (there < std::max<std::uintmax_t>(head.bytes, kHead))
        throw InputError(fmt::format("it is truncated: {} bytes are there of {}", there, head.bytes));
    if (there != head.bytes || block != head.block(sum_of(file.get(), head)))
        throw InputError("it is corrupted: its checksum is not that of its contents");
}
#else
void seal(const std::filesystem::path&) {}
void require_whole(const std::filesystem::path&) {}
#endif

// ---- what is in it ----------------------------------------------------------------------------------------------------

/// The input without what may change from one part of a run to the next.
std::string identity_of(CaseInput input)
{
    input.title.clear();
    input.time.end   = 0;
    input.output     = OutputInput();
    input.checkpoint = CheckpointInput();
    input.watch      = WatchInput();
    for (BodyInput& b : input.bodies) b.file = std::filesystem::path(b.file).filename().string();
    return echo_case(input);
}

/// Where two inputs differ first, in words.
std::string difference(const std::string& before, const std::string& now)
{
    std::istringstream a(before), b(now);
    std::string x, y;
    for (;;) {
        const bool has_x = static_cast<bool>(std::getline(a, x)), has_y = static_cast<bool>(std::getline(b, y));
        if (!has_x && !has_y) return "nothing";
        if (has_x != has_y || x != y) return fmt::format("`{}` then, `{}` now", has_x ? x : "", has_y ? y : "");
    }
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

/// f(name, array of numbers) for everything that particles and their corners are.
template <int D, class F>
void for_each_array(Particles<D>& p, F&& f)
{
    auto visit = [&](const std::string& name, auto& field) {
        using Number         = typename Scalar<std::remove_reference_t<decltype(field[0])>>::Type;
        constexpr auto bytes = sizeof(field[0]);
        static_assert(bytes % sizeof(Number) == 0);
        f(name, ArrayOf<Number>{reinterpret_cast<Number*>(field.data()), field.size(), bytes / sizeof(Number)});
    };
    p.for_each_named_field([&](const char* name, auto& field) { visit(std::string("particle_") + name, field); });
    visit("corner", p.corner);
    visit("corner_velocity", p.corner_velocity);
    visit("corner_enriched", p.enriched);
    visit("corner_planes", p.corner_planes);
    visit("corner_part", p.corner_part);
}

/// What a state has of single numbers.
template <int D>
std::array<double*, 8> numbers_of(State<D>& s)
{
    return {&s.t, &s.t_rest, &s.t_v, &s.t_F, &s.dt_prev, &s.drift, &s.reach, &s.move};
}

template <int D>
void add_state(Hdf5Writer& out, State<D>& s)
{
    for_each_array(s.particles, [&]<class T>(const std::string& name, const ArrayOf<T>& array) {
        out.add(name, ArrayOf<const T>{array.data, array.rows, array.columns});
    });
    const TileRecord layout = s.tiles.record();
    out.add("layout_tiles", layout.tiles);
    out.add("layout_ends", layout.ends);
    out.add("layout_blocks", layout.blocks);
    out.add("layout_halo", std::vector<std::int32_t>{s.tiles.halo()});
    std::vector<double> numbers;
    for (const double* x : numbers_of(s)) numbers.push_back(*x);
    out.add("numbers", numbers);
}

template <int D>
void read_state(const Hdf5Reader& in, const Model<D>& model, State<D>& s)
{
    for_each_array(s.particles, [&](const std::string& name, const auto& array) { in.read(name, array); });
    const std::vector<double> numbers = in.list<double>("numbers");
    const auto places                 = numbers_of(s);
    if (numbers.size() != places.size()) throw InputError("its numbers are not those of a state");
    for (std::size_t k = 0; k < places.size(); ++k) *places[k] = numbers[k];
    std::int32_t halo = 0;
    in.read("layout_halo", ArrayOf<std::int32_t>{&halo, 1, 1});
    TileRecord layout{in.list<std::uint64_t>("layout_tiles"), in.list<std::int32_t>("layout_ends"),
                      in.list<std::uint64_t>("layout_blocks")};
    if (!restore_layout(model, s, std::move(layout), halo)) throw InputError("its tiles are not those of its particles");
}

}  // namespace

std::optional<std::int64_t> step_of_checkpoint(const std::string& name)
{
    if (!name.starts_with(kBefore) || !name.ends_with(kAfter)) return {};
    const char *first = name.data() + kBefore.size(), *last = name.data() + name.size() - kAfter.size();
    std::int64_t step       = 0;
    const auto [end, error] = std::from_chars(first, last, step);
    if (error != std::errc() || end != last || first == last) return {};
    return step;
}

template <int D>
Checkpoints<D>::Checkpoints(const CaseInput& input, const Model<D>& model)
    : input_(input), model_(model), directory_(input.output.directory), identity_(identity_of(input))
{}

template <int D>
bool Checkpoints<D>::is_due(const State<D>& s) const
{
    const CheckpointInput& wanted = input_.checkpoint;
    if (wanted.steps && s.n % *wanted.steps == 0) return true;
    return wanted.wall_minutes && std::chrono::duration<double>(Clock::now() - last_).count() >= 60 * *wanted.wall_minutes;
}

template <int D>
std::vector<std::filesystem::path> Checkpoints<D>::files() const
{
    std::vector<std::filesystem::path> r;
    std::error_code none;
    for (const auto& entry : std::filesystem::directory_iterator(directory_, none))
        if (step_of_checkpoint(entry.path().filename().string())) r.push_back(entry.path());
    std::sort(r.begin(), r.end(), [](const auto& a, const auto& b) {
        return *step_of_checkpoint(a.filename().string()) > *step_of_checkpoint(b.filename().string());
    });
    return r;
}

template <int D>
void Checkpoints<D>::write(State<D>& s, const Written& written)
{
    if (last_step_ == s.n) return;
    PartName name(directory_ / fmt::format("{}{:09}{}", kBefore, s.n, kAfter));
    {
        Hdf5Writer out(name.part(), kHead);
        out.add_text("case", identity_);
        add_state(out, s);
        out.add("written_frames", written.frames);
        out.add("written_grid_frames", written.grid_frames);
        out.add("written_table_sizes", written.table_sizes);
        out.add("written_probe_particles", written.probe_particles);
        out.add("written_next_frame", std::vector<double>{written.next_frame});
        out.add("watched", written.watched);
        out.add("steps", std::vector<std::int64_t>{s.n, written.row_step, written.frame_step});  // of the state, a row, a frame
        out.close();
    }
    seal(name.part());
    name.commit();
    last_            = Clock::now();
    last_step_       = s.n;
    const auto there = files();
    const auto keep  = static_cast<std::size_t>(input_.checkpoint.keep);
    std::error_code none;
    for (std::size_t k = keep; k < there.size(); ++k) std::filesystem::remove(there[k], none);
}

template <int D>
Written Checkpoints<D>::read_file(const std::filesystem::path& file, State<D>& s) const
{
    require_whole(file);
    const Hdf5Reader in(file);
    const std::string identity = in.text("case");
    if (identity != identity_) throw InputError(fmt::format("it is of another case: {}", difference(identity, identity_)));
    read_state(in, model_, s);
    Written w;
    w.frames          = in.list<double>("written_frames");
    w.grid_frames     = in.list<std::int32_t>("written_grid_frames");
    w.table_sizes     = in.list<std::uint64_t>("written_table_sizes");
    w.probe_particles = in.list<std::int32_t>("written_probe_particles");
    w.watched         = in.list<double>("watched");
    in.read("written_next_frame", ArrayOf<double>{&w.next_frame, 1, 1});
    std::array<std::int64_t, 3> steps{};
    in.read("steps", ArrayOf<std::int64_t>{steps.data(), steps.size(), 1});
    s.n          = static_cast<long>(steps[0]);
    w.step       = steps[0];
    w.row_step   = steps[1];
    w.frame_step = steps[2];
    return w;
}

template <int D>
Written Checkpoints<D>::read(const std::string& which, State<D>& s) const
{
    if (which != "latest") {
        try {
            return read_file(which, s);
        } catch (const InputError& e) {
            throw InputError(fmt::format("--restart {}: {}", which, e.what()));
        }
    }
    std::string reasons;
    for (const std::filesystem::path& file : files()) {
        try {
            Written w = read_file(file, s);
            if (!reasons.empty()) say("ordo: warning: checkpoints that cannot be used:{}\n", reasons);
            return w;
        } catch (const InputError& e) {
            reasons += fmt::format("\n  {}: {}", file.string(), e.what());
        }
    }
    throw InputError(fmt::format("--restart latest: there is no checkpoint in {}{}{}", directory_.string(),
                                 reasons.empty() ? "; write some with [checkpoint] steps or wall_minutes, or name a file"
                                                 : " that can be used:",
                                 reasons));
}

template class Checkpoints<1>;
template class Checkpoints<2>;
template class Checkpoints<3>;

}  // namespace ordo::io
