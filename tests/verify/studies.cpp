// The instrument itself, the quick studies of `ordo verify` with their bars, and what has no bar there.
#include "base/error.hpp"
#include "verification/cases.hpp"
#include "verification/fem.hpp"
#include "verification/study.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

namespace ordo::verification {
namespace {

const Case& case_called(std::string_view name)
{
    for (const Case& c : cases())
        if (c.name == name) return c;
    throw std::logic_error("no such case");
}

std::vector<Row> run(const Resolved& study)
{
    std::vector<Row> rows;
    for (const int cells : study.cells) {
        Request request = study.request;
        request.cells   = cells;
        rows.push_back(study.of->run(request));
    }
    return rows;
}

std::string title(const Resolved& s)
{
    std::string text = s.of->name + ", " + s.preset + ", ppc " + std::to_string(s.ppc);
    for (const auto& [name, value] : s.request.values.entries)
        std::visit(
            [&, key = name](const auto& v) {
                std::ostringstream out;
                out << ", " << key << ' ' << v;
                text += out.str();
            },
            value);
    return text;
}

class Studies : public testing::TestWithParam<std::string> {};

/// Every quick study of the case meets its bars; every bar is about meshes that the study runs.
TEST_P(Studies, MeetTheirBars)
{
    for (const Study& study : case_called(GetParam()).studies) {
        if (study.length != Study::quick) continue;
        const Resolved resolved     = resolve(case_called(GetParam()), study);
        const std::vector<Row> rows = run(resolved);
        EXPECT_FALSE(resolved.bars.empty());
        for (const Bar& bar : resolved.bars) {
            const Verdict v = resolved.judge(bar, rows);
            EXPECT_TRUE(v.was_run) << title(resolved) << ": " << bar.what();
            EXPECT_TRUE(v.pass()) << title(resolved) << ": " << bar.what() << " is " << v.value << ", not " << bar.limit();
        }
    }
}

std::vector<std::string> case_names()
{
    std::vector<std::string> names;
    for (const Case& c : cases()) names.push_back(c.name);
    return names;
}
std::string test_name(const testing::TestParamInfo<std::string>& of)
{
    std::string name = of.param;
    std::replace(name.begin(), name.end(), '-', '_');
    return name;
}
INSTANTIATE_TEST_SUITE_P(Quick, Studies, testing::ValuesIn(case_names()), test_name);

/// Every scheme but those of splines is second order off a full period, where a wrong time level shows as first order, and at large
/// deformation, where the schemes differ in the configuration of their gradients.
TEST(Schemes, AreSecondOrder)
{
    for (const auto& scheme : Axis<TimeScheme>::choices) {
        const std::string name(scheme.name);
        if (has_stages_of_runge_kutta({.scheme = scheme.value}) || is_static({.scheme = scheme.value})) continue;
        const auto wave =
            run(resolve(case_called("vibration-1d"), {.method = "cpdi1",
                                                      .set    = {{"amplitude", 1e-4}, {"end", 0.013}, {"method.scheme", name}},
                                                      .cells  = {16, 32, 64, 128},
                                                      .bars   = {}}));
        const auto ring = run(resolve(case_called("ring"),
                                      {.method = "cpdi1", .set = {{"method.scheme", name}}, .cells = {10, 20, 40}, .bars = {}}));
        for (const auto& rows : {wave, ring})
            for (std::size_t k = 1; k < rows.size(); ++k)
                EXPECT_GE(order_between(rows[k - 1], rows[k], "displacement"), 1.85) << name;
    }
}

/// Every hyperelastic law has its own manufactured solution.
TEST(Materials, AreSecondOrder)
{
    for (const char* name : {"vibration-2d", "shear-rotation"}) {
        const auto rows = run(resolve(
            case_called(name), {.method = "cpdi1", .set = {{"material", "st-venant-kirchhoff"}}, .cells = {16, 32}, .bars = {}}));
        EXPECT_GE(order_between(rows[0], rows[1], "displacement"), 1.85) << name;
    }
}

/// The reference of bar-large-strain: second order in the elements, and so far finer than what it judges.
TEST(FiniteElementBar, Converges)
{
    auto displacement = [](int elements, double X) {
        return FiniteElementBar({1.0, 2000.0, 4e4, 0.8, elements, 1e-5, 0.1}).position({X}, 0.1)[0] - X;
    };
    for (double X : {0.25, 0.5, 0.75}) {
        const double coarse = displacement(64, X) - displacement(4000, X), fine = displacement(128, X) - displacement(4000, X);
        EXPECT_NEAR(coarse / fine, 4.0, 0.2);
        EXPECT_LT(std::fabs(displacement(2000, X) - displacement(4000, X)), 1e-7);
    }
    // A push of a soft bar and the linear wave agree where the push is small.
    const FiniteElementBar small({1.0, 2000.0, 4e4, 8e-4, 400, 1e-5, 0.1});
    const double w = std::numbers::pi * std::sqrt(4e4 / 2000.0);
    EXPECT_NEAR(small.position({0.5}, 0.1)[0] - 0.5, 8e-4 / w * std::sin(w * 0.1), 2e-8);
}

// ---- parameters and bars ---------------------------------------------------------------------------------------------

TEST(Resolve, FillsDefaultsAndRefusesWhatThereIsNot)
{
    const Case& ring   = case_called("ring");
    const Resolved two = resolve(
        ring, {.method = "cpdi1", .set = {{"nu", std::string("0.25")}, {"method.scheme", "musl"}}, .cells = {}, .bars = {}});
    EXPECT_EQ(two.request.values.number("nu"), 0.25);
    EXPECT_EQ(two.request.values.number("amplitude"), 0.1);
    EXPECT_EQ(two.request.method.scheme, TimeScheme::musl);
    EXPECT_EQ(two.ppc, 4);
    EXPECT_EQ(two.request.per_axis, 2);
    EXPECT_EQ(two.cells, ring.cells);
    const Resolved three = resolve(ring, {.method = "mpm", .set = {{"dim", std::string("3")}}, .cells = {5}, .bars = {}});
    EXPECT_EQ(three.ppc, 8);
    const std::pair<std::string, Value> wrong[] = {
        {"nu", std::string("0.5")}, {"nu", std::string("x")}, {"nu", std::string("nan")}, {"Nu", std::string("0.3")},
        {"method.basis", "cubic"},  {"method.preset", "mpm"}, {"dim", std::string("4")},  {"material", "rubber"}};
    for (const auto& setting : wrong)
        EXPECT_THROW(resolve(ring, {.method = "cpdi1", .set = {setting}, .cells = {}, .bars = {}}), InputError) << setting.first;
    EXPECT_THROW(resolve(ring, {.method = "cpdi9", .set = {}, .cells = {}, .bars = {}}), InputError);
    EXPECT_THROW(resolve(ring, {.method = "cpdi1", .ppc = 5, .set = {}, .cells = {}, .bars = {}}), InputError);
}

TEST(Bars, BelongToTheStudiesThatRunTheSame)
{
    const Case& ring = case_called("ring");
    EXPECT_FALSE(resolve(ring, {.method = "cpdi1", .set = {{"nu", 0.3}}, .cells = {10}, .bars = {}}).bars.empty());
    EXPECT_TRUE(resolve(ring, {.method = "cpdi1", .set = {{"nu", 0.2}}, .cells = {10}, .bars = {}}).bars.empty());
    EXPECT_TRUE(resolve(ring, {.method = "cpdi1", .ppc = 9, .set = {}, .cells = {10}, .bars = {}}).bars.empty());
}

TEST(Bars, AreJudged)
{
    Row coarse{}, fine{}, blown{};
    coarse.cells = 8, coarse.h = 0.125, coarse.error = {{"velocity", 4.0}}, coarse.error_l2 = {{"velocity", 8.0}};
    fine.cells = 16, fine.h = 0.0625, fine.error = {{"velocity", 1.0}}, fine.error_l2 = {{"velocity", 4.0}};
    blown.cells = 32, blown.h = 0.03125, blown.failed = "inverted";
    const std::vector<Row> rows{coarse, fine, blown};
    const Resolved study{};
    const Verdict second = study.judge({.name = "velocity", .from = 8, .to = 16, .low = 1.9}, rows);
    EXPECT_DOUBLE_EQ(second.value, 2.0);
    EXPECT_TRUE(second.was_run && second.pass());
    EXPECT_DOUBLE_EQ(study.judge({.name = "l2 velocity", .from = 8, .to = 16}, rows).value, 1.0);
    EXPECT_FALSE(study.judge({.name = "velocity", .from = 8, .to = 16, .high = 1.9}, rows).pass());
    EXPECT_DOUBLE_EQ(study.judge(value_at_most("velocity", 16, 2.0), rows).value, 1.0);
    const Verdict lost = study.judge({.name = "velocity", .from = 16, .to = 32, .low = -100}, rows);
    EXPECT_TRUE(lost.was_run);
    EXPECT_FALSE(lost.pass()) << "a run that failed has no order";
    EXPECT_FALSE(study.judge({.name = "velocity", .from = 16, .to = 64}, rows).was_run);
    EXPECT_TRUE(study.judge(fails_at(32), rows).pass());
    EXPECT_FALSE(study.judge(fails_at(16), rows).pass());
}

}  // namespace
}  // namespace ordo::verification
