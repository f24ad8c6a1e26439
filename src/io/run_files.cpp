#include "io/run_files.hpp"

#include "io/file.hpp"

#include <fmt/format.h>

#include <charconv>

namespace ordo::io {

namespace {

using namespace std::string_view_literals;

constexpr std::string_view kBefore = "checkpoint_", kAfter = ".h5";

}  // namespace

std::string frame_file(std::string_view what, std::size_t number)
{
    return fmt::format("{}_{:06}.{}", what, number, what == "grid" ? "vti" : "vtu");
}

std::string probe_file(const ProbeInput& probe) { return "probe_" + probe.name + ".csv"; }

std::string body_file(std::size_t body) { return fmt::format("body_{}.csv", body); }

std::string checkpoint_file(std::int64_t step) { return fmt::format("{}{:09}{}", kBefore, step, kAfter); }

std::optional<std::int64_t> step_of_checkpoint(const std::string& name)
{
    if (!name.starts_with(kBefore) || !name.ends_with(kAfter)) return {};
    const char *first = name.data() + kBefore.size(), *last = name.data() + name.size() - kAfter.size();
    std::int64_t step       = 0;
    const auto [end, error] = std::from_chars(first, last, step);
    if (first >= last || error != std::errc() || end != last) return {};
    return step;
}

bool is_run_file(const std::string& name)
{
    for (const auto& [start, end] :
         {std::pair{"particles_", ".vtu"}, {"contact_", ".vtu"}, {"grid_", ".vti"}, {"probe_", ".csv"}, {"body_", ".csv"}})
        if (name.starts_with(start) && name.ends_with(end)) return true;
    for (const std::string_view one :
         {"particles.pvd"sv, "contact.pvd"sv, "grid.pvd"sv, "history.csv"sv, kNewtonFile, "case.toml"sv, "files.txt"sv})
        if (name == one) return true;
    return step_of_checkpoint(name).has_value();
}

std::vector<std::string> table_files(const CaseInput& input)
{
    std::vector<std::string> r{"history.csv"};
    for (const ProbeInput& p : input.probes) r.push_back(probe_file(p));
    for (std::size_t k = 0; input.output.per_body && k < input.bodies.size(); ++k) r.push_back(body_file(k));
    if (is_implicit(input.spec)) r.emplace_back(kNewtonFile);
    return r;
}

void require_files(const CaseInput& input, const Written& written)
{
    const std::filesystem::path directory(input.output.directory);
    auto fail = [&](const std::string& name, std::string_view what) {
        throw InputError(
            fmt::format("{} {}: {} does not hold all files of the interrupted run; give an empty directory with --output", name,
                        what, directory.string()));
    };
    auto require = [&](const std::string& name) {
        std::error_code none;
        if (!std::filesystem::is_regular_file(directory / name, none)) fail(name, "is missing");
    };
    const std::vector<std::string> tables = table_files(input);
    if (tables.size() != written.table_sizes.size())
        throw InputError(
            "output.per_body is not that of the interrupted run; set it as it was, or give an empty directory with --output");
    for (std::size_t k = 0; k < tables.size(); ++k) {
        require(tables[k]);
        const auto sum = checksum_of(directory / tables[k], written.table_sizes.at(k));
        if (!sum) fail(tables[k], "is shorter than it was");
        if (*sum != written.table_sums.at(k)) fail(tables[k], "is of another run");
    }
    for (std::size_t k = 0; k < written.frames.size(); ++k) require(frame_file("particles", k));
    for (const int k : written.grid_frames) require(frame_file("grid", k));
    for (std::size_t k = 0; k < written.frames.size() && !(input.contacts.empty() && input.obstacles.empty()); ++k)
        require(frame_file("contact", k));
}

}  // namespace ordo::io
