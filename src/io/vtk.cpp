#include "io/vtk.hpp"

#include "base/agree.hpp"
#include "base/error.hpp"
#include "base/joined_rows.hpp"
#include "io/file.hpp"
#include "method/grid_sample.hpp"
#include "particles/sort.hpp"
#include "sim/output_fields.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>

namespace ordo::io {

namespace {

static_assert(std::endian::native == std::endian::little, "the VTK writers need a little-endian machine");

/// Bytes in compressed blocks, as VTK's vtkZLibDataCompressor reads them: numbers of blocks, bytes of a block, of the last one if it
/// is not full, and compressed bytes of each; then the blocks.
class Packed {
  public:
    void add(std::string_view bytes)
    {
        pending_ += bytes;
        if (pending_.size() >= kBlock * kBatch) pack(pending_.size() / kBlock);
    }
    std::string finish()
    {
        const std::uint64_t last = pending_.size() % kBlock;
        pack(pending_.size() / kBlock + (last > 0));
        std::vector<std::uint64_t> head{sizes_.size(), kBlock, last};
        head.insert(head.end(), sizes_.begin(), sizes_.end());
        return std::string(reinterpret_cast<const char*>(head.data()), head.size() * sizeof(head[0])) + packed_;
    }

  private:
    static constexpr std::size_t kBlock = 1 << 18, kBatch = 64;
    static constexpr int kLevel = 4;  // of zlib; higher ones take twice the time for some percent

    /// Packs the first blocks of what is pending, in parallel.
    void pack(std::size_t blocks)
    {
        std::vector<std::string> out(blocks);
        parallel_for_each(static_cast<std::ptrdiff_t>(blocks), [&](std::ptrdiff_t i) {
            const auto k              = static_cast<std::size_t>(i);
            const std::string_view in = std::string_view(pending_).substr(k * kBlock, kBlock);
            uLongf size               = ::compressBound(in.size());
            out[k].resize(size);
            ::compress2(reinterpret_cast<Bytef*>(out[k].data()), &size, reinterpret_cast<const Bytef*>(in.data()), in.size(),
                        kLevel);
            out[k].resize(size);
        });
        for (const std::string& block : out) {
            sizes_.push_back(block.size());
            packed_ += block;
        }
        pending_.erase(0, blocks * kBlock);
    }

    std::string pending_, packed_;
    std::vector<std::uint64_t> sizes_;
};

/// The names of the components of tensors, which ParaView shows.
std::string component_names(int components)
{
    std::string r;
    for (int c = 0; c < components && components == 9; ++c)
        r += fmt::format(R"( ComponentName{}="{}{}")", c, "xyz"[c / 3], "xyz"[c % 3]);
    return r;
}

/// The appended section of a VTK XML file: arrays of numbers, each after its size in bytes. Values are computed while they are
/// written, a block at a time: arrays of a whole frame would need as much memory as the particles, and touching new pages costs
/// more than computing the numbers. Only compressed arrays are held, because the file begins with their sizes. Of several ranks the first
/// has the section, and all make the same calls.
class Appended {
  public:
    using Put = std::function<void(std::string_view)>;

    explicit Appended(bool is_compressed = false) : is_compressed_(is_compressed) {}

    /// Adds an array of tuples, one a row, and returns its XML element. fill(k, out) writes the numbers of row k of this rank; it is called
    /// in parallel, until `write` returns.
    template <class T, class Fill>
    std::string add(std::string_view name, const JoinedRows& rows, int components, Fill fill)
    {
        const auto length = static_cast<std::size_t>(components);
        return add_runs<T>(
            name, rows, static_cast<std::size_t>(rows.count()) * length, components, [=](std::size_t) { return length; },
            std::move(fill));
    }
    /// The same for rows of one process.
    template <class T, class Fill>
    std::string add(std::string_view name, std::size_t count, int components, Fill fill)
    {
        return add<T>(name, JoinedRows(static_cast<std::int64_t>(count)), components, std::move(fill));
    }
    /// The same for rows of several tuples: `numbers` in all, length(k) in row k.
    template <class T, class Length, class Fill>
    std::string add_runs(std::string_view name, const JoinedRows& rows, std::size_t numbers, int components, Length length,
                         Fill fill)
    {
        return add_array<T>(name, numbers, components, [=](const auto& put) { rows.for_each_block<T>(length, fill, put); });
    }
    /// An array of the sums of the numbers up to each row, one a row.
    template <class T, class Fill>
    std::string add_sums(std::string_view name, const JoinedRows& rows, Fill fill)
    {
        return add_array<T>(name, static_cast<std::size_t>(rows.count()), 1, [=](const auto& put) {
            T sum = 0;
            rows.for_each_block<T>([](std::size_t) { return 1; }, fill,
                                   [&](std::span<T> numbers) {
                                       for (T& one : numbers) one = sum += one;
                                       put(numbers);
                                   });
        });
    }
    std::uint64_t size() const { return size_; }
    void write(const Put& put) const
    {
        put("<AppendedData encoding=\"raw\">\n_");
        for (const auto& w : writers_) w(put);
        put("\n</AppendedData>\n</VTKFile>\n");
    }

