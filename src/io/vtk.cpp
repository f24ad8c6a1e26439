#include "io/vtk.hpp"

#include "base/error.hpp"
#include "io/file.hpp"
#include "method/grid_sample.hpp"
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
/// more than computing the numbers. Only compressed arrays are held, because the file begins with their sizes.
class Appended {
  public:
    explicit Appended(bool is_compressed = false) : is_compressed_(is_compressed) {}

    /// Adds an array of `count` tuples and returns its XML element. fill(k, out) writes the numbers of tuple k; it is called in
    /// parallel, until `write` returns.
    template <class T, class Fill>
    std::string add(std::string_view name, std::size_t count, int components, Fill fill)
    {
        const auto length = static_cast<std::size_t>(components);
        return add_runs<T>(
            name, count, components, [=](std::size_t k) { return k * length; }, std::move(fill));
    }
    /// The same for `count` runs of tuples; the numbers of run k begin at place begin(k).
    template <class T, class Begin, class Fill>
    std::string add_runs(std::string_view name, std::size_t count, int components, Begin begin, Fill fill)
    {
        const std::string type = std::is_same_v<T, double>  ? "Float64"
                                 : std::is_same_v<T, float> ? "Float32"
                                 : sizeof(T) == 1           ? "UInt8"
                                 : sizeof(T) == 4           ? "Int32"
                                                            : "Int64";
        const std::string tag =
            fmt::format(R"(<DataArray type="{}" Name="{}" NumberOfComponents="{}"{} format="appended" offset="{}"/>)", type, name,
                        components, component_names(components), size_);
        auto compute = [=](auto&& put) {  // put(bytes) for block after block
            std::vector<T> values;
            for (std::size_t first = 0, last = 0; first < count; first = last) {
                last                = std::min(count, first + kBlock);
                const std::size_t n = begin(last) - begin(first);
                if (values.size() < n) values.resize(n);
                parallel_for_each(static_cast<std::ptrdiff_t>(last - first), [&](std::ptrdiff_t i) {
                    const std::size_t k = first + static_cast<std::size_t>(i);
                    fill(k, values.data() + (begin(k) - begin(first)));
                });
                put(std::string_view(reinterpret_cast<const char*>(values.data()), n * sizeof(T)));
            }
        };
        if (is_compressed_) {
            Packed packed;
            compute([&](std::string_view bytes) { packed.add(bytes); });
            std::string all = packed.finish();
            size_ += all.size();
            writers_.push_back([all = std::move(all)](AtomicFile& file) { file.write(all); });
            return tag + "\n";
        }
        const std::uint64_t bytes = begin(count) * sizeof(T);
        size_ += sizeof(bytes) + bytes;
        writers_.push_back([=](AtomicFile& file) {
            file.write_binary(std::span<const std::uint64_t>(&bytes, 1));
            compute([&](std::string_view block) { file.write(block); });
        });
        return tag + "\n";
    }
    std::uint64_t size() const { return size_; }
    void write(AtomicFile& file) const
    {
        file.write("<AppendedData encoding=\"raw\">\n_");
        for (const auto& w : writers_) w(file);
        file.write("\n</AppendedData>\n</VTKFile>\n");
    }

  private:
    static constexpr std::size_t kBlock = 1 << 14;
    bool is_compressed_;
    std::uint64_t size_ = 0;
    std::vector<std::function<void(AtomicFile&)>> writers_;
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

/// A file of particles before it is written. Particles must not change until then.
template <int D>
class ParticleFile {
  public:
    ParticleFile(const Model<D>& model, const State<D>& s, const FrameStyle& style)
        : model_(model), p_(s.particles), style_(style), data_(style.is_compressed)
    {
        has_domain_ = !style.as_points && (!p_.edges.empty() || !p_.half.empty() || !p_.cell.empty());
        find_order();
        const std::string arrays = find_arrays(), points = find_points(), cells = find_cells();
        text_ =
            fmt::format(fmt::runtime(kHead), "UnstructuredGrid",
                        style.is_compressed ? R"( compressor="vtkZLibDataCompressor")" : "") +
            fmt::format("<UnstructuredGrid>\n<FieldData>\n<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" "
                        "format=\"ascii\">{}</DataArray>\n</FieldData>\n",
                        s.t) +
            fmt::format("<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n", first_point_.back(), cell_count_) +
            fmt::format("<{0}>\n{1}</{0}>\n<Points>\n{2}</Points>\n<Cells>\n{3}</Cells>\n</Piece>\n</UnstructuredGrid>\n",
                        has_domain_ ? "CellData" : "PointData", arrays, points, cells);
    }
    ParticleFile(const ParticleFile&) = delete;

