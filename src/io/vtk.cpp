#include "io/vtk.hpp"

#include "base/error.hpp"
#include "io/file.hpp"
#include "method/diagnostics.hpp"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numeric>

namespace ordo::io {

namespace {

static_assert(std::endian::native == std::endian::little, "the VTK writers say LittleEndian");

/// The appended section of a VTK XML file: arrays of numbers, each behind its size in bytes.
class Appended {
  public:
    /// Adds an array and returns the attributes that place it in the XML.
    template <class T>
    std::string add(std::string_view name, std::vector<T> values, int components)
    {
        const std::string type = std::is_same_v<T, double> ? "Float64"
                                 : sizeof(T) == 1          ? "UInt8"
                                 : sizeof(T) == 4          ? "Int32"
                                                           : "Int64";
        const std::string tag =
            fmt::format(R"(<DataArray type="{}" Name="{}" NumberOfComponents="{}" format="appended" offset="{}"/>)", type, name,
                        components, size_);
        size_ += sizeof(std::uint64_t) + values.size() * sizeof(T);
        writers_.push_back([v = std::move(values)](AtomicFile& file) {
            const std::uint64_t bytes = v.size() * sizeof(T);
            file.write_binary(std::span<const std::uint64_t>(&bytes, 1));
            file.write_binary(std::span<const T>(v));
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
    std::uint64_t size_ = 0;
    std::vector<std::function<void(AtomicFile&)>> writers_;
};

constexpr std::string_view kHead = R"(<?xml version="1.0"?>
<VTKFile type="{}" version="1.0" byte_order="LittleEndian" header_type="UInt64">
)";

/// f(i, out) writes `components` numbers of particle i; particles come in the order given.
template <class F>
std::vector<double> tabulate(const std::vector<int>& order, int components, F&& f)
{
    std::vector<double> values(order.size() * static_cast<std::size_t>(components));
    parallel_for_each(static_cast<std::ptrdiff_t>(order.size()),
                      [&](std::ptrdiff_t k) { f(order[k], values.data() + k * components); });
    return values;
}

/// Stress with the normal components across a 1D or 2D problem.
template <int D>
Mat<3> full_stress(const Model<D>& model, const Particles<D>& p, int i)
{
    Mat<3> r{};
    const double lateral = D < 3 ? lateral_stress(model.materials[p.material[i]], p.F[i], p.sigma[i]) : 0.0;
    for (int a = 0; a < 3; ++a) r(a, a) = lateral;
    for (int a = 0; a < D; ++a)
        for (int b = 0; b < D; ++b) r(a, b) = p.sigma[i](a, b);
    return r;
}

template <int D>
std::string field_array(Appended& data, const std::string& name, const std::vector<int>& order, const Model<D>& model,
                        const Particles<D>& p)
{
    auto scalar = [&](auto&& f) { return data.add(name, tabulate(order, 1, [&](int i, double* out) { *out = f(i); }), 1); };
    auto vector = [&](auto&& f) {
        return data.add(name,
                        tabulate(order, 3,
                                 [&](int i, double* out) {
                                     const Vec<3> v = padded(f(i));
                                     for (int a = 0; a < 3; ++a) out[a] = v[a];
                                 }),
                        3);
    };
    auto tensor = [&](auto&& f) {
        return data.add(name,
                        tabulate(order, 9,
                                 [&](int i, double* out) {
                                     const Mat<3> m = f(i);
                                     for (int k = 0; k < 9; ++k) out[k] = m(k / 3, k % 3);
                                 }),
                        9);
    };
    if (name == "displacement") return vector([&](int i) { return displacement(model, p, i); });
    if (name == "position") return vector([&](int i) { return place_in_period(model, p, i); });
    if (name == "velocity") return vector([&](int i) { return p.v[i]; });
    if (name == "stress") return tensor([&](int i) { return full_stress(model, p, i); });
    if (name == "deformation_gradient")
        return tensor([&](int i) {
            Mat<3> F = Mat<3>::identity();
            for (int a = 0; a < D; ++a)
                for (int b = 0; b < D; ++b) F(a, b) = p.F[i](a, b);
            return F;
        });
    if (name == "density") return scalar([&](int i) { return p.m[i] / p.V[i]; });
    if (name == "mass") return scalar([&](int i) { return p.m[i]; });
    if (name == "volume") return scalar([&](int i) { return p.V[i]; });
    if (name == "pressure") return scalar([&](int i) { return -trace(full_stress(model, p, i)) / 3; });
    if (name == "von_mises")
        return scalar([&](int i) {
            Mat<3> s          = full_stress(model, p, i);
            const double mean = trace(s) / 3;
            for (int a = 0; a < 3; ++a) s(a, a) -= mean;
            return std::sqrt(1.5 * ddot(s, s));
        });
    if (name == "energy_density")
        return scalar(
            [&](int i) { return strain_energy(model.materials[p.material[i]], p.F[i], p.sigma[i], p.V0[i], p.V[i]) / p.V[i]; });
    throw std::logic_error("field_array: no field " + name);
}

/// Adds the corners of a particle's domain in VTK's order, of a point itself; returns VTK's type of the cell.
template <int D>
int add_corners(const Model<D>& model, const Particles<D>& p, int i, std::vector<double>& out)
{
    const Vec<D> place = place_in_period(model, p, i);
    auto add           = [&](const Vec<D>& x) {
        const Vec<3> at = padded(x);
        out.insert(out.end(), {at[0], at[1], at[2]});
    };
    constexpr int vertex = 1, line = 3, triangle = 5, quad = 9, tetrahedron = 10, hexahedron = 12;
    constexpr int of_dim[] = {line, quad, hexahedron}, of_simplex[] = {line, triangle, tetrahedron};
    // VTK walks around a quad; bits of the corner number are signs along the edges.
    static constexpr int walk[8] = {0, 1, 3, 2, 4, 5, 7, 6};
    if (!p.cell.empty()) {
        const CornerIds<D>& ids = p.cell[i];
        const bool is_simplex   = ids.is_simplex();
        for (int c = 0; c < ids.count(); ++c) add(place + (corner_place(model, p, i, ids[is_simplex ? c : walk[c]]) - p.x[i]));
        return is_simplex ? of_simplex[D - 1] : of_dim[D - 1];
    }
    if (p.edges.empty() && p.half.empty()) {
        add(place);
        return vertex;
    }
    for (int c = 0; c < (1 << D); ++c) {
        Vec<D> x = place;
        for (int d = 0; d < D; ++d) {
            const double sign = walk[c] >> d & 1 ? 1.0 : -1.0;
            if (!p.edges.empty())
                x += sign * column(p.edges[i], d);
            else
                x[d] += sign * p.half[i][d];
        }
        add(x);
    }
    return of_dim[D - 1];
}

}  // namespace

template <int D>
void write_particles(const std::filesystem::path& file, const Model<D>& model, State<D>& s,
                     const std::vector<std::string>& fields)
{
    const Particles<D>& p = s.particles;
    std::vector<int> order(static_cast<std::size_t>(p.count));
    for (int i = 0; i < p.count; ++i) order[p.id[i]] = i;

    const bool has_domain = !p.edges.empty() || !p.half.empty() || !p.cell.empty();
    std::vector<double> points;
    std::vector<std::int64_t> offsets;
    std::vector<std::uint8_t> types;
    points.reserve(order.size() * (has_domain ? 3u << D : 3u));
    for (int i : order) {
        types.push_back(static_cast<std::uint8_t>(add_corners(model, p, i, points)));
        offsets.push_back(static_cast<std::int64_t>(points.size() / 3));
    }
    std::vector<std::int64_t> connectivity(points.size() / 3);
    std::iota(connectivity.begin(), connectivity.end(), 0);
    const std::size_t point_count = connectivity.size();

    Appended data;
    std::string arrays;
    auto integers = [&](std::string_view name, auto&& f) {
        std::vector<std::int32_t> values;
        for (int i : order) values.push_back(f(i));
        arrays += data.add(name, std::move(values), 1);
    };
    integers("id", [&](int i) { return p.id[i]; });
    integers("body", [&](int i) { return p.body[i]; });
    integers("material", [&](int i) { return p.material[i]; });
    if (has_domain) arrays += field_array(data, "position", order, model, p);
    for (const std::string& name : fields) arrays += field_array(data, name, order, model, p);
    const std::string point_array = data.add("Points", std::move(points), 3);
    const std::string cell_arrays = data.add("connectivity", std::move(connectivity), 1) +
                                    data.add("offsets", std::move(offsets), 1) + data.add("types", std::move(types), 1);
    const std::string_view kind = has_domain ? "CellData" : "PointData";

    AtomicFile out(file);
    out.write(fmt::format(fmt::runtime(kHead), "UnstructuredGrid"));
    out.write(fmt::format("<UnstructuredGrid>\n<FieldData>\n<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" "
                          "format=\"ascii\">{}</DataArray>\n</FieldData>\n",
                          s.t));
    out.write(fmt::format("<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n", point_count, order.size()));
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
    // Points that the material touches: those of its blocks and, of splines, their neighbours.
    Index<D> last{};
    for (int a = 0; a < D; ++a) last[a] = n[a];
    IndexBox<D>{{}, last}.for_each([&](const Index<D>& at) {
        Vec<D> x{};
        Index<D> node{};
        std::size_t k = 0;
        for (int a = D - 1; a >= 0; --a) {
            x[a]    = g.origin[a] + at[a] * g.h[a];
            node[a] = at[a] + g.margin;
            k       = k * static_cast<std::size_t>(n[a]) + static_cast<std::size_t>(at[a]);
        }
        if (!s.tiles.is_active(node)) return;
        const GridSample<D> sample = sample_grid(s, x);
        mass[k]                    = sample.mass;
        for (int a = 0; a < D; ++a) velocity[3 * k + a] = sample.velocity[a];
    });
    Appended data;
    const std::string arrays = data.add("mass", std::move(mass), 1) + data.add("velocity", std::move(velocity), 3);
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
