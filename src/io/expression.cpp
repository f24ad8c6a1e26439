#include "io/expression.hpp"

#include "base/parallel.hpp"

#include <muParser.h>

#include <algorithm>
#include <memory>
#include <numbers>

namespace ordo::io {

namespace {

/// One parser with its variables; muParser keeps pointers to them, so it must not move.
class Evaluator {
  public:
    explicit Evaluator(const std::string& text)
    {
        const char* names[] = {"x", "y", "z", "X", "Y", "Z", "t"};
        for (int k = 0; k < 7; ++k) parser_.DefineVar(names[k], &values_[k]);
        parser_.DefineConst("pi", std::numbers::pi);
        parser_.SetExpr(text);
        int values = 0;
        parser_.Eval(values);  // compiles, so that errors show now
        if (values != 1) throw mu::ParserError("it gives several values instead of one");
    }
    Evaluator(const Evaluator&) = delete;

    double operator()(const FieldPoint& at)
    {
        for (int a = 0; a < 3; ++a) {
            values_[a]     = at.x[a];
            values_[3 + a] = at.X[a];
        }
        values_[6] = at.t;
        return parser_.Eval();
    }

  private:
    mu::Parser parser_;
    double values_[7] = {};
};

/// muParser takes x = 1 for an assignment, which fields must not contain.
bool has_assignment(const std::string& text)
{
    for (std::size_t k = text.find('='); k != std::string::npos; k = text.find('=', k + 1)) {
        if (k + 1 < text.size() && text[k + 1] == '=')
            ++k;
        else if (k == 0 || std::string_view("<>!").find(text[k - 1]) == std::string_view::npos)
            return true;
    }
    return false;
}

/// One evaluator per thread. Copies share nothing: std::function copies its content.
class ParsedField {
  public:
    explicit ParsedField(const std::string& text) : text_(text) { make(); }
    ParsedField(const ParsedField& o) : text_(o.text_) { make(); }
    ParsedField(ParsedField&&) = default;

    double operator()(const FieldPoint& at) const { return (*evaluators_[static_cast<std::size_t>(thread_index())])(at); }

  private:
    void make()
    {
        for (int k = 0; k < std::max(thread_count(), 1); ++k) evaluators_.push_back(std::make_unique<Evaluator>(text_));
    }
    std::string text_;
    std::vector<std::unique_ptr<Evaluator>> evaluators_;
};

}  // namespace

Field make_field(const Expression& expression)
{
    if (const double* number = std::get_if<double>(&expression.value)) return *number;
    const auto& text = std::get<std::string>(expression.value);
    try {
        if (has_assignment(text)) throw mu::ParserError("it assigns with =");
        return Field(std::function<double(const FieldPoint&)>(ParsedField(text)));
    } catch (const mu::ParserError& e) {
        std::string message = e.GetMsg();
        if (!message.empty() && message.back() == '.') message.pop_back();
        fail(expression.place, expression.key,
             fmt::format("the expression {} cannot be read: {}. It may use x, y, z, t, X, Y, Z, pi, + - * / ^ and "
                         "functions such as sin, exp, sqrt",
                         to_toml(text), message));
    }
}

bool depends_on_time_alone(const Expression& expression)
{
    const auto* text = std::get_if<std::string>(&expression.value);
    if (!text) return true;
    double place = 0.0, t = 0.0;
    mu::Parser parser;
    for (const char* name : {"x", "y", "z", "X", "Y", "Z"}) parser.DefineVar(name, &place);
    parser.DefineVar("t", &t);
    parser.DefineConst("pi", std::numbers::pi);
    parser.SetExpr(*text);
    for (const auto& used : parser.GetUsedVar())
        if (used.first != "t") return false;
    return true;
}

}  // namespace ordo::io
