#include "verification/study.hpp"

#include "base/error.hpp"
#include "io/method_names.hpp"
#include "io/schema.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace ordo::verification {

namespace {

constexpr double kNaN      = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The rest of `text` after `prefix`, if it starts with it.
std::optional<std::string_view> after(std::string_view text, std::string_view prefix)
{
    if (!text.starts_with(prefix)) return std::nullopt;
    return text.substr(prefix.size());
}

std::string text_of(const Value& value)
{
    if (const double* number = std::get_if<double>(&value)) return fmt::format("{}", *number);
    return std::get<std::string>(value);
}

/// The value converted to the type of the parameter; throws if it is not valid.
Value checked(const Parameter& parameter, const Value& value)
{
    auto refuse = [&](const std::string& why) {
        throw InputError(fmt::format("--set {}={}: {}", parameter.name, text_of(value), why));
    };
    if (std::holds_alternative<std::string>(parameter.value)) {
        const std::string word = text_of(value);
        const auto& choices    = parameter.choices;
        if (std::find(choices.begin(), choices.end(), word) == choices.end())
            refuse("there is no such choice. " + io::suggestion(word, choices));
        return word;
    }
    const auto number = std::holds_alternative<double>(value) ? std::optional(std::get<double>(value))
                                                              : io::parse_number(std::get<std::string>(value));
    if (!number || !std::isfinite(*number)) refuse("it must be a number");
    if (!(*number > parameter.above && *number < parameter.below))
        refuse(std::isinf(parameter.below)
                   ? fmt::format("it must be larger than {}", parameter.above)
                   : fmt::format("it must lie between {} and {}, ends excluded", parameter.above, parameter.below));
    return *number;
}

std::string join(const std::vector<Parameter>& parameters)
{
    std::string text;
    for (const Parameter& p : parameters) text += (text.empty() ? "" : ", ") + p.name;
    return text;
}

/// The particles per axis that make up `ppc` in a cell.
int per_axis_of(int ppc, int dim)
{
    const int n = static_cast<int>(std::lround(std::pow(ppc, 1.0 / dim)));
    int all     = 1;
    for (int a = 0; a < dim; ++a) all *= n;
    if (all != ppc || n < 1)
        throw InputError(fmt::format("--ppc {}: counted over the whole cell it must be a {} number in {}D, such as {}", ppc,
                                     dim == 2 ? "square" : "cubic", dim, dim == 2 ? "1, 4, 9, 16" : "1, 8, 27, 64"));
    return n;
}

/// Whether two studies of a case have the same method and parameters, however these were set.
bool run_the_same(const Resolved& a, const Resolved& b)
{
    const auto own = [](const Resolved& r) {
        auto entries = r.request.values.entries;
        std::erase_if(entries, [](const auto& e) { return e.first.starts_with("method."); });
        return entries;
    };
    return a.preset == b.preset && a.ppc == b.ppc && a.request.method == b.request.method && own(a) == own(b);
}

/// Resolves a study, without the bars of other studies.
Resolved resolve_one(const Case& of, const Study& study)
{
    Resolved r{};
    r.of     = &of;
    r.preset = study.method;
    r.cells  = study.cells.empty() ? of.cells : study.cells;
    r.bars   = study.bars;

    r.request.method = io::preset_called(study.method).spec;

    for (const Parameter& p : of.parameters) r.request.values.set(p.name, p.value);
    for (const auto& [name, value] : study.set) {
        const auto p = std::find_if(of.parameters.begin(), of.parameters.end(),
                                    [&name = name](const Parameter& q) { return q.name == name; });
        if (p != of.parameters.end() && !name.starts_with("method.")) {
            r.request.values.set(name, checked(*p, value));
        } else if (after(name, "method.")) {
            r.request.values.set(name, text_of(value));
        } else {
            std::vector<std::string> known;
            for (const Parameter& q : of.parameters) known.push_back(q.name);
            const std::string near = io::nearest(name, known);
            throw InputError(fmt::format("--set {}: case {} has no such parameter. {}It has {}; axes are set as method.AXIS",
                                         name, of.name, near.empty() ? "" : "Did you mean \"" + near + "\"? ",
                                         join(of.parameters)));
        }
    }
    for (const auto& [name, value] : r.request.values.entries)
        if (const auto axis = after(name, "method."))
            io::set_axis(r.request.method, "--set method.", std::string(*axis), text_of(value));
    io::require_allowed(study.method, r.request.method);

    const int dim = of.dim_of(r.request.values);
    r.ppc         = study.ppc;
    if (r.ppc == 0) {
        r.ppc = 1;
        for (int a = 0; a < dim; ++a) r.ppc *= of.per_axis;
    }
    r.request.per_axis = per_axis_of(r.ppc, dim);
    return r;
}

}  // namespace

double find(const Named& named, std::string_view name)
{
    for (const auto& [key, value] : named)
        if (key == name) return value;
    return kNaN;
}

const Value& Values::at(std::string_view name) const
{
    for (const auto& [key, value] : entries)
        if (key == name) return value;
    throw std::logic_error("no parameter " + std::string(name));
}

