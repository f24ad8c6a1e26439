#include "io/run_directory.hpp"

#include "base/error.hpp"
#include "io/file.hpp"
#include "io/run_files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <sstream>
#include <tuple>
#include <vector>

namespace ordo::io {

namespace {

constexpr const char* kList = "files.txt";
constexpr const char* kLock = "run.lock";

std::string host()
{
    std::array<char, 256> name{};
    if (::gethostname(name.data(), name.size() - 1) != 0) return "an unknown host";
    return name.data();
}

std::string this_process() { return fmt::format("process {} on {}", ::getpid(), host()); }

/// Whether the process that `this_process` named may still live.
bool may_live(const std::string& holder)
{
    std::istringstream words(holder);
    std::string process, on, where;
    int id = 0;
    if (!(words >> process >> id >> on >> where)) return false;
    return where != host() || ::kill(id, 0) == 0 || errno == EPERM;
}

std::string text_of(const std::filesystem::path& file)
{
    std::ifstream in(file);
    std::string line;
    std::getline(in, line);
    return line;
}

/// The names in files.txt; nothing that is not a plain name in the directory.
std::set<std::string> listed(const std::filesystem::path& directory)
{
    std::set<std::string> r;
    std::ifstream in(directory / kList);
    for (std::string line; std::getline(in, line);)
        if (!line.empty() && line[0] != '#' && line.find('/') == std::string::npos) r.insert(line);
    if (in.is_open()) r.insert(kList);
    return r;
}

/// Throws if the directory holds files under names of results that no list names, or results that may not be replaced.
void require_no_loss(const OutputInput& output, Earlier earlier)
{
    const std::filesystem::path directory(output.directory);
    std::error_code none;
    if (!std::filesystem::is_directory(directory, none)) return;
    std::vector<std::string> names;  // before the list: a run that goes on names its files before it makes them
    for (const auto& entry : std::filesystem::directory_iterator(directory, none))
        names.push_back(entry.path().filename().string());
    const std::set<std::string> own = listed(directory);
    for (const std::string& name : names) {
        if (!is_run_file(name) || own.contains(name)) continue;
        if (earlier == Earlier::go_on && step_of_checkpoint(name)) continue;  // brought from elsewhere, to continue from
        output.fail("directory",
                    fmt::format("{} holds {}, which {} does not name as the file of a run and which would be lost; move it away "
                                "or choose another directory with --output",
                                directory.string(), name, kList));
    }
    if (earlier == Earlier::refuse && !own.empty())
        output.fail("directory",
                    fmt::format("{} holds the results of an earlier run; continue it with --restart latest, choose another "
                                "directory with --output, or give --overwrite to delete the files that {} names",
                                directory.string(), (directory / kList).string()));
}

}  // namespace

void require_usable(const OutputInput& output, Earlier earlier)
{
    const std::filesystem::path directory(output.directory);
    std::filesystem::path existing = std::filesystem::absolute(directory).lexically_normal();
    std::error_code none;
    while (!std::filesystem::exists(existing, none) && existing.has_relative_path()) existing = existing.parent_path();
    if (!std::filesystem::is_directory(existing, none))
        output.fail("directory", fmt::format("{} cannot be made: {} is not a directory; choose another with --output",
                                             directory.string(), existing.string()));
    if (::access(existing.c_str(), W_OK | X_OK) != 0)
        output.fail("directory", fmt::format("{} cannot be written: {} is not writable; choose another with --output",
                                             directory.string(), existing.string()));
    require_no_loss(output, earlier);
}

DirectoryLock::DirectoryLock(const std::filesystem::path& directory) : file_(directory / kLock)
{
    do open();
    while (!take());
    const std::string text = this_process() + "\n";
    if (::ftruncate(descriptor_, 0) == 0) std::ignore = ::write(descriptor_, text.data(), text.size());  // for messages
}

DirectoryLock::~DirectoryLock()
{
    if (descriptor_ < 0) return;
    ::unlink(file_.c_str());  // before others can take it
    ::close(descriptor_);
}

void DirectoryLock::open()
{
    if (descriptor_ >= 0) ::close(descriptor_);
    descriptor_ = ::open(file_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    if (descriptor_ < 0) throw OutputError(fmt::format("{}: cannot be made: {}", file_.string(), std::strerror(errno)));
}

bool DirectoryLock::take()
{
    const std::string holder = text_of(file_);
    if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
        if (errno == EWOULDBLOCK) refuse(holder, "wait for its end");
        if (may_live(holder))
            refuse(holder, "remove run.lock if that run is over, because this file system has no locks that tell");
    }
    struct stat ours {
    }, there{};
    return ::fstat(descriptor_, &ours) == 0 && ::stat(file_.c_str(), &there) == 0 && ours.st_ino == there.st_ino;
}

void DirectoryLock::refuse(std::string_view holder, std::string_view remedy) const
{
    ::close(descriptor_);
    throw InputError(fmt::format("{}: another run writes there ({}); {}, or choose another directory with --output",
                                 file_.parent_path().string(), holder, remedy));
}

RunDirectory::Made::Made(const std::filesystem::path& path)
{
    std::error_code failure;
    for (auto p                                                           = std::filesystem::absolute(path).lexically_normal();
         p.has_relative_path() && !std::filesystem::exists(p, failure); p = p.parent_path())
        new_ones.push_back(p);
    std::filesystem::create_directories(path, failure);
    if (failure) throw OutputError(fmt::format("{}: cannot be made: {}", path.string(), failure.message()));
}

RunDirectory::Made::~Made()
{
    std::error_code none;
    for (const auto& p : new_ones) std::filesystem::remove(p, none);  // fails if it is not empty
}

RunDirectory::RunDirectory(const OutputInput& output, Earlier earlier, bool is_held) : path_(output.directory)
{
    if (!is_held) return;
    made_.emplace(path_);
    lock_.emplace(path_);
    require_no_loss(output, earlier);  // again, now that no other run can change it
    files_ = listed(path_);
}

std::filesystem::path RunDirectory::file(const std::string& name)
{
    if (files_.insert(name).second) write_list();
    return path_ / name;
}

void RunDirectory::remove(std::set<std::string> names)
{
    std::vector<std::string> order(names.begin(), names.end());
    auto is_list = [](const std::string& name) { return name.ends_with(".pvd"); };
    std::stable_partition(order.begin(), order.end(), is_list);
    for (const std::string& name : order) {
        if (!files_.contains(name) || name == kList) continue;
        for (const std::string& file : {name, name + ".part"}) {
            std::error_code failure;
            std::filesystem::remove(path_ / file, failure);
            if (failure) throw OutputError(fmt::format("{}: cannot be removed: {}", (path_ / file).string(), failure.message()));
        }
    }
    for (const std::string& name : order) files_.erase(name);
    write_list();
}

void RunDirectory::write_list() const
{
    std::string text = "# Files of a run of ordo, which --overwrite deletes.\n";
    for (const std::string& name : files_)
        if (name != kList) text += name + "\n";
    AtomicFile list(path_ / kList);
    list.write(text);
    list.commit();
}

std::string expanded_directory(const CaseInput& input)
{
    CaseInput portable        = input;
    portable.output.directory = "";
    const std::string& given  = input.output.directory;
    std::string r;
    for (std::size_t at = 0; at < given.size();) {
        const std::size_t end = given[at] == '{' ? given.find('}', at) : std::string::npos;
        if (end == std::string::npos) {
            r += given[at++];
            continue;
        }
        const std::string word = given.substr(at + 1, end - at - 1);
        if (word == "case")
            r += input.name;
        else if (word == "hash")
            r += fmt::format("{:010x}", checksum(echo_case(portable)) >> 24);
        else
            input.output.fail("directory", fmt::format("{{{}}} is unknown; {{case}} and {{hash}} may stand there", word));
        at = end + 1;
    }
    return r;
}

}  // namespace ordo::io
