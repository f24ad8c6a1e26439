#include "app/path.hpp"

#include "material/branches.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>

namespace ordo::app {

namespace {

// ---- named paths ----------------------------------------------------------------------------------------------------------

constexpr const char* kNames[] = {"uniaxial", "simple-shear", "triaxial", "oedometer", "undrained"};

void prescribe_stress(Target& t, int first, int last, double stress)
{
    for (int a = first; a < last; ++a) {
        t.is_stress(a, a) = true;
        t.stress(a, a)    = stress;
    }
}

/// The row of a named path at strain e.
Target named_row(const NamedPath& path, int dim, double e)
{
    Target t;
    if (path.name == "simple-shear") {
        t.F(0, 1) = e;
        return t;
    }
    t.F(0, 0) = std::exp(e);
    if (path.name == "uniaxial") prescribe_stress(t, 1, dim, 0.0);
    if (path.name == "triaxial") prescribe_stress(t, 1, dim, -*path.confine);
    if (path.name == "undrained")
        for (int a = 1; a < dim; ++a) t.F(a, a) = std::exp(-e / (dim - 1));
    return t;
}

// ---- files ----------------------------------------------------------------------------------------------------------------

struct Cell {
    std::string text;
    io::Place place;
};

std::vector<Cell> split(const std::string& line, const io::Place& place)
{
    std::vector<Cell> cells;
    for (std::size_t begin = 0;;) {
        const std::size_t end = std::min(line.find(',', begin), line.size());
        std::size_t first = begin, last = end;
        auto is_blank = [&](std::size_t k) { return line[k] == ' ' || line[k] == '\t' || line[k] == '\r'; };
        while (first < last && is_blank(first)) ++first;
        while (last > first && is_blank(last - 1)) --last;
        cells.push_back({line.substr(first, last - first), {place.file, place.line, static_cast<int>(first) + 1}});
        if (end == line.size()) return cells;
        begin = end + 1;
    }
}

/// A column: time, or component (i, j) of F or of the stress.
struct Column {
    bool is_time = false, is_stress = false;
    int i = 0, j = 0;
};

constexpr const char* kColumns = "time,F11,F12,F13,F21,F22,F23,F31,F32,F33; S22 instead of F22 prescribes the Cauchy stress";

Column column_of(const Cell& cell)
{
    const std::string& t = cell.text;
    if (t == "time") return {.is_time = true};
    auto is_axis = [](char c) { return c >= '1' && c <= '3'; };
    if (t.size() != 3 || (t[0] != 'F' && t[0] != 'S') || !is_axis(t[1]) || !is_axis(t[2]))
        io::fail(cell.place, "header", fmt::format("there is no column \"{}\"; the columns are {}", t, kColumns));
    return {.is_stress = t[0] == 'S', .i = t[1] - '1', .j = t[2] - '1'};
}

std::vector<Column> read_header(const std::vector<Cell>& cells, const io::Place& line)
{
    std::vector<Column> columns;
    Mat<3, int> count{};
    int times = 0;
    for (const Cell& c : cells) {
        columns.push_back(column_of(c));
        const Column& now = columns.back();
        int& seen         = now.is_time ? times : count(now.i, now.j);
        if (++seen > 1) io::fail(c.place, "header", "there is another column for the same component; remove one");
        if (now.is_stress && now.i > now.j)
            io::fail(c.place, "header", fmt::format("the stress is symmetric: give S{}{}", now.j + 1, now.i + 1));
    }
    if (times == 0) io::fail(line, "header", fmt::format("the column time is missing; the columns are {}", kColumns));
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            if (count(i, j) == 0)
                io::fail(line, "header", fmt::format("the column F{}{} is missing; the columns are {}", i + 1, j + 1, kColumns));
    return columns;
}

double read_number(const Cell& cell)
{
    double value      = 0;
    const char* first = cell.text.data();
    const char* last  = first + cell.text.size();
    const auto result = std::from_chars(first, last, value);
    if (result.ec != std::errc() || result.ptr != last || !std::isfinite(value))
        io::fail(cell.place, "value", "must be a finite number (got \"" + cell.text + "\")");
    return value;
}

/// Throws if a row has a component that the problem does not have.
void require_components(const Target& t, const Column& c, const Cell& cell, int dim)
{
    if (c.is_time || (c.i < dim && c.j < dim)) return;
    if (c.is_stress)
        io::fail(cell.place, fmt::format("S{}{}", c.i + 1, c.j + 1), fmt::format("cannot be prescribed in {}D", dim));
    if (t.F(c.i, c.j) != (c.i == c.j ? 1.0 : 0.0))
        io::fail(cell.place, fmt::format("F{}{}", c.i + 1, c.j + 1),
                 fmt::format("must be {} in {}D (got {}); use --dim 3", c.i == c.j ? 1 : 0, dim, t.F(c.i, c.j)));
}

Target read_row(const std::vector<Cell>& cells, const std::vector<Column>& columns, int dim, const io::Place& place)
{
    if (cells.size() != columns.size())
        io::fail(place, "row", fmt::format("has {} values, the header {}", cells.size(), columns.size()));
    Target t;
    t.place      = place;
    bool has_all = true;  // components of F
    for (std::size_t k = 0; k < cells.size(); ++k) {
        const Column& c    = columns[k];
        const double value = read_number(cells[k]);
        if (c.is_time) t.time = value;
        if (c.is_stress) t.stress(c.i, c.j) = value;
        if (!c.is_time && !c.is_stress) t.F(c.i, c.j) = value;
        if (c.is_stress) t.is_stress(c.i, c.j) = true;
        has_all = has_all && !c.is_stress;
        require_components(t, c, cells[k], dim);
    }
    if (has_all && !(det(t.F) > 0)) io::fail(place, "row", fmt::format("det F must be positive (got {})", det(t.F)));
    return t;
}

void require_sequence(const std::vector<Target>& path)
{
    Target start = path.front();
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            if (!start.is_stress(i, j) && start.F(i, j) != (i == j ? 1.0 : 0.0))
                io::fail(start.place, fmt::format("F{}{}", i + 1, j + 1), "the first row is the start and must be F = I");
    for (std::size_t k = 1; k < path.size(); ++k)
        if (!(path[k].time >= path[k - 1].time))
            io::fail(path[k].place, "time", fmt::format("must not fall (got {} after {})", path[k].time, path[k - 1].time));
}

// ---- steps ----------------------------------------------------------------------------------------------------------------

template <int D>
struct PointState {
    Mat<D> F = Mat<D>::identity();
    Stress<D> sigma{};
    std::vector<double> history;
    double time = 0.0;
    int parts   = 1;
};

template <int D>
Mat<3> embedded(const Mat<D>& F)
{
    Mat<3> r = Mat<3>::identity();
    for (int a = 0; a < D; ++a)
        for (int b = 0; b < D; ++b) r(a, b) = F(a, b);
    return r;
}

template <int D>
Mat<D> plane_of(const Mat<3>& F)
{
    Mat<D> r{};
    for (int a = 0; a < D; ++a)
        for (int b = 0; b < D; ++b) r(a, b) = F(a, b);
    return r;
}

/// Steps a point of one material.
template <int D>
class Point {
  public:
    explicit Point(const Material& material) : material_(material), columns_(history_of(material, D)) {}