void Values::set(std::string_view name, const Value& value)
{
    for (auto& [key, old] : entries)
        if (key == name) {
            old = value;
            return;
        }
    entries.emplace_back(name, value);
}

std::string Bar::what() const
{
    if (name == "failed") return fmt::format("run fails at {}", from);
    return to > 0 ? fmt::format("{} order {}-{}", name, from, to) : fmt::format("{} at {}", name, from);
}

std::string Bar::limit() const
{
    if (std::isinf(low)) return fmt::format("<= {}", high);
    if (std::isinf(high)) return fmt::format(">= {}", low);
    return fmt::format("in [{}, {}]", low, high);
}

std::vector<Bar> orders_between(std::string_view name, const std::vector<int>& meshes, double low, double high)
{
    std::vector<Bar> bars;
    for (std::size_t k = 1; k < meshes.size(); ++k)
        bars.push_back({.name = std::string(name), .from = meshes[k - 1], .to = meshes[k], .low = low, .high = high});
    return bars;
}

std::vector<Study> operator+(std::vector<Study> a, const std::vector<Study>& b)
{
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

std::vector<Study> averaged(const std::vector<int>& meshes)
{
    std::vector<Study> r;
    for (const char* method : {"cpdi1", "cpdi2"})
        for (const char* choice : {"cell", "node"})
            r.push_back({.method = method,
                         .set    = {{"method.averaging", choice}},
                         .cells  = meshes,
                         .bars   = orders_at_least("displacement", meshes, 1.9)});
    return r;
}

Study by_midpoint(double cfl, const std::vector<int>& meshes, Study::Length length)
{
    return {.method = "bscpdi2",
            .set    = {{"method.scheme", "midpoint"}, {"cfl", cfl}},
            .cells  = meshes,
            .bars   = orders_at_least("displacement", meshes, 1.9) + orders_at_least("stress", meshes, cfl > 1 ? 1.9 : 1.7),
            .length = length};
}

std::vector<Bar> orders_at_least(std::string_view name, const std::vector<int>& meshes, double low)
{
    return orders_between(name, meshes, low, kInfinity);
}

std::vector<Bar> all_orders_at_least(const std::vector<int>& meshes, double low)
{
    return orders_at_least("displacement", meshes, low) + orders_at_least("velocity", meshes, low) +
           orders_at_least("stress", meshes, low);
}

std::vector<Bar> orders_at_most(std::string_view name, const std::vector<int>& meshes, double high)
{
    return orders_between(name, meshes, -kInfinity, high);
}

Bar value_between(std::string_view name, int cells, double low, double high)
{
    return {.name = std::string(name), .from = cells, .low = low, .high = high};
}

Bar value_at_most(std::string_view name, int cells, double high) { return value_between(name, cells, -kInfinity, high); }

Bar fails_at(int cells) { return {.name = "failed", .from = cells, .low = 1}; }

std::vector<Bar> operator+(std::vector<Bar> a, const std::vector<Bar>& b)
{
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

int Case::dim_of(const Values& values) const
{
    for (const auto& [key, value] : values.entries)
        if (key == "dim") return std::get<std::string>(value)[0] - '0';
    return dim;
}

Resolved resolve(const Case& of, const Study& study)
{
    Resolved r = resolve_one(of, study);
    if (!study.bars.empty()) return r;
    for (const Study& other : of.studies) {
        const Resolved o = resolve_one(of, other);
        if (!run_the_same(o, r)) continue;
        for (const Bar& bar : o.bars) {
            auto is_same = [&](const Bar& b) { return b.what() == bar.what() && b.limit() == bar.limit(); };
            if (std::none_of(r.bars.begin(), r.bars.end(), is_same)) r.bars.push_back(bar);
        }
    }
    return r;
}

double value_of(const Row& row, std::string_view name)
{
    if (name == "failed") return row.failed.empty() ? 0.0 : 1.0;
    if (const auto key = after(name, "l2 ")) return find(row.error_l2, *key);
    if (const auto key = after(name, "relative ")) return find(row.error_relative, *key);
    const double error = find(row.error, name);
    return std::isnan(error) ? find(row.quantities, name) : error;
}

double order_between(const Row& coarse, const Row& fine, std::string_view name)
{
    const double e1 = value_of(coarse, name), e2 = value_of(fine, name);
    if (!(e1 > 0 && e2 > 0)) return kNaN;
    return std::log(e1 / e2) / std::log(coarse.h / fine.h);
}

Verdict Resolved::judge(const Bar& bar, const std::vector<Row>& rows) const
{
    const Row *from = nullptr, *to = nullptr;
    for (const Row& row : rows) {
        if (row.cells == bar.from) from = &row;
        if (row.cells == bar.to) to = &row;
    }
    if (!from || (bar.to > 0 && !to)) return {.bar = bar};
    return {.bar = bar, .was_run = true, .value = bar.to > 0 ? order_between(*from, *to, bar.name) : value_of(*from, bar.name)};
}

}  // namespace ordo::verification
