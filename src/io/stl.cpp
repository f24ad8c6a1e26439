#include "io/stl.hpp"

#include "io/schema.hpp"

#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace ordo::io {

namespace {

using Triangle = std::array<Vec<3>, 3>;

constexpr std::uintmax_t kMost = std::uintmax_t{1} << 31;  ///< bytes, 40 million triangles
constexpr std::size_t kHead    = 84;                       ///< of a binary file: 80 bytes of text and the number of triangles
constexpr std::size_t kRecord  = 50;                       ///< of a triangle: normal and corners as 12 floats, 2 bytes more

constexpr double kLargest = 1e30;  ///< no length: its squares overflow

constexpr const char* kRemedy = "save it again as binary STL";

std::string read_all(const std::string& file)
{
    std::error_code failure;
    if (std::filesystem::is_directory(file, failure)) fail({file}, "STL", "is a directory; give a file");
    const std::uintmax_t bytes = std::filesystem::file_size(file, failure);
    if (failure) fail({file}, "STL", "cannot be opened; paths are relative to the case file");
    if (bytes > kMost) fail({file}, "STL", "is larger than 2 GB; coarsen the surface");
    std::ifstream in(file, std::ios::binary);
    std::string text(static_cast<std::size_t>(bytes), '\0');
    if (!in.read(text.data(), static_cast<std::streamsize>(text.size()))) fail({file}, "STL", "cannot be read");
    return text;
}

/// The whole number at the end of the head, least byte first.
std::uint32_t count_of(const std::string& bytes)
{
    std::uint32_t r = 0;
    for (int k = 3; k >= 0; --k) r = r << 8 | static_cast<unsigned char>(bytes[80 + static_cast<std::size_t>(k)]);
    return r;
}

std::vector<Triangle> read_binary(const std::string& file, const std::string& bytes, double scale)
{
    const std::uint32_t count = count_of(bytes);
    std::vector<Triangle> r(count);
    for (std::size_t k = 0; k < count; ++k)
        for (std::size_t c = 0; c < 3; ++c)
            for (std::size_t a = 0; a < 3; ++a) {
                const std::size_t at = kHead + kRecord * k + 4 * (3 + 3 * c + a);
                std::uint32_t bits   = 0;
                for (std::size_t b = 4; b-- > 0;) bits = bits << 8 | static_cast<unsigned char>(bytes[at + b]);
                const double x = std::bit_cast<float>(bits);
                if (!(std::fabs(x) < kLargest))
                    fail({file}, fmt::format("triangle {}", k), fmt::format("has a corner that is not finite; {}", kRemedy));
                r[k][c][static_cast<int>(a)] = scale * x;
            }
    return r;
}

/// The words of a text file, with their lines.
class Words {
  public:
    Words(const std::string& file, const std::string& text) : file_(file), text_(text) {}

    /// Empty at the end.
    std::string_view next()
    {
        while (at_ < text_.size() && is_blank(text_[at_])) line_ += text_[at_++] == '\n';
        const std::size_t begin = at_;
        while (at_ < text_.size() && !is_blank(text_[at_])) ++at_;
        return std::string_view(text_).substr(begin, at_ - begin);
    }
    /// The rest of the line is a name.
    void skip_line()
    {
        while (at_ < text_.size() && text_[at_] != '\n') ++at_;
    }
    void expect(std::string_view wanted)
    {
        const std::string_view word = next();
        if (word != wanted) fail_at(fmt::format("must be \"{}\" (got {})", wanted, quoted(word)));
    }
    double number()
    {
        std::string_view word = next(), digits = word;
        if (digits.starts_with('+')) digits.remove_prefix(1);
        double value      = 0.0;
        const auto result = std::from_chars(digits.data(), digits.data() + digits.size(), value);
        if (result.ec != std::errc() || result.ptr != digits.data() + digits.size() || !(std::fabs(value) < kLargest))
            fail_at(fmt::format("must be a finite number (got {})", quoted(word)));
        return value;
    }
    [[noreturn]] void fail_at(const std::string& message) const
    {
        fail({file_, line_, 1}, "STL", fmt::format("{}; {}", message, kRemedy));
    }

  private:
    static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }
    static std::string quoted(std::string_view word)
    {
        constexpr std::size_t enough = 40;
        return word.empty() ? "the end of the file" : one_line(fmt::format("\"{}\"", word.substr(0, enough)));
    }

    const std::string& file_;
    const std::string& text_;
    std::size_t at_ = 0;
    int line_       = 1;
};

std::vector<Triangle> read_text(const std::string& file, const std::string& text, double scale)
{
    Words words(file, text);
    std::vector<Triangle> r;
    words.expect("solid");
    words.skip_line();
    for (;;) {
        const std::string_view word = words.next();
        if (word == "endsolid") {
            words.skip_line();
            if (words.next().empty()) return r;
            words.skip_line();  // another solid of the same file
            continue;
        }
        if (word != "facet") words.fail_at("must be \"facet\" or \"endsolid\"");
        words.expect("normal");
        for (int a = 0; a < 3; ++a) words.next();
        words.expect("outer");
        words.expect("loop");
        Triangle& t = r.emplace_back();
        for (Vec<3>& x : t) {
            words.expect("vertex");
            for (int a = 0; a < 3; ++a) x[a] = scale * words.number();
        }
        words.expect("endloop");
        words.expect("endfacet");
    }
}

}  // namespace

std::vector<Triangle> read_stl(const std::string& file, double scale)
{
    const std::string bytes = read_all(file);
    // Binary files too may begin with "solid"; their length tells.
    const bool is_binary =
        bytes.size() >= kHead && bytes.size() == kHead + kRecord * static_cast<std::uintmax_t>(count_of(bytes));
    std::vector<Triangle> r;
    if (is_binary)
        r = read_binary(file, bytes, scale);
    else if (bytes.starts_with("solid"))
        r = read_text(file, bytes, scale);
    else if (bytes.size() >= kHead)
        fail({file}, "STL",
             fmt::format("says that it has {} triangles, which need {} bytes, but has {}; {}", count_of(bytes),
                         kHead + kRecord * static_cast<std::uintmax_t>(count_of(bytes)), bytes.size(), kRemedy));
    else
        fail({file}, "STL", fmt::format("is neither a binary nor a text STL file; {}", kRemedy));
    if (r.empty()) fail({file}, "STL", "holds no triangle");
    return r;
}

}  // namespace ordo::io