    PointState<D> start() const
    {
        PointState<D> s;
        s.history.resize(columns_.size());
        start_history(material_, s.F, s.history.data());
        s.sigma = initial_stress(material_, s.F);
        return s;
    }
    /// One step from s to F; false if it was not solved.
    bool step(PointState<D>& s, const Mat<D>& F, double dt) const
    {
        double fault = 0.0;
        s.sigma      = update_stress(material_, {F, (F - s.F) * inverse(s.F), dt}, s.sigma, s.history.data(), fault);
        s.F          = F;
        s.time += dt;
        double sum = 0.0;
        for (const double c : s.sigma.c) sum += c;
        return !(fault > 0) && det(F) > 0 && std::isfinite(sum);
    }
    /// The same in as few equal parts, a power of two, as are solved; nothing if none is.
    std::optional<PointState<D>> advanced(const PointState<D>& from, const Mat<D>& F, double dt) const
    {
        constexpr int most = 1024;
        for (int parts = 1; parts <= most; parts *= 2) {
            PointState<D> s = from;
            bool is_good    = true;
            for (int k = 1; k <= parts && is_good; ++k)
                is_good = step(s, k == parts ? F : from.F + (F - from.F) * (static_cast<double>(k) / parts), dt / parts);
            s.parts = parts;
            if (is_good) return s;
        }
        return std::nullopt;
    }
    PointRow row(const PointState<D>& s) const
    {
        PointRow r{.time = s.time, .F = embedded(s.F), .cauchy = full(s.sigma), .history = s.history, .parts = s.parts};
        r.stored = stored_energy(material_, s.F, s.sigma, 1.0, det(s.F), s.history.data());
        for (std::size_t k = 0; k < s.history.size(); ++k)
            if (columns_[k].name == "dissipated") r.dissipated = s.history[k];
        return r;
    }
    double modulus() const { return material_.p_wave_modulus(); }
    double shear() const { return material_.mu + material_.branches.total_shear(); }

