// Obstacles: distances to solids, their mass properties, files of triangles, free and given motion.
#include "method/obstacle.hpp"

#include "base/error.hpp"
#include "io/stl.hpp"
#include "shape/curved_face.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>
#include <unistd.h>

namespace ordo {
namespace {

constexpr double kReach = 0.5;

template <int D>
const Vec<D>* any()
{
    return nullptr;
}

template <int D>
Vec<D> place(std::mt19937& random, double size)
{
    std::uniform_real_distribution<double> x(-size, size);
    Vec<D> r{};
    for (int a = 0; a < D; ++a) r[a] = x(random);
    return r;
}

/// The normal is the gradient of the gap, and a gap to the nearest point of the surface leads onto it.
template <int D>
void expect_distance(const Solid<D>& solid, int least)
{
    std::mt19937 random(1);
    int found = 0;
    for (int k = 0; k < 2000; ++k) {
        const Vec<D> x = place<D>(random, 1.5);
        const auto at  = clearance(solid, x, any<D>(), kReach);
        if (!at) continue;
        EXPECT_NEAR(norm(at->normal), 1.0, 1e-12);
        const auto foot = clearance(solid, Vec<D>(x - at->gap * at->normal), any<D>(), kReach);
        ASSERT_TRUE(foot);
        EXPECT_NEAR(foot->gap, 0.0, 1e-12);
        bool is_smooth = true;  // not across the middle, where the nearest face changes
        Vec<D> gradient{};
        for (int a = 0; a < D; ++a) {
            Vec<D> step{};
            step[a]          = 1e-6;
            const auto above = clearance(solid, Vec<D>(x + step), any<D>(), kReach + 1e-5),
                       below = clearance(solid, Vec<D>(x - step), any<D>(), kReach + 1e-5);
            ASSERT_TRUE(above && below);
            is_smooth   = is_smooth && dot(above->normal, below->normal) > 0.999;
            gradient[a] = (above->gap - below->gap) / 2e-6;
        }
        if (!is_smooth) continue;
        ++found;
        EXPECT_LT(norm(gradient - at->normal), 1e-5);
    }
    EXPECT_GT(found, least);
}

std::vector<std::array<Vec<3>, 3>> triangles_of_box(const Vec<3>& low, const Vec<3>& high, int n)
{
    std::vector<std::array<Vec<3>, 3>> r;
    for (int a = 0; a < 3; ++a)
        for (const bool above : {false, true})
            for (int i = 0; i < n; ++i)
                for (int j = 0; j < n; ++j) {
                    auto at = [&](int u, int v) {
                        Vec<3> x{};
                        const int b = (a + 1) % 3, c = (a + 2) % 3;
                        x[a] = above ? high[a] : low[a];
                        x[b] = (low[b] * (n - u) + high[b] * u) / n;
                        x[c] = (low[c] * (n - v) + high[c] * v) / n;
                        return x;
                    };
                    const Vec<3> p = at(i, j), q = at(i + 1, j), s = at(i + 1, j + 1), t = at(i, j + 1);
                    r.push_back(above ? std::array{p, q, s} : std::array{p, s, q});
                    r.push_back(above ? std::array{p, s, t} : std::array{p, t, s});
                }
    return r;
}

TEST(Obstacles, distances)
{
    expect_distance<2>(HalfSpace<2>{{0.1, 0.2}, {0.6, 0.8}}, 300);
    expect_distance<2>(Bounds<2>{{-0.6, -0.4}, {0.5, 0.7}}, 300);
    expect_distance<2>(Ball<2>{{0.1, 0.0}, 0.7}, 300);
    expect_distance<3>(Bounds<3>{{-0.6, -0.4, -0.5}, {0.5, 0.7, 0.3}}, 300);
    expect_distance<3>(Ball<3>{{0.1, 0.0, 0.2}, 0.7}, 300);
    for (int axis = 0; axis < 3; ++axis) expect_distance<3>(Cylinder<3>{{0.1, 0.0, 0.2}, 0.5, 1.1, axis}, 300);
    expect_distance<3>(TriangleSurface(triangles_of_box({-0.6, -0.4, -0.5}, {0.5, 0.7, 0.3}, 3)), 300);
}

/// Inside, outside and beyond edges and corners, for any direction that is asked for.
TEST(Obstacles, triangles_are_the_box_that_they_bound)
{
    const Bounds<3> bounds{{-0.6, -0.4, -0.5}, {0.5, 0.7, 0.3}};
    std::mt19937 random(2);
    for (const int n : {1, 4}) {
        const Solid<3> box(bounds), surface(TriangleSurface(triangles_of_box(bounds.lower, bounds.upper, n)));
        int found = 0;
        for (int k = 0; k < 5000; ++k) {
            const Vec<3> x = place<3>(random, 1.2), n_s = unit(place<3>(random, 1.0));
            for (const Vec<3>* of : {any<3>(), &n_s}) {
                const auto one = clearance(box, x, of, kReach), other = clearance(surface, x, of, kReach);
                ASSERT_EQ(one.has_value(), other.has_value()) << k;
                if (!one) continue;
                ++found;
                EXPECT_NEAR(one->gap, other->gap, 1e-12);
                EXPECT_LT(norm(one->normal - other->normal), 1e-9);
            }
        }
        EXPECT_GT(found, 3000);
    }
}

/// Of a point just inside the side of a box and just below its top each asks for the face that it meets.
TEST(Obstacles, nearest_face_that_faces)
{
    const Solid<2> box(Bounds<2>{{0, 0}, {1, 1}});
    const Vec<2> x{0.001, 0.99}, down{0, -1}, right{1, 0}, up{0, 1};
    EXPECT_NEAR(clearance(box, x, any<2>(), 0.1)->gap, -0.001, 1e-15);
    EXPECT_NEAR(clearance(box, x, &right, 0.1)->gap, -0.001, 1e-15);
    EXPECT_NEAR(clearance(box, x, &down, 0.1)->gap, -0.01, 1e-15);
    EXPECT_FALSE(clearance(box, x, &up, 0.1));                      // the bottom is too far: nothing is pushed out the far side
    EXPECT_FALSE(clearance(box, Vec<2>{-0.001, 0.5}, &down, 0.1));  // beside the box
}

TEST(Obstacles, open_surface_ends)
{
    const auto all = triangles_of_box({0, 0, 0}, {1, 1, 1}, 3);
    const TriangleSurface top(std::vector(all.begin() + 5 * 18, all.begin() + 6 * 18));
    EXPECT_FALSE(top.is_closed());
    EXPECT_EQ(top.open_edges(), 12u);
    const Solid<3> solid(top);
    EXPECT_NEAR(clearance(solid, Vec<3>{0.5, 0.4, 1.1}, any<3>(), kReach)->gap, 0.1, 1e-14);
    EXPECT_NEAR(clearance(solid, Vec<3>{1.0 / 3, 1.0 / 3, 0.9}, any<3>(), kReach)->gap, -0.1, 1e-14);  // below a common corner
    EXPECT_FALSE(clearance(solid, Vec<3>{1.01, 0.4, 1.1}, any<3>(), kReach));
    EXPECT_FALSE(bulk_of<3>(solid));
}

TEST(Obstacles, mass_properties)
{
    constexpr double pi = std::numbers::pi;
    const Bounds<3> bounds{{-0.6, -0.4, -0.5}, {0.5, 0.7, 0.3}};
    const auto box = *bulk_of<3>(bounds), surface = *bulk_of<3>(TriangleSurface(triangles_of_box(bounds.lower, bounds.upper, 2)));
    EXPECT_NEAR(box.volume, 1.1 * 1.1 * 0.8, 1e-14);
    EXPECT_NEAR(surface.volume, box.volume, 1e-14);
    EXPECT_LT(norm(surface.center - box.center), 1e-14);
    EXPECT_NEAR(box.inertia(2, 2), box.volume * (1.21 + 1.21) / 12, 1e-14);
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) EXPECT_NEAR(surface.inertia(a, b), box.inertia(a, b), 1e-14);
    const auto ball = *bulk_of<3>(Ball<3>{{1, 2, 3}, 0.5});
    EXPECT_NEAR(ball.volume, pi / 6, 1e-14);
    EXPECT_NEAR(ball.inertia(0, 0), 0.4 * ball.volume * 0.25, 1e-14);
    const auto disk = *bulk_of<2>(Ball<2>{{1, 2}, 0.5});
    EXPECT_NEAR(disk.inertia(2, 2), 0.5 * disk.volume * 0.25, 1e-14);
    const auto round = *bulk_of<3>(Cylinder<3>{{0, 0, 0}, 0.5, 2.0, 1});
    EXPECT_NEAR(round.volume, pi / 2, 1e-14);
    EXPECT_NEAR(round.inertia(1, 1), 0.5 * round.volume * 0.25, 1e-14);
    EXPECT_NEAR(round.inertia(0, 0), round.volume * (3 * 0.25 + 4.0) / 12, 1e-14);
    EXPECT_FALSE(bulk_of<3>(HalfSpace<3>{{0, 0, 0}, {0, 0, 1}}));
}

/// The distance to a solid that has turned and moved is that of the point taken back.
TEST(Obstacles, turned)
{
    Obstacle<3> o{.solid = Bounds<3>{{0, 0, 0}, {1, 0.5, 0.4}}, .center = {0.5, 0.2, 0.1}};
    ObstacleMotion<3> motion = start_of(o, 0.0);
    const double angle       = 0.3;
    motion.turn              = {std::cos(angle / 2), 0, 0, std::sin(angle / 2)};
    motion.center            = {2, 3, 4};
    auto moved               = [&](const Vec<3>& x) { return Vec<3>(motion.center + rotation_of(motion.turn) * (x - o.center)); };
    const Vec<3> x{0.3, 0.45, 0.55}, n = rotation_of(motion.turn) * Vec<3>{0, 0, -1};
    const auto at = clearance(o, motion, moved(x), &n, kReach);
    ASSERT_TRUE(at);
    EXPECT_NEAR(at->gap, 0.15, 1e-14);
    EXPECT_LT(norm(at->normal + n), 1e-14);
    const Bounds<3> bounds = bounds_of(o, motion);
    for (const double u : {0.0, 1.0})
        for (const double v : {0.0, 0.5}) {
            const Vec<3> corner = moved({u, v, 0.4});
            for (int a = 0; a < 3; ++a) {
                EXPECT_LE(bounds.lower[a], corner[a] + 1e-14);
                EXPECT_GE(bounds.upper[a], corner[a] - 1e-14);
            }
        }
}

/// Far from its axes of inertia a free solid keeps its angular momentum, and its points move with it.
TEST(Obstacles, free_rotation)
{
    std::vector<Obstacle<3>> o(1);
    o[0].solid           = Bounds<3>{{0, 0, 0}, {1, 0.5, 0.2}};
    const auto bulk      = *bulk_of<3>(o[0].solid);
    o[0].center          = bulk.center;
    o[0].inverse_mass    = Vec<3>::filled(1.0);
    o[0].inverse_inertia = inverse(bulk.inertia);
    o[0].spin            = {Field(1.0), Field(2.0), Field(0.5)};
    o[0].velocity        = {Field(0.3), Field(0.0), Field(-0.1)};
    std::vector<ContactPair<3>> pairs(1);
    pairs[0].obstacle = 0;
    Contacts<3> contacts;
    contacts.obstacles.push_back(start_of(o[0], 0.0));
    contacts.points.resize(1);
    contacts.points[0].anchor = {0.1, 0.2, -0.3};
    auto momentum = [&] { return Vec<3>(inverse(inverse_inertia(o[0], contacts.obstacles[0])) * contacts.obstacles[0].spin); };
    auto energy   = [&] { return 0.5 * dot(momentum(), contacts.obstacles[0].spin); };
    const Vec<3> before = momentum();
    const double start  = energy();
    for (int k = 0; k < 1000; ++k) {
        kick(o, contacts.obstacles, {0, 0, 0}, 1e-3 * k, 1e-3);
        move(o, pairs, 1e-3, contacts);
    }
    EXPECT_LT(norm(momentum() - before), 1e-13);
    EXPECT_NEAR(energy(), start, 2e-3 * start);  // of first order in the step
    EXPECT_GT(norm(contacts.obstacles[0].spin - Vec<3>{1.0, 2.0, 0.5}), 0.1);
    EXPECT_LT(norm(contacts.obstacles[0].center - (bulk.center + Vec<3>{0.3, 0, -0.1})), 1e-12);
    EXPECT_LT(norm(contacts.points[0].anchor - rotation_of(contacts.obstacles[0].turn) * Vec<3>{0.1, 0.2, -0.3}), 1e-12);
}

/// Gravity and given motions: each axis by itself.
TEST(Obstacles, held_components)
{
    std::vector<Obstacle<2>> o(1);
    o[0].velocity                          = {Field([](const FieldPoint& at) { return 2 * at.t; }), Field(1.0)};
    o[0].inverse_mass                      = {0.0, 0.5};
    std::vector<ObstacleMotion<2>> motions = {start_of(o[0], 0.0)};
    kick(o, motions, {3, -10}, 0.5, 0.125);
    EXPECT_EQ(motions[0].velocity, (Vec<2>{1.0, -0.25}));
    EXPECT_TRUE(o[0].is_moved());
}

class StlFiles : public testing::Test {
  protected:
    std::filesystem::path file = std::filesystem::temp_directory_path() / fmt::format("ordo_{}.stl", ::getpid());

