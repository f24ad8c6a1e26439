// Motions x(X, t) with known behaviour at boundaries, each a template on the scalar. Everything else in a manufactured solution
// is derived from them.
#pragma once

#include "base/vec.hpp"

#include <numbers>

namespace ordo::verification {

inline constexpr double kPi = std::numbers::pi;

/// u_a = A sin(k X_a) sin(w t + phase) along each axis: Gong (2015) eqs. 4.35 and 4.41, Tran et al. (2019) eq. 48.
/// Walls at multiples of pi/k do not move and carry no shear.
struct StandingWave {
    double amplitude;    ///< m
    double wave_number;  ///< k, 1/m
    double frequency;    ///< w, rad/s
    double phase = 0.0;  ///< rad

    template <int D, class T>
    ORDO_FLAT Vec<D, T> operator()(const Vec<D, T>& X, const T& t) const
    {
        const T s   = amplitude * sin(frequency * t + phase);
        Vec<D, T> x = X;
        for (int a = 0; a < D; ++a) x[a] = X[a] + s * sin(wave_number * X[a]);
        return x;
    }
};

/// u_r = A sin(w t) (c3 R^3 + c2 R^2 + c1 R) with no radial strain at both rims: Tran et al. (2019) eqs. 57 and 59,
/// corrected; after Wallstedt & Guilkey (2008). The rims are free of traction only for nu = 0.
struct RingExpansion {
    double amplitude;  ///< of the outer rim, m
    double inner, outer;
    double frequency;

    template <int D, class T>
    ORDO_FLAT Vec<D, T> operator()(const Vec<D, T>& X, const T& t) const
    {
        const double scale = 1 / (outer * (outer - 3 * inner));
        const double c1 = -6 * inner * scale, c2 = 3 * (inner + outer) / outer * scale, c3 = -2 / outer * scale;
        const T R2      = X[0] * X[0] + X[1] * X[1];
        const T stretch = amplitude * sin(frequency * t) * (c3 * R2 + c2 * sqrt(R2) + c1);  // u_r/R
        Vec<D, T> x     = X;
        for (int a = 0; a < 2; ++a) x[a] = X[a] + X[a] * stretch;
        return x;
    }
};

/// Rotation about the z axis by A sin(w t) h(R), h = 1 - 32 (R - 1)^2 + 256 (R - 1)^4, without traction on the rims
/// R = 0.75 and 1.25: Tran et al. (2019) eqs. 62 to 65, corrected; after Kamojjala et al. (2013). In 3D the angle may
/// vary as 1 + twist cos(pi Z/height), which leaves the faces Z = 0 and Z = height free of shear.
struct Vortex {
    double amplitude;  ///< rad
    double frequency;
    double twist = 0.0, height = 1.0;

    template <int D, class T>
    ORDO_FLAT Vec<D, T> operator()(const Vec<D, T>& X, const T& t) const
    {
        const T r  = sqrt(X[0] * X[0] + X[1] * X[1]) - 1.0;
        const T r2 = r * r;
        T angle    = amplitude * sin(frequency * t) * (256.0 * (r2 * r2) - 32.0 * r2 + 1.0);
        if constexpr (D == 3) angle = angle * (twist * cos((kPi / height) * X[2]) + 1.0);
        const T c = cos(angle), s = sin(angle);
        Vec<D, T> x = X;
        x[0]        = X[0] * c - X[1] * s;
        x[1]        = X[0] * s + X[1] * c;
        return x;
    }
};

/// u_x = A sin(w t + phase) sin(pi X) sin(pi Y), u_y the same with two waves along y; in 3D u_z with two along x, and each times
/// the sine of its missing axis (ours): shear and rotation between walls that hold all components.
struct BentBox {
    double amplitude;  ///< m
    double frequency, phase;

