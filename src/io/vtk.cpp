#include "io/vtk.hpp"

#include "base/error.hpp"
#include "io/file.hpp"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>

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

/// The corners of a particle's domain in VTK's order; none for points.
template <int D>
void corners_of(const Model<D>& model, const Particles<D>& p, int i, std::vector<double>& out)
{
    // VTK walks around a quad; bits of the corner number are signs along the edges.
    static constexpr int walk[8] = {0, 1, 3, 2, 4, 5, 7, 6};
    for (int c = 0; c < (1 << D); ++c) {
        Vec<D> x = place_in_period(model, p, i);
        for (int d = 0; d < D; ++d) {
            const double sign = walk[c] >> d & 1 ? 1.0 : -1.0;
            if (!p.edges.empty())
                x += sign * column(p.edges[i], d);
            else
                x[d] += sign * p.half[i][d];
        }
        const Vec<3> at = padded(x);
        out.insert(out.end(), {at[0], at[1], at[2]});
    }
}

}  // namespace

template <int D>
void write_particles(const std::filesystem::path& file, const Model<D>& model, State<D>& s,
                     const std::vector<std::string>& fields)
{
    const Particles<D>& p = s.particles;
    std::vector<int> order(static_cast<std::size_t>(p.count));
    for (int i = 0; i < p.count; ++i) order[p.id[i]] = i;

    const bool has_domain = !p.edges.empty() || !p.half.empty();
    const int per_cell    = has_domain ? 1 << D : 1;
    const int vtk_type    = !has_domain ? 1 : D == 1 ? 3 : D == 2 ? 9 : 12;  // vertex, line, quad, hexahedron

    std::vector<double> points;
    points.reserve(order.size() * static_cast<std::size_t>(3 * per_cell));
    for (int i : order) {
        if (has_domain) {
            corners_of(model, p, i, points);
        } else {
            const Vec<3> x = padded(place_in_period(model, p, i));
            points.insert(points.end(), {x[0], x[1], x[2]});
        }
    }
    std::vector<std::int64_t> connectivity(points.size() / 3), offsets(order.size());
    for (std::size_t k = 0; k < connectivity.size(); ++k) connectivity[k] = static_cast<std::int64_t>(k);
    for (std::size_t k = 0; k < offsets.size(); ++k) offsets[k] = static_cast<std::int64_t>(k + 1) * per_cell;

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
    const std::string cell_arrays =
        data.add("connectivity", std::move(connectivity), 1) + data.add("offsets", std::move(offsets), 1) +
        data.add("types", std::vector<std::uint8_t>(order.size(), static_cast<std::uint8_t>(vtk_type)), 1);
    const std::string_view kind = has_domain ? "CellData" : "PointData";

    AtomicFile out(file);
    out.write(fmt::format(fmt::runtime(kHead), "UnstructuredGrid"));
    out.write(fmt::format("<UnstructuredGrid>\n<FieldData>\n<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" "
                          "format=\"ascii\">{}</DataArray>\n</FieldData>\n",
                          s.t));
    out.write(fmt::format("<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n",
                          order.size() * static_cast<std::size_t>(per_cell), order.size()));
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
    for (const Index<D>& block : s.tiles.blocks())
        s.tiles.nodes_of(block).for_each([&](const Index<D>& at) {
            std::size_t k = 0;
            for (int a = D - 1; a >= 0; --a) {
                const int inside = at[a] - g.margin;
                if (inside < 0 || inside >= n[a]) return;
                k = k * static_cast<std::size_t>(n[a]) + static_cast<std::size_t>(inside);
            }
            const Lanes& node = s.nodes[g.offset(at)];
            mass[k]           = node[NodeLane::mass];
            for (int a = 0; a < D; ++a) velocity[3 * k + a] = node[NodeLane::velocity + a];
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
