// The machinery of the input schema: one description of each key (name, type, range, unit, sentence) parses and
// validates the TOML, echoes the resolved values and writes the reference page. Knows nothing of ordo's own keys.
#pragma once

#include "base/error.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace ordo::io {

/// A place in an input file; line 0 means the command line.
struct Place {
    std::string file;
    int line   = 0;
    int column = 0;

    std::string text() const { return line > 0 ? fmt::format("{}:{}:{}", file, line, column) : file; }
};

/// The text with control characters as \xNN: an error is one line, whatever the user put into names.
std::string one_line(std::string_view text);

/// Throws InputError "file:line:column: key: message".
[[noreturn]] void fail(const Place& place, std::string_view key, std::string_view message);

/// The candidate nearest to `word` by edit distance, or empty if none is near.
std::string nearest(std::string_view word, const std::vector<std::string>& candidates);

/// "Did you mean X?" or the list of candidates.
std::string suggestion(std::string_view word, const std::vector<std::string>& candidates);

/// A number or an expression of x, y, z, t as the user wrote it.
struct Expression {
    std::variant<double, std::string> value = 0.0;
    Place place{};
    std::string key{};

    bool operator==(const Expression& o) const { return value == o.value; }
};

/// A table of the input, with the places of the table and its keys.
struct Located {
    Place place;
    std::string path;  ///< such as body[0]
    std::map<std::string, Place> at;

    Place where(const std::string& key) const
    {
        const auto found = at.find(key);
        return found == at.end() ? place : found->second;
    }
    bool has(const std::string& key) const { return at.contains(key); }
    /// Throws InputError at a key of this table.
    [[noreturn]] void fail(const std::string& key, std::string_view message) const
    {
        io::fail(where(key), path.empty() ? key : path + "." + key, message);
    }
};

/// The description of a key.
struct KeyInfo {
    std::string name;
    std::string what;                       ///< one sentence
    std::string unit                 = {};  ///< SI, empty for none
    std::string default_text         = {};  ///< shown in the reference if the default is derived
    bool required                    = false;
    bool per_axis                    = false;  ///< as many values as the grid has dimensions; a single number is repeated
    bool is_vector                   = false;  ///< with per_axis: no single number but 0, which would act along all axes
    double min                       = -std::numeric_limits<double>::infinity();
    double max                       = std::numeric_limits<double>::infinity();
    bool open_min                    = false;  ///< min itself is excluded
    bool open_max                    = false;
    std::vector<std::string> choices = {};
};

/// Numbers and words by their keys, for keys that come from tables: parameters of laws, axes of methods.
using Numbers = std::map<std::string, double>;
using Words   = std::map<std::string, std::string>;
using Flags   = std::map<std::string, bool>;
using Lists   = std::map<std::string, std::vector<double>>;

template <class Owner>
using Member =
    std::variant<double Owner::*, std::optional<double> Owner::*, int Owner::*, std::optional<int> Owner::*, bool Owner::*,
                 std::string Owner::*, std::vector<double> Owner::*, std::vector<int> Owner::*, std::vector<std::string> Owner::*,
                 std::vector<Expression> Owner::*, Numbers Owner::*, Words Owner::*, Flags Owner::*, Lists Owner::*>;

template <class Owner>
struct Key {
    Member<Owner> member;
    KeyInfo info;
};

/// A table of the input: its name, what it is for, its keys.
template <class Owner>
struct Section {
    std::string name;  ///< empty for the top level
    std::string what;
    bool repeated = false;  ///< [[name]]
    std::vector<Key<Owner>> keys;

    std::string header() const { return repeated ? "[[" + name + "]]" : "[" + name + "]"; }
};

/// The place of a node; nodes made by --set have no place in a file.
Place place_of(const toml::node& node);

/// Reads one value; throws InputError if the type or the range is wrong. `dim` is the number of axes.
struct ValueReader {
    const KeyInfo& info;
    std::string path;
    Place place;
    int dim;

    void read(const toml::node& node, double& out) const;
    void read(const toml::node& node, int& out) const;
    void read(const toml::node& node, bool& out) const;
    void read(const toml::node& node, std::string& out) const;
    void read(const toml::node& node, Expression& out) const;
    template <class T>
    void read(const toml::node& node, std::map<std::string, T>& out) const
    {
        read(node, out[info.name]);
    }
    template <class T>
    void read(const toml::node& node, std::optional<T>& out) const
    {
        T value{};
        read(node, value);
        out = value;
    }
    template <class T>
    void read(const toml::node& node, std::vector<T>& out) const
    {
        out.clear();
        if (const toml::array* list = node.as_array()) {
            for (const toml::node& item : *list) ValueReader{info, path, place_of(item), dim}.read(item, out.emplace_back());
        } else if (info.per_axis) {
            T value{};
            read(node, value);
            if (info.is_vector && dim > 1 && node.value<double>() != 0.0)
                fail(place, path, fmt::format("is a vector and must have {} values, one per axis (got one)", dim));
            out.assign(repeats_scalar<T>() ? static_cast<std::size_t>(dim) : 1, value);
        } else {
            read(node, out.emplace_back());
        }
        if (info.per_axis && list_length_matters(node) && static_cast<int>(out.size()) != dim)
            fail(place, path, fmt::format("must have {} value{}, one per axis (got {})", dim, dim > 1 ? "s" : "", out.size()));
    }

  private:
    /// A single integer stays single: particles_per_cell = 4 counts the whole cell.
    template <class T>
    static constexpr bool repeats_scalar()
    {
        return !std::is_same_v<T, int>;
    }
    static bool list_length_matters(const toml::node& node) { return node.is_array(); }
    void check_range(double value) const;
};

