// `ordo drive`: one material point along a path of deformation.
#include "app/commands.hpp"
#include "app/path.hpp"
#include "base/error.hpp"
#include "io/file.hpp"
#include "io/input.hpp"
#include "io/message.hpp"
#include "material/branches.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace ordo::app {

namespace {

using Json = nlohmann::ordered_json;

struct DriveOptions {
    std::string law, path, json;
    std::vector<std::string> overrides;  ///< key=value
    int dim = 3;
    NamedPath named;
};

std::vector<std::string> names_of_history(const Material& m, int dim)
{
    std::vector<std::string> names;
    for (const HistoryColumn& c : history_of(m, dim)) names.emplace_back(c.name);
    return names;
}

Json parameters_of(const io::MaterialInput& in)
{
    Json r                                                     = {{"density", in.density}};
    const std::pair<const char*, std::optional<double>> pair[] = {{"young", in.young},   {"poisson", in.poisson},
                                                                  {"lambda", in.lambda}, {"mu", in.mu},
                                                                  {"bulk", in.bulk},     {"shear", in.shear}};
    for (const auto& [name, value] : pair)
        if (value) r[name] = *value;
    for (const auto& [name, value] : in.parameters) r[name] = value;
    for (const auto& [name, value] : in.words) r[name] = value;
    for (const auto& [name, value] : in.flags) r[name] = value;
    for (const auto& [name, value] : in.lists) r[name] = value;
    if (!in.branch_shear.empty()) r["branch_shear"] = in.branch_shear;
    if (!in.branch_time.empty()) r["branch_time"] = in.branch_time;
    return r;
}

Json nine(const Mat<3>& m)
{
    Json r = Json::array();
    for (int c = 0; c < 9; ++c) r.push_back(m(c / 3, c % 3));
    return r;
}

Json to_json(const std::string& law, const io::MaterialInput& in, const std::vector<std::string>& columns,
             const std::vector<PointRow>& rows)
{
    Json list = Json::array();
    for (const PointRow& row : rows) {
        Json history = Json::object();
        for (std::size_t k = 0; k < columns.size(); ++k) history[columns[k]] = row.history[k];
        list.push_back({{"time", row.time},
                        {"F", nine(row.F)},
                        {"cauchy", nine(row.cauchy)},
                        {"history", history},
                        {"stored", row.stored},
                        {"dissipated", row.dissipated},
                        {"parts", row.parts}});
    }
    return {{"law", law}, {"parameters", parameters_of(in)}, {"rows", list}};
}

void print_table(const std::vector<std::string>& columns, const std::vector<PointRow>& rows)
{
    std::string header = "time";
    for (const char* tensor : {"F", "cauchy_"})
        for (int c = 0; c < 9; ++c) header += fmt::format(",{}{}{}", tensor, c / 3 + 1, c % 3 + 1);
    for (const std::string& c : columns)
        if (c != "dissipated") header += "," + c;
    fmt::print("{},stored,dissipated\n", header);
    for (const PointRow& row : rows) {
        std::string line = fmt::format("{}", row.time);
        for (const Mat<3>& m : {row.F, row.cauchy})
            for (int c = 0; c < 9; ++c) line += fmt::format(",{}", m(c / 3, c % 3));
        for (std::size_t k = 0; k < columns.size(); ++k)
            if (columns[k] != "dissipated") line += fmt::format(",{}", row.history[k]);
        fmt::print("{},{},{}\n", line, row.stored, row.dissipated);
    }
}

void require_law(const std::string& name)
{
    if (find_law(name)) return;
    std::vector<std::string> names;
    for (const LawRow& row : laws()) names.emplace_back(row.name);
    throw InputError(fmt::format("{}: there is no such law (ordo list materials). {}", name, io::suggestion(name, names)));
}

int drive(const DriveOptions& options)
{
    require_law(options.law);
    if (!options.json.empty() && options.json != "-") require_writable_file("--json", options.json);
    const auto [input, material] = io::read_material(options.law, options.overrides, options.dim);
    const auto& names            = path_names();
    const bool is_named          = std::find(names.begin(), names.end(), options.path) != names.end();
    if (!is_named && (options.named.strain || options.named.confine))
        throw InputError("--strain and --confine: are for named paths; remove them");
    const std::vector<Target> path =
        is_named ? named_path(options.named, material, options.dim) : read_path(options.path, options.dim);
    const std::vector<PointRow> rows = follow_path(material, path, options.dim);
    const auto divided               = std::count_if(rows.begin(), rows.end(), [](const PointRow& r) { return r.parts > 1; });
    if (divided > 0)
        io::say("ordo: {} of {} steps were divided, because they were not solved at once\n", divided, rows.size() - 1);

    const std::vector<std::string> columns = names_of_history(material, options.dim);
    if (options.json.empty()) {
        print_table(columns, rows);
        return 0;
    }
    const std::string text = to_json(options.law, input, columns, rows).dump(1) + "\n";
    if (options.json == "-") {
        fmt::print("{}", text);
        return 0;
    }
    io::AtomicFile file(options.json);
    file.write(text);
    file.commit();
    return 0;
}

}  // namespace

void add_drive(CLI::App& cli, int& result)
{
    CLI::App* command = cli.add_subcommand("drive", "one material point along a path of deformation: stress, history, energies");
    const auto given  = std::make_shared<DriveOptions>();
    command->add_option("law", given->law, "material law; see ordo list materials")->required();
    command
        ->add_option("--set", given->overrides,
                     "set a key of [[material]], key=value; may be repeated; density is 1000 by default")
        ->allow_extra_args(false);
    command
        ->add_option(
            "--path", given->path,
            fmt::format("CSV file with columns time,F11,F12,..,F33 (S22 instead of F22 prescribes the Cauchy stress), or {}",
                        fmt::join(path_names(), ", ")))
        ->required();
    command->add_option("--dim", given->dim, "dimensions; default: 3")->check(CLI::Range(1, 3));
    command->add_option("--strain", given->named.strain,
                        "of a named path: logarithmic strain along x, or shear; default: 0.1, 1, -0.1, -0.1, -0.1");
    command->add_option("--confine", given->named.confine, "of triaxial and undrained: pressure that acts first, Pa");
    command->add_option("--steps", given->named.steps, "of a named path; default: 100")->check(CLI::Range(1, 1'000'000));
    command->add_option("--rate", given->named.rate, "of a named path: strain rate, 1/s; default: 1")->check(CLI::PositiveNumber);
    command->add_option("--json", given->json, "write JSON to a file, or to stdout with -");
    command->callback([given, &result] {
        given->named.name = given->path;
        result            = drive(*given);
    });
}

}  // namespace ordo::app
