// Two elastic rings in frictionless or sliding contact at their common radius, plane strain: the exact solutions of contact-ring.
#pragma once

#include "base/vec.hpp"

#include <array>
#include <cmath>
#include <numbers>

namespace ordo::verification {

/// A ring under pressure on both rims that may turn about its axis; small strains, plane strain. Lame's solution, and for the turning
/// Timoshenko & Goodier, Theory of Elasticity, sec. 32, in plane strain.
struct ElasticRing {
    double inner, outer;  ///< m
    double young, poisson, density;

    struct Load {
        double inside, outside;  ///< pressures, Pa
        double speed = 0.0;      ///< angular, rad/s
    };
    /// Radial and hoop stress at radius r, Pa.
    struct Stresses {
        double radial, hoop;
    };

    Stresses stresses(double r, const Load& of) const
    {
        const double a2 = inner * inner, b2 = outer * outer, r2 = r * r;
        const double mean  = (of.inside * a2 - of.outside * b2) / (b2 - a2),
                     swing = (of.inside - of.outside) * a2 * b2 / (b2 - a2);
        const double turn  = (3 - 2 * poisson) / (8 * (1 - poisson)) * density * of.speed * of.speed;
        const double part  = (1 + 2 * poisson) / (3 - 2 * poisson);
        return {mean - swing / r2 + turn * (a2 + b2 - a2 * b2 / r2 - r2),
                mean + swing / r2 + turn * (a2 + b2 + a2 * b2 / r2 - part * r2)};
    }
    /// Radial displacement, m: r times the hoop strain.
    double displacement(double r, const Load& of) const
    {
        const Stresses s = stresses(r, of);
        return r * (1 + poisson) / young * ((1 - poisson) * s.hoop - poisson * s.radial);
    }
    /// About its axis, per unit depth, kg m.
    double inertia() const { return 0.5 * std::numbers::pi * density * (std::pow(outer, 4) - std::pow(inner, 4)); }
};

/// The inner ring is pressed against the outer one from inside.
struct PressedRings {
    std::array<ElasticRing, 2> ring;

    /// Radii 0.4, 0.6137 and 0.85 m, E = 1 Pa inside and `stiffness` times that outside, nu = 0.3, density 1.
    static PressedRings of(double stiffness)
    {
        constexpr double a = 0.4, b = 0.6137, c = 0.85, nu = 0.3;
        return {{ElasticRing{a, b, 1.0, nu, 1.0}, ElasticRing{b, c, stiffness, nu, 1.0}}};
    }
    double common_radius() const { return ring[0].outer; }

    /// Contact pressure, Pa, for which both surfaces are at the same place.
    double contact_pressure(double inside, const std::array<double, 2>& speeds = {}) const
    {
        const double b     = common_radius();
        const double apart = ring[1].displacement(b, {0.0, 0.0, speeds[1]}) - ring[0].displacement(b, {inside, 0.0, speeds[0]});
        return -apart / (ring[1].displacement(b, {1.0, 0.0}) - ring[0].displacement(b, {0.0, 1.0}));
    }
    /// The load on ring k at rest.
    ElasticRing::Load load(int k, double inside) const
    {
        const double p = contact_pressure(inside);
        return k == 0 ? ElasticRing::Load{inside, p} : ElasticRing::Load{p, 0.0};
    }
    /// Of the inner ring about the axis by sliding friction that brakes its spin, N m per unit depth.
    double torque(double friction, double pressure) const
    {
        return 2 * std::numbers::pi * common_radius() * common_radius() * friction * pressure;
    }
};

/// Angular speeds of rings that slide on each other, under a pressure inside that changes slowly: I1 w1' = -2 pi b^2 mu p = -I2 w2'
/// while w1 > w2, p the contact pressure with the turning.
class SpinningRings {
  public:
    SpinningRings(const PressedRings& rings, double friction, double speed)
        : rings_(rings), friction_(friction), speeds_{speed, 0.0}
    {}
    /// One step of the midpoint rule from time t; `inside(t)` is the pressure.
    template <class Pressure>
    void step(double t, double dt, const Pressure& inside)
    {
        const auto middle = changed(speeds_, 0.5 * dt, torque(speeds_, inside(t)));
        speeds_           = changed(speeds_, dt, torque(middle, inside(t + 0.5 * dt)));
    }
    const std::array<double, 2>& speeds() const { return speeds_; }

  private:
    using Speeds = std::array<double, 2>;

    double torque(const Speeds& w, double inside) const { return rings_.torque(friction_, rings_.contact_pressure(inside, w)); }
    Speeds changed(const Speeds& w, double dt, double torque) const
    {
        return {w[0] - dt * torque / rings_.ring[0].inertia(), w[1] + dt * torque / rings_.ring[1].inertia()};
    }

    PressedRings rings_;
    double friction_;
    Speeds speeds_;
};

}  // namespace ordo::verification
