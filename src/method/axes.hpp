// A method is a row of choices on independent axes. The tables here are the only place that names them: input, error
// messages, `ordo list` and dispatch all read them. A new choice is a new entry.
#pragma once

#include "base/error.hpp"

#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

namespace ordo {

enum class Basis { hat, bspline2, bspline3, ddmpm };
enum class Domain { point, box, stretched_box, parallelepiped, cell, simplex };
enum class CornerWeights { exact, mean };
enum class Projection { mass };
enum class Samples { particles };
enum class Quadrature { particle };
enum class MassMatrix { lumped, consistent };
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
    static constexpr std::array choices{
        Choice<Basis>{Basis::hat, "hat", "piecewise linear"},
        Choice<Basis>{Basis::bspline2, "bspline2", "quadratic splines, knots clamped at the grid's faces (Wobbes et al. 2020)"},
        Choice<Basis>{Basis::bspline3, "bspline3", "cubic splines, knots clamped at the grid's faces"},
        Choice<Basis>{Basis::ddmpm, "ddmpm", "hats with the dual-domain gradient (Zhang et al. 2011; Wobbes et al. 2020)"}};
};
template <> struct Axis<Domain> {
    static constexpr std::string_view key = "domain", what = "the region that a particle stands for";
    static constexpr std::array choices{
        Choice<Domain>{Domain::point, "point", "phi_ip = N_i(x_p)"},
        Choice<Domain>{Domain::box, "box", "a box of fixed size (uGIMP)"},
        Choice<Domain>{Domain::stretched_box, "stretched-box", "a box stretched by the diagonal of F (cpGIMP)"},
        Choice<Domain>{Domain::parallelepiped, "parallelepiped", "a parallelepiped r = F r0 (CPDI1)"},
        Choice<Domain>{Domain::cell, "cell", "a cell of a mesh with shared corners that move (CPDI2)"},
        Choice<Domain>{Domain::simplex, "simplex", "the same, built-in shapes cut into triangles or tetrahedra (CPDI-T)"}};
};
template <> struct Axis<CornerWeights> {
    static constexpr std::string_view key = "cell_weights", what = "weights of the corners of a cell";
    static constexpr std::array choices{
        Choice<CornerWeights>{CornerWeights::exact, "exact", "integrals over the cell"},
        Choice<CornerWeights>{CornerWeights::mean, "mean", "the mean of the corners (Sadeghirad et al. 2013), exact for parallelepipeds"}};
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
    static constexpr std::array choices{
        Choice<MassMatrix>{MassMatrix::lumped, "lumped", "row sums"},
        Choice<MassMatrix>{MassMatrix::consistent, "consistent", "sum_p m_p phi_ip phi_jp, solved by conjugate gradients; rows below lump_below are lumped"}};
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
    CornerWeights weights = CornerWeights::exact;
    Projection projection = Projection::mass;
    Samples samples       = Samples::particles;
    Quadrature quadrature = Quadrature::particle;
    MassMatrix mass       = MassMatrix::lumped;
    Gradient gradient     = Gradient::shape;
    Update update         = Update::flip;
    Scheme scheme         = Scheme::usl;
    Start start           = Start::leapfrog;
    double pic_fraction   = 0.0;
    double a0             = 0.5;
    double lump_below     = 0.3;
    double stretch_limit  = 0.0;

    bool operator==(const MethodSpec&) const = default;
};

/// f(axis member) for each axis of a MethodSpec: the one list of axes.
template <class F>
void for_each_axis(F&& f)
{
    f(&MethodSpec::basis);
    f(&MethodSpec::domain);
    f(&MethodSpec::weights);
    f(&MethodSpec::projection);
    f(&MethodSpec::samples);
    f(&MethodSpec::quadrature);
    f(&MethodSpec::mass);
    f(&MethodSpec::gradient);
    f(&MethodSpec::update);
    f(&MethodSpec::scheme);
    f(&MethodSpec::start);
}

