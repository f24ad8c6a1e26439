#include "io/schema.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <numeric>

namespace ordo::io {

std::string one_line(std::string_view text)
{
    std::string line;
    for (char c : text)
        line += static_cast<unsigned char>(c) < 0x20 ? fmt::format("\\x{:02x}", static_cast<unsigned>(c)) : std::string(1, c);
    return line;
}

void fail(const Place& place, std::string_view key, std::string_view message)
{
    throw InputError(one_line(fmt::format("{}: {}: {}", place.text(), key, message)));
}

namespace {

std::size_t edit_distance(std::string_view a, std::string_view b)
{
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 0; i < a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0]               = i + 1;
        for (std::size_t j = 0; j < b.size(); ++j) {
            const std::size_t substitute = diagonal + (a[i] == b[j] ? 0 : 1);
            diagonal                     = row[j + 1];
            row[j + 1]                   = std::min({substitute, row[j] + 1, row[j + 1] + 1});
        }
    }
    return row[b.size()];
}

std::string describe(const toml::node& node)
{
    std::string kind = "a date or time";
    if (const auto s = node.value_exact<std::string>()) return "the string " + to_toml(*s);
    if (node.is_boolean()) kind = node.value_or(false) ? "true" : "false";
    if (node.is_integer()) kind = fmt::format("the integer {}", node.value_or(std::int64_t{0}));
    if (node.is_floating_point()) kind = fmt::format("the number {}", node.value_or(0.0));
    if (node.is_array()) kind = "a list";
    if (node.is_table()) kind = "a table";
    return kind;
}

}  // namespace

std::string nearest(std::string_view word, const std::vector<std::string>& candidates)
{
    // What others call it; each is taken only where it is a candidate.
    static const std::multimap<std::string, std::string, std::less<>> synonyms{{"sphere", "ball"},
                                                                               {"disk", "ball"},
                                                                               {"disc", "ball"},
                                                                               {"circle", "ball"},
                                                                               {"tube", "cylinder"},
                                                                               {"pipe", "cylinder"},
                                                                               {"annulus", "ring"},
                                                                               {"cube", "box"},
                                                                               {"block", "box"},
                                                                               {"rectangle", "box"},
                                                                               {"square", "box"},
                                                                               {"points", "particles"},
                                                                               {"linear", "hat"},
                                                                               {"tent", "hat"},
                                                                               {"quadratic", "bspline2"},
                                                                               {"cubic", "bspline3"},
                                                                               {"quartic", "bspline4"},
                                                                               {"quintic", "bspline5"},
                                                                               {"gimp", "ugimp"},
                                                                               {"cpdi", "cpdi1"},
                                                                               {"mlsmpm", "mls-mpm"},
                                                                               {"slip", "symmetry"},
                                                                               {"roller", "symmetry"},
                                                                               {"clamped", "fixed"},
                                                                               {"floor", "wall"},
                                                                               {"rigid", "wall"},
                                                                               {"dirichlet", "velocity"},
                                                                               {"neohookean", "neo-hookean"},
                                                                               {"hyperelastic", "neo-hookean"}};
    std::string lower(word);
    std::transform(lower.begin(), lower.end(), lower.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    auto is_candidate = [&](const std::string& c) {
        return std::find(candidates.begin(), candidates.end(), c) != candidates.end();
    };
    if (is_candidate(lower)) return lower;
    for (auto [it, end] = synonyms.equal_range(lower); it != end; ++it)
        if (is_candidate(it->second)) return it->second;
    std::string best;
    std::size_t least = word.size() / 3 + 2;
    for (const std::string& c : candidates) {
        const std::size_t d = edit_distance(word, c);
        if (d < least) {
            least = d;
            best  = c;
        }
    }
    return best;
}

std::string suggestion(std::string_view word, const std::vector<std::string>& candidates)
{
    const std::string near = nearest(word, candidates);
    std::string all;
    for (const std::string& c : candidates) all += (all.empty() ? "" : ", ") + c;
    return near.empty() ? "There is: " + all : fmt::format("Did you mean \"{}\"?", near);
}

Place place_of(const toml::node& node)
{
    const toml::source_region& source = node.source();
    if (source.begin.line == 0 || !source.path) return {"--set", 0, 0};
    return {*source.path, static_cast<int>(source.begin.line), static_cast<int>(source.begin.column)};
}

void ValueReader::check_range(double value) const
{
    if (!std::isfinite(value)) fail(place, path, fmt::format("must be a finite number (got {})", value));
    const bool low  = info.open_min ? !(value > info.min) : !(value >= info.min);
    const bool high = info.open_max ? !(value < info.max) : !(value <= info.max);
    if (!low && !high) return;
    std::string range;
    if (std::isfinite(info.min) && info.min == 0 && !std::isfinite(info.max))
        range = info.open_min ? "positive" : "zero or positive";
    else if (std::isfinite(info.min) && std::isfinite(info.max))
        range = fmt::format("{} {} and {} {}", info.open_min ? "above" : "at least", info.min,
                            info.open_max ? "below" : "at most", info.max);
    else if (std::isfinite(info.min))
        range = fmt::format("{} {}", info.open_min ? "above" : "at least", info.min);
    else
        range = fmt::format("{} {}", info.open_max ? "below" : "at most", info.max);
    fail(place, path, fmt::format("must be {} (got {})", range, value));
}

void ValueReader::read(const toml::node& node, double& out) const
{
    if (!node.is_number()) fail(place, path, "must be a number (got " + describe(node) + ")");
    out = node.value_or(0.0);
    check_range(out);
}

void ValueReader::read(const toml::node& node, int& out) const
{
    if (!node.is_integer()) fail(place, path, "must be an integer (got " + describe(node) + ")");
    const std::int64_t value = node.value_or(std::int64_t{0});
    check_range(static_cast<double>(value));
    if (value != static_cast<int>(value)) fail(place, path, fmt::format("is too large (got {})", value));
    out = static_cast<int>(value);
}

void ValueReader::read(const toml::node& node, bool& out) const
{
    if (!node.is_boolean()) fail(place, path, "must be true or false (got " + describe(node) + ")");
    out = node.value_or(false);
}

void ValueReader::read(const toml::node& node, std::string& out) const
{
    if (!node.is_string()) fail(place, path, "must be a string (got " + describe(node) + ")");
    out = node.value_or(std::string());
    if (std::any_of(out.begin(), out.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }))
        fail(place, path, fmt::format("must not hold control characters (got {})", to_toml(out)));
    if (constexpr std::size_t most = 200; (info.name == "name" || info.name == "title") && out.size() > most)
        fail(place, path, fmt::format("must have at most {} letters (got {})", most, out.size()));
    if (!info.choices.empty() && std::find(info.choices.begin(), info.choices.end(), out) == info.choices.end()) {
        std::string all;
        for (const std::string& c : info.choices) all += (all.empty() ? "" : ", ") + c;
        const std::string near = nearest(out, info.choices);
        fail(place, path,
             fmt::format("must be one of {} (got {}){}", all, to_toml(out),
                         near.empty() ? "" : ". Did you mean \"" + near + "\"?"));
    }
}

