// Mohr-Coulomb plasticity with tension cut-off.
#pragma once

#include "material/elastic_state.hpp"

#include <utility>

namespace ordo {

/// Planes of the Mohr-Coulomb pyramid in principal Kirchhoff stresses, tension positive: the shear plane of axes (i, j),
/// tau_i - tau_j + (tau_i + tau_j) sin phi = 2 c cos phi, with flow of angle psi, and the cut-off tau_i = T, associated.
/// Returns a trial stress to the face, edge or corner on which it belongs. Exact, because all faces are planes (Clausen, Damkilde
/// & Andersen 2006, IJNME 66:1795). S is double or Dual<double>.
struct MohrCoulombPyramid {
    double bulk, shear;                     ///< Pa
    double sin_phi, sin_psi, rhs, tension;  ///< rhs = 2 c cos phi; tension may be infinite

    /// Largest excess over all planes; tau sorted, largest first. Positive outside.
    double excess(const double (&tau)[3]) const { return std::fmax(shear_excess(tau, 0, 2), tau[0] - tension); }

    /// The stress on the pyramid for a sorted trial stress outside. Returns false if no face takes it.
    template <class S>
    bool project(const S (&trial)[3], S (&tau)[3]) const
    {
        // Faces, edges and corners as sets of planes: those of the axes (0, 2), (0, 1), (1, 2), and cut-offs of axes 0, 1, 2.
        // Where tau_0 = tau_1 = T four planes meet: two sets of three span what returns there. The empty set stands for the apex.
        static constexpr int sets[][3] = {{0, -1, -1}, {3, -1, -1}, {0, 1, -1}, {0, 2, -1}, {0, 3, -1},  {3, 4, -1},
                                          {0, 1, 3},   {0, 3, 4},   {0, 2, 4},  {3, 4, 5},  {-1, -1, -1}};
        const double size              = std::fabs(primal(trial[0])) + std::fabs(primal(trial[2])) + rhs;
        double least                   = 1e-9 * size;
        bool is_found                  = false;
        for (const auto& set : sets) {
            S candidate[3]{};
            const double wrong = set[0] < 0 ? violation_of_apex(trial, candidate) : violation(set, trial, candidate);
            if (!(wrong < least)) continue;
            least    = wrong;
            is_found = true;
            for (int a = 0; a < 3; ++a) tau[a] = candidate[a];
            if (least < 1e-14 * size) break;
        }
        return is_found;
    }

