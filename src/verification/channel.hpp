// Flows between parallel walls from rest, as series: a plate that moves, a force along the channel; and grains down a plane.
#pragma once

#include "verification/motions.hpp"
#include "verification/solution.hpp"

#include <cmath>

namespace ordo::verification {

/// A velocity along x that depends on y and t, between walls at 0 and 1 m, and what follows from it.
struct ChannelProfile {
    double velocity;      ///< u, m/s
    double shear_rate;    ///< du/dy, 1/s
    double displacement;  ///< integral of u over time, m
    double shear;         ///< integral of du/dy
};

/// How many terms of a series with factors exp(-n^2 pi^2 s) count.
inline int terms_of_series(double s) { return static_cast<int>(std::ceil(std::sqrt(40 / (kPi * kPi * s)))) + 1; }

/// The wall at y = 1 moves with velocity U from t = 0 (Couette):
/// u/U = y + 2 sum (-1)^n/(n pi) exp(-n^2 pi^2 nu t) sin(n pi y), Schlichting (1979), Boundary-layer theory, eq. 5.24.
struct StartingCouette {
    double speed, nu;  ///< U, m/s; kinematic viscosity, m^2/s

    ChannelProfile operator()(double y, double t) const
    {
        const double s = nu * t;  // dimensionless, as the width is 1 m
        if (!(s > 0)) return {};
        ChannelProfile r{y, 1.0, s * y + (y * y * y - y) / 6, s + (3 * y * y - 1) / 6};
        for (int n = 1; n <= terms_of_series(s); ++n) {
            const double k = n * kPi, decay = 2 * (n % 2 ? -1 : 1) * std::exp(-k * k * s), wave = std::sin(k * y),
                         slope = std::cos(k * y);
            r.velocity += decay / k * wave;
            r.shear_rate += decay * slope;
            r.displacement -= decay / (k * k * k) * wave;
            r.shear -= decay / (k * k) * slope;
        }
        return {speed * r.velocity, speed * r.shear_rate, speed / nu * r.displacement, speed / nu * r.shear};
    }
};

/// A force f per mass along x acts from t = 0 (Poiseuille):
/// u nu/f = y (1 - y)/2 - 4 sum over odd n of exp(-n^2 pi^2 nu t)/(n pi)^3 sin(n pi y), after Batchelor (1967), sec. 4.3.
struct StartingPoiseuille {
    double force, nu;  ///< m/s^2; m^2/s

    ChannelProfile operator()(double y, double t) const
    {
        const double s = nu * t;
        if (!(s > 0)) return {};
        ChannelProfile r{y * (1 - y) / 2, 0.5 - y, s * y * (1 - y) / 2 - (y - 2 * y * y * y + y * y * y * y) / 24,
                         s * (0.5 - y) - (1 - 6 * y * y + 4 * y * y * y) / 24};
        for (int n = 1; n <= terms_of_series(s); n += 2) {
            const double k = n * kPi, decay = 4 * std::exp(-k * k * s) / (k * k * k), wave = std::sin(k * y),
                         slope = std::cos(k * y);
            r.velocity -= decay * wave;
            r.shear_rate -= decay * k * slope;
            r.displacement += decay / (k * k) * wave;
            r.shear += decay / k * slope;
        }
        const double scale = force / nu;
        return {scale * r.velocity, scale * r.shear_rate, scale / nu * r.displacement, scale / nu * r.shear};
    }
};

/// Such a flow of a Newtonian fluid. Layers slide on each other, so the volume and with it the pressure stay.
template <class Profile>
class ChannelFlow final : public Solution<2> {
  public:
    ChannelFlow(const Profile& profile, double viscosity) : profile_(profile), viscosity_(viscosity) {}

    Vec<2> position(const Vec<2>& X, double t) const override { return {X[0] + profile_(X[1], t).displacement, X[1]}; }
    Vec<2> velocity(const Vec<2>& X, double t) const override { return {profile_(X[1], t).velocity, 0.0}; }
    Mat<2> deformation(const Vec<2>& X, double t) const override { return {{{1.0, profile_(X[1], t).shear}, {0.0, 1.0}}}; }
    Mat<2> stress(const Vec<2>& X, double t) const override
    {
        const double s = viscosity_ * profile_(X[1], t).shear_rate;
        return {{{0.0, s}, {s, 0.0}}};
    }

  private:
    Profile profile_;
    double viscosity_;
};

/// The steady flow of grains of the mu(I) rheology down a plane, for which mu(I) = tan(slope) everywhere: with y from the plane
/// u = 2/3 (I/d) sqrt(phi g cos(slope)) (h^1.5 - (h - y)^1.5), Jop, Forterre & Pouliquen (2006), after Bagnold.
struct PlaneOfGrains {
    double slope   = 25 * kPi / 180;                           ///< rad
    double depth   = 0.1;                                      ///< h, m
    double gravity = 9.81;                                     ///< m/s^2
    double grain = 5e-3, grain_density = 2450, packing = 0.6;  ///< d, m; kg/m^3; phi
    double slow = std::tan(20.9 * kPi / 180), fast = std::tan(32.76 * kPi / 180), I0 = 0.279;

    double density() const { return packing * grain_density; }
    /// I of the steady flow; zero where the grains stay at rest.
    double inertial_number() const { return std::fmax(0.0, I0 * (std::tan(slope) - slow) / (fast - std::tan(slope))); }
    double steady_velocity(double y) const
    {
        return 2.0 / 3 * inertial_number() / grain * std::sqrt(packing * gravity * std::cos(slope)) *
               (std::pow(depth, 1.5) - std::pow(depth - y, 1.5));
    }
    double pressure(double y) const { return density() * gravity * std::cos(slope) * (depth - y); }
};

}  // namespace ordo::verification
