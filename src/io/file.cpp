#include "io/file.hpp"

#include "base/error.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>

namespace ordo::io {

namespace {

[[noreturn]] void fail(const std::filesystem::path& path, std::string_view what)
{
    throw OutputError(fmt::format("{}: {}: {}", path.string(), what, std::strerror(errno)));
}

}  // namespace

AtomicFile::AtomicFile(std::filesystem::path path, Start start) : path_(std::move(path))
{
    std::error_code failure;
    const auto status = std::filesystem::status(path_, failure);  // of what a link leads to
    if (std::filesystem::is_directory(status)) throw OutputError(fmt::format("{}: is a directory", path_.string()));
    const bool exists = std::filesystem::exists(status), is_device = exists && !std::filesystem::is_regular_file(status);
    if (exists && !is_device) path_ = std::filesystem::canonical(path_, failure);
    part_ = is_device ? path_ : std::filesystem::path(path_.string() + ".part");  // a pipe must stay a pipe
    failure.clear();
    if (start == Start::copy)
        std::filesystem::copy_file(path_, part_, std::filesystem::copy_options::overwrite_existing, failure);
    if (failure) throw OutputError(fmt::format("{}: cannot be copied: {}", path_.string(), failure.message()));
    file_.reset(std::fopen(part_.c_str(), start == Start::copy ? "ab" : "wb"));
    if (!file_) fail(part_, "cannot be created");
}

AtomicFile::~AtomicFile()
{
    if (!file_) return;
    file_.reset();
    std::error_code none;
    if (part_ != path_) std::filesystem::remove(part_, none);
}

void AtomicFile::write(std::string_view text)
{
    if (std::fwrite(text.data(), 1, text.size(), file_.get()) != text.size()) fail(part_, "cannot be written");
}

void AtomicFile::commit()
{
    if (std::fflush(file_.get()) != 0) fail(part_, "cannot be written");
    file_.reset();
    if (part_ != path_ && std::rename(part_.c_str(), path_.c_str()) != 0) fail(path_, "cannot be named");
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
}

void LineFile::flush(When when)
{
    constexpr std::chrono::seconds pause(1);
    constexpr std::uintmax_t small = 1 << 20;  // bytes that are copied in no time
    if (pending_.empty()) return;
    if (when == When::soon && size_ > small && Clock::now() - last_ < pause) return;
    AtomicFile file(path_, AtomicFile::Start::copy);
    file.write(pending_);
    file.commit();
    size_ += pending_.size();
    pending_.clear();
    last_ = Clock::now();
}

}  // namespace ordo::io