  private:
    /// compute(put) calls put(numbers) for block after block.
    template <class T, class Compute>
    std::string add_array(std::string_view name, std::size_t numbers, int components, const Compute& compute)
    {
        const std::string type = std::is_same_v<T, double>  ? "Float64"
                                 : std::is_same_v<T, float> ? "Float32"
                                 : sizeof(T) == 1           ? "UInt8"
                                 : sizeof(T) == 4           ? "Int32"
                                                            : "Int64";
        const std::string tag =
            fmt::format(R"(<DataArray type="{}" Name="{}" NumberOfComponents="{}"{} format="appended" offset="{}"/>)", type, name,
                        components, component_names(components), size_);
        auto bytes_of = [](std::span<const T> block) {
            return std::string_view(reinterpret_cast<const char*>(block.data()), block.size_bytes());
        };
        if (is_compressed_) {
            Packed packed;
            compute([&](std::span<T> block) { packed.add(bytes_of(block)); });
            std::string all = packed.finish();
            size_ += all.size();
            writers_.push_back([all = std::move(all)](const Put& put) { put(all); });
            return tag + "\n";
        }
        const std::uint64_t bytes = numbers * sizeof(T);
        size_ += sizeof(bytes) + bytes;
        writers_.push_back([=](const Put& put) {
            put({reinterpret_cast<const char*>(&bytes), sizeof(bytes)});
            compute([&](std::span<T> block) { put(bytes_of(block)); });
        });
        return tag + "\n";
    }

