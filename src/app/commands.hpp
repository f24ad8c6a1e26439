// The commands of `ordo`, one function each; main.cpp parses the line and turns exceptions into exit codes.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace CLI {
class App;
}  // namespace CLI

namespace ordo::app {

/// Adds the command `drive`; running it sets the exit code.
void add_drive(CLI::App& cli, int& result);

struct RunOptions {
    std::string file;
    std::vector<std::string> overrides;  ///< key=value
    std::optional<std::string> output;
    std::optional<std::string> restart;  ///< a checkpoint, or "latest"
    bool overwrite   = false;            ///< delete results that are there
    bool quiet       = false;
    bool has_threads = false;  ///< their number is given
};

/// Runs a case; returns the exit code: 0, or 130/143 after SIGINT/SIGTERM.
int run(const RunOptions& options);

/// Parses and validates a case and prints it with every default.
int check(const RunOptions& options);

/// Lists methods, materials, shapes, cases or input; all except input if `what` is empty.
int list(const std::string& what);

struct VerifyOptions {
    std::string name;  ///< of the case; empty with `all`
    bool all = false;
    std::vector<std::string> methods;
    std::vector<int> cells;
    std::optional<int> ppc;
    std::vector<std::string> overrides;  ///< key=value
    std::optional<std::string> json;     ///< file, or - for stdout
    std::optional<std::string> data;     ///< directory
    std::optional<std::string> figures;  ///< directory
};

/// Runs verification cases and judges them by their bars; returns 1 if a bar is missed.
int verify(const VerifyOptions& options);

/// Where this program lies, with links followed; what belongs to it is found from there. Empty if that is not known.
std::filesystem::path folder_of_program();

/// The two sides of `--set key=value`. Throws InputError.
std::pair<std::string, std::string> parse_setting(const std::string& text);

/// Throws InputError if a file cannot be written; called before long runs. The message names `option`.
void require_writable_file(const std::string& option, const std::string& path);

struct BenchOptions {
    bool machine = false;
    bool all     = false;               ///< every preset
    std::optional<int> dim;             ///< default 3; with `all` 2 and 3
    std::optional<std::string> method;  ///< default mpm
    std::string material = "neo-hookean";
    std::vector<std::string> overrides;  ///< key=value
    std::optional<int> particles;        ///< default 1e6; with `all` 2e5
    std::optional<int> steps;            ///< default 20; with `all` as many as take about two seconds
    int repeats = 1;
    std::optional<std::string> json;  ///< file, or - for stdout
};

/// Times a block of material for one method or all, or the machine; returns 1 if a run failed.
int bench(const BenchOptions& options);

}  // namespace ordo::app
