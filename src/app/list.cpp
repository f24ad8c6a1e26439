#include "app/commands.hpp"
#include "base/error.hpp"
#include "io/input.hpp"
#include "method/tables.hpp"
#include "sim/output_fields.hpp"
#include "verification/study.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

namespace ordo::app {

namespace {

void list_methods()
{
    fmt::print("Presets (method.preset)\n");
    for (const Preset& p : presets()) {
        fmt::print("  {:<10} {}\n", p.name, p.what);
        std::string row;
        for_each_axis([&](auto axis) {
            using A = Axis<std::decay_t<decltype(p.spec.*axis)>>;
            if (p.spec.*axis != MethodSpec{}.*axis)
                row += fmt::format("{}{} {}", row.empty() ? "" : ", ", A::key, name_of(p.spec.*axis));
        });
        for (const Setting& s : settings())
            if (p.spec.*s.value != MethodSpec{}.*s.value) row += fmt::format(", {} {}", s.name, p.spec.*s.value);
        if (row.empty()) row = "the default of every axis";
        fmt::print("             {}\n", row);
    }
    fmt::print("\nAxes (method.AXIS overrides the preset)\n");
    const MethodSpec any{};
    for_each_axis([&](auto axis) {
        using A = Axis<std::decay_t<decltype(any.*axis)>>;
        fmt::print("  {}: {}\n", A::key, A::what);
        for (const auto& c : A::choices)
            fmt::print("    {:<15} {}{}\n", c.name, c.what, c.value == any.*axis ? " (default)" : "");
    });
    fmt::print("\nNumbers (method.NAME)\n");
    for (const Setting& s : settings())
        fmt::print("  {:<20} {} ({} to {}, default {})\n", s.name, s.what, s.min, s.max,
                   s.default_text.empty() ? fmt::format("{}", any.*s.value) : s.default_text);
    fmt::print("\nBases and domains that go together (x)\n  {:<16}", "");
    for (const auto& d : Axis<Domain>::choices) fmt::print("{:<16}", d.name);
    fmt::print("\n");
    for (const auto& b : Axis<Basis>::choices) {
        fmt::print("  {:<16}", b.name);
        for (const auto& d : Axis<Domain>::choices)
            fmt::print("{:<16}", broken_rule({.basis = b.value, .domain = d.value}) ? "-" : "x");
        fmt::print("\n");
    }
    fmt::print("\nNot allowed\n");
    for (const Rule& r : rules()) fmt::print("  {}\n    {}\n", r.what, r.why);
}

void list_materials()
{
    fmt::print("Materials (material.model)\n");
    for (const LawRow& m : laws()) fmt::print("  {:<20} {}\n", m.name, m.what);
}

void list_shapes()
{
    auto list = [](const std::vector<io::ShapeInfo>& rows) {
        for (const auto& s : rows) {
            const std::string dims =
                s.min_dim == s.max_dim ? fmt::format("{}D", s.min_dim) : fmt::format("{}D to {}D", s.min_dim, s.max_dim);
            fmt::print("  {:<10} {} ({})\n", s.name, s.what, dims);
            fmt::print("             needs {}{}{}\n", fmt::join(s.required, ", "), s.optional.empty() ? "" : "; takes ",
                       fmt::join(s.optional, ", "));
        }
    };
    fmt::print("Shapes (body.shape)\n");
    list(io::shapes());
    fmt::print("Shapes of obstacles (obstacle.shape)\n");
    list(io::obstacle_shapes());
}

void list_fields()
{
    fmt::print("Fields of particles (output.fields)\n");
    for (const OutputFieldText& f : output_fields())
        fmt::print("  {:<20} {}{}{}\n", f.name, f.what, f.what.empty() || f.unit.empty() ? "" : ", ", f.unit);
}

void list_cases()
{
    fmt::print("Cases (cases/NAME/case.toml)\n");
    std::error_code none;
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator("cases", none))
        if (std::filesystem::exists(entry.path() / "case.toml")) names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    for (const std::string& name : names)
        fmt::print("  {:<20} {}\n", name, io::read_case("cases/" + name + "/case.toml", {}).title);
    if (names.empty()) fmt::print("  none here: run ordo in the folder that contains cases/\n");
    fmt::print("\nVerification cases (ordo verify NAME --set parameter=value)\n");
    for (const verification::Case& c : verification::cases()) {
        int ppc = 1;
        for (int a = 0; a < c.dim; ++a) ppc *= c.per_axis;
        fmt::print("  {:<20} {}\n  {:<20} {}D, --cells {}, --ppc {}\n", c.name, c.what, "", c.dim, fmt::join(c.cells, ","), ppc);
        for (const verification::Parameter& p : c.parameters)
            std::visit(
                [&](const auto& value) {
                    fmt::print("  {:<20} {} = {} ({}{}{})\n", "", p.name, value, p.what, p.choices.empty() ? "" : ": ",
                               fmt::join(p.choices, ", "));
                },
                p.value);
    }
}

}  // namespace

int list(const std::string& what)
{
    if (what == "input") {
        fmt::print("{}", io::reference_page());
        return 0;
    }
    const std::pair<const char*, void (*)()> pages[] = {{"methods", list_methods},
                                                        {"materials", list_materials},
                                                        {"shapes", list_shapes},
                                                        {"fields", list_fields},
                                                        {"cases", list_cases}};
    bool first                                       = true;
    for (const auto& [name, page] : pages) {
        if (!what.empty() && what != name) continue;
        if (!first) fmt::print("\n");
        first = false;
        page();
    }
    return 0;
}

}  // namespace ordo::app
