// Waves of small strain in two bars that touch end to end: the exact solutions of contact-bars.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace ordo::verification {

/// A bar in uniaxial strain.
struct WaveBar {
    double modulus, density;

    double speed() const { return std::sqrt(modulus / density); }
    double impedance() const { return std::sqrt(modulus * density); }
};

/// Bar 0 has x < 0 and bar 1 x > 0; they touch and stay in contact. At rest and free of stress bar 0 gets the velocity
/// `peak` cos^4(pi (x - middle)/(2 width)), |x - middle| < width: a wave of compression runs to the interface, one of tension away from
/// it (d'Alembert). At the interface a part of the first is reflected, since velocity and stress are continuous.
struct PulseThroughContact {
    std::array<WaveBar, 2> bar;
    double peak, middle, width;  ///< m/s, m, m

    /// Of the wave that leaves the interface, over the one that arrives: in bar 0, reflected, and in bar 1.
    double reflected() const { return (bar[0].impedance() - bar[1].impedance()) / (bar[0].impedance() + bar[1].impedance()); }
    double transmitted() const { return 1 + reflected(); }

    double displacement(double x, double t) const
    {
        const double c = bar[0].speed(), way = c * t;
        if (x > 0) return transmitted() * beyond(in_first(x) - way) / c;
        return (beyond(x - way) - beyond(x + way) + reflected() * beyond(-x - way)) / c;
    }
    double velocity(double x, double t) const
    {
        const double way = bar[0].speed() * t;
        if (x > 0) return transmitted() * half(in_first(x) - way);
        return half(x - way) + half(x + way) + reflected() * half(-x - way);
    }
    double stress(double x, double t) const
    {
        const double way = bar[0].speed() * t;
        if (x > 0) return -bar[1].impedance() * transmitted() * half(in_first(x) - way);
        return bar[0].impedance() * (half(x + way) + reflected() * half(-x - way) - half(x - way));
    }
    /// Compression at the interface, Pa.
    double contact_pressure(double t) const { return bar[1].impedance() * transmitted() * half(-bar[0].speed() * t); }

  private:
    /// How far from the interface a wave in bar 0 is when one in bar 1 is at x.
    double in_first(double x) const { return x * bar[0].speed() / bar[1].speed(); }
    /// Half of the initial velocity at s, m/s.
    double half(double s) const
    {
        const double c = std::cos(angle(s) / 2);
        return 0.5 * peak * c * c * c * c;
    }
    /// Its integral over all places beyond s, m^2/s.
    double beyond(double s) const
    {
        const double a = angle(s), all = 0.375 * std::numbers::pi;
        return 0.5 * peak * width / std::numbers::pi * (all - (0.375 * a + 0.5 * std::sin(a) + std::sin(2 * a) / 16));
    }
    double angle(double s) const { return std::numbers::pi * std::clamp((s - middle) / width, -1.0, 1.0); }
};

/// Bars of lengths that waves run along in the same time hit each other: what both have after one way along both and back, when the waves
/// of release from the free ends meet at the interface and the bars part.
struct BarImpact {
    std::array<WaveBar, 2> bar;
    std::array<double, 2> speeds;  ///< before, m/s

    /// Of the interface while they touch, m/s.
    double interface_speed() const
    {
        const double Z0 = bar[0].impedance(), Z1 = bar[1].impedance();
        return (Z0 * speeds[0] + Z1 * speeds[1]) / (Z0 + Z1);
    }
    double pressure() const { return bar[0].impedance() * (speeds[0] - interface_speed()); }
    /// Of bar k after they part.
    double speed_after(int k) const { return 2 * interface_speed() - speeds[k]; }
};

}  // namespace ordo::verification
