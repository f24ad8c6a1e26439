#include "app/commands.hpp"
#include "base/error.hpp"
#include "io/file.hpp"
#include "io/message.hpp"
#include "verification/choice.hpp"
#include "verification/report.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <optional>
#include <utility>

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

namespace ordo::app {

namespace {

using namespace verification;

/// Prints to stdout, or to stderr if stdout is for the JSON. A stderr that cannot be written does not end the run.
void print(std::FILE* table, const std::string& text)
{
    if (table == stderr)
        io::say("{}", text);
    else
        fmt::print(table, "{}", text);
    std::fflush(table);
}

void write_file(const std::filesystem::path& path, const std::string& text)
{
    io::AtomicFile file(path);
    file.write(text);
    file.commit();
}

/// A directory with verify.json, without times so that it is the same in each run, and the tables of its rows.
class Data {
  public:
    /// Throws InputError if it cannot be written, before any run.
    Data(const std::string& option, const std::filesystem::path& directory) : directory_(directory)
    {
        std::error_code failure;
        std::filesystem::create_directories(directory_, failure);
        if (failure)
            throw InputError(fmt::format("{}: {} cannot be created: {}", option, directory_.string(), failure.message()));
        require_writable_file(option, json().string());
    }

    /// Writes the tables of a row and empties them.
    void take_tables(const Resolved& study, int number, Row& row) const
    {
        take_table("history", study, number, row.history, row);
        take_table("particles", study, number, row.final_particles, row);
    }

    void write(const std::vector<Result>& results) const { write_file(json(), to_json(results, Times::no)); }

  private:
    std::filesystem::path json() const { return directory_ / "verify.json"; }

    void take_table(const std::string& what, const Resolved& study, int number, Table& table, Row& row) const
    {
        const Table taken = std::exchange(table, {});
        if (taken.values.empty()) return;
        const std::string name = fmt::format("{:02}-{}-{}-{}-{}.csv", number, study.of->name, study.preset, row.cells, what);
        write_file(directory_ / name, to_csv(taken));
        row.files.emplace_back(what, name);
    }

    std::filesystem::path directory_;
};

Result run_study(const Resolved& study, const Data* data, int number, std::FILE* table)
{
    Result result{study, {}, {}};
    std::string header;
    for (const int cells : study.cells) {
        result.rows.push_back(run_row(study, cells, data != nullptr));
        if (data) data->take_tables(study, number, result.rows.back());
        const std::size_t n = result.rows.size();
        if (n == 1) print(table, table_title(study));
        const std::string now = table_header(result.rows.back());
        if (header.empty() || now.size() > header.size()) print(table, header = now);  // a failed row has fewer columns
        print(table, table_row(result.rows.back(), n > 1 ? &result.rows[n - 2] : nullptr));
    }
    for (const Bar& bar : study.bars) result.verdicts.push_back(study.judge(bar, result.rows));
    print(table, table_bars(result));
    return result;
}

/// Plots with python/ordo_figures.py and ordo_gallery.py, which are in the source tree or in share/ordo of an installation.
class Figures {
  public:
    /// Throws InputError if plots cannot be made, before any run.
    explicit Figures(const std::filesystem::path& directory) : directory_(directory)
    {
        const auto here = folder_of_program();
        for (const char* place : {"../../python", "../share/ordo"})
            if (std::filesystem::exists(here / place / "ordo_figures.py")) script_ = here / place / "ordo_figures.py";
        if (script_.empty()) refuse("ordo_figures.py is neither in the source tree nor in share/ordo");
        if (run({"-c", "import matplotlib, numpy"}) != 0) refuse("python3 has no matplotlib; install python3-matplotlib");
    }

    /// Plots the files of Data.
    void draw() const
    {
        const std::string gallery = script_.parent_path() / "ordo_gallery.py", json = directory_ / "verify.json";
        if (run({script_.string(), "convergence", json, "-o", directory_.string()}) != 0 ||
            run({gallery, "runs", json, "-o", directory_.string()}) != 0)
            throw OutputError(fmt::format("--figures {}: the plots were not drawn", directory_.string()));
    }

  private:
    [[noreturn]] static void refuse(const std::string& why) { throw InputError("--figures: " + why); }

    /// Runs Debian's python3, which has Debian's packages, or else the one in the path. Returns the exit code.
    static int run(std::vector<std::string> arguments)
    {
        const bool has_debians = access("/usr/bin/python3", X_OK) == 0;
        arguments.insert(arguments.begin(), has_debians ? "/usr/bin/python3" : "python3");
        std::vector<char*> argv;
        for (std::string& a : arguments) argv.push_back(a.data());
        argv.push_back(nullptr);
        // Output of python goes to stderr: stdout may be for the JSON.
        posix_spawn_file_actions_t actions{};
        posix_spawn_file_actions_init(&actions);
        posix_spawn_file_actions_adddup2(&actions, STDERR_FILENO, STDOUT_FILENO);
        pid_t child   = 0;
        int status    = 0;
        const int bad = posix_spawnp(&child, argv[0], &actions, nullptr, argv.data(), environ);
        posix_spawn_file_actions_destroy(&actions);
        if (bad != 0 || waitpid(child, &status, 0) != child || !WIFEXITED(status)) return 1;
        return WEXITSTATUS(status);
    }

    std::filesystem::path directory_, script_;
};

}  // namespace

int verify(const VerifyOptions& options)
{
    StudyChoice choice{options.name, options.all, options.methods, options.cells, options.ppc, {}};
    for (const std::string& text : options.overrides) choice.settings.push_back(parse_setting(text));
    const std::vector<Resolved> studies = choose_studies(choice);
    if (options.json && *options.json != "-") require_writable_file("--json", *options.json);
    std::optional<Data> data;
    if (options.data) data.emplace("--data", *options.data);
    std::optional<Figures> figures;
    if (options.figures) {
        data.emplace("--figures", *options.figures);
        figures.emplace(*options.figures);
    }
    std::FILE* table = options.json == "-" ? stderr : stdout;
    std::vector<Result> results;
    int failures = 0;
    for (const Resolved& study : studies) {
        results.push_back(run_study(study, data ? &*data : nullptr, static_cast<int>(results.size()) + 1, table));
        failures += results.back().pass() == false;
        if (options.json && *options.json != "-") write_file(*options.json, to_json(results));  // results so far, in long runs
    }
    const std::string json = to_json(results);
    if (options.json == "-") fmt::print("{}", json);
    if (data) data->write(results);
    if (figures) figures->draw();
    if (failures > 0) io::say("ordo: {} of {} studies miss a bar\n", failures, studies.size());
    return failures > 0 ? 1 : 0;
}

}  // namespace ordo::app