void ValueReader::read(const toml::node& node, Expression& out) const
{
    out.place = place_of(node);
    out.key   = path;
    if (node.is_number()) {
        double value = 0.0;
        read(node, value);
        out.value = value;
    } else if (node.is_string()) {
        out.value = node.value_or(std::string());
    } else {
        fail(place, path, "must be a number or an expression in quotes (got " + describe(node) + ")");
    }
}

std::string to_toml(double value)
{
    if (std::isnan(value)) return "nan";
    if (std::isinf(value)) return value > 0 ? "inf" : "-inf";
    std::string text = fmt::format("{}", value);
    return text.find_first_of(".e") == std::string::npos ? text + ".0" : text;
}

std::string to_toml(const std::string& value)
{
    std::string text = "\"";
    for (char c : value) {
        if (c == '"' || c == '\\') text += '\\';
        if (c == '\n')
            text += "\\n";
        else if (c == '\t')
            text += "\\t";
        else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
            text += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
        else
            text += c;
    }
    return text + "\"";
}

std::string to_toml(const Expression& value)
{
    return std::visit([](const auto& v) { return to_toml(v); }, value.value);
}

std::string markdown_cell(std::string text)
{
    for (std::size_t k = text.find('|'); k != std::string::npos; k = text.find('|', k + 2)) text.insert(k, "\\");
    return text;
}

std::string describe_type(std::string_view type, const KeyInfo& info)
{
    std::string text(type);
    if (info.per_axis) text += ", one per axis";
    if (!info.choices.empty()) {
        text.clear();
        for (const std::string& c : info.choices) text += (text.empty() ? "`" : ", `") + c + "`";
    }
    const bool low = std::isfinite(info.min), high = std::isfinite(info.max);
    if (low && high)
        text += fmt::format(", {} {} and {} {}", info.open_min ? ">" : ">=", info.min, info.open_max ? "<" : "<=", info.max);
    else if (low)
        text += fmt::format(", {} {}", info.open_min ? ">" : ">=", info.min);
    else if (high)
        text += fmt::format(", {} {}", info.open_max ? "<" : "<=", info.max);
    return text;
}

std::string reference(const SectionText& section)
{
    std::string text = fmt::format("## {}\n\n{}\n\n| key | type | default | unit | meaning |\n|---|---|---|---|---|\n",
                                   section.name.empty() ? "Top level" : "`" + section.header() + "`", section.what);
    for (const KeyText& k : section.keys)
        text += fmt::format("| `{}` | {} | {} | {} | {} |\n", k.info.name, describe_type(k.type, k.info),
                            k.info.required ? "required" : k.default_value, k.info.unit, markdown_cell(k.info.what));
    return text + "\n";
}

}  // namespace ordo::io
