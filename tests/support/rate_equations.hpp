// Plasticity by its rate equations, for tests: Runge-Kutta steps of fourth order in tensor components, with events. It shares no
// code with the laws: logarithms are Eigen's, there is no return map and no exponential map.
//
//     L_v b = -2 gamma N b,   tau = C : (ln b)/2,   consistency  M : C : (d - gamma N) = h gamma     (materials in their rates)
#pragma once

#include <Eigen/Dense>

#include <cmath>
#include <functional>

namespace ordo::test {

using Tensor = Eigen::Matrix3d;

inline Tensor log_of(const Tensor& b)
{
    const Eigen::SelfAdjointEigenSolver<Tensor> e(b);
    return e.eigenvectors() * e.eigenvalues().array().log().matrix().asDiagonal() * e.eigenvectors().transpose();
}
inline Tensor dev_of(const Tensor& t) { return t - t.trace() / 3 * Tensor::Identity(); }
inline double inner(const Tensor& a, const Tensor& b) { return a.cwiseProduct(b).sum(); }

/// b_e, hardening variables and what is dissipated.
struct RateState {
    Tensor b              = Tensor::Identity();
    Eigen::Vector3d inner = Eigen::Vector3d::Zero();
    double dissipated     = 0.0;
    RateState operator+(const RateState& o) const { return {b + o.b, inner + o.inner, dissipated + o.dissipated}; }
    RateState operator*(double s) const { return {b * s, inner * s, dissipated * s}; }
};

/// What a law says at a state: Kirchhoff stress, yield function, plastic flow gamma N and rates of the inner variables. `flow` is
/// called where the state yields; gamma may come out negative, which means unloading.
struct RateFlow {
    double gamma          = 0.0;
    Tensor N              = Tensor::Zero();
    Eigen::Vector3d inner = Eigen::Vector3d::Zero();  ///< rates per gamma
};
struct RateLawOf {
    std::function<Tensor(const RateState&)> stress;
    std::function<double(const RateState&)> yield;  ///< negative inside, Pa
    std::function<RateFlow(const RateState&, const Tensor& d)> flow;
    bool is_viscous = false;  ///< gamma is a function of the state outside the yield surface: no consistency
};

/// A path F(t), t from 0 to 1, and its rate.
struct SmoothPath {
    Tensor A, B;
    Tensor F(double t) const { return Tensor::Identity() + t * A + t * t * B; }
    Tensor rate(double t) const { return A + 2 * t * B; }
};

class RateIntegrator {
  public:
    RateIntegrator(const RateLawOf& law, const SmoothPath& path, RateState start) : law_(law), path_(path), s_(std::move(start))
    {}

    /// The state at t = 1; not a number if events do not end.
    RateState integrate(int steps)
    {
        t_          = 0;
        is_plastic_ = false;
        while (t_ < 1 - 1e-14) {
            if (events > 100) return s_ * std::nan("");
            const double dt = std::min(1.0 / steps, 1 - t_);
            is_plastic_ ? flow(dt) : load(dt);
        }
        return s_;
    }
    int events = 0;

  private:
    /// An elastic step, to the yield surface if that is reached before.
    void load(double dt)
    {
        auto end = [&](double h) {
            const Tensor f = path_.F(t_ + h) * path_.F(t_).inverse();
            RateState r    = s_;
            r.b            = f * s_.b * f.transpose();
            return r;
        };
        double low = 0, high = dt;
        if (law_.yield(end(dt)) > 0) {
            for (int k = 0; k < 60; ++k) (law_.yield(end((low + high) / 2)) > 0 ? high : low) = (low + high) / 2;
            is_plastic_ = true;
            ++events;
        }
        s_ = end(high);
        t_ += high;
    }
    double gamma(const RateState& s, double t) const { return law_.flow(s, d(t)).gamma; }
    Tensor d(double t) const
    {
        const Tensor l = path_.rate(t) * path_.F(t).inverse();
        return (l + l.transpose()) / 2;
    }
    RateState rate(const RateState& s, double t) const
    {
        const Tensor l    = path_.rate(t) * path_.F(t).inverse();
        const RateFlow f  = law_.flow(s, (l + l.transpose()) / 2);
        const Tensor back = f.gamma * (f.N * s.b + s.b * f.N);
        return {l * s.b + s.b * l.transpose() - back, f.gamma * f.inner, f.gamma * inner(law_.stress(s), f.N)};
    }
    RateState rk4(double h) const
    {
        const RateState k1 = rate(s_, t_), k2 = rate(s_ + k1 * (h / 2), t_ + h / 2);
        const RateState k3 = rate(s_ + k2 * (h / 2), t_ + h / 2), k4 = rate(s_ + k3 * h, t_ + h);
        return s_ + (k1 + k2 * 2 + k3 * 2 + k4) * (h / 6);
    }
    /// A plastic step, to unloading if that comes before.
    void flow(double dt)
    {
        auto ends  = [&](double h) { return law_.is_viscous ? law_.yield(rk4(h)) < 0 : gamma(rk4(h), t_ + h) < 0; };
        double low = 0, high = dt;
        if (ends(dt)) {
            for (int k = 0; k < 60; ++k) (ends((low + high) / 2) ? high : low) = (low + high) / 2;
            is_plastic_ = false;
            ++events;
        }
        s_ = rk4(high);
        t_ += high;
    }

    const RateLawOf& law_;
    const SmoothPath& path_;
    RateState s_;
    double t_        = 0;
    bool is_plastic_ = false;
};

}  // namespace ordo::test