    bool is_compressed_;
    std::uint64_t size_ = 0;
    std::vector<std::function<void(const Put&)>> writers_;
};

constexpr std::string_view kHead = R"(<?xml version="1.0"?>
<VTKFile type="{}" version="1.0" byte_order="LittleEndian" header_type="UInt64"{}>
)";

/// The number of corners of a particle's domain in drawings; one for a point.
template <int D>
int corner_count(const Particles<D>& p, int i)
{
    if (!p.cell.empty()) return p.cell[i].count();
    return p.edges.empty() && p.half.empty() ? 1 : 1 << D;
}

/// VTK's type of a particle's cell.
template <int D>
std::uint8_t cell_type(const Particles<D>& p, int i)
{
    constexpr std::uint8_t vertex = 1, line = 3, triangle = 5, quad = 9, tetrahedron = 10, hexahedron = 12;
    constexpr std::uint8_t of_dim[] = {line, quad, hexahedron}, of_simplex[] = {line, triangle, tetrahedron};
    if (!p.cell.empty() && p.cell[i].is_simplex()) return of_simplex[D - 1];
    return corner_count(p, i) == 1 ? vertex : of_dim[D - 1];
}

template <int D>
void put_point(const Vec<D>& x, double* out)
{
    const Vec<3> at = padded(x);
    for (int a = 0; a < 3; ++a) out[a] = at[a];
}

/// The corners of a particle's domain in VTK's order.
template <int D>
void put_corners(const Model<D>& model, const Particles<D>& p, int i, double* out)
{
    const Vec<D> place = place_in_period(model, p, i);
    auto put           = [&](const Vec<D>& x) {
        put_point(x, out);
        out += 3;
    };
    // VTK walks around a quad; bits of the corner number are signs along the edges.
    static constexpr int walk[8] = {0, 1, 3, 2, 4, 5, 7, 6};
    const int count              = corner_count(p, i);
    if (!p.cell.empty()) {
        const CornerIds<D>& ids = p.cell[i];
        for (int c = 0; c < count; ++c) put(place + (corner_place(model, p, i, ids[ids.is_simplex() ? c : walk[c]]) - p.x[i]));
        return;
    }
    for (int c = 0; c < count; ++c) {
        Vec<D> x = place;
        for (int d = 0; d < D && count > 1; ++d) {
            const double sign = walk[c] >> d & 1 ? 1.0 : -1.0;
            if (!p.edges.empty())
                x += sign * column(p.edges[i], d);
            else
                x[d] += sign * p.half[i][d];
        }
        put(x);
    }
}

/// The particles of this rank whose numbers are multiples of `every`, in the order of their numbers, and the rows that they are among those of
/// all ranks.
template <int D>
class NumberedParticles {
  public:
    NumberedParticles(const Particles<D>& p, Ranks& ranks, int every) : rows_(0)
    {
        std::vector<int> chosen;
        for (int i = 0; i < p.count; ++i)
            if (p.id[i] % every == 0) chosen.push_back(i);
        Array<std::uint64_t> numbers(chosen.size());
        for (std::size_t k = 0; k < chosen.size(); ++k) numbers[k] = static_cast<std::uint64_t>(p.id[chosen[k]] / every);
        const double most      = numbers.empty() ? 0 : static_cast<double>(*std::max_element(numbers.begin(), numbers.end()));
        const auto end         = static_cast<std::uint64_t>(largest(ranks, most)) + 1;
        const Array<int> order = sort_keys(numbers, end);
        order_                 = chosen;
        for (std::size_t k = 0; k < order.size(); ++k) order_[k] = chosen[order[k]];
        rows_ = ranks.is_alone() ? JoinedRows(static_cast<std::int64_t>(chosen.size())) : join(ranks, numbers, end);
    }

    const JoinedRows& rows() const { return rows_; }
    /// The particle in row k of this rank.
    int operator[](std::size_t k) const { return order_[k]; }
    const std::vector<int>& order() const { return order_; }

  private:
    /// A bit says that a number is there; it is on one rank only, so the sum of words has the bits of all.
    static JoinedRows join(Ranks& ranks, const Array<std::uint64_t>& numbers, std::uint64_t end)
    {
        std::vector<std::int64_t> words(end / 64 + 1, 0);
        auto bit_of = [](std::uint64_t n) { return std::uint64_t{1} << n % 64; };
        for (const std::uint64_t n : numbers) words[n / 64] |= static_cast<std::int64_t>(bit_of(n));
        ranks.add(words);
        std::vector<std::int64_t> places;
        std::int64_t before = 0;  // of all words before the one of the number
        std::size_t word    = 0;
        auto bits           = [&](std::size_t k) { return static_cast<std::uint64_t>(words[k]); };
        for (const std::uint64_t n : numbers) {
            for (; word < n / 64; ++word) before += std::popcount(bits(word));
            places.push_back(before + std::popcount(bits(word) & (bit_of(n) - 1)));
        }
        for (; word < words.size(); ++word) before += std::popcount(bits(word));
        return {ranks, std::move(places), before};
    }

    std::vector<int> order_;
    JoinedRows rows_;
};

/// A file of particles before it is written, made by all ranks together. Particles must not change until then.
template <int D>
class ParticleFile {
  public:
    ParticleFile(const Model<D>& model, const State<D>& s, const FrameStyle& style)
        : model_(model),
          p_(s.particles),
          ranks_(*s.ranks),
          style_(style),
          written_(s.particles, *s.ranks, style.every),
          data_(style.is_compressed)
    {
        const FieldGroups groups = field_groups(model);
        has_domain_              = !style.as_points && (groups.box || groups.corners || groups.cells);
        std::int64_t points      = 0;
        for (const int i : written_.order()) points += points_of(i);
        ranks_.add({&points, 1});
        points_                  = static_cast<std::size_t>(points);
        const auto cells         = style_.as_points ? 1 : written_.rows().count();
        const std::string arrays = find_arrays(), coordinates = find_points(), topology = find_cells();
        text_ =
            fmt::format(fmt::runtime(kHead), "UnstructuredGrid",
                        style.is_compressed ? R"( compressor="vtkZLibDataCompressor")" : "") +
            fmt::format("<UnstructuredGrid>\n<FieldData>\n<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" "
                        "format=\"ascii\">{}</DataArray>\n</FieldData>\n",
                        s.t) +
            fmt::format("<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n", points_, cells) +
            fmt::format("<{0}>\n{1}</{0}>\n<Points>\n{2}</Points>\n<Cells>\n{3}</Cells>\n</Piece>\n</UnstructuredGrid>\n",
                        has_domain_ ? "CellData" : "PointData", arrays, coordinates, topology);
    }
    ParticleFile(const ParticleFile&) = delete;