  private:
    const Material& material_;
    std::vector<HistoryColumn> columns_;
};

/// The components of F that a row does not prescribe.
template <int D>
std::vector<std::pair<int, int>> unknowns_of(const Target& t)
{
    std::vector<std::pair<int, int>> r;
    for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j)
            if (t.is_stress(i, j)) r.emplace_back(i, j);
    return r;
}

/// Solves A x = b by elimination with pivots; false if A is singular.
bool solve(std::vector<std::vector<double>> A, std::vector<double>& b)
{
    const std::size_t n = b.size();
    for (std::size_t k = 0; k < n; ++k) {
        std::size_t pivot = k;
        for (std::size_t i = k; i < n; ++i)
            if (std::fabs(A[i][k]) > std::fabs(A[pivot][k])) pivot = i;
        if (!(std::fabs(A[pivot][k]) > 0)) return false;
        std::swap(A[k], A[pivot]);
        std::swap(b[k], b[pivot]);
        for (std::size_t i = k + 1; i < n; ++i) {
            const double f = A[i][k] / A[k][k];
            for (std::size_t j = k; j < n; ++j) A[i][j] -= f * A[k][j];
            b[i] -= f * b[k];
        }
    }
    for (std::size_t k = n; k-- > 0;) {
        for (std::size_t j = k + 1; j < n; ++j) b[k] -= A[k][j] * b[j];
        b[k] /= A[k][k];
    }
    return true;
}

/// The smallest x of A x = b in the sense of least squares: (A^T A + 1e-12 |A|^2 I) x = A^T b. Plastic flow leaves directions
/// without stiffness. Zero if A is.
std::vector<double> least_change(const std::vector<std::vector<double>>& A, const std::vector<double>& b)
{
    const std::size_t n = b.size();
    std::vector<std::vector<double>> normal(n, std::vector<double>(n));
    std::vector<double> x(n);
    double square = 0.0;
    for (std::size_t i = 0; i < n; ++i)
        for (std::size_t j = 0; j < n; ++j) {
            square += A[i][j] * A[i][j];
            x[j] += A[i][j] * b[i];
            for (std::size_t k = 0; k < n; ++k) normal[j][k] += A[i][j] * A[i][k];
        }
    for (std::size_t i = 0; i < n; ++i) normal[i][i] += 1e-12 * square;
    return solve(normal, x) ? x : std::vector<double>(n);
}

/// One row with mixed control: Newton's method on the free components of F, with differences for the derivatives.
template <int D>
class MixedStep {
  public:
    MixedStep(const Point<D>& point, const PointState<D>& from, const Target& target, const Mat<D>& base)
        : point_(point),
          from_(from),
          target_(target),
          dt_(target.time - from.time),
          unknowns_(unknowns_of<D>(target)),
          base_(base)
    {}

    std::optional<PointState<D>> solve()
    {
        Mat<D> F = plane_of<D>(target_.F) * base_;
        for (const auto& [i, j] : unknowns_) F(i, j) = from_.F(i, j);
        for (int k = 0; k < kMost; ++k) {
            auto now = point_.advanced(from_, F, dt_);
            if (!now) return std::nullopt;
            std::vector<double> r = residual(*now);
            if (size(r) < kTolerance) return now;
            if (!improve(F, r)) return size(r) < kEnough ? now : std::nullopt;
        }
        return std::nullopt;
    }

  private:
    static constexpr int kMost         = 100;
    static constexpr double kTolerance = 1e-12, kEnough = 1e-9;  // of the P-wave modulus

    std::vector<double> residual(const PointState<D>& s) const
    {
        std::vector<double> r;
        for (const auto& [i, j] : unknowns_) r.push_back((target_.stress(i, j) - s.sigma(i, j)) / point_.modulus());
        return r;
    }
    static double size(const std::vector<double>& r)
    {
        double largest = 0.0;
        for (const double one : r) largest = std::max(largest, std::fabs(one));
        return largest;
    }
    using Slope = std::vector<std::vector<double>>;