/// A number of a method, beside its axes.
struct Setting {
    std::string_view name;
    double MethodSpec::*value;
    double min, max;
    std::string_view what;
};
inline constexpr std::array settings{
    Setting{"pic_fraction", &MethodSpec::pic_fraction, 0, 1, "part of the velocity update that is PIC instead of FLIP; damps"},
    Setting{"a0", &MethodSpec::a0, 0, 1, "ddmpm: the part of the plain gradient in the middle of a cell"},
    Setting{"lump_below", &MethodSpec::lump_below, 0, 1,
            "consistent mass: nodes that are filled to less than this part are lumped"},
    Setting{"stretch_limit", &MethodSpec::stretch_limit, 0, 30,
            "parallelepiped: largest distance of a corner from the particle, cells; wider domains are scaled (Homel et al. "
            "2016); 0: none"}};

/// dt c/h at which the fastest wave of the grid becomes unstable, over that of hats with lumped mass in full cells, 1. With
/// the consistent mass 2/sqrt(largest eigenvalue of M^-1 K) in units of h/c, the end functions of splines being the fastest
/// (computed for 40 cells, both ends free); waves along several axes then add.
inline double allowed_courant_number(const MethodSpec& s, int dim)
{
    const bool lumped    = s.mass == MassMatrix::lumped;
    const double several = lumped ? 1.0 : 1.0 / std::sqrt(dim);
    switch (s.basis) {
    case Basis::hat:
    case Basis::ddmpm: return lumped ? 1.0 : 0.577 * several;
    case Basis::bspline2: return lumped ? 0.862 : 0.430 * several;
    case Basis::bspline3: return lumped ? 0.652 : 0.291 * several;
    }
    return 1.0;
}

/// A combination that makes no sense, and why.
struct Rule {
    bool (*forbids)(const MethodSpec&);
    std::string_view what;  ///< the combination, in names of choices
    std::string_view why;
};

inline bool has_cells(const MethodSpec& s) { return s.domain == Domain::cell || s.domain == Domain::simplex; }

inline const std::vector<Rule>& rules()
{
    static const std::vector<Rule> rows = {
        {[](const MethodSpec& s) { return s.basis == Basis::ddmpm && s.domain != Domain::point; },
         "basis ddmpm with a domain other than point",
         "ddmpm changes the gradient at a point; domains take means of the values of hats, which it leaves alone: use basis hat"},
        {[](const MethodSpec& s) { return s.weights == CornerWeights::mean && !has_cells(s); },
         "cell_weights mean with a domain other than cell and simplex", "there are no cells whose corners could be weighted"},
        {[](const MethodSpec& s) { return s.stretch_limit > 0 && s.domain != Domain::parallelepiped; },
         "stretch_limit with a domain other than parallelepiped",
         "points and boxes do not stretch with F and cells share their corners: there is nothing that could be scaled"},
    };
    return rows;
}

/// The rule that a combination breaks; null when it is allowed.
inline const Rule* broken_rule(const MethodSpec& s)
{
    for (const Rule& r : rules())
        if (r.forbids(s)) return &r;
    return nullptr;
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
        {"cpdi2",
         "convected particle domains, quadrilaterals and hexahedra (Gong 2015, sec. 6.5; Sadeghirad et al. 2013)",
         {.domain = Domain::cell}},
        {"cpdi2t", "convected particle domains, triangles and tetrahedra (Nguyen et al. 2017)", {.domain = Domain::simplex}},
        {"bsmpm",
         "quadratic splines with a consistent mass matrix (Wobbes et al. 2020)",
         {.basis = Basis::bspline2, .mass = MassMatrix::consistent, .scheme = Scheme::musl}},
        {"ddmpm",
         "dual domain gradient with a consistent mass matrix (Wobbes et al. 2020)",
         {.basis = Basis::ddmpm, .mass = MassMatrix::consistent, .scheme = Scheme::musl}},
    };
    return rows;
}

}  // namespace ordo