    void TearDown() override { std::filesystem::remove(file); }
    void write(const std::string& bytes) const { std::ofstream(file, std::ios::binary) << bytes; }
    std::string refusal() const
    {
        try {
            io::read_stl(file.string());
        } catch (const InputError& e) {
            return e.what();
        }
        return "accepted";
    }
};

std::string binary_of(const std::vector<std::array<Vec<3>, 3>>& all, std::string head)
{
    head.resize(80, ' ');
    auto add = [&](std::uint32_t bits, int bytes = 4) {
        for (int k = 0; k < bytes; ++k) head += static_cast<char>(bits >> 8 * k);
    };
    add(static_cast<std::uint32_t>(all.size()));
    for (const auto& t : all) {
        for (int k = 0; k < 3; ++k) add(0);
        for (const Vec<3>& x : t)
            for (int a = 0; a < 3; ++a) add(std::bit_cast<std::uint32_t>(static_cast<float>(x[a])));
        add(0, 2);
    }
    return head;
}

const std::string kText =
    "solid a name of words\nfacet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex +1.0 0 0\n  vertex 0 1e0 0.5\n"
    " endloop\nendfacet\nendsolid a name of words\n";

TEST_F(StlFiles, binary_and_text)
{
    const auto box = triangles_of_box({-0.5, -0.25, 0}, {0.5, 0.75, 2}, 2);
    for (const char* head : {"made by a program", "solid, though it is binary"}) {
        write(binary_of(box, head));
        EXPECT_EQ(io::read_stl(file.string()), box);
    }
    EXPECT_EQ(io::read_stl(file.string(), 2.0)[0][0], 2.0 * box[0][0]);
    write(kText + kText);
    const auto two = io::read_stl(file.string());
    ASSERT_EQ(two.size(), 2u);
    EXPECT_EQ(two[1], (std::array<Vec<3>, 3>{Vec<3>{0, 0, 0}, Vec<3>{1, 0, 0}, Vec<3>{0, 1, 0.5}}));
}

TEST_F(StlFiles, bad_ones)
{
    auto replaced = [](std::string text, const std::string& old, const std::string& with) {
        return text.replace(text.find(old), old.size(), with);
    };
    auto box                                         = triangles_of_box({0, 0, 0}, {1, 1, 1}, 1);
    std::string whole                                = binary_of(box, "box");
    box[3][1][2]                                     = NAN;
    const std::pair<std::string, std::string> rows[] = {
        {"", "is neither a binary nor a text STL file"},
        {"nothing of the kind", "is neither a binary nor a text STL file"},
        {whole.substr(0, whole.size() - 1), "says that it has 12 triangles, which need 684 bytes, but has 683"},
        {binary_of({}, "none"), "holds no triangle"},
        {binary_of(box, "box"), "triangle 3: has a corner that is not finite"},
        {"solid\nendsolid\n", "holds no triangle"},
        {replaced(kText, "1e0", "1e0x"), ":6:1: STL: must be a finite number (got \"1e0x\")"},
        {replaced(kText, "1e0", "nan"), ":6:1: STL: must be a finite number (got \"nan\")"},
        {replaced(kText, "endloop", "vertex"), ":7:1: STL: must be \"endloop\" (got \"vertex\")"},
        {kText.substr(0, kText.find("endsolid")), "must be \"facet\" or \"endsolid\""},
        {kText.substr(0, kText.find("0.5")), "(got the end of the file)"},
    };
    for (const auto& [text, says] : rows) {
        write(text);
        const std::string message = refusal();
        EXPECT_NE(message.find(says), message.npos) << message << "\nshould say: " << says;
        EXPECT_TRUE(message.starts_with(file.string())) << message;
        const bool has_remedy = message.find("save it again as binary STL") != message.npos;
        EXPECT_TRUE(has_remedy || message.find("holds no triangle") != message.npos) << message;
    }
    std::filesystem::remove(file);
    EXPECT_NE(refusal().find("cannot be opened; paths are relative to the case file"), std::string::npos);
    std::filesystem::create_directory(file);
    EXPECT_NE(refusal().find("is a directory; give a file"), std::string::npos);
}

}  // namespace
}  // namespace ordo
