// One particle driven along a path by the functions of its law, and the comparison with rate equations.
#pragma once

#include "material/branches.hpp"
#include "support/materials.hpp"
#include "support/particles.hpp"
#include "support/rate_equations.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdio>

namespace ordo::test {

template <int D>
struct Driven {
    Material material;
    Mat<D> F = Mat<D>::identity();
    Stress<D> sigma{};
    std::array<double, Material::most_history> history{};
    double fault = 0;

    explicit Driven(const Material& m) : material(m)
    {
        start_history(m, F, history.data());
        sigma = initial_stress(m, F);
    }
    const LawFunctions<D>& functions() const { return material.law->in<D>(); }
    const Stress<D>& step(const Mat<D>& next, double dt = 1.0)
    {
        sigma = update_stress(material, {next, (next - F) * inverse(F), dt}, sigma, history.data(), fault);
        F     = next;
        EXPECT_FALSE(fault > 0);
        return sigma;
    }
    /// A column by its name.
    double column(std::string_view name) const
    {
        int k = 0;
        for (const HistoryColumn& c : history_of(material, D)) {
            if (c.name == name) return history[k];
            ++k;
        }
        ADD_FAILURE() << "no column " << name;
        return 0;
    }
    void set_column(std::string_view name, double value)
    {
        int k = 0;
        for (const HistoryColumn& c : history_of(material, D)) {
            if (c.name == name) history[k] = value;
            ++k;
        }
    }
    Symmetric<D> kirchhoff() const { return det(F) * sigma; }
    double stored() const { return stored_energy(material, F, sigma, 1.0, det(F), history.data()); }
};

inline Mat<3> to_mat(const Tensor& t)
{
    Mat<3> r{};
    for (int c = 0; c < 9; ++c) r(c / 3, c % 3) = t(c / 3, c % 3);
    return r;
}

/// A random path to strains of about `size`; `volume` is how much of its rate of volume stays, `compress` a mean rate.
inline SmoothPath random_path(Random& random, double size, double volume = 1.0, double compress = 0.0)
{
    for (;;) {
        SmoothPath p;
        for (Tensor* m : {&p.A, &p.B}) {
            for (int c = 0; c < 9; ++c) (*m)(c / 3, c % 3) = uniform(random, -size, size);
            *m = dev_of(*m) + (volume * m->trace() / 3 - compress) * Tensor::Identity();
        }
        bool is_good = true;
        for (double t = 0; t <= 1; t += 0.05) is_good = is_good && p.F(t).determinant() > 0.3 && p.F(t).determinant() < 3;
        if (is_good) return p;
    }
}

/// The law along a path in equal steps: Kirchhoff stress at the end, and its largest norm on the way.
struct PathEnd {
    Symmetric<3> tau{};
    double largest = 0, dissipated = 0;
};
/// It starts with the b_e of `start`.
inline PathEnd drive(const Material& m, const SmoothPath& path, int steps, double time = 1.0, const RateState& start = {})
{
    Driven<3> point(m);
    for (int a = 0; a < 3; ++a)
        if (start.b(a, a) != 1) point.set_column(std::string("elastic_b_") + "xyz"[a] + "xyz"[a], start.b(a, a));
    PathEnd r;
    for (int k = 1; k <= steps; ++k) {
        point.step(to_mat(path.F(static_cast<double>(k) / steps)), time / steps);
        r.largest = std::max(r.largest, std::sqrt(square(point.kirchhoff())));
    }
    r.tau        = point.kirchhoff();
    r.dissipated = point.column("dissipated");
    return r;
}

template <int D>
double distance(const Symmetric<D>& a, const Symmetric<D>& b)
{
    return std::sqrt(square(a + -1.0 * b));
}

/// What 200 random paths show: the error of the law after extrapolation from two step sizes, over the largest stress of the
/// path, and the mean order of its errors.
struct Comparison {
    double worst = 0, worst_work = 0, order = 0;
    int with_events = 0;
};
using MakePath = std::function<SmoothPath(Random&)>;
inline Comparison compare(const Material& m, const RateLawOf& law, const RateState& start, const MakePath& make, int steps,
                          int reference_steps, double time = 1.0, int paths = 200)
{
    Random random(13);
    Comparison r;
    double ratio = 0;
    int ratios   = 0;
    for (int k = 0; k < paths; ++k) {
        const SmoothPath path = make(random);
        RateIntegrator reference(law, path, start);
        const RateState exact = reference.integrate(reference_steps);
        const Mat<3> tau      = to_mat(law.stress(exact));
        Symmetric<3> wanted{};
        for (int i = 0; i < 3; ++i)
            for (int j = i; j < 3; ++j) wanted(i, j) = tau(i, j);
        const PathEnd coarse = drive(m, path, steps, time, start), fine = drive(m, path, 2 * steps, time, start);
        const double error = distance(2.0 * fine.tau + -1.0 * coarse.tau, wanted) / fine.largest;
        r.worst            = std::max(r.worst, error);
        const double work  = 2 * fine.dissipated - coarse.dissipated;
        r.worst_work =
            std::max(r.worst_work, std::fabs(work - exact.dissipated) / std::max(1e-2 * fine.largest, exact.dissipated));
        r.with_events += reference.events > 0;
        const double e1 = distance(coarse.tau, wanted), e2 = distance(fine.tau, wanted);
        if (e1 > 1e-9 * fine.largest) ratio += std::log2(e1 / e2), ++ratios;
    }
    r.order = ratio / std::max(ratios, 1);
    std::printf("          largest error %.2g of the stress, %.2g of the dissipated energy, mean order %.3f, %d of %d paths with "
                "plastic flow\n",
                r.worst, r.worst_work, r.order, r.with_events, paths);
    return r;
}

/// tau = K tr(eps) I + 2 G dev(eps), eps = (ln b)/2.
inline std::function<Tensor(const RateState&)> hencky_stress(const Material& m)
{
    const double K = m.bulk_modulus(), G = m.mu;
    return [K, G](const RateState& s) -> Tensor {
        const Tensor e = log_of(s.b) / 2;
        return K * e.trace() * Tensor::Identity() + 2 * G * dev_of(e);
    };
}

}  // namespace ordo::test