  private:
    struct Plane {
        double normal[3], flow[3], at;  ///< normal . tau = at
    };
    double shear_excess(const double (&tau)[3], int i, int j) const
    {
        return tau[i] - tau[j] + (tau[i] + tau[j]) * sin_phi - rhs;
    }
    Plane plane(int k) const
    {
        static constexpr int axes[3][2] = {{0, 2}, {0, 1}, {1, 2}};
        Plane p{};
        if (k >= 3) {
            p.normal[k - 3] = p.flow[k - 3] = 1.0;
            p.at                            = tension;
            return p;
        }
        const auto [i, j] = axes[k];
        p.normal[i]       = 1 + sin_phi;
        p.normal[j]       = sin_phi - 1;
        p.flow[i]         = 1 + sin_psi;
        p.flow[j]         = sin_psi - 1;
        p.at              = rhs;
        return p;
    }
    /// C : v in principal axes.
    void stiffen(const double (&v)[3], double (&out)[3]) const
    {
        const double volume = (bulk - 2.0 / 3 * shear) * (v[0] + v[1] + v[2]);
        for (int a = 0; a < 3; ++a) out[a] = 2 * shear * v[a] + volume;
    }
    /// The return to the intersection of some planes, and how far it is from being the answer, Pa: by a plane that it exceeds, or
    /// by a multiplier that is negative.
    template <class S>
    double violation(const int (&set)[3], const S (&trial)[3], S (&tau)[3]) const
    {
        constexpr double never = LawParameter::none;
        Plane planes[3];
        double stiff[3][3], A[3][3];
        S lambda[3];
        int n = 0;
        for (; n < 3 && set[n] >= 0; ++n) {
            if (set[n] >= 3 && !(tension < never)) return never;
            planes[n] = plane(set[n]);
            stiffen(planes[n].flow, stiff[n]);
        }
        for (int i = 0; i < n; ++i) {
            lambda[i] = -planes[i].at;
            for (int a = 0; a < 3; ++a) lambda[i] += planes[i].normal[a] * trial[a];
            for (int j = 0; j < n; ++j) {
                A[i][j] = 0;
                for (int a = 0; a < 3; ++a) A[i][j] += planes[i].normal[a] * stiff[j][a];
            }
        }
        if (!solve(A, lambda, n)) return never;
        double wrong = 0;
        for (int a = 0; a < 3; ++a) tau[a] = trial[a];
        for (int i = 0; i < n; ++i) {
            wrong = std::fmax(wrong, -primal(lambda[i]) * shear);
            for (int a = 0; a < 3; ++a) tau[a] -= lambda[i] * stiff[i][a];
        }
        return std::fmax(wrong, outside(tau));
    }
    /// The same for the apex, where all shear planes meet. Sorted plastic strains v are in the cone of their flows if they are on
    /// the inner side of its two faces, whose normals are the edges of the pyramid of angle psi.
    template <class S>
    double violation_of_apex(const S (&trial)[3], S (&tau)[3]) const
    {
        if (!(sin_phi > 0 && sin_psi > 0)) return LawParameter::none;
        const double apex = rhs / (2 * sin_phi);
        for (S& t : tau) t = apex;
        const double mean = primal(trial[0] + trial[1] + trial[2]) / 3, far = 1 + sin_psi, near = 1 - sin_psi;
        double v[3];  // times G
        for (int a = 0; a < 3; ++a) v[a] = (primal(trial[a]) - mean) / 2 + shear / (3 * bulk) * (mean - apex);
        const double wrong = std::fmax(-(near * v[0] + far * (v[1] + v[2])), -(near * (v[0] + v[1]) + far * v[2]));
        return std::fmax(std::fmax(wrong, 0.0), outside(tau));
    }
    /// How far a stress, in any order, is outside.
    template <class S>
    double outside(const S (&stress)[3]) const
    {
        const double tau[3] = {primal(stress[0]), primal(stress[1]), primal(stress[2])};
        double r            = 0;
        for (int i = 0; i < 3; ++i) {
            r = std::fmax(r, tau[i] - tension);
            for (int j = 0; j < 3; ++j)
                if (i != j) r = std::fmax(r, shear_excess(tau, i, j));
        }
        return r;
    }
    /// Elimination with pivots. False if the planes have no common point that flow reaches.
    template <class S>
    static bool solve(double (&A)[3][3], S (&b)[3], int n)
    {
        double scale = 0;
        for (int k = 0; k < n; ++k) scale = std::fmax(scale, std::fabs(A[k][k]));
        for (int k = 0; k < n; ++k) {
            int pivot = k;
            for (int i = k + 1; i < n; ++i)
                if (std::fabs(A[i][k]) > std::fabs(A[pivot][k])) pivot = i;
            if (!(std::fabs(A[pivot][k]) > 1e-13 * scale)) return false;
            for (int j = 0; j < n; ++j) std::swap(A[k][j], A[pivot][j]);
            std::swap(b[k], b[pivot]);
            for (int i = k + 1; i < n; ++i) {
                const double f = A[i][k] / A[k][k];
                for (int j = k; j < n; ++j) A[i][j] -= f * A[k][j];
                b[i] -= f * b[k];
            }
        }
        for (int k = n; k-- > 0;) {
            for (int j = k + 1; j < n; ++j) b[k] -= A[k][j] * b[j];
            b[k] /= A[k][k];
        }
        return true;
    }
};

/// Mohr-Coulomb with Hencky's elasticity. Cohesion and angles tend to residual values, r + (p - r) exp(-alpha/a0), with
/// alpha' = sqrt(2/3) |dev eps_p'|; they are those of the start of the step, so softening is first order in the step.
struct MohrCoulomb {
    static constexpr std::string_view name = "mohr-coulomb",
                                      what = "Mohr-Coulomb plasticity, exact at edges and apex, tension cut-off, softening "
                                             "(Clausen et al. 2006)";
    static constexpr Elasticity elasticity = Elasticity::isotropic;
    static constexpr int max_dim           = 3;
    static constexpr double not_given      = LawParameter::none;
    static constexpr std::array parameters{
        LawParameter{.name = "friction_angle", .unit = "degree", .what = "angle of friction", .max = 89.0},
        LawParameter{.name = "dilation_angle", .unit = "degree", .what = "angle of dilation", .max = 89.0},
        LawParameter{.name = "cohesion", .unit = "Pa", .what = "cohesion"},
        LawParameter{.name = "tension_cutoff", .unit = "Pa", .what = "largest principal stress", .fallback = not_given},
        LawParameter{.name = "residual_cohesion", .unit = "Pa", .what = "cohesion after softening", .fallback_of = "cohesion"},
        LawParameter{.name        = "residual_friction_angle",
                     .unit        = "degree",
                     .what        = "angle of friction after softening",
                     .max         = 89.0,
                     .fallback_of = "friction_angle"},
        LawParameter{.name        = "residual_dilation_angle",
                     .unit        = "degree",
                     .what        = "angle of dilation after softening",
                     .max         = 89.0,
                     .fallback_of = "dilation_angle"},
        LawParameter{.name     = "softening_strain",
                     .unit     = "",
                     .what     = "plastic strain in which strength falls by the factor e",
                     .fallback = not_given,
                     .open_min = true}};
    static constexpr std::array history = with_elastic_columns(std::array{kPlasticStrain, kDissipated});
    enum Parameter {
        kFriction,
        kDilation,
        kCohesion,
        kTension,
        kResidualCohesion,
        kResidualFriction,
        kResidualDilation,
        kSoftening
    };
    enum Column { kAlpha, kWork, kB };