    /// A step of Newton's method, halved until the residual falls; false if it does not. At corners of yield surfaces and where
    /// stress has just vanished the slope depends on the side: differences to either side, their mean, and the elastic slope.
    bool improve(Mat<D>& F, const std::vector<double>& r) const
    {
        const auto ahead = difference(F, r, 1e-7);
        if (ahead && descend(F, r, *ahead)) return true;
        const auto behind = difference(F, r, -1e-7);
        if (behind && descend(F, r, *behind)) return true;
        if (ahead && behind) {
            Slope mean = *ahead;
            for (std::size_t i = 0; i < mean.size(); ++i)
                for (std::size_t k = 0; k < mean.size(); ++k) mean[i][k] = 0.5 * (mean[i][k] + (*behind)[i][k]);
            if (descend(F, r, mean)) return true;
        }
        return descend(F, r, elastic_slope());
    }
    /// Derivatives of the stress over the unknowns by differences of h; nothing if a step is not solved.
    std::optional<Slope> difference(const Mat<D>& F, const std::vector<double>& r, double h) const
    {
        const std::size_t n = unknowns_.size();
        Slope slope(n, std::vector<double>(n));
        for (std::size_t k = 0; k < n; ++k) {
            Mat<D> moved = F;
            moved(unknowns_[k].first, unknowns_[k].second) += h;
            const auto s = point_.advanced(from_, moved, dt_);
            if (!s) return std::nullopt;
            const std::vector<double> other = residual(*s);
            for (std::size_t i = 0; i < n; ++i) slope[i][k] = (r[i] - other[i]) / h;
        }
        return slope;
    }
    /// That of an isotropic material at rest.
    Slope elastic_slope() const
    {
        const std::size_t n = unknowns_.size();
        const double shear  = point_.shear() / point_.modulus();
        Slope slope(n, std::vector<double>(n));
        for (std::size_t i = 0; i < n; ++i)
            for (std::size_t k = 0; k < n; ++k) {
                const bool are_normal = unknowns_[i].first == unknowns_[i].second && unknowns_[k].first == unknowns_[k].second;
                slope[i][k]           = i == k ? (are_normal ? 1.0 : shear) : are_normal ? 1 - 2 * shear : 0.0;
            }
        return slope;
    }
    bool descend(Mat<D>& F, const std::vector<double>& r, const Slope& slope) const
    {
        const std::size_t n        = unknowns_.size();
        std::vector<double> change = least_change(slope, r);
        for (double part = 1.0; part > 1e-6; part /= 2) {
            Mat<D> next = F;
            for (std::size_t k = 0; k < n; ++k) next(unknowns_[k].first, unknowns_[k].second) += part * change[k];
            if (!(det(next) > 0)) continue;
            const auto s = point_.advanced(from_, next, dt_);
            if (!s || !(size(residual(*s)) < size(r))) continue;
            F = next;
            return true;
        }
        return false;
    }

    const Point<D>& point_;
    const PointState<D>& from_;
    const Target& target_;
    double dt_;
    std::vector<std::pair<int, int>> unknowns_;
    Mat<D> base_;
};

std::string row_text(const Target& t, std::size_t k)
{
    return t.place.file.empty() ? fmt::format("row {} of the path", k) : t.place.text();
}

template <int D>
std::vector<PointRow> follow(const Material& material, const std::vector<Target>& path)
{
    const Point<D> point(material);
    PointState<D> s = point.start();
    s.time          = path.front().time;
    Mat<D> base     = Mat<D>::identity();
    std::vector<PointRow> rows{point.row(s)};
    for (std::size_t k = 1; k < path.size(); ++k) {
        const Target& t     = path[k];
        const bool is_mixed = !unknowns_of<D>(t).empty();
        const auto next =
            is_mixed ? MixedStep<D>(point, s, t, base).solve() : point.advanced(s, plane_of<D>(t.F) * base, t.time - s.time);
        if (!next)
            throw NumericalError(fmt::format("{}, t = {:.6g} s: {}; take smaller steps", row_text(t, k), t.time,
                                             is_mixed ? "no deformation gives the prescribed stress"
                                                      : "the equations of the law were not solved, even in 1024 parts"));
        s      = *next;
        s.time = t.time;
        rows.push_back(point.row(s));
        if (t.is_base) base = s.F;
    }
    return rows;
}

}  // namespace

