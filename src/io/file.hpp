// Files that are whole or absent: written beside their name and renamed when complete.
#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace ordo::io {

/// A file under construction. Without `commit` nothing is left. Throws OutputError when the disk refuses.
class AtomicFile {
  public:
    explicit AtomicFile(std::filesystem::path path);
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

/// A text file that grows by whole lines: a killed run leaves no half line.
class LineFile {
  public:
    LineFile() = default;
    /// Starts the file with a header line.
    LineFile(std::filesystem::path path, std::string_view header);

    void add(std::string_view line);
    /// Hands all lines to the system in one write.
    void flush();

  private:
    std::filesystem::path path_;
    std::string pending_;
};

}  // namespace ordo::io
