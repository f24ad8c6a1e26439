// The command line of ordo. Exit codes: 0 good, 1 the run or a check failed, 2 bad usage or input.
#include "app/commands.hpp"
#include "base/error.hpp"
#include "base/parallel.hpp"
#include "io/message.hpp"
#include "io/schema.hpp"
#include "ordo_version.hpp"

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

#include <unistd.h>

namespace {

int dispatch(int argc, char** argv)
{
    using namespace ordo;
    CLI::App cli{"ordo: a material point method of accurate order at large deformation"};
    cli.set_version_flag("--version", fmt::format("ordo {} ({})", ORDO_VERSION, ORDO_COMMIT));
    cli.require_subcommand(1);

    int threads       = 0;
    int result        = 0;
    auto with_threads = [&](CLI::App* command) {
        command->add_option("--threads", threads, "number of threads; all cores without it")->check(CLI::Range(1, 1024));
    };
    auto prepare = [&] {
        if (threads > 0) set_thread_count(threads);
    };

    app::RunOptions run_options;
    std::string output, restart;
    auto with_case = [&](CLI::App* command) {
        command->add_option("case", run_options.file, "case file (TOML)")->required();
        command->add_option("--set", run_options.overrides, "override an input key, key=value; may be repeated")
            ->allow_extra_args(false);
        command->add_option("--output", output, "directory of the output files");
    };
    CLI::App* run = cli.add_subcommand("run", "run a case");
    with_case(run);
    with_threads(run);
    run->add_option("--restart", restart,
                    "go on from a checkpoint: its file, or latest for the newest good one in the output directory");
    run->add_flag("--quiet", run_options.quiet, "no progress, no summary");
    run->callback([&] {
        prepare();
        if (!output.empty()) run_options.output = output;
        if (run->count("--restart") > 0) run_options.restart = restart;
        result = app::run(run_options);
    });

    CLI::App* check = cli.add_subcommand("check", "parse and validate a case, print it with every default");
    with_case(check);
    check->callback([&] {
        if (!output.empty()) run_options.output = output;
        result = app::check(run_options);
    });

    std::string what;
    CLI::App* list = cli.add_subcommand("list", "what there is: methods, materials, shapes, cases, input (the reference page)");
    list->add_option("what", what)->check(CLI::IsMember({"methods", "materials", "shapes", "cases", "input"}));
    list->callback([&] { result = app::list(what); });

    app::VerifyOptions verify_options;
    std::string json, data, figures;
    int ppc = 0;
    CLI::App* verify =
        cli.add_subcommand("verify", "run cases with known answers: errors, orders and whether they meet the bars");
    CLI::Option* name = verify->add_option("case", verify_options.name, "case; see ordo list cases");
    CLI::Option* all  = verify->add_flag("--all", verify_options.all, "every study of every case (minutes)");
    verify->add_option("--method", verify_options.methods, "presets, separated by commas")
        ->delimiter(',')
        ->allow_extra_args(false);
    verify->add_option("--cells", verify_options.cells, "meshes, in cells per unit length, separated by commas")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->check(CLI::Range(1, 1'000'000));
    verify->add_option("--ppc", ppc, "particles per cell, counted over the whole cell")->check(CLI::Range(1, 1'000'000));
    verify->add_option("--set", verify_options.overrides, "set a parameter of the case or an axis, key=value; may be repeated")
        ->allow_extra_args(false);
    verify->add_option("--json", json, "write JSON to a file, or to stdout with -");
    verify->add_option("--data", data, "directory for sums over time and particles at the end, as CSV, and their verify.json");
    verify->add_option("--figures", figures, "directory for these and plots of them (needs python3 with matplotlib)");
    with_threads(verify);
    verify->callback([&] {
        prepare();
        if (name->count() + all->count() != 1)
            throw InputError(
                fmt::format("ordo verify needs a case, or --all{}; see ordo list cases", all->count() > 0 ? ", not both" : ""));
        if (ppc > 0) verify_options.ppc = ppc;
        if (verify->count("--json") > 0) verify_options.json = json;
        if (verify->count("--data") > 0) verify_options.data = data;
        if (verify->count("--figures") > 0) verify_options.figures = figures;
        if (verify_options.data && verify_options.figures)
            throw InputError("--figures: it writes what --data does; give one of them");
        result = app::verify(verify_options);
    });

    app::BenchOptions bench_options;
    CLI::App* bench = cli.add_subcommand("bench", "particle-steps per second on a block of neo-Hookean material");
    bench->add_flag("--machine", bench_options.machine,
                    "measure the peak of fused multiply-adds and the memory bandwidth instead");
    bench->add_flag("--all", bench_options.all, "every preset, in 2D and 3D (minutes)");
    bench->add_option("--dim", bench_options.dim, "dimensions; 3 without it")->check(CLI::Range(1, 3));
    bench->add_option("--method", bench_options.method, "preset; mpm without it");
    bench->add_option("--set", bench_options.overrides, "set an axis of the preset, key=value; may be repeated")
        ->allow_extra_args(false);
    bench->add_option("--particles", bench_options.particles, "about how many; 1000000 without it, 200000 with --all")
        ->check(CLI::Range(1, 2'000'000'000));
    bench
        ->add_option("--steps", bench_options.steps,
                     "steps to time; 20 without it, with --all as many of these as two seconds allow")
        ->check(CLI::Range(1, 1'000'000'000));
    bench->add_option("--repeat", bench_options.repeats, "times to time them; the medians are reported")
        ->check(CLI::Range(1, 1'000'000));
    bench->add_option("--json", json, "write JSON to a file, or to stdout with -");
    with_threads(bench);
    bench->callback([&] {
        prepare();
        if (!json.empty()) bench_options.json = json;
        result = app::bench(bench_options);
    });

    if (argc > 1 && argv[1][0] != '-') {  // CLI11 would only say that a command is missing
        std::vector<std::string> commands;
        for (const CLI::App* command : cli.get_subcommands({})) commands.push_back(command->get_name());
        if (std::find(commands.begin(), commands.end(), argv[1]) == commands.end())
            throw InputError(std::string(argv[1]) + ": there is no such command. " + io::suggestion(argv[1], commands) +
                             " See ordo --help.");
    }
    try {
        cli.parse(argc, argv);
    } catch (const CLI::Success& e) {
        return cli.exit(e);  // --help and --version
    } catch (const CLI::ParseError& e) {
        cli.exit(e);
        return 2;
    }
    return result;
}

/// Threads that wait must give up their core soon: with two busy neighbours a small 2D case took 2 to 30 times as long as
/// with a short spin, while without neighbours the short spin cost nothing (2 cores, 2026-11). libgomp reads its
/// environment when it is loaded, before main, so the program starts itself again, unless the user has chosen.
void start_with_short_spin([[maybe_unused]] char** argv)
{
#if defined(ORDO_OPENMP) && defined(__linux__)
    if (std::getenv("OMP_WAIT_POLICY") || std::getenv("GOMP_SPINCOUNT")) return;
    std::error_code none;
    const auto self = std::filesystem::read_symlink("/proc/self/exe", none);
    if (none || setenv("GOMP_SPINCOUNT", "300", 1) != 0) return;
    execv(self.c_str(), argv);  // returns only where it fails; then all goes on as it was
#endif
}

}  // namespace

int main(int argc, char** argv)
{
    using ordo::io::say;
    start_with_short_spin(argv);
    std::signal(SIGPIPE, SIG_IGN);  // a reader that goes away must not end a run
    std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is an error that says so
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
        if (e.code() == std::errc::broken_pipe) return 128 + SIGPIPE;  // the reader of stdout has seen enough
        say("ordo: the run failed: {}\n", e.what());
    } catch (const std::exception& e) {
        say("ordo: the run failed: {}\n", e.what());
    }
    return 1;
}