    template <int D, class T>
    ORDO_FLAT Vec<D, T> operator()(const Vec<D, T>& X, const T& t) const
    {
        const T s   = amplitude * sin(frequency * t + phase);
        Vec<D, T> x = X;
        for (int a = 0; a < D; ++a) {
            T bump = s;
            for (int b = 0; b < D; ++b) {
                const double waves = (a == 1 && b == 1) || (a == 2 && b == 0) ? 2 : 1;
                bump               = bump * sin(waves * kPi * X[b]);
            }
            x[a] = X[a] + bump;
        }
        return x;
    }
};

/// X turned about the z axis through the middle of the unit box.
template <int D, class T>
ORDO_FLAT inline Vec<D, T> turned_in_unit_box(const Vec<D, T>& X, const T& angle)
{
    const T c = cos(angle), s = sin(angle);
    const T dx = X[0] - 0.5, dy = X[1] - 0.5;
    Vec<D, T> x = X;
    x[0]        = dx * c - dy * s + 0.5;
    x[1]        = dx * s + dy * c + 0.5;
    return x;
}

/// The middle of a unit box rotates about the z axis through its centre by A sin(w t) sin^2 pi X sin^2 pi Y (sin^2 pi Z), while
/// the walls stay at rest and free of stress (ours). The material in between shears; F is neither diagonal nor constant over a
/// particle.
struct ShearRotation {
    double amplitude;  ///< rad
    double frequency;

    template <int D, class T>
    ORDO_FLAT Vec<D, T> operator()(const Vec<D, T>& X, const T& t) const
    {
        T bump = sin(kPi * X[0]);
        for (int a = 1; a < D; ++a) bump = bump * sin(kPi * X[a]);
        const T angle = amplitude * sin(frequency * t) * (bump * bump);
        return turned_in_unit_box(X, angle);
    }
};

/// Rigid rotation about the z axis through the middle of the unit box.
struct RigidRotation {
    double frequency;  ///< rad/s

    template <int D, class T>
    ORDO_FLAT Vec<D, T> operator()(const Vec<D, T>& X, const T& t) const
    {
        return turned_in_unit_box(X, frequency * t);
    }
};

/// Uniaxial strain that grows everywhere until w t = pi/2 (ours): dx/dX = start + A sin(w t)(1 + cos(pi X)/2) along x, x = 0 is held.
struct GrowingStretch {
    double start;      ///< dx/dX at t = 0
    double amplitude;  ///< A
    double frequency;  ///< w, rad/s

    template <int D, class T>
    ORDO_FLAT Vec<D, T> operator()(const Vec<D, T>& X, const T& t) const
    {
        Vec<D, T> x = X;
        x[0]        = start * X[0] + amplitude * sin(frequency * t) * (X[0] + 1 / (2 * kPi) * sin(kPi * X[0]));
        return x;
    }
};

/// A ring grows without change of volume: r^2 = R^2 + a(t), a = start + A sin(w t). In polar axes F = diag(R/r, r/R) (1 along the
/// axis), so the logarithmic strain keeps its directions.
struct RingGrowth {
    double start, amplitude;  ///< m^2
    double frequency;         ///< w, rad/s

    template <int D, class T>
    ORDO_FLAT Vec<D, T> operator()(const Vec<D, T>& X, const T& t) const
    {
        const T R2 = X[0] * X[0] + X[1] * X[1], stretch = sqrt((R2 + (amplitude * sin(frequency * t) + start)) / R2);
        Vec<D, T> x = X;
        for (int a = 0; a < 2; ++a) x[a] = X[a] * stretch;
        return x;
    }
};

/// Layers slide along x: u_x = rate t Y. F is uniform, and there is no body force.
struct SimpleShear {
    double rate;  ///< 1/s

    template <int D, class T>
    ORDO_FLAT Vec<D, T> operator()(const Vec<D, T>& X, const T& t) const
    {
        Vec<D, T> x = X;
        x[0]        = X[0] + rate * t * X[1];
        return x;
    }
};

}  // namespace ordo::verification
