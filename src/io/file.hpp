// Files that are whole or absent: written beside their name and renamed when complete.
#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace ordo::io {

/// A file under construction. Without `commit` nothing is left. Throws OutputError when the disk refuses. Links are
/// followed; devices and pipes are written as they are.
class AtomicFile {
  public:
    enum class Start { empty, copy };
    /// Starts empty, or as a copy of the file there is.
    explicit AtomicFile(std::filesystem::path path, Start start = Start::empty);
    ~AtomicFile();
    AtomicFile(const AtomicFile&) = delete;

    void write(std::string_view text);
    template <class T>
    void write_binary(std::span<const T> values)
    {
        write({reinterpret_cast<const char*>(values.data()), values.size_bytes()});
    }
    /// Gives the file its name, replacing what was there.
    void commit();

  private:
    struct Close {
        void operator()(std::FILE* f) const { std::fclose(f); }
    };
    std::filesystem::path path_, part_;
    std::unique_ptr<std::FILE, Close> file_;
};

/// A text file that grows by lines. It is replaced as a whole each time: a process killed in the middle of an appending
/// write would leave half a line (seen at page boundaries).
class LineFile {
  public:
    LineFile() = default;
    /// Starts the file with a header line.
    LineFile(std::filesystem::path path, std::string_view header);

    void add(std::string_view line);
    /// Writes the lines added so far; a large file waits until a second has passed since the last time.
    enum class When { soon, now };
    void flush(When when);

  private:
    using Clock = std::chrono::steady_clock;
    std::filesystem::path path_;
    std::string pending_;
    std::uintmax_t size_    = 0;
    Clock::time_point last_ = Clock::now();
};

}  // namespace ordo::io