template <class Owner>
std::vector<std::string> key_names(const Section<Owner>& section)
{
    std::vector<std::string> names;
    for (const auto& k : section.keys) names.push_back(k.info.name);
    return names;
}

/// Fills `owner` from the keys of a table. The caller reads the names in `others` itself.
template <class Owner>
void read_table(const Section<Owner>& section, const toml::table& table, const std::string& path, int dim, Owner& owner,
                const std::vector<std::string>& others = {})
{
    owner.path  = path;
    owner.place = place_of(table);
    for (const auto& [key, value] : table) {
        const toml::node& node = value;  // clang 14 does not let lambdas capture structured bindings
        const std::string name(key.str());
        const std::string full = path.empty() ? name : path + "." + name;
        if (std::find(others.begin(), others.end(), name) != others.end()) continue;
        const auto found =
            std::find_if(section.keys.begin(), section.keys.end(), [&](const auto& k) { return k.info.name == name; });
        if (found == section.keys.end()) {
            std::vector<std::string> names = key_names(section);
            names.insert(names.end(), others.begin(), others.end());
            const Place key_place{place_of(node).file, static_cast<int>(key.source().begin.line),
                                  static_cast<int>(key.source().begin.column)};
            fail(key_place, full, "there is no such key. " + suggestion(name, names));
        }
        owner.at[name] = place_of(node);
        const ValueReader reader{found->info, full, owner.at[name], dim};
        std::visit([&](auto member) { reader.read(node, owner.*member); }, found->member);
    }
    for (const auto& k : section.keys)
        if (k.info.required && !owner.has(k.info.name))
            fail(owner.place, path.empty() ? k.info.name : path + "." + k.info.name,
                 fmt::format("is missing ({}{})", k.info.what, k.info.unit.empty() ? "" : ", " + k.info.unit));
}

/// TOML text of a value; empty for one that is not set.
std::string to_toml(double value);
std::string to_toml(const std::string& value);
inline std::string to_toml(int value) { return fmt::format("{}", value); }
inline std::string to_toml(bool value) { return value ? "true" : "false"; }
std::string to_toml(const Expression& value);
template <class T>
std::string to_toml(const std::vector<T>& values);
template <class T>
std::string to_toml(const std::optional<T>& value)
{
    return value ? to_toml(*value) : "";
}
template <class T>
std::string to_toml(const std::vector<T>& values)
{
    if (values.empty()) return "";
    std::string r;
    for (const T& v : values) r += (r.empty() ? "[" : ", ") + to_toml(v);
    return r + "]";
}

/// The value of a key in a member: the member itself, or its entry of that name.
template <class T>
const T& value_of(const T& member, const std::string&)
{
    return member;
}
template <class T>
std::optional<T> value_of(const std::map<std::string, T>& member, const std::string& key)
{
    const auto found = member.find(key);
    return found == member.end() ? std::nullopt : std::optional(found->second);
}

/// The table as TOML with every default; keys without a value are left out.
template <class Owner>
std::string echo(const Section<Owner>& section, const Owner& owner)
{
    std::string text;
    if (!section.name.empty()) text += "\n" + section.header() + "\n";
    for (const auto& k : section.keys) {
        std::string value = std::visit([&](auto member) { return to_toml(value_of(owner.*member, k.info.name)); }, k.member);
        if (value.empty() && owner.has(k.info.name)) value = "[]";
        if (!value.empty() && value != "\"\"") text += fmt::format("{} = {}\n", k.info.name, value);
    }
    return text;
}

/// The text, escaped for a cell of a Markdown table.
std::string markdown_cell(std::string text);

/// The type of a key in words, with its range or choices.
std::string describe_type(std::string_view type, const KeyInfo& info);

/// A key and a section in words.
struct KeyText {
    KeyInfo info;
    std::string type;           ///< such as "numbers"
    std::string default_value;  ///< empty if there is none
};
struct SectionText {
    std::string name, what;
    bool repeated;
    std::vector<KeyText> keys;

    std::string header() const { return repeated ? "[[" + name + "]]" : "[" + name + "]"; }
};

template <class Owner>
SectionText described(const Section<Owner>& section)
{
    struct TypeName {
        std::string operator()(double Owner::*) const { return "number"; }
        std::string operator()(std::optional<double> Owner::*) const { return "number"; }
        std::string operator()(int Owner::*) const { return "integer"; }
        std::string operator()(std::optional<int> Owner::*) const { return "integer"; }
        std::string operator()(bool Owner::*) const { return "boolean"; }
        std::string operator()(std::string Owner::*) const { return "string"; }
        std::string operator()(std::vector<double> Owner::*) const { return "numbers"; }
        std::string operator()(std::vector<int> Owner::*) const { return "integers"; }
        std::string operator()(std::vector<std::string> Owner::*) const { return "strings"; }
        std::string operator()(std::vector<Expression> Owner::*) const { return "numbers or expressions"; }
        std::string operator()(Numbers Owner::*) const { return "number"; }
        std::string operator()(Words Owner::*) const { return "string"; }
        std::string operator()(Flags Owner::*) const { return "boolean"; }
        std::string operator()(Lists Owner::*) const { return "numbers"; }
    };
    SectionText r{section.name, section.what, section.repeated, {}};
    const Owner defaults = Owner();
    for (const auto& k : section.keys) {
        std::string value = k.info.default_text;
        if (value.empty())
            value = std::visit([&](auto member) { return to_toml(value_of(defaults.*member, k.info.name)); }, k.member);
        r.keys.push_back({k.info, std::visit(TypeName{}, k.member), value == "\"\"" ? "" : value});
    }
    return r;
}

/// The section as Markdown, one row per key.
std::string reference(const SectionText& section);

}  // namespace ordo::io