    std::uint64_t size() const { return text_.size() + data_.size(); }
    /// The first rank writes. Throws OutputError on all of them.
    void write(const std::filesystem::path& path) const
    {
        std::optional<AtomicFile> file;
        on_first(ranks_, [&] { file.emplace(path); });
        KeptFailure failure;
        auto put = [&](std::string_view bytes) {
            if (file) failure.run([&] { file->write(bytes); });
        };
        put(text_);
        data_.write(put);
        on_first(ranks_, [&] {
            failure.rethrow();
            file->commit();
        });
    }

  private:
    int points_of(int i) const { return has_domain_ ? corner_count(p_, i) : 1; }
    // Each call of data_.add is one of all ranks: their order must not be left to the compiler.
    std::string find_arrays()
    {
        std::string r = integers("id", p_.id);
        r += integers("body", p_.body);
        r += integers("material", p_.material);
        if (has_domain_) r += field("position");
        for (const std::string& name : style_.fields) r += field(name);
        return r;
    }
    std::string integers(std::string_view name, const Array<std::int32_t>& values)
    {
        return data_.add<std::int32_t>(name, written_.rows(), 1,
                                       [&](std::size_t k, std::int32_t* out) { *out = values[written_[k]]; });
    }
    std::string field(const std::string& name)
    {
        const FieldReader<D> reader(name, model_, p_);
        const auto length = static_cast<std::size_t>(reader.components());
        return add_reals(
            name, static_cast<std::size_t>(written_.rows().count()) * length, reader.components(),
            [length](std::size_t) { return length; }, [this, reader](std::size_t k, double* out) { reader(written_[k], out); });
    }
    std::string find_points()
    {
        return add_reals(
            "Points", 3 * points_, 3, [this](std::size_t k) { return 3 * static_cast<std::size_t>(points_of(written_[k])); },
            [this](std::size_t k, double* out) {
                if (has_domain_)
                    put_corners(model_, p_, written_[k], out);
                else
                    put_point(place_in_period(model_, p_, written_[k]), out);
            });
    }
    /// Real numbers of each particle, at most those of the corners of a hexahedron.
    template <class Length, class Fill>
    std::string add_reals(const std::string& name, std::size_t numbers, int components, Length length, Fill fill)
    {
        if (!style_.is_single) return data_.add_runs<double>(name, written_.rows(), numbers, components, length, fill);
        return data_.add_runs<float>(name, written_.rows(), numbers, components, length,
                                     [length, fill](std::size_t k, float* out) {
                                         std::array<double, 24> of_row{};
                                         fill(k, of_row.data());
                                         std::copy_n(of_row.begin(), length(k), out);
                                     });
    }
    std::string find_cells()
    {
        return points_ < std::numeric_limits<std::int32_t>::max() ? find_cells_by<std::int32_t>() : find_cells_by<std::int64_t>();
    }
    /// One cell a particle, or one of all points.
    template <class Number>
    std::string find_cells_by()
    {
        constexpr std::uint8_t poly_vertex = 2;
        const std::size_t points           = ranks_.index() == 0 ? points_ : 0;
        std::string r =
            data_.add<Number>("connectivity", points, 1, [](std::size_t k, Number* out) { *out = static_cast<Number>(k); });
        if (style_.as_points) {
            r += data_.add<Number>("offsets", 1, 1, [this](std::size_t, Number* out) { *out = static_cast<Number>(points_); });
            r += data_.add<std::uint8_t>("types", 1, 1, [](std::size_t, std::uint8_t* out) { *out = poly_vertex; });
            return r;
        }
        r += data_.add_sums<Number>("offsets", written_.rows(),
                                    [this](std::size_t k, Number* out) { *out = points_of(written_[k]); });
        r += data_.add<std::uint8_t>("types", written_.rows(), 1,
                                     [this](std::size_t k, std::uint8_t* out) { *out = cell_type(p_, written_[k]); });
        return r;
    }

