#include "io/file.hpp"

#include "base/error.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace ordo::io {

namespace {

[[noreturn]] void fail(const std::filesystem::path& path, std::string_view what)
{
    throw OutputError(fmt::format("{}: {}: {}", path.string(), what, std::strerror(errno)));
}

}  // namespace

AtomicFile::AtomicFile(std::filesystem::path path) : path_(std::move(path)), part_(path_.string() + ".part")
{
    file_.reset(std::fopen(part_.c_str(), "wb"));
    if (!file_) fail(part_, "cannot be created");
}

AtomicFile::~AtomicFile()
{
    if (!file_) return;
    file_.reset();
    std::error_code none;
    std::filesystem::remove(part_, none);
}

void AtomicFile::write(std::string_view text)
{
    if (std::fwrite(text.data(), 1, text.size(), file_.get()) != text.size()) fail(part_, "cannot be written");
}

void AtomicFile::commit()
{
    if (std::fflush(file_.get()) != 0) fail(part_, "cannot be written");
    file_.reset();
    if (std::rename(part_.c_str(), path_.c_str()) != 0) fail(path_, "cannot be named");
}

LineFile::LineFile(std::filesystem::path path, std::string_view header) : path_(std::move(path))
{
    AtomicFile file(path_);
    file.write(fmt::format("{}\n", header));
    file.commit();
}

void LineFile::add(std::string_view line)
{
    pending_ += line;
    pending_ += '\n';
    if (pending_.size() > 1 << 16) flush();
}

void LineFile::flush()
{
    if (pending_.empty()) return;
    const int file = ::open(path_.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
    if (file < 0) fail(path_, "cannot be opened");
    const ssize_t written = ::write(file, pending_.data(), pending_.size());
    const bool complete   = written == static_cast<ssize_t>(pending_.size());
    if (!complete) {
        // Disk full in the middle of a line: take the part back, so that the file ends with a whole line.
        const int reason = written < 0 ? errno : ENOSPC;
        const off_t size = ::lseek(file, 0, SEEK_END);
        if (written > 0 && size >= written && ::ftruncate(file, size - written) != 0) errno = reason;
        ::close(file);
        errno = reason;
        fail(path_, "cannot be written");
    }
    ::close(file);
    pending_.clear();
}

}  // namespace ordo::io
