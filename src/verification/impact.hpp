// Self-similar waves behind a rigid wall that a plate hits: steps between fronts of constant speed, from jump conditions.
#pragma once

#include "verification/solution.hpp"

#include <cmath>
#include <vector>

namespace ordo::verification {

/// A front that leaves the wall at t = 0, and the state behind it.
struct WaveFront {
    double speed;     ///< with respect to the initial configuration, m/s
    double F;         ///< dx/dX behind it
    double stress;    ///< Cauchy stress along the motion behind it, Pa
    double velocity;  ///< of the material behind it, m/s
};

/// The plate X > 0 moves with -speed onto a wall at 0. Fronts from the slowest to the fastest.
class SteppedWave final : public Solution<1> {
  public:
    SteppedWave(std::vector<WaveFront> fronts, double speed) : fronts_(std::move(fronts)), speed_(speed) {}

    const std::vector<WaveFront>& fronts() const { return fronts_; }

    Vec<1> position(const Vec<1>& X, double t) const override
    {
        double x = X[0], velocity = -speed_, since = 0.0;
        for (std::size_t k = fronts_.size(); k-- > 0 && X[0] < fronts_[k].speed * t;) {
            const double arrival = X[0] / fronts_[k].speed;
            x += velocity * (arrival - since);
            velocity = fronts_[k].velocity;
            since    = arrival;
        }
        return {x + velocity * (t - since)};
    }
    Vec<1> velocity(const Vec<1>& X, double t) const override
    {
        const WaveFront* f = front_over(X, t);
        return {f ? f->velocity : -speed_};
    }
    Mat<1> deformation(const Vec<1>& X, double t) const override
    {
        const WaveFront* f = front_over(X, t);
        return {{{f ? f->F : 1.0}}};
    }
    Mat<1> stress(const Vec<1>& X, double t) const override
    {
        const WaveFront* f = front_over(X, t);
        return {{{f ? f->stress : 0.0}}};
    }

  private:
    /// The slowest front that has passed X; null if none has.
    const WaveFront* front_over(const Vec<1>& X, double t) const
    {
        for (const WaveFront& f : fronts_)
            if (X[0] < f.speed * t) return &f;
        return nullptr;
    }
    std::vector<WaveFront> fronts_;
    double speed_;
};

/// Uniaxial strain of `j2` without hardening: tau = (K + 4G/3) ln F up to yield, then K ln F - 2Y/3; sigma = tau/F, and the
/// first Piola-Kirchhoff stress P = sigma. Its slope dP/dF grows in compression, so both waves are shocks:
/// rho0 c^2 = [P]/[F], [v] = -c [F] (Rankine and Hugoniot). Defaults: steel, E = 200 GPa, nu = 0.3.
struct JumpOfJ2 {
    double bulk = 200e9 / 1.2, shear = 200e9 / 2.6, yield = 400e6;  ///< Pa
    double density = 7800;                                          ///< kg/m^3

    /// P, Pa.
    double stress(double F) const
    {
        const double e = std::log(F), elastic = (bulk + 4.0 / 3 * shear) * e, plastic = bulk * e - 2.0 / 3 * yield;
        return std::fmax(elastic, plastic) / F;
    }
    /// Precursor and plastic wave of a plate of this speed, m/s; the precursor alone if it does not yield.
    std::vector<WaveFront> fronts(double speed) const
    {
        const WaveFront ahead{0.0, 1.0, 0.0, -speed};
        const WaveFront precursor = front_to(std::exp(-yield / (2 * shear)), ahead);
        if (precursor.velocity >= 0) return {at_rest(ahead)};
        return {at_rest(precursor), precursor};
    }

  private:
    /// The front that compresses from the state `ahead` to F.
    WaveFront front_to(double F, const WaveFront& ahead) const
    {
        const double c = std::sqrt((stress(F) - ahead.stress) / (F - ahead.F) / density);
        return {c, F, stress(F), ahead.velocity - c * (F - ahead.F)};
    }
    /// The front that stops the material, by bisection for F.
    WaveFront at_rest(const WaveFront& ahead) const
    {
        double low = 0.5, high = ahead.F;
        for (int k = 0; k < 100; ++k) {
            const double middle                                 = (low + high) / 2;
            (front_to(middle, ahead).velocity > 0 ? low : high) = middle;
        }
        return front_to((low + high) / 2, ahead);
    }
};

/// A shock without strength: U = c0 + s u, pressure rho0 U u, J = 1 - u/U. Defaults: copper.
struct Hugoniot {
    double density = 8930, sound = 3940, slope = 1.489;  ///< kg/m^3, m/s, 1

    std::vector<WaveFront> fronts(double speed) const
    {
        const double shock = sound + slope * speed;
        return {{shock, 1 - speed / shock, -density * shock * speed, 0.0}};
    }
};

}  // namespace ordo::verification
