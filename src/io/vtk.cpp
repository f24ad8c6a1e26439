#include "io/vtk.hpp"

#include "base/error.hpp"
#include "io/file.hpp"
#include "method/grid_sample.hpp"
#include "sim/output_fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <span>
#include <type_traits>
#include <utility>

namespace ordo::io {

namespace {

static_assert(std::endian::native == std::endian::little, "the VTK writers need a little-endian machine");

/// The appended section of a VTK XML file: arrays of numbers, each after its size in bytes. Values are computed while they are
/// written, a block at a time: arrays of a whole frame would need as much memory as the particles, and touching new pages costs
/// more than computing the numbers.
class Appended {
  public:
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
        const std::string type = std::is_same_v<T, double> ? "Float64"
                                 : sizeof(T) == 1          ? "UInt8"
                                 : sizeof(T) == 4          ? "Int32"
                                                           : "Int64";
        const std::string tag =
            fmt::format(R"(<DataArray type="{}" Name="{}" NumberOfComponents="{}" format="appended" offset="{}"/>)", type, name,
                        components, size_);
        const std::uint64_t bytes = begin(count) * sizeof(T);
        size_ += sizeof(bytes) + bytes;
        writers_.push_back([=](AtomicFile& file) {
            file.write_binary(std::span<const std::uint64_t>(&bytes, 1));
            std::vector<T> values;
            for (std::size_t first = 0, last = 0; first < count; first = last) {
                last                = std::min(count, first + kBlock);
                const std::size_t n = begin(last) - begin(first);
                if (values.size() < n) values.resize(n);
                parallel_for_each(static_cast<std::ptrdiff_t>(last - first), [&](std::ptrdiff_t i) {
                    const std::size_t k = first + static_cast<std::size_t>(i);
                    fill(k, values.data() + (begin(k) - begin(first)));
                });
                file.write_binary(std::span<const T>(values.data(), n));
            }
        });
        return tag + "\n";
    }
    void write(AtomicFile& file) const
    {
        file.write("<AppendedData encoding=\"raw\">\n_");
        for (const auto& w : writers_) w(file);
        file.write("\n</AppendedData>\n</VTKFile>\n");
    }

  private:
    static constexpr std::size_t kBlock = 1 << 14;
    std::uint64_t size_                 = 0;
    std::vector<std::function<void(AtomicFile&)>> writers_;
};

constexpr std::string_view kHead = R"(<?xml version="1.0"?>
<VTKFile type="{}" version="1.0" byte_order="LittleEndian" header_type="UInt64">
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

/// The corners of a particle's domain in VTK's order; for a point its position.
template <int D>
void put_corners(const Model<D>& model, const Particles<D>& p, int i, double* out)
{
    const Vec<D> place = place_in_period(model, p, i);
    auto put           = [&](const Vec<D>& x) {
        const Vec<3> at = padded(x);
        for (int a = 0; a < 3; ++a) *out++ = at[a];
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

}  // namespace

template <int D>
void write_particles(const std::filesystem::path& file, const Model<D>& model, State<D>& s,
                     const std::vector<std::string>& fields)
{
    const Particles<D>& p = s.particles;
    std::vector<int> order(static_cast<std::size_t>(p.count));
    parallel_for_each(p.count, [&](std::ptrdiff_t i) { order[p.id[i]] = static_cast<int>(i); });
    std::vector<std::size_t> first_point = {0};  // of each particle, and the end
    first_point.reserve(order.size() + 1);
    for (int i : order) first_point.push_back(first_point.back() + static_cast<std::size_t>(corner_count(p, i)));
    const std::size_t count = order.size(), point_count = first_point.back();
    const bool has_domain = !p.edges.empty() || !p.half.empty() || !p.cell.empty();

    Appended data;
    std::string arrays;
    auto integers = [&](std::string_view name, const Array<std::int32_t>& field) {
        arrays += data.add<std::int32_t>(name, count, 1, [&](std::size_t k, std::int32_t* out) { *out = field[order[k]]; });
    };
    integers("id", p.id);
    integers("body", p.body);
    integers("material", p.material);
    auto add_field = [&](const std::string& name) {
        const FieldReader<D> field(name, model, p);
        arrays += data.add<double>(name, count, field.components(),
                                   [&order, field](std::size_t k, double* out) { field(order[k], out); });
    };
    if (has_domain) add_field("position");
    for (const std::string& name : fields) add_field(name);
    const std::string point_array = data.add_runs<double>(
        "Points", count, 3, [&](std::size_t k) { return 3 * first_point[k]; },
        [&](std::size_t k, double* out) { put_corners(model, p, order[k], out); });
    auto counted = [](auto f) { return [f](std::size_t k, std::int64_t* out) { *out = static_cast<std::int64_t>(f(k)); }; };
    const std::string cell_arrays =
        data.add<std::int64_t>("connectivity", point_count, 1, counted([](std::size_t k) { return k; })) +
        data.add<std::int64_t>("offsets", count, 1, counted([&](std::size_t k) { return first_point[k + 1]; })) +
        data.add<std::uint8_t>("types", count, 1, [&](std::size_t k, std::uint8_t* out) { *out = cell_type(p, order[k]); });
    const std::string_view kind = has_domain ? "CellData" : "PointData";

    AtomicFile out(file);
    out.write(fmt::format(fmt::runtime(kHead), "UnstructuredGrid"));
    out.write(fmt::format("<UnstructuredGrid>\n<FieldData>\n<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" "
                          "format=\"ascii\">{}</DataArray>\n</FieldData>\n",
                          s.t));
    out.write(fmt::format("<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n", point_count, count));
    out.write(fmt::format("<{0}>\n{1}</{0}>\n<Points>\n{2}</Points>\n<Cells>\n{3}</Cells>\n</Piece>\n</UnstructuredGrid>\n", kind,
                          arrays, point_array, cell_arrays));
    data.write(out);
    out.commit();
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
        both_sides.for_each([&](const Index<D>& side) { is = is || s.field.tiles.is_active(node + side * last); });
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
    out.write(fmt::format(fmt::runtime(kHead), "ImageData"));
    out.write(fmt::format("<ImageData WholeExtent=\"{}\" Origin=\"{} {} {}\" Spacing=\"{} {} {}\">\n", extent, origin[0],
                          origin[1], origin[2], spacing[0], spacing[1], spacing[2]));
    out.write(fmt::format("<Piece Extent=\"{}\">\n<PointData>\n{}</PointData>\n</Piece>\n</ImageData>\n", extent, arrays));
    data.write(out);
    out.commit();
}

void write_pvd(const std::filesystem::path& file, const std::vector<Frame>& frames)
{
    AtomicFile out(file);
    out.write(fmt::format(fmt::runtime(kHead), "Collection"));
    out.write("<Collection>\n");
    for (const Frame& f : frames) out.write(fmt::format("<DataSet timestep=\"{}\" part=\"0\" file=\"{}\"/>\n", f.t, f.file));
    out.write("</Collection>\n</VTKFile>\n");
    out.commit();
}

template void write_particles(const std::filesystem::path&, const Model<1>&, State<1>&, const std::vector<std::string>&);
template void write_particles(const std::filesystem::path&, const Model<2>&, State<2>&, const std::vector<std::string>&);
template void write_particles(const std::filesystem::path&, const Model<3>&, State<3>&, const std::vector<std::string>&);
template void write_grid(const std::filesystem::path&, const State<1>&);
template void write_grid(const std::filesystem::path&, const State<2>&);
template void write_grid(const std::filesystem::path&, const State<3>&);

}  // namespace ordo::io