    const Model<D>& model_;
    const Particles<D>& p_;
    Ranks& ranks_;
    FrameStyle style_;
    bool has_domain_ = false;
    NumberedParticles<D> written_;
    std::size_t points_ = 0;  ///< of all ranks
    Appended data_;
    std::string text_;
};

}  // namespace

template <int D>
void write_particles(const std::filesystem::path& file, const Model<D>& model, const State<D>& s, const FrameStyle& style)
{
    ParticleFile<D>(model, s, style).write(file);
}

template <int D>
std::uint64_t size_of_frame(const Model<D>& model, const State<D>& s, FrameStyle style)
{
    style.is_compressed = false;
    return ParticleFile<D>(model, s, style).size();
}

template <int D>
void write_grid(const std::filesystem::path& file, const State<D>& s)
{
    const Lattice<D>& g = s.lattice;
    Vec<3> origin{}, spacing = Vec<3>::filled(1.0);
    Index<3> n = {1, 1, 1};
    for (int a = 0; a < D; ++a) {
        origin[a]  = g.origin[a];
        spacing[a] = g.h[a];
        n[a]       = g.cells[a] + 1;
    }
    const std::size_t count = static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(n[2]);
    std::vector<double> mass(count), velocity(3 * count);
    // The functions at a point are those of its node and, for splines, of the next ones. They are fewer than a block is wide, so
    // checking the first and the last along each axis is enough.
    const int last        = g.basis.degree - 1;
    const auto both_sides = IndexBox<D>{Index<D>{}, Index<D>::filled(last > 0 ? 2 : 1)};
    auto is_touched       = [&](const Index<D>& node) {
        bool is = false;
        for (int k = 0; k < s.field.tiles.fields(); ++k)
            both_sides.for_each([&](const Index<D>& side) { is = is || s.field.tiles.is_active(node + side * last, k); });
        return is;
    };
    parallel_for_each(static_cast<std::ptrdiff_t>(count), [&](std::ptrdiff_t k) {
        Vec<D> x{};
        Index<D> node{};
        std::ptrdiff_t rest = k;
        for (int a = 0; a < D; ++a) {
            const int at = static_cast<int>(rest % n[a]);
            rest /= n[a];
            x[a]    = g.origin[a] + at * g.h[a];
            node[a] = at + g.margin;
        }
        if (!is_touched(node)) return;
        const GridSample<D> sample = sample_grid(s, x);
        mass[k]                    = sample.mass;
        for (int a = 0; a < D; ++a) velocity[3 * k + a] = sample.velocity[a];
    });
    Appended data;
    const std::string arrays = data.add<double>("mass", count, 1, [&](std::size_t k, double* out) {
        *out = mass[k];
    }) + data.add<double>("velocity", count, 3, [&](std::size_t k, double* out) { std::copy_n(&velocity[3 * k], 3, out); });
    const std::string extent = fmt::format("0 {} 0 {} 0 {}", n[0] - 1, n[1] - 1, n[2] - 1);
    AtomicFile out(file);
    out.write(fmt::format(fmt::runtime(kHead), "ImageData", ""));
    out.write(fmt::format("<ImageData WholeExtent=\"{}\" Origin=\"{} {} {}\" Spacing=\"{} {} {}\">\n", extent, origin[0],
                          origin[1], origin[2], spacing[0], spacing[1], spacing[2]));
    out.write(fmt::format("<Piece Extent=\"{}\">\n<PointData>\n{}</PointData>\n</Piece>\n</ImageData>\n", extent, arrays));
    data.write([&](std::string_view bytes) { out.write(bytes); });
    out.commit();
}

