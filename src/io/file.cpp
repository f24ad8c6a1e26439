#include "io/file.hpp"

#include "base/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>

namespace ordo::io {

namespace {

[[noreturn]] void fail(const std::filesystem::path& path, std::string_view what)
{
    throw OutputError(fmt::format("{}: {}: {}", path.string(), what, std::strerror(errno)));
}

}  // namespace

PartName::PartName(std::filesystem::path path) : path_(std::move(path))
{
    std::error_code failure;
    const auto status = std::filesystem::status(path_, failure);  // of the target of a link
    if (std::filesystem::is_directory(status)) throw OutputError(fmt::format("{}: is a directory", path_.string()));
    const bool exists = std::filesystem::exists(status), is_device = exists && !std::filesystem::is_regular_file(status);
    const auto target = exists && !is_device ? std::filesystem::canonical(path_, failure) : path_;
    if (!failure) path_ = target;                                                 // else it has gone meanwhile
    part_ = is_device ? path_ : std::filesystem::path(path_.string() + ".part");  // a pipe must stay a pipe
}

PartName::~PartName()
{
    std::error_code none;
    if (!is_complete_ && part_ != path_) std::filesystem::remove(part_, none);
}

void PartName::commit()
{
    if (part_ != path_ && std::rename(part_.c_str(), path_.c_str()) != 0) fail(path_, "cannot be renamed from its .part file");
    is_complete_ = true;
}

AtomicFile::AtomicFile(std::filesystem::path path, std::uintmax_t bytes_kept) : name_(std::move(path))
{
    const auto& part = name_.part();
    if (bytes_kept > 0 && part != name_.path()) {
        std::error_code failure;
        std::filesystem::copy_file(name_.path(), part, std::filesystem::copy_options::overwrite_existing, failure);
        if (!failure) std::filesystem::resize_file(part, bytes_kept, failure);
        if (failure) throw OutputError(fmt::format("{}: cannot be copied: {}", name_.path().string(), failure.message()));
    }
    file_.reset(std::fopen(part.c_str(), bytes_kept > 0 ? "ab" : "wb"));
    if (!file_) fail(part, "cannot be created");
}

void AtomicFile::write(std::string_view text)
{
    if (std::fwrite(text.data(), 1, text.size(), file_.get()) != text.size()) fail(name_.part(), "cannot be written");
}

void AtomicFile::commit()
{
    if (std::fclose(file_.release()) != 0) fail(name_.part(), "cannot be written");
    name_.commit();
}

std::uint64_t checksum(std::string_view bytes, std::uint64_t before)
{
    for (const char c : bytes) before = (before ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
    return before;
}

std::optional<std::uint64_t> checksum_of(const std::filesystem::path& path, std::uintmax_t bytes, std::uintmax_t first)
{
    std::ifstream file(path, std::ios::binary);
    file.seekg(static_cast<std::streamoff>(first));
    std::string part(1 << 16, '\0');
    std::uint64_t sum = kNoBytes;
    for (std::uintmax_t left = bytes; left > 0; left -= part.size()) {
        part.resize(std::min<std::uintmax_t>(left, part.size()));
        if (!file.read(part.data(), static_cast<std::streamsize>(part.size()))) return {};
        sum = checksum(part, sum);
    }
    return sum;
}

LineFile::LineFile(std::filesystem::path path, std::string_view header) : path_(std::move(path))
{
    add(header);
    AtomicFile file(path_);
    file.write(pending_);
    file.commit();
    size_ = pending_.size();
    pending_.clear();
}

LineFile::LineFile(std::filesystem::path path, std::uintmax_t bytes_kept, std::uint64_t sum)
    : path_(std::move(path)), size_(bytes_kept), sum_(sum)
{
    AtomicFile(path_, bytes_kept).commit();
}

void LineFile::add(std::string_view line)
{
    pending_ += line;
    pending_ += '\n';
    sum_ = checksum("\n", checksum(line, sum_));
}

void LineFile::flush(When when)
{
    constexpr std::chrono::seconds pause(1);
    constexpr std::uintmax_t small = 1 << 20;  // bytes; copying them takes almost no time
    if (pending_.empty()) return;
    if (when == When::soon && size_ > small && Clock::now() - last_ < pause) return;
    AtomicFile file(path_, size_);
    file.write(pending_);
    file.commit();
    size_ += pending_.size();
    pending_.clear();
    last_ = Clock::now();
}

}  // namespace ordo::io
