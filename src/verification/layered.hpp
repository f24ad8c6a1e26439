// Two bonded layers that move along one coordinate: the reference for the bi-material bar and ring of Sadeghirad, Brannon &
// Guilkey (2013), sec. 5. Linear finite elements with one midpoint, lumped mass, total Lagrangian, leapfrog.
#pragma once

#include "base/error.hpp"
#include "material/material.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

namespace ordo::verification {

/// Starts at rest and free of stress at time 0, when the body force is suddenly applied. Points are given by their coordinate R
/// at that time. Second order in element size and dt; fronts where the stress has a kink leave ripples behind.
class LayeredBody {
  public:
    enum class Geometry {
        column,  ///< along a straight line, uniaxial strain; per area
        ring,    ///< along the radius, plane strain; per radian and depth, R0 > 0
    };
    enum class FixedEnd { none, low, high };

    struct Setting {
        Geometry geometry = Geometry::column;
        std::array<double, 3> ends{};         ///< R0 < R1 < R2, the layers are [R0, R1] and [R1, R2], m
        std::array<Material, 2> materials{};  ///< of the layers, hyperelastic
        std::array<int, 2> elements{};        ///< of the layers
        double dt          = 0.0;             ///< below element size over wave speed, s
        FixedEnd fixed_end = FixedEnd::none;
        std::function<double(double x)> body_force;  ///< per mass along the coordinate, at the current coordinate, m/s^2
    };

    explicit LayeredBody(Setting setting) : setting_(std::move(setting))
    {
        const auto& ends = setting_.ends;
        for (int l = 0; l < 2; ++l) {
            const int n = setting_.elements[l];
            ORDO_EXPECT(n > 0 && ends[l] < ends[l + 1]);
            ORDO_EXPECT(setting_.materials[l].law->is_hyperelastic);
            for (int i = 0; i < n; ++i) R_.push_back(ends[l] + i * (ends[l + 1] - ends[l]) / n);
        }
        R_.push_back(ends[2]);
        u_.assign(R_.size(), 0.0);
        v_ = m_ = f_ = u_;
        for (int e = 0; e < count(); ++e) {
            const double a = R_[e], b = R_[e + 1], half = setting_.materials[layer_of(e)].density * (b - a) / 2;
            m_[e] += half * (ring() ? (2 * a + b) / 3 : 1.0);  // the integral of rho0 N R, exact
            m_[e + 1] += half * (ring() ? (a + 2 * b) / 3 : 1.0);
        }
    }

    /// Steps forward to the multiple of dt nearest to time t, s.
    void advance(double t)
    {
        for (const long last = std::lround(t / setting_.dt); steps_ < last; ++steps_) step();
    }

    /// Displacement of the material point R along the coordinate, m.
    double displacement(double R) const
    {
        const auto above = std::upper_bound(R_.begin() + 1, R_.end() - 1, R);
        const int e      = static_cast<int>(above - R_.begin()) - 1;
        const double y   = (R - R_[e]) / (R_[e + 1] - R_[e]);
        return (1 - y) * u_[e] + y * u_[e + 1];
    }
    /// Cauchy stress along the coordinate at the material point R, Pa. Linear between and beyond the midpoints of the
    /// elements of a layer; the interface belongs to the upper layer.
    double stress(double R) const { return between_midpoints(R)(0, 0); }
    /// Cauchy stress around a ring, or across a column, the same way.
    double hoop_stress(double R) const { return between_midpoints(R)(1, 1); }

  private:
    bool ring() const { return setting_.geometry == Geometry::ring; }
    int count() const { return setting_.elements[0] + setting_.elements[1]; }
    int layer_of(int e) const { return e < setting_.elements[0] ? 0 : 1; }

    Mat<2> deformation(int e) const
    {
        Mat<2> F = Mat<2>::identity();
        F(0, 0) += (u_[e + 1] - u_[e]) / (R_[e + 1] - R_[e]);
        if (ring()) F(1, 1) += (u_[e + 1] + u_[e]) / (R_[e + 1] + R_[e]);
        return F;
    }
    Mat<2> element_stress(int e) const
    {
        const Material& m = setting_.materials[layer_of(e)];
        return in_plane(m.law->in_2d.initial_stress(m, deformation(e)));
    }

    Mat<2> between_midpoints(double R) const
    {
        const int l = R < setting_.ends[1] ? 0 : 1, n = setting_.elements[l], first = l == 0 ? 0 : setting_.elements[0];
        if (n == 1) return element_stress(first);
        const double size = (setting_.ends[l + 1] - setting_.ends[l]) / n, y = (R - setting_.ends[l]) / size - 0.5;
        const int e = std::clamp(static_cast<int>(std::floor(y)), 0, n - 2);
        return (1 - y + e) * element_stress(first + e) + (y - e) * element_stress(first + e + 1);
    }

    void step()
    {
        for (std::size_t i = 0; i < u_.size(); ++i) f_[i] = m_[i] * setting_.body_force(R_[i] + u_[i]);
        for (int e = 0; e < count(); ++e) {
            // The integral of P_RR N' + P_TT N/R over R dR at the midpoint, or of P_RR N' over dR; P is first Piola-Kirchhoff.
            const Mat<2> P      = element_stress(e) * cofactor(deformation(e));
            const double radial = P(0, 0) * (ring() ? (R_[e] + R_[e + 1]) / 2 : 1.0);
            const double hoop   = ring() ? P(1, 1) * (R_[e + 1] - R_[e]) / 2 : 0.0;
            f_[e] += radial - hoop;
            f_[e + 1] -= radial + hoop;
        }
        const double kick = steps_ == 0 ? setting_.dt / 2 : setting_.dt;  // velocities live at half steps
        for (std::size_t i = 0; i < u_.size(); ++i) v_[i] += kick * f_[i] / m_[i];
        if (setting_.fixed_end == FixedEnd::low) v_.front() = 0.0;
        if (setting_.fixed_end == FixedEnd::high) v_.back() = 0.0;
        for (std::size_t i = 0; i < u_.size(); ++i) u_[i] += setting_.dt * v_[i];
    }

    Setting setting_;
    std::vector<double> R_, u_, v_, m_, f_;  // of nodes; with x_ instead of u_ round-off would be 0.5 Pa for 2048 elements
    long steps_ = 0;
};

}  // namespace ordo::verification
