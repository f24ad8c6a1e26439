// The directory that a run writes to: locked while the run lives, with a list of the files that are its own.
#pragma once

#include "io/input.hpp"

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace ordo::io {

/// Whether a directory holds the results of a run: case.toml says so.
inline bool has_results(const std::filesystem::path& directory) { return std::filesystem::exists(directory / "case.toml"); }

/// What becomes of results that are in the directory already.
enum class Earlier { refuse, overwrite, go_on };

/// Throws InputError when the output directory cannot be used; changes nothing.
void require_usable(const OutputInput& output, Earlier earlier);

/// A lock that one process at a time can hold, and that dies with it: flock() on `run.lock`. Where the file system has no locks
/// (ENOLCK, ENOSYS, ..), the file's text says who holds it: a lock of a process on this host that has ended is taken over.
class DirectoryLock {
  public:
    /// Throws InputError if another run holds it.
    explicit DirectoryLock(const std::filesystem::path& directory);
    ~DirectoryLock();  ///< removes the file
    DirectoryLock(const DirectoryLock&) = delete;

  private:
    void open();
    bool take();  ///< false if the file was removed meanwhile
    [[noreturn]] void refuse(std::string_view holder, std::string_view remedy) const;

    std::filesystem::path file_;
    int descriptor_ = -1;
};

/// Only files that its list `files.txt` names are ever removed. A name joins the list before its file is made.
class RunDirectory {
  public:
    /// Makes the directory and locks it; removes nothing yet. Throws InputError, and OutputError if it cannot be made. Without `is_held`
    /// another process of the run does all that.
    RunDirectory(const OutputInput& output, Earlier earlier, bool is_held = true);

    const std::filesystem::path& path() const { return path_; }
    /// The path of a file that the run is about to make; from now on it is in the list.
    std::filesystem::path file(const std::string& name);
    /// Removes the files, those that list others first: a run killed here must not leave a list of files that are gone.
    void remove(std::set<std::string> names);
    /// Those in the list.
    const std::set<std::string>& files() const { return files_; }

  private:
    /// The directory and those above it; what was made here and stays empty goes again.
    struct Made {
        explicit Made(const std::filesystem::path& path);
        ~Made();
        std::vector<std::filesystem::path> new_ones;  ///< the deepest first
    };
    void write_list() const;

    std::filesystem::path path_;
    std::optional<Made> made_;
    std::optional<DirectoryLock> lock_;
    std::set<std::string> files_;
};

/// `directory` with {case} replaced by the name of the case and {hash} by a hash of all that `input` says but the directory. Throws
/// InputError for other words in braces.
std::string expanded_directory(const CaseInput& input);

}  // namespace ordo::io