    struct Strength {
        double friction, dilation, cohesion;  ///< radians, Pa
    };
    HenckyElasticity elastic;
    Strength peak, residual;
    double tension, softening_strain;

    ORDO_FLAT static MohrCoulomb of(const Material& m)
    {
        const auto& p           = m.parameters;
        constexpr double degree = 3.14159265358979323846 / 180;
        return {{m.bulk_modulus(), m.mu},
                {p[kFriction] * degree, p[kDilation] * degree, p[kCohesion]},
                {p[kResidualFriction] * degree, p[kResidualDilation] * degree, p[kResidualCohesion]},
                p[kTension],
                p[kSoftening]};
    }
    static BadParameter check(const Material& m)
    {
        const MohrCoulomb law = of(m);
        if (law.peak.dilation > law.peak.friction)
            return {"dilation_angle", "must not be above friction_angle: flow would create energy"};
        if (law.residual.dilation > law.residual.friction)
            return {"residual_dilation_angle", "must not be above residual_friction_angle: flow would create energy"};
        const bool softens = law.peak.friction != law.residual.friction || law.peak.dilation != law.residual.dilation ||
                             law.peak.cohesion != law.residual.cohesion;
        if (softens && law.softening_strain == not_given)
            return {"softening_strain", "is missing: residual values differ from those at the start"};
        if (!softens && law.softening_strain != not_given)
            return {"softening_strain", "has no effect: give a residual value other than that at the start, or remove it"};
        const bool has_apex = law.peak.friction > 0 || law.residual.friction > 0;
        const bool is_flat  = law.peak.dilation == 0 || law.residual.dilation == 0;
        if (has_apex && is_flat && law.tension == not_given)
            return {
                "tension_cutoff",
                "is missing: without dilation no flow leads to the apex; give 0 or more, at most cohesion/tan(friction_angle)"};
        if (law.tension != not_given && !(law.tension <= law.peak.cohesion / std::tan(law.peak.friction) * (1 + 1e-12)))
            return {"tension_cutoff", "must be at most cohesion/tan(friction_angle), the tension at the apex"};
        return {};
    }

