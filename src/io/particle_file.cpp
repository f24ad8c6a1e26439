#include "io/particle_file.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>

namespace ordo::io {

namespace {

struct Cell {
    std::string text;
    int column;
};

std::vector<Cell> split(const std::string& line)
{
    std::vector<Cell> cells;
    std::size_t begin = 0;
    for (;;) {
        const std::size_t end = std::min(line.find(',', begin), line.size());
        std::size_t first = begin, last = end;
        auto blank = [&](std::size_t k) { return line[k] == ' ' || line[k] == '\t' || line[k] == '\r'; };
        while (first < last && blank(first)) ++first;
        while (last > first && blank(last - 1)) --last;
        cells.push_back({line.substr(first, last - first), static_cast<int>(first) + 1});
        if (end == line.size()) return cells;
        begin = end + 1;
    }
}

bool is_blank_or_comment(const std::string& line)
{
    const std::size_t first = line.find_first_not_of(" \t\r");
    return first == std::string::npos || line[first] == '#';
}

/// The columns that a file may have.
struct Columns {
    std::vector<std::string> required = {"volume"};  ///< and the coordinates
    std::vector<std::string> edges;                  ///< all or none of them
    std::vector<std::string> known;

    explicit Columns(int dim)
    {
        const std::string axes = "xyz";
        for (int a = 0; a < dim; ++a) required.push_back(axes.substr(a, 1));
        for (int d = 0; d < dim; ++d)
            for (int a = 0; a < dim; ++a) edges.push_back(fmt::format("r{}{}", d + 1, axes[a]));
        known = required;
        known.insert(known.end(), edges.begin(), edges.end());
    }
};

Place place_of(const Cell& cell, const Place& line) { return {line.file, line.line, cell.column}; }

bool has(const std::vector<std::string>& names, const std::string& name)
{
    return std::find(names.begin(), names.end(), name) != names.end();
}

/// The names of the columns. `line` is the place of the header.
std::vector<std::string> read_header(const std::vector<Cell>& cells, const Columns& columns, const Place& line)
{
    std::vector<std::string> header;
    for (const Cell& c : cells) {
        if (c.text.find(';') != std::string::npos || c.text.find('\t') != std::string::npos)
            fail(place_of(c, line), "header", "has semicolons or tabs; columns must be separated by commas");
        if (!has(columns.known, c.text))
            fail(place_of(c, line), "header", "there is no column \"" + c.text + "\". " + suggestion(c.text, columns.known));
        if (has(header, c.text)) fail(place_of(c, line), "header", "the column \"" + c.text + "\" is there twice");
        header.push_back(c.text);
    }
    for (const std::string& r : columns.required)
        if (!has(header, r))
            fail(line, "header",
                 fmt::format("the column \"{}\" is missing; there must be {}", r, fmt::join(columns.required, ", ")));
    const auto given = std::count_if(columns.edges.begin(), columns.edges.end(), [&](const auto& e) { return has(header, e); });
    if (given != 0 && given != static_cast<std::ptrdiff_t>(columns.edges.size()))
        fail(line, "header", fmt::format("half-edge vectors need all of {}, or none", fmt::join(columns.edges, ", ")));
    return header;
}

double read_number(const Cell& cell, const std::string& column, const Place& line)
{
    double value      = 0;
    const char* first = cell.text.data();
    const char* last  = first + cell.text.size();
    const auto result = std::from_chars(first, last, value);
    if (result.ec != std::errc() || result.ptr != last || !std::isfinite(value))
        fail(place_of(cell, line), column, "must be a finite number (got \"" + cell.text + "\")");
    return value;
}

/// Checks half-edge vectors if given, else sets those of a cube of the same volume.
template <int D>
void settle_edges(Seed<D>& seed, bool has_edges, const Place& line)
{
    if (has_edges && !(det(seed.edges) > 0)) fail(line, "r1x", "the half-edge vectors must be right-handed and span a volume");
    const double spanned = std::pow(2.0, D) * det(seed.edges);
    if (has_edges && std::fabs(spanned - seed.volume) > 0.01 * seed.volume)
        fail(line, "volume",
             fmt::format("is {}, but the half-edge vectors span {:.6g}; they may differ by 1 %", seed.volume, spanned));
    if (!has_edges)
        for (int a = 0; a < D; ++a) seed.edges(a, a) = std::pow(seed.volume, 1.0 / D) / 2;
}

/// The particle of a line.
template <int D>
Seed<D> read_particle(const std::vector<Cell>& cells, const std::vector<std::string>& header, const Place& line)
{
    if (cells.size() != header.size())
        fail(line, "particle", fmt::format("has {} values, the header {}", cells.size(), header.size()));
    Seed<D> seed{};
    bool has_edges = false;
    for (std::size_t k = 0; k < cells.size(); ++k) {
        const std::string& column = header[k];
        const double value        = read_number(cells[k], column, line);
        if (column == "volume") {
            seed.volume = value;
            if (!(value > 0)) fail(place_of(cells[k], line), "volume", fmt::format("must be positive (got {})", value));
        } else if (column.size() == 1) {
            seed.x[column[0] - 'x'] = value;
        } else {
            has_edges                                    = true;
            seed.edges(column[2] - 'x', column[1] - '1') = value;
        }
    }
    settle_edges(seed, has_edges, line);
    return seed;
}

/// Like std::getline, for files that may be devices without end or newline.
bool read_line(std::istream& in, std::string& line, const Place& place)
{
    constexpr std::size_t most = 1 << 16;
    line.clear();
    char c = 0;
    while (in.get(c) && c != '\n') {
        line += c;
        if (line.size() > most) fail(place, "line", fmt::format("has more than {} letters; that is no file of particles", most));
    }
    return static_cast<bool>(in) || !line.empty();
}

}  // namespace

template <int D>
std::vector<Seed<D>> read_particles(const BodyInput& body)
{
    if (std::error_code none; std::filesystem::is_directory(body.file, none))
        body.fail("file", "\"" + body.file + "\" is a directory; give a CSV file");
    std::ifstream in(body.file);
    if (!in) body.fail("file", "\"" + body.file + "\" cannot be opened; paths are relative to the case file");

    const Columns columns(D);
    std::vector<std::string> header;
    std::vector<Seed<D>> seeds;
    std::string line;
    for (int number = 1; read_line(in, line, {body.file, number, 1}); ++number) {
        if (number == 1 && line.starts_with("\xef\xbb\xbf")) line.erase(0, 3);  // the UTF-8 mark that some programs write
        if (is_blank_or_comment(line)) continue;
        const std::vector<Cell> cells = split(line);
        const Place place{body.file, number, 1};
        if (header.empty())
            header = read_header(cells, columns, place);
        else
            seeds.push_back(read_particle<D>(cells, header, place));
    }
    if (seeds.empty())
        body.fail("file", "\"" + body.file + "\" holds no particle; it needs a header line such as " +
                              fmt::format("{}", fmt::join(columns.required, ",")) + " and one line per particle");
    return seeds;
}

template std::vector<Seed<1>> read_particles(const BodyInput&);
template std::vector<Seed<2>> read_particles(const BodyInput&);
template std::vector<Seed<3>> read_particles(const BodyInput&);

}  // namespace ordo::io
