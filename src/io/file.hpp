// Files that are whole or absent: written under a temporary name and renamed when complete.
#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace ordo::io {

/// The temporary name of a file, `path` with ".part". Without `commit` nothing is left. Links are followed; devices and pipes
/// are written directly. Throws OutputError.
class PartName {
  public:
    explicit PartName(std::filesystem::path path);
    ~PartName();
    PartName(const PartName&) = delete;

    const std::filesystem::path& path() const { return path_; }
    const std::filesystem::path& part() const { return part_; }
    /// Gives the file its name, replacing what was there.
    void commit();

  private:
    std::filesystem::path path_, part_;
    bool is_complete_ = false;
};

/// A file under construction. Without `commit` nothing is left. Throws OutputError if writing fails.
class AtomicFile {
  public:
    /// Starts empty, or with the first bytes of the existing file.
    explicit AtomicFile(std::filesystem::path path, std::uintmax_t bytes_kept = 0);

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
    PartName name_;
    std::unique_ptr<std::FILE, Close> file_;
};

/// The checksum (FNV-1a, 64 bits) of bytes that follow those of checksum `before`.
inline constexpr std::uint64_t kNoBytes = 0xcbf29ce484222325u;
std::uint64_t checksum(std::string_view bytes, std::uint64_t before = kNoBytes);
/// The checksum of `bytes` bytes of a file from place `first` on; nothing if the file is shorter.
std::optional<std::uint64_t> checksum_of(const std::filesystem::path& file, std::uintmax_t bytes, std::uintmax_t first = 0);

/// A text file that grows by lines. It is replaced as a whole each time, because an appending write that was killed left half
/// a line (seen at page boundaries).
class LineFile {
  public:
    LineFile() = default;
    /// Starts the file with a header line.
    LineFile(std::filesystem::path path, std::string_view header);
    /// Continues after the first bytes of the existing file, whose checksum is `sum`; the rest of the file is dropped.
    LineFile(std::filesystem::path path, std::uintmax_t bytes_kept, std::uint64_t sum);

    /// Number of bytes and their checksum, including those not written yet.
    std::uintmax_t size() const { return size_ + pending_.size(); }
    std::uint64_t sum() const { return sum_; }

    void add(std::string_view line);
    /// Writes the lines added so far. With `soon` a large file is written at most once a second.
    enum class When { soon, now };
    void flush(When when);

  private:
    using Clock = std::chrono::steady_clock;
    std::filesystem::path path_;
    std::string pending_;
    std::uintmax_t size_    = 0;
    std::uint64_t sum_      = kNoBytes;
    Clock::time_point last_ = Clock::now();
};

}  // namespace ordo::io
