#include "io/particle_file.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
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

}  // namespace

template <int D>
std::vector<Seed<D>> read_particles(const BodyInput& body)
{
    std::ifstream in(body.file);
    if (!in) body.fail("file", "\"" + body.file + "\" cannot be opened; paths are relative to the case file");

    const std::string axes = "xyz";
    std::vector<std::string> known(1, "volume"), required(1, "volume"), edges;
    for (int a = 0; a < D; ++a) required.push_back(axes.substr(a, 1));
    for (int d = 0; d < D; ++d)
        for (int a = 0; a < D; ++a) edges.push_back(fmt::format("r{}{}", d + 1, axes[a]));
    known.insert(known.end(), required.begin() + 1, required.end());
    known.insert(known.end(), edges.begin(), edges.end());

    std::string line;
    int number = 0;
    std::vector<std::string> header;
    std::vector<Seed<D>> seeds;
    while (std::getline(in, line)) {
        ++number;
        if (number == 1 && line.starts_with("\xef\xbb\xbf")) line.erase(0, 3);  // the mark of UTF-8 that some programs write
        if (is_blank_or_comment(line)) continue;
        const std::vector<Cell> cells = split(line);
        if (header.empty()) {
            for (const Cell& c : cells) {
                if (std::find(known.begin(), known.end(), c.text) == known.end())
                    fail({body.file, number, c.column}, "header",
                         "there is no column \"" + c.text + "\". " + suggestion(c.text, known));
                if (std::find(header.begin(), header.end(), c.text) != header.end())
                    fail({body.file, number, c.column}, "header", "the column \"" + c.text + "\" stands twice");
                header.push_back(c.text);
            }
            for (const std::string& r : required)
                if (std::find(header.begin(), header.end(), r) == header.end())
                    fail({body.file, number, 1}, "header",
                         fmt::format("the column \"{}\" is missing; there must be {}", r, fmt::join(required, ", ")));
            const auto given = std::count_if(edges.begin(), edges.end(), [&](const auto& e) {
                return std::find(header.begin(), header.end(), e) != header.end();
            });
            if (given != 0 && given != static_cast<std::ptrdiff_t>(edges.size()))
                fail({body.file, number, 1}, "header",
                     fmt::format("half-edge vectors need all of {}, or none", fmt::join(edges, ", ")));
            continue;
        }
        if (cells.size() != header.size())
            fail({body.file, number, 1}, "particle", fmt::format("has {} values, the header {}", cells.size(), header.size()));
        Seed<D> seed{};
        bool has_edges = false;
        for (std::size_t k = 0; k < cells.size(); ++k) {
            double value      = 0;
            const char* first = cells[k].text.data();
            const char* last  = first + cells[k].text.size();
            const auto result = std::from_chars(first, last, value);
            if (result.ec != std::errc() || result.ptr != last || !std::isfinite(value))
                fail({body.file, number, cells[k].column}, header[k], "must be a finite number (got \"" + cells[k].text + "\")");
            if (header[k] == "volume") {
                seed.volume = value;
                if (!(value > 0))
                    fail({body.file, number, cells[k].column}, "volume", fmt::format("must be positive (got {})", value));
            } else if (header[k].size() == 1) {
                seed.x[header[k][0] - 'x'] = value;
            } else {
                has_edges                                          = true;
                seed.edges(header[k][2] - 'x', header[k][1] - '1') = value;
            }
        }
        if (has_edges && !(det(seed.edges) > 0))
            fail({body.file, number, 1}, "r1x", "the half-edge vectors must be right-handed and span a volume");
        const double spanned = std::pow(2.0, D) * det(seed.edges);
        if (has_edges && std::fabs(spanned - seed.volume) > 0.01 * seed.volume)
            fail({body.file, number, 1}, "volume",
                 fmt::format("is {}, but the half-edge vectors span {:.6g}; they may differ by 1 %", seed.volume, spanned));
        if (!has_edges)
            for (int a = 0; a < D; ++a) seed.edges(a, a) = std::pow(seed.volume, 1.0 / D) / 2;
        seeds.push_back(seed);
    }
    if (seeds.empty())
        body.fail("file", "\"" + body.file + "\" holds no particle; it needs a header line such as " +
                              fmt::format("{}", fmt::join(required, ",")) + " and a line a particle");
    return seeds;
}

template std::vector<Seed<1>> read_particles(const BodyInput&);
template std::vector<Seed<2>> read_particles(const BodyInput&);
template std::vector<Seed<3>> read_particles(const BodyInput&);

}  // namespace ordo::io