const std::vector<std::string>& path_names()
{
    static const std::vector<std::string> names(std::begin(kNames), std::end(kNames));
    return names;
}

namespace {

/// Throws if the numbers of a named path make no path.
void require_numbers(const NamedPath& path)
{
    const bool is_shear = path.name == "simple-shear";
    const double most   = is_shear ? 1000.0 : 10.0;
    if (path.strain && !(std::fabs(*path.strain) <= most))
        throw InputError(fmt::format("--strain: must be from -{0} to {0}, it is {1} (got {2})", most,
                                     is_shear ? "a shear" : "a logarithmic strain", *path.strain));
    if (!(path.rate >= 1e-100 && path.rate <= 1e100))
        throw InputError(fmt::format("--rate: must be a positive number from 1e-100 to 1e100 (got {})", path.rate));
    if (path.confine && !(*path.confine <= 1e100))
        throw InputError(fmt::format("--confine: must be at most 1e100 Pa (got {})", *path.confine));
}

}  // namespace

std::vector<Target> named_path(const NamedPath& given, const Material& material, int dim)
{
    NamedPath path         = given;
    const bool is_confined = path.name == "triaxial" || path.name == "undrained";
    if (dim == 1 && path.name != "uniaxial" && path.name != "oedometer")
        throw InputError(fmt::format("--path {}: does not exist in 1D; there is uniaxial and oedometer", path.name));
    if (is_confined && !(path.confine && *path.confine > 0))
        throw InputError(fmt::format("--path {}: needs --confine, a positive pressure in Pa", path.name));
    if (!is_confined && path.confine)
        throw InputError(fmt::format("--confine: has no meaning for --path {}; remove it", path.name));
    require_numbers(path);
    if (!path.strain) path.strain = path.name == "simple-shear" ? 1.0 : path.name == "uniaxial" ? 0.1 : -0.1;
    std::vector<Target> rows(1);
    if (is_confined) {
        constexpr int parts = 10;  // of the consolidation
        const double start  = material.law->in_2d.initial_stress(material, Mat<2>::identity())(0, 0);
        for (int k = 1; k <= parts; ++k) {
            Target& t = rows.emplace_back();
            prescribe_stress(t, 0, dim, start + (-*path.confine - start) * k / parts);
            t.is_base = k == parts;
        }
    }
    for (int k = 1; k <= path.steps; ++k) {
        rows.push_back(named_row(path, dim, *path.strain * k / path.steps));
        rows.back().time = std::fabs(*path.strain) / path.rate * k / path.steps;
    }
    return rows;
}

std::vector<Target> read_path(const std::string& file, int dim)
{
    const io::Place whole{file, 0, 0};
    if (std::error_code none; std::filesystem::is_directory(file, none))
        io::fail(whole, "--path", "is a directory; give a CSV file");
    std::ifstream in(file);
    if (!in)
        io::fail(whole, "--path", fmt::format("cannot be opened; give a CSV file, or one of {}", fmt::join(path_names(), ", ")));
    constexpr std::size_t most_rows = 1'000'000, most_letters = 10'000;
    std::vector<Column> columns;
    std::vector<Target> path;
    std::string line;
    for (int number = 1; std::getline(in, line); ++number) {
        const io::Place place{file, number, 1};
        if (number == 1 && line.starts_with("\xef\xbb\xbf")) line.erase(0, 3);  // the UTF-8 mark that some programs write
        const std::size_t first = line.find_first_not_of(" \t\r");
        if (first == std::string::npos || line[first] == '#') continue;
        if (line.size() > most_letters || path.size() > most_rows) io::fail(place, "row", "is too long; that is no path");
        const std::vector<Cell> cells = split(line, place);
        if (columns.empty())
            columns = read_header(cells, place);
        else
            path.push_back(read_row(cells, columns, dim, place));
    }
    if (path.size() < 2)
        io::fail(whole, "--path",
                 fmt::format("has {} rows; it needs a header, {}, the start and at least one step", path.size(), kColumns));
    require_sequence(path);
    return path;
}

std::vector<PointRow> follow_path(const Material& material, const std::vector<Target>& path, int dim)
{
    switch (dim) {
    case 1: return follow<1>(material, path);
    case 2: return follow<2>(material, path);
    default: return follow<3>(material, path);
    }
}

}  // namespace ordo::app
