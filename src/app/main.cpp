// The command line of ordo. Exit codes: 0 good, 1 the run or a check failed, 2 bad usage or input.
#include "app/commands.hpp"
#include "app/ranks.hpp"
#include "base/error.hpp"
#include "base/parallel.hpp"
#include "io/message.hpp"
#include "io/program.hpp"
#include "io/schema.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <new>
#include <system_error>

#if defined(__GLIBC__)
#include <malloc.h>
#endif
#include <unistd.h>

namespace {

using namespace ordo;

/// The options of all commands; `result` is the exit code of the command that ran.
struct CommandLine {
    int threads = 0;  ///< 0 without --threads
    int result  = 0;
    app::RunOptions run;
    std::string output, restart;
    std::string what;  ///< to list
    app::VerifyOptions verify;
    int ppc = 0;  ///< 0 without --ppc
    std::string json, data, figures;
    app::BenchOptions bench;
};

void add_threads(CLI::App& command, CommandLine& line)
{
    command.add_option("--threads", line.threads, "number of threads; default: all cores")->check(CLI::Range(1, 1024));
}

void use_threads(const CommandLine& line)
{
    if (line.threads > 0) set_thread_count(line.threads);
}

void add_case(CLI::App& command, CommandLine& line)
{
    command.add_option("case", line.run.file, "case file (TOML)")->required();
    command.add_option("--set", line.run.overrides, "override an input key, key=value; may be repeated")->allow_extra_args(false);
    command.add_option("--output", line.output, "directory of the output files");
}

void add_run(CLI::App& cli, CommandLine& line)
{
    CLI::App* run = cli.add_subcommand("run", "run a case");
    add_case(*run, line);
    add_threads(*run, line);
    run->add_option("--restart", line.restart,
                    "continue from a checkpoint: its file, or latest for the newest good one in the output directory");
    run->add_flag("--overwrite", line.run.overwrite, "delete the results of an earlier run in the output directory")
        ->excludes("--restart");
    run->add_flag("--quiet", line.run.quiet, "no progress, no summary");
    run->callback([&line, run] {
        use_threads(line);
        line.run.has_threads = line.threads > 0 || std::getenv("OMP_NUM_THREADS");
        if (!line.output.empty()) line.run.output = line.output;
        if (run->count("--restart") > 0) line.run.restart = line.restart;
        line.result = app::run(line.run);
    });
}

void add_check(CLI::App& cli, CommandLine& line)
{
    CLI::App* check = cli.add_subcommand("check", "parse and validate a case, print it with every default");
    add_case(*check, line);
    check->callback([&line] {
        if (!line.output.empty()) line.run.output = line.output;
        line.result = app::check(line.run);
    });
}

void add_list(CLI::App& cli, CommandLine& line)
{
    CLI::App* list = cli.add_subcommand("list", "list methods, materials, shapes, cases or input (the reference page)");
    list->add_option("what", line.what)->check(CLI::IsMember({"methods", "materials", "shapes", "fields", "cases", "input"}));
    list->callback([&line] { line.result = app::list(line.what); });
}

/// Checks options that CLI11 cannot check, and runs the cases.
void verify_as_told(const CLI::App& verify, CommandLine& line)
{
    use_threads(line);
    const std::size_t all = verify.count("--all");
    if (verify.count("case") + all != 1)
        throw InputError(fmt::format("ordo verify needs a case, or --all{}; see ordo list cases", all > 0 ? ", not both" : ""));
    if (line.ppc > 0) line.verify.ppc = line.ppc;
    if (verify.count("--json") > 0) line.verify.json = line.json;
    if (verify.count("--data") > 0) line.verify.data = line.data;
    if (verify.count("--figures") > 0) line.verify.figures = line.figures;
    if (line.verify.data && line.verify.figures)
        throw InputError("--figures: it also writes the files of --data; give only one of them");
    line.result = app::verify(line.verify);
}

void add_verify(CLI::App& cli, CommandLine& line)
{
    CLI::App* verify =
        cli.add_subcommand("verify", "run cases with known answers: errors, orders, and whether they meet the bars");
    verify->add_option("case", line.verify.name, "case; see ordo list cases");
    verify->add_flag("--all", line.verify.all, "every study of every case (minutes)");
    verify->add_option("--method", line.verify.methods, "presets, separated by commas")->delimiter(',')->allow_extra_args(false);
    verify->add_option("--cells", line.verify.cells, "meshes, in cells per unit length, separated by commas")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->check(CLI::Range(1, 1'000'000));
    verify->add_option("--ppc", line.ppc, "particles per cell, counted over the whole cell")->check(CLI::Range(1, 1'000'000));
    verify->add_option("--set", line.verify.overrides, "set a parameter of the case or an axis, key=value; may be repeated")
        ->allow_extra_args(false);
    verify->add_option("--json", line.json, "write JSON to a file, or to stdout with -");
    verify->add_option("--data", line.data,
                       "directory for CSV files of sums over time and of the final particles, and verify.json");
    verify->add_option("--figures", line.figures, "directory for the same files and plots (needs python3 with matplotlib)");
    add_threads(*verify, line);
    verify->callback([&line, verify] { verify_as_told(*verify, line); });
}

void add_bench(CLI::App& cli, CommandLine& line)
{
    CLI::App* bench = cli.add_subcommand("bench", "particle-steps per second on a block of material");
    bench->add_flag("--machine", line.bench.machine, "measure the peak of fused multiply-adds and the memory bandwidth instead");
    bench->add_flag("--all", line.bench.all, "every preset, in 2D and 3D (minutes)");
    bench->add_option("--dim", line.bench.dim, "dimensions; default: 3")->check(CLI::Range(1, 3));
    bench->add_option("--method", line.bench.method, "preset; default: mpm");
    bench->add_option("--material", line.bench.material, "law of the block, weak enough to flow; default: neo-hookean");
    bench->add_option("--set", line.bench.overrides, "set an axis of the preset, key=value; may be repeated")
        ->allow_extra_args(false);
    bench->add_option("--particles", line.bench.particles, "approximate number; default: 1000000, with --all 200000")
        ->check(CLI::Range(1, 2'000'000'000));
    bench
        ->add_option("--steps", line.bench.steps,
                     "steps to time; default: 20, with --all fewer if they take more than two seconds")
        ->check(CLI::Range(1, 1'000'000'000));
    bench->add_option("--repeat", line.bench.repeats, "number of repetitions; medians are reported")
        ->check(CLI::Range(1, 1'000'000));
    bench->add_option("--json", line.json, "write JSON to a file, or to stdout with -");
    add_threads(*bench, line);
    bench->callback([&line] {
        use_threads(line);
        if (!line.json.empty()) line.bench.json = line.json;
        line.result = app::bench(line.bench);
    });
}

/// Suggests the nearest command for an unknown one; CLI11 only says that a command is missing.
void require_known_command(const CLI::App& cli, const std::string& given)
{
    std::vector<std::string> commands;
    for (const CLI::App* command : cli.get_subcommands({})) commands.push_back(command->get_name());
    if (std::find(commands.begin(), commands.end(), given) == commands.end())
        throw InputError(given + ": there is no such command (ordo --help). " + io::suggestion(given, commands));
}

/// Runs the command that the line names; returns the exit code.
int dispatch(int argc, char** argv)
{
    CLI::App cli{"ordo: a material point method of accurate order at large deformation"};
    cli.set_version_flag("--version", io::version_text());
    cli.require_subcommand(1);

    CommandLine line;
    add_run(cli, line);
    add_check(cli, line);
    add_list(cli, line);
    add_verify(cli, line);
    add_bench(cli, line);
    app::add_drive(cli, line.result);

    if (argc > 1 && argv[1][0] != '-') {
        require_known_command(cli, argv[1]);
        if (const std::string command = argv[1]; command != "run" && command != "bench") app::require_one_process();
    }
    try {
        cli.parse(argc, argv);
    } catch (const CLI::Success& e) {
        return cli.exit(e);  // --help and --version
    } catch (const CLI::ParseError& e) {
        cli.exit(e);
        return 2;
    }
    return line.result;
}

/// Waiting threads must give up their core soon: with two busy neighbours a small 2D case took 2 to 30 times as long as with a
/// short spin; without neighbours the short spin cost nothing (2 cores, 2026-11). libgomp reads its environment when it is
/// loaded, before main, so the program starts itself again, unless the user has set the environment.
void start_with_short_spin([[maybe_unused]] char** argv)
{
#if defined(ORDO_OPENMP) && defined(__linux__)
    if (std::getenv("OMP_WAIT_POLICY") || std::getenv("GOMP_SPINCOUNT")) return;
    std::error_code none;
    const auto self = std::filesystem::read_symlink("/proc/self/exe", none);
    if (none || setenv("GOMP_SPINCOUNT", "300", 1) != 0) return;
    execv(self.c_str(), argv);  // returns only if it fails; then we continue as we are
#endif
}

/// Implicit steps free matrices of megabytes and ask for them again: without this each time from the system, whose page faults took an eighth of
/// a quasi-static run.
void keep_freed_memory()
{
#if defined(__GLIBC__)
    constexpr int megabyte = 1 << 20;
    mallopt(M_MMAP_THRESHOLD, 32 * megabyte);  // the most that it takes
    mallopt(M_TRIM_THRESHOLD, 256 * megabyte);
#endif
}

}  // namespace

int main(int argc, char** argv)
{
    using ordo::io::say;
    start_with_short_spin(argv);
    keep_freed_memory();
    std::signal(SIGPIPE, SIG_IGN);  // a reader that goes away must not end a run
    std::signal(SIGXFSZ, SIG_IGN);  // a file at its size limit gives a write error instead
    try {
        const int result = dispatch(argc, argv);
        std::cout.flush();
        if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout.good()) return result;
        say("ordo: stdout cannot be written\n");
        return result == 0 ? 1 : result;
    } catch (const ordo::InputError& e) {
        say("ordo: error: {}\n", e.what());
        return 2;
    } catch (const ordo::NumericalError& e) {
        say("ordo: the run failed: {}\n", e.what());
    } catch (const std::bad_alloc&) {
        say("ordo: the run failed: out of memory; use fewer particles or a coarser grid\n");
    } catch (const std::system_error& e) {
        if (e.code() == std::errc::broken_pipe) return 128 + SIGPIPE;  // the reader of stdout has gone
        say("ordo: the run failed: {}\n", e.what());
    } catch (const std::exception& e) {
        say("ordo: the run failed: {}\n", e.what());
    }
    return 1;
}
