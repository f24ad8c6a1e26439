#include "app/ranks.hpp"

#include "app/commands.hpp"
#include "base/agree.hpp"
#include "base/error.hpp"
#include "base/parallel.hpp"
#include "io/message.hpp"
#include "io/program.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>
#include <thread>

#include <dlfcn.h>
#include <unistd.h>
#if defined(__linux__)
#include <sched.h>
#endif

namespace ordo::app {

namespace {

constexpr const char* kLibrary = "libordo_ranks.so";

/// A launcher's variables, and what they say.
struct Launcher {
    const char *of_count, *of_index;

    static int number(const char* name)
    {
        const char* text = std::getenv(name);
        return text ? std::atoi(text) : 0;
    }
    int count() const { return number(of_count); }
    int index() const { return number(of_index); }
};

/// The one that has started several processes; null if none has.
const Launcher* launcher()
{
    static constexpr Launcher all[] = {
        {"OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK"}, {"PMI_SIZE", "PMI_RANK"}, {"SLURM_STEP_NUM_TASKS", "SLURM_PROCID"}};
    for (const Launcher& one : all)
        if (one.count() > 1) return &one;
    return nullptr;
}

/// "started as one of 4 processes (PMI_SIZE)"
std::string started() { return fmt::format("started as one of {} processes ({})", launcher()->count(), launcher()->of_count); }

/// The function that starts ranks, in the library beside the program or where it is installed.
StartRanks* starter()
{
    std::error_code none;
    const std::filesystem::path beside = folder_of_program();
    std::string reason;
    for (const std::filesystem::path& folder : {beside, beside / ".." / "lib" / "ordo"}) {
        if (!std::filesystem::exists(folder / kLibrary, none)) continue;
        if (void* handle = dlopen((folder / kLibrary).c_str(), RTLD_NOW | RTLD_GLOBAL | RTLD_NODELETE))
            if (void* address = dlsym(handle, "ordo_start_ranks")) return reinterpret_cast<StartRanks*>(address);
        reason = dlerror();
    }
    throw InputError(reason.empty()
                         ? fmt::format("{}, but this ordo was built without ranks: build with -DORDO_RANKS=ON "
                                       "(packages libopenmpi-dev openmpi-bin), or start it without mpiexec or srun, with "
                                       "--threads for more cores; if each process "
                                       "has a case of its own, unset {}",
                                       started(), launcher()->of_count)
                         : fmt::format("{} cannot be loaded: {}; install the packages that it was built with", kLibrary, reason));
}

std::string model_of_processor()
{
    std::string text;
    if (std::FILE* file = std::fopen("/proc/cpuinfo", "r")) {
        std::array<char, 4096> block{};
        text.assign(block.data(), std::fread(block.data(), 1, block.size(), file));
        std::fclose(file);
    }
    const std::size_t at = text.find("model name");
    return at == std::string::npos ? "" : text.substr(at, text.find('\n', at) - at);
}

/// Bits hold between equal programs on equal processors.
void warn_of_differences(Ranks& ranks)
{
    const std::string mine = io::this_program() + ", " + model_of_processor();
    const auto all         = gather_all(ranks, std::vector<char>(mine.begin(), mine.end()));
    if (std::any_of(all.begin(), all.end(), [&](const auto& one) { return one != all.front(); }))
        io::say(
            "ordo: warning: ranks run on different processors or programs: results may differ in the last digits from those of "
            "one machine\n");
}

}  // namespace

setup::Share launched_share() { return launcher() ? setup::Share{launcher()->index(), launcher()->count()} : setup::Share{}; }

void require_one_process()
{
    if (launcher())
        throw InputError(
            fmt::format("{}, but this command runs on one; start it without mpiexec or srun; if each process has a case "
                        "of its own, unset {}",
                        started(), launcher()->of_count));
}

Launch::Launch()
{
    if (!launcher()) return;
    io::leaves_messages() = launcher()->index() > 0;
    starter_              = starter();
}

Ranks& Launch::start()
{
    if (!starter_) return alone();
    ranks_.reset(starter_());
    const bool differs = ranks_->count() != launcher()->count() || ranks_->index() != launcher()->index();
    if (largest(*ranks_, differs ? 1 : 0) > 0)
        throw InputError(
            fmt::format("{}, but MPI finds rank {} of {}: the launcher is of another MPI than the one that ordo was built with",
                        started(), ranks_->index(), ranks_->count()));
    io::leaves_messages() = ranks_->index() > 0;
    warn_of_differences(*ranks_);
    return *ranks_;
}

void Launch::fail(const std::exception& error)
{
    if (!ranks_) {
        if (io::leaves_messages()) std::this_thread::sleep_for(std::chrono::seconds(3));
        io::leaves_messages() = false;
        return;
    }
    const bool is_agreed = dynamic_cast<const InputError*>(&error) || dynamic_cast<const NumericalError*>(&error) ||
                           dynamic_cast<const OutputError*>(&error);
    if (is_agreed) return;
    io::leaves_messages() = false;
    io::say("ordo: the run failed on rank {}: {}\n", ranks_->index(), error.what());
    ranks_->abort();
}

void Launch::divide_threads()
{
#if defined(__linux__)
    if (!ranks_) return;
    struct Place {
        std::array<char, 256> host;
        cpu_set_t cores;
    };
    Place mine{};
    gethostname(mine.host.data(), mine.host.size() - 1);
    CPU_ZERO(&mine.cores);
    sched_getaffinity(0, sizeof(mine.cores), &mine.cores);
    int sharing = 0;
    for (const auto& of_rank : gather_all(*ranks_, std::vector<Place>{mine})) {
        cpu_set_t common;
        CPU_AND(&common, &mine.cores, &of_rank.front().cores);
        sharing += of_rank.front().host == mine.host && CPU_COUNT(&common) > 0;
    }
    set_thread_count(std::max(CPU_COUNT(&mine.cores) / std::max(sharing, 1), 1));
#endif
}

}  // namespace ordo::app
