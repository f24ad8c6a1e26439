// A method is a row of choices on independent axes. The tables here are the only place that names them: input, error
// messages, `ordo list` and dispatch all read them. A new choice is a new entry.
#pragma once

#include "base/error.hpp"

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace ordo {

enum class Basis { hat };
enum class Domain { point, box, stretched_box, parallelepiped };
enum class Projection { mass };
enum class Samples { particles };
enum class Quadrature { particle };
enum class MassMatrix { lumped };
enum class Gradient { shape };
enum class Update { flip };
enum class Scheme { usf, usl, musl };
enum class Start { leapfrog, plain };

/// One choice of an axis: its value, its name in the input, a sentence.
template <class E>
struct Choice {
    E value;
    std::string_view name;
    std::string_view what;
};

/// The choices of an axis, and what the axis decides.
template <class E>
struct Axis;

// clang-format off
template <> struct Axis<Basis> {
    static constexpr std::string_view key = "basis", what = "shape functions N_i of the background grid";
    static constexpr std::array choices{Choice<Basis>{Basis::hat, "hat", "piecewise linear"}};
};
template <> struct Axis<Domain> {
    static constexpr std::string_view key = "domain", what = "the region that a particle stands for";
    static constexpr std::array choices{
        Choice<Domain>{Domain::point, "point", "phi_ip = N_i(x_p)"},
        Choice<Domain>{Domain::box, "box", "a box of fixed size (uGIMP)"},
        Choice<Domain>{Domain::stretched_box, "stretched-box", "a box stretched by the diagonal of F (cpGIMP)"},
        Choice<Domain>{Domain::parallelepiped, "parallelepiped", "a parallelepiped r = F r0 (CPDI1)"}};
};
template <> struct Axis<Projection> {
    static constexpr std::string_view key = "projection", what = "velocity from particles to nodes";
    static constexpr std::array choices{Choice<Projection>{Projection::mass, "mass", "weighted by m_p phi_ip; conserves linear momentum"}};
};
template <> struct Axis<Samples> {
    static constexpr std::string_view key = "samples", what = "what the projection sums over";
    static constexpr std::array choices{Choice<Samples>{Samples::particles, "particles", "particles"}};
};
template <> struct Axis<Quadrature> {
    static constexpr std::string_view key = "quadrature", what = "integration of mass and forces";
    static constexpr std::array choices{Choice<Quadrature>{Quadrature::particle, "particle", "sum over particle volumes; conserves mass and linear momentum"}};
};
template <> struct Axis<MassMatrix> {
    static constexpr std::string_view key = "mass", what = "mass matrix of the nodes";
    static constexpr std::array choices{Choice<MassMatrix>{MassMatrix::lumped, "lumped", "row sums"}};
};
template <> struct Axis<Gradient> {
    static constexpr std::string_view key = "gradient", what = "velocity gradient at the particle";
    static constexpr std::array choices{Choice<Gradient>{Gradient::shape, "shape", "sum_i v_i (x) grad phi_ip"}};
};
template <> struct Axis<Update> {
    static constexpr std::string_view key = "update", what = "velocity from nodes to particles";
    static constexpr std::array choices{Choice<Update>{Update::flip, "flip", "increments; a fraction pic_fraction takes the node velocity instead"}};
};
template <> struct Axis<Scheme> {
    static constexpr std::string_view key = "scheme", what = "when the stress is updated";
    static constexpr std::array choices{
        Choice<Scheme>{Scheme::usf, "usf", "stress first, from the projected velocity"},
        Choice<Scheme>{Scheme::usl, "usl", "stress last, from the advanced velocity"},
        Choice<Scheme>{Scheme::musl, "musl", "stress last, from the velocity projected again after the particle update"}};
};
template <> struct Axis<Start> {
    static constexpr std::string_view key = "start", what = "time level of the velocities";
    static constexpr std::array choices{
        Choice<Start>{Start::leapfrog, "leapfrog", "the first kick is a half step: velocities live at t - dt/2"},
        Choice<Start>{Start::plain, "plain", "the first kick is a whole step: the initial velocity is taken as that of -dt/2"}};
};
// clang-format on

template <class E>
constexpr std::string_view name_of(E value)
{
    for (const auto& c : Axis<E>::choices)
        if (c.value == value) return c.name;
    return "?";
}

template <class E>
std::vector<std::string> choice_names()
{
    std::vector<std::string> r;
    for (const auto& c : Axis<E>::choices) r.emplace_back(c.name);
    return r;
}

/// The choice called `name`, which the input's schema has checked.
template <class E>
E parse_choice(std::string_view name)
{
    for (const auto& c : Axis<E>::choices)
        if (c.name == name) return c.value;
    throw InputError(std::string(Axis<E>::key) + ": there is no choice called " + std::string(name));
}

/// A method: one choice per axis.
struct MethodSpec {
    Basis basis           = Basis::hat;
    Domain domain         = Domain::point;
    Projection projection = Projection::mass;
    Samples samples       = Samples::particles;
    Quadrature quadrature = Quadrature::particle;
    MassMatrix mass       = MassMatrix::lumped;
    Gradient gradient     = Gradient::shape;
    Update update         = Update::flip;
    Scheme scheme         = Scheme::usl;
    Start start           = Start::leapfrog;
    double pic_fraction   = 0.0;

    bool operator==(const MethodSpec&) const = default;
};

/// f(axis member) for each axis of a MethodSpec: the one list of axes.
template <class F>
void for_each_axis(F&& f)
{
    f(&MethodSpec::basis);
    f(&MethodSpec::domain);
    f(&MethodSpec::projection);
    f(&MethodSpec::samples);
    f(&MethodSpec::quadrature);
    f(&MethodSpec::mass);
    f(&MethodSpec::gradient);
    f(&MethodSpec::update);
    f(&MethodSpec::scheme);
    f(&MethodSpec::start);
}

/// A named row of the table of methods.
struct Preset {
    std::string_view name;
    std::string_view what;
    MethodSpec spec;
};

/// The presets, in the order of `ordo list methods`.
inline const std::vector<Preset>& presets()
{
    static const std::vector<Preset> rows = {
        {"mpm", "the original material point method (Gong 2015, ch. 4)", {.domain = Domain::point}},
        {"ugimp", "GIMP with domains of fixed size (Gong 2015, sec. 6.3)", {.domain = Domain::box}},
        {"cpgimp", "GIMP with domains stretched along the axes (Gong 2015, sec. 6.3)", {.domain = Domain::stretched_box}},
        {"cpdi1", "convected particle domains, parallelepipeds (Gong 2015, sec. 6.4)", {.domain = Domain::parallelepiped}},
    };
    return rows;
}

}  // namespace ordo