template <int D>
void write_contacts(const std::filesystem::path& file, const Model<D>& model, const State<D>& s)
{
    std::vector<const ContactPoint<D>*> q;
    for (const ContactPoint<D>& point : s.contacts.points)
        if (point.p > 0 || point.is_tied) q.push_back(&point);
    const std::size_t n   = q.size();
    const double per_time = s.contacts.dt > 0 ? 1 / s.contacts.dt : 0.0;
    Appended data;
    auto vector = [&](const char* name, auto value) {
        return data.add<double>(name, n, 3, [&q, value](std::size_t k, double* out) { put_point(Vec<D>(value(*q[k])), out); });
    };
    auto number = [&](const char* name, auto value) {
        return data.add<double>(name, n, 1, [&q, value](std::size_t k, double* out) { *out = value(*q[k]); });
    };
    auto integer = [&](const char* name, auto value) {
        return data.add<std::int32_t>(name, n, 1, [&q, value](std::size_t k, std::int32_t* out) { *out = value(*q[k]); });
    };
    const std::string arrays =
        number("pressure", [=](const auto& p) { return per_time * p.p; }) +
        vector("traction", [=](const auto& p) { return per_time * (p.p * p.normal + p.t); }) +
        number("area", [](const auto& p) { return p.area; }) + number("gap", [](const auto& p) { return p.gap; }) +
        vector("slip", [](const auto& p) { return p.slip; }) + vector("normal", [](const auto& p) { return p.normal; }) +
        integer("contact", [](const auto& p) { return p.key.pair; }) + integer("body", [&](const auto& p) {
            const ContactPair<D>& pair = model.contacts[p.key.pair];
            return pair.obstacle < 0 ? model.surfaces[pair.surface[p.key.side]].body : pair.body;
        });
    const std::string points = vector("Points", [&](const auto& p) { return s.lattice.inside_period(p.x); });
    const std::string cells  = data.add<std::int32_t>("connectivity", n, 1, [](std::size_t k, std::int32_t* out) {
        *out = static_cast<std::int32_t>(k);
    }) + data.add<std::int32_t>("offsets", n, 1, [](std::size_t k, std::int32_t* out) {
        *out = static_cast<std::int32_t>(k + 1);
    }) + data.add<std::uint8_t>("types", n, 1, [](std::size_t, std::uint8_t* out) { *out = 1; });
    AtomicFile out(file);
    out.write(fmt::format(fmt::runtime(kHead), "UnstructuredGrid", ""));
    out.write(
        fmt::format("<UnstructuredGrid>\n<Piece NumberOfPoints=\"{0}\" NumberOfCells=\"{0}\">\n<PointData>\n{1}</PointData>\n"
                    "<Points>\n{2}</Points>\n<Cells>\n{3}</Cells>\n</Piece>\n</UnstructuredGrid>\n",
                    n, arrays, points, cells));
    data.write([&](std::string_view bytes) { out.write(bytes); });
    out.commit();
}

void write_pvd(const std::filesystem::path& file, const std::vector<Frame>& frames)
{
    AtomicFile out(file);
    out.write(fmt::format(fmt::runtime(kHead), "Collection", ""));
    out.write("<Collection>\n");
    for (const Frame& f : frames) out.write(fmt::format("<DataSet timestep=\"{}\" part=\"0\" file=\"{}\"/>\n", f.t, f.file));
    out.write("</Collection>\n</VTKFile>\n");
    out.commit();
}

template void write_particles(const std::filesystem::path&, const Model<1>&, const State<1>&, const FrameStyle&);
template std::uint64_t size_of_frame(const Model<1>&, const State<1>&, FrameStyle);
template void write_particles(const std::filesystem::path&, const Model<2>&, const State<2>&, const FrameStyle&);
template std::uint64_t size_of_frame(const Model<2>&, const State<2>&, FrameStyle);
template void write_particles(const std::filesystem::path&, const Model<3>&, const State<3>&, const FrameStyle&);
template std::uint64_t size_of_frame(const Model<3>&, const State<3>&, FrameStyle);
template void write_contacts(const std::filesystem::path&, const Model<1>&, const State<1>&);
template void write_contacts(const std::filesystem::path&, const Model<2>&, const State<2>&);
template void write_contacts(const std::filesystem::path&, const Model<3>&, const State<3>&);
template void write_grid(const std::filesystem::path&, const State<1>&);
template void write_grid(const std::filesystem::path&, const State<2>&);
template void write_grid(const std::filesystem::path&, const State<3>&);

}  // namespace ordo::io