    std::uint64_t size() const { return text_.size() + data_.size(); }
    void write(const std::filesystem::path& file) const
    {
        AtomicFile out(file);
        out.write(text_);
        data_.write(out);
        out.commit();
    }

  private:
    void find_order()
    {
        const int end = p_.count > 0 ? *std::max_element(p_.id.begin(), p_.id.end()) + 1 : 0;
        std::vector<int> all(static_cast<std::size_t>(end), -1);  // -1: taken out
        parallel_for_each(p_.count, [&](std::ptrdiff_t i) { all[p_.id[i]] = static_cast<int>(i); });
        for (std::size_t k = 0; k < all.size(); k += static_cast<std::size_t>(style_.every))
            if (all[k] >= 0) order_.push_back(all[k]);
        first_point_.reserve(order_.size() + 1);
        for (const int i : order_)
            first_point_.push_back(first_point_.back() + (has_domain_ ? static_cast<std::size_t>(corner_count(p_, i)) : 1));
    }

    std::string find_arrays()
    {
        std::string r = integers("id", p_.id) + integers("body", p_.body) + integers("material", p_.material);
        if (has_domain_) r += field("position");
        for (const std::string& name : style_.fields) r += field(name);
        return r;
    }
    std::string integers(std::string_view name, const Array<std::int32_t>& values)
    {
        return data_.add<std::int32_t>(name, order_.size(), 1,
                                       [&](std::size_t k, std::int32_t* out) { *out = values[order_[k]]; });
    }
    std::string field(const std::string& name)
    {
        const FieldReader<D> reader(name, model_, p_);
        return add_reals(
            name, reader.components(), [n = static_cast<std::size_t>(reader.components())](std::size_t k) { return k * n; },
            [this, reader](std::size_t k, double* out) { reader(order_[k], out); });
    }
    std::string find_points()
    {
        return add_reals(
            "Points", 3, [this](std::size_t k) { return 3 * first_point_[k]; },
            [this](std::size_t k, double* out) {
                if (has_domain_)
                    put_corners(model_, p_, order_[k], out);
                else
                    put_point(place_in_period(model_, p_, order_[k]), out);
            });
    }
    /// Real numbers of each particle, at most those of the corners of a hexahedron.
    template <class Begin, class Fill>
    std::string add_reals(const std::string& name, int components, Begin begin, Fill fill)
    {
        if (!style_.is_single) return data_.add_runs<double>(name, order_.size(), components, begin, fill);
        return data_.add_runs<float>(name, order_.size(), components, begin, [begin, fill](std::size_t k, float* out) {
            std::array<double, 24> numbers{};
            fill(k, numbers.data());
            std::copy_n(numbers.begin(), begin(k + 1) - begin(k), out);
        });
    }
    std::string find_cells()
    {
        cell_count_ = style_.as_points ? 1 : order_.size();
        return first_point_.back() < std::numeric_limits<std::int32_t>::max() ? find_cells_by<std::int32_t>()
                                                                              : find_cells_by<std::int64_t>();
    }
    template <class Number>
    std::string find_cells_by()
    {
        constexpr std::uint8_t poly_vertex = 2;
        const bool is_one                  = style_.as_points;
        return data_.add<Number>("connectivity", first_point_.back(), 1, [](std::size_t k, Number* out) {
            *out = static_cast<Number>(k);
        }) + data_.add<Number>("offsets", cell_count_, 1, [this, is_one](std::size_t k, Number* out) {
            *out = static_cast<Number>(is_one ? first_point_.back() : first_point_[k + 1]);
        }) + data_.add<std::uint8_t>("types", cell_count_, 1, [this, is_one](std::size_t k, std::uint8_t* out) {
            *out = is_one ? poly_vertex : cell_type(p_, order_[k]);
        });
    }

    const Model<D>& model_;
    const Particles<D>& p_;
    FrameStyle style_;
    bool has_domain_ = false;
    std::vector<int> order_;                      ///< of the particles written
    std::vector<std::size_t> first_point_ = {0};  ///< of each, and the end
    std::size_t cell_count_               = 0;
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
    data.write(out);
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
    data.write(out);
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
