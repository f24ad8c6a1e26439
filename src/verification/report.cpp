#include "verification/report.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace ordo::verification {

namespace {

using Json = nlohmann::ordered_json;

Json number(double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); }

Json object(const Named& named)
{
    Json r = Json::object();
    for (const auto& [name, value] : named) r[name] = number(value);
    return r;
}

/// Names of the errors for which orders are computed, and their columns: RMS errors and the velocity of the grid.
std::vector<std::pair<std::string, std::string>> ordered_errors(const Row& row)
{
    std::vector<std::pair<std::string, std::string>> r;
    for (const auto& [name, value] : row.error) r.emplace_back(name, name);
    if (!std::isnan(find(row.error_l2, "velocity_grid"))) r.emplace_back("velocity_grid", "l2 velocity_grid");
    return r;
}

Json orders(const Row& row, const Row* before)
{
    if (!before) return nullptr;
    Json r = Json::object();
    for (const auto& [name, key] : ordered_errors(row)) r[name] = number(order_between(*before, row, key));
    return r.empty() ? Json(nullptr) : r;
}

Json to_json(const Row& row, const Row* before)
{
    Json r{{"cells", row.cells},
           {"h", row.h},
           {"particles", row.particles},
           {"steps", row.steps},
           {"dt", row.dt},
           {"seconds", row.seconds},
           {"seconds_body_force", row.seconds_body_force},
           {"seconds_cpu", row.seconds_cpu},
           {"error", object(row.error)},
           {"error_l2", object(row.error_l2)},
           {"error_relative", object(row.error_relative)},
           {"quantities", object(row.quantities)},
           {"order", orders(row, before)},
           {"failed", row.failed.empty() ? Json(nullptr) : Json(row.failed)}};
    for (const auto& [what, file] : row.files) r["files"][what] = file;
    for (const auto& [name, values] : row.curves)
        for (const double value : values) r["curves"][name].push_back(number(value));
    return r;
}

Json to_json(const Verdict& v)
{
    return {{"what", v.bar.what()},
            {"limit", v.bar.limit()},
            {"value", v.was_run ? number(v.value) : Json(nullptr)},
            {"pass", v.was_run ? Json(v.pass()) : Json(nullptr)}};
}

Json to_json(const Result& result)
{
    Json parameters = Json::object();
    for (const auto& [name, value] : result.study.request.values.entries)
        std::visit([&, key = name](const auto& v) { parameters[key] = v; }, value);
    parameters["ppc"] = result.study.ppc;
    Json rows = Json::array(), bars = Json::array();
    for (std::size_t k = 0; k < result.rows.size(); ++k)
        rows.push_back(to_json(result.rows[k], k > 0 ? &result.rows[k - 1] : nullptr));
    for (const Verdict& v : result.verdicts) bars.push_back(to_json(v));
    const auto pass = result.pass();
    return {{"case", result.study.of->name},
            {"method", result.study.preset},
            {"parameters", parameters},
            {"rows", rows},
            {"bars", bars},
            {"pass", pass ? Json(*pass) : Json(nullptr)}};
}

/// Sets all numbers whose names start with seconds to null.
void forget_times(Json& json)
{
    for (auto& [name, value] : json.items())
        if (value.is_structured())
            forget_times(value);
        else if (name.starts_with("seconds"))
            value = nullptr;
}

}  // namespace

std::optional<bool> Result::pass() const
{
    std::optional<bool> all;
    for (const Verdict& v : verdicts)
        if (v.was_run) all = all.value_or(true) && v.pass();
    return all;
}

std::string to_json(const std::vector<Result>& results, Times times)
{
    Json r = Json::array();
    for (const Result& result : results) r.push_back(to_json(result));
    if (times == Times::no) forget_times(r);
    return r.dump(1) + "\n";
}

std::string to_csv(const Table& table)
{
    std::string text        = fmt::format("{}\n", fmt::join(table.columns, ","));
    const std::size_t width = table.columns.size();
    for (std::size_t k = 0; k < table.values.size(); ++k)
        fmt::format_to(std::back_inserter(text), "{}{}", table.values[k], (k + 1) % width ? ',' : '\n');
    return text;
}

std::string table_title(const Resolved& study)
{
    std::string title =
        fmt::format("\n{}, {}, {} particle{} a cell", study.of->name, study.preset, study.ppc, study.ppc > 1 ? "s" : "");
    for (const auto& [name, value] : study.request.values.entries)
        std::visit([&, key = name](const auto& v) { title += fmt::format(", {} {}", key, v); }, value);
    return title + "\n";
}

std::string table_header(const Row& row)
{
    std::string columns = fmt::format("{:>6} {:>10} {:>8} {:>8}", "cells", "particles", "steps", "seconds");
    for (const auto& [name, key] : ordered_errors(row)) columns += fmt::format("  {:>13} order", name);
    for (const auto& [name, value] : row.error_relative) columns += fmt::format("  {:>13}", "rel. " + name.substr(0, 8));
    if (row.error.empty())
        for (const auto& [name, value] : row.quantities) columns += fmt::format("  {:>21}", name);
    return columns + "\n";
}

std::string table_row(const Row& row, const Row* before)
{
    std::string line = fmt::format("{:>6} {:>10} {:>8} {:>8.2f}", row.cells, row.particles, row.steps, row.seconds);
    for (const auto& [name, key] : ordered_errors(row)) {
        const double order = before ? order_between(*before, row, key) : std::nan("");
        line += fmt::format("  {:>13.4e} {:>5}", value_of(row, key), std::isfinite(order) ? fmt::format("{:.2f}", order) : "");
    }
    for (const auto& [name, value] : row.error_relative) line += fmt::format("  {:>13.4e}", value);
    if (row.error.empty())
        for (const auto& [name, value] : row.quantities) line += fmt::format("  {:>21.6g}", value);
    if (!row.failed.empty()) line += "  failed: " + row.failed;
    return line + "\n";
}

std::string table_bars(const Result& result)
{
    std::string text;
    for (const Verdict& v : result.verdicts)
        text += fmt::format("  {:<8} {} {}: {}\n",
                            !v.was_run ? "not run"
                            : v.pass() ? "pass"
                                       : "FAIL",
                            v.bar.what(), v.bar.limit(),
                            !v.was_run            ? "its meshes were not run"
                            : std::isnan(v.value) ? "no number"
                                                  : fmt::format("{:.4g}", v.value));
    return text;
}

}  // namespace ordo::verification