    template <int D, class T>
    ORDO_FLAT void start(const Mat<D, T>& F, T* h) const
    {
        write_symmetric(left_cauchy_green(F), h + kB);
    }
    template <int D, class T>
    ORDO_FLAT Stress<D, T> stress(const Mat<D, T>& F, const T* h) const
    {
        return cauchy_of(elastic.kirchhoff(hencky_strain(read_symmetric<D>(h + kB))), F);
    }
    template <int D, class T>
    ORDO_FLAT T energy(const Mat<D, T>&, const T* h) const
    {
        return elastic.energy(hencky_strain(read_symmetric<D>(h + kB)));
    }
    template <int D, class T>
    ORDO_FLAT Stress<D, T> update(const Step<D, T>& step, T* h, T& fault) const
    {
        return step_principally(step, elastic, h + kB, h[kWork], [&](const T(&trial)[3], T(&tau)[3]) {
            T plastic(0.0);
            for (int k = 0; k < lanes_of(plastic); ++k) {
                const Lane<T> start[3] = {lane(trial[0], k), lane(trial[1], k), lane(trial[2], k)};
                Lane<T> end[3], alpha = lane(h[kAlpha], k);
                const int state = returned(start, end, alpha);
                if (state < 0) set_lane(fault, k, 1.0);
                if (state <= 0) continue;
                set_lane(plastic, k, 1.0);
                set_lane(h[kAlpha], k, alpha);
                for (int a = 0; a < 3; ++a) set_lane(tau[a], k, end[a]);
            }
            return plastic;
        });
    }

  private:
    /// The pyramid at a plastic strain.
    MohrCoulombPyramid pyramid(double alpha) const
    {
        const double part = softening_strain < not_given ? std::exp(-alpha / softening_strain) : 1.0;
        auto now          = [&](double Strength::*s) { return residual.*s + (peak.*s - residual.*s) * part; };
        const double phi = now(&Strength::friction), c = now(&Strength::cohesion);
        const double apex = phi > 0 ? c / std::tan(phi) : not_given;
        return {elastic.bulk,          elastic.shear,
                std::sin(phi),         std::sin(now(&Strength::dilation)),
                2 * c * std::cos(phi), std::fmin(tension, tension < not_given ? apex : tension)};
    }
    /// Positive if the state yields: `end` is then the stress on the pyramid, and alpha has grown. Negative if no stress was
    /// found. The pyramid is that of the start of the step, so it has no slope.
    template <class S>
    ORDO_CALL int returned(const S (&trial)[3], S (&end)[3], S& alpha) const
    {
        int order[3] = {0, 1, 2};
        auto sort    = [&](int a, int b) {
            if (primal(trial[order[a]]) < primal(trial[order[b]])) std::swap(order[a], order[b]);
        };
        sort(0, 1);
        sort(1, 2);
        sort(0, 1);
        const S sorted[3]            = {trial[order[0]], trial[order[1]], trial[order[2]]};
        const MohrCoulombPyramid now = pyramid(primal(alpha));
        if (!(now.excess({primal(sorted[0]), primal(sorted[1]), primal(sorted[2])}) > 0)) return 0;
        S tau[3];
        if (!now.project(sorted, tau)) return -1;
        S mean = 0, square = 0;
        for (int a = 0; a < 3; ++a) mean += (sorted[a] - tau[a]) / 3;
        for (int a = 0; a < 3; ++a) {
            const S strain = (sorted[a] - tau[a] - mean) / (2 * elastic.shear);
            square += strain * strain;
            end[order[a]] = tau[a];
        }
        alpha += sqrt(2.0 / 3 * square);
        return 1;
    }
};
static_assert(Inelastic<MohrCoulomb>);

}  // namespace ordo
