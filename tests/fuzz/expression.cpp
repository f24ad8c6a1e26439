// An expression, as bodies, conditions and tractions have them: read, copied and evaluated. Bytes behind a zero grow one that
// muParser takes; anything else is its text. Debian's muParser is not instrumented: text alone seldom comes that far.
#include "io/expression.hpp"
#include "fuzz.hpp"

#include <limits>

namespace ordo::fuzz {
namespace {

constexpr const char* kLeaves[]    = {"x", "y", "z", "X", "Y", "Z", "t", "pi", "_e", "0", "1", "-2.5", "1e308", "1e-308", "3"};
constexpr const char* kOperators[] = {"+", "-", "*", "/", "^", "<", "<=", ">", ">=", "==", "!=", "&&", "||"};
constexpr const char* kFunctions[] = {"sin",  "cos",   "tan",   "asin",  "acos", "atan",  "sinh", "cosh",
                                      "tanh", "asinh", "acosh", "atanh", "ln",   "log10", "log2", "exp",
                                      "sqrt", "sign",  "rint",  "abs",   "-",    "+",     ""};
constexpr const char* kFolds[]     = {"min", "max", "sum", "avg"};

template <std::size_t n>
std::string pick(const char* const (&list)[n], int byte)
{
    return list[static_cast<std::size_t>(byte) / 8 % n];
}

std::string grow(std::string_view& bytes, int depth)
{
    const int byte = bytes.empty() ? 0 : static_cast<unsigned char>(bytes.front());
    if (!bytes.empty()) bytes.remove_prefix(1);
    if (bytes.empty() || depth == 0) return pick(kLeaves, byte);
    auto next = [&] { return grow(bytes, depth - 1); };
    switch (byte % 8) {
    case 0: return pick(kLeaves, byte);
    case 1: return pick(kFunctions, byte) + "(" + next() + ")";
    case 2: {
        std::string call = pick(kFolds, byte) + "(" + next();
        for (int k = byte / 32; k > 0; --k) call += ", " + next();
        return call + ")";
    }
    case 3: {
        const std::string condition = next(), yes = next();
        return "(" + condition + " ? " + yes + " : " + next() + ")";
    }
    case 4: {
        const std::string y = next();
        return "atan2(" + y + ", " + next() + ")";
    }
    case 5: {
        const std::string condition = next(), yes = next();
        return condition + " ? " + yes + " : " + next();
    }
    default: {
        const std::string left = next();
        return left + pick(kOperators, byte) + next();
    }
    }
}

bool is_same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

void run(std::string_view data)
{
    constexpr double tiny = std::numeric_limits<double>::denorm_min(), huge = std::numeric_limits<double>::max();
    const FieldPoint points[] = {{{}, {}, 0.0},
                                 {{0.5, 0.25, -1.0}, {0.4, 0.2, -2.0}, 0.1},
                                 {{-1e3, 1e-3, 7.0}, {1.0, 2.0, 3.0}, 1e6},
                                 {{tiny, -tiny, huge}, {-huge, huge, -0.0}, tiny}};
    std::string text(data);
    if (data.starts_with('\0')) {
        data = data.substr(1, 60);  // longer ones would be slow, not new
        text = grow(data, 8);
    }
    accepts([&] {
        const Field field = io::make_field({text, {"case.toml", 1, 1}, "body[0].velocity"});
        const Field copy  = field;
        for (const FieldPoint& at : points) {
            const double value = field(at);
            if (!is_same(value, copy(at)) || !is_same(value, field(at)))
                fail("an expression has several values at one place: " + text);
        }
    });
}

}  // namespace
}  // namespace ordo::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    ordo::fuzz::run({reinterpret_cast<const char*>(data), size});
    return 0;
}
