// Updated-Lagrangian finite elements as a textbook has them: four-node quadrilaterals of one point in the middle, lumped
// mass, leapfrog. Shares nothing with the code that it checks but vectors and the material law. After Belytschko, Liu, Moran
// & Elkhodary, Nonlinear Finite Elements (2014), ch. 4.
#pragma once

#include "material/neo_hookean.hpp"

#include <array>
#include <functional>
#include <vector>

namespace ordo::test {

struct PlainFem {
    struct Element {
        std::array<int, 4> node;  ///< anticlockwise
        NeoHookean law;
        Mat<2> F = Mat<2>::identity(), sigma{};
    };
    std::vector<Vec<2>> x, v;
    std::vector<double> m;
    std::vector<Element> elements;
    Vec<2> gravity{};
    std::function<void(int node, Vec<2>& v)> constrain = [](int, Vec<2>&) {};

    PlainFem(std::vector<Vec<2>> nodes, std::vector<Element> of, double density) : x(std::move(nodes)), elements(std::move(of))
    {
        v.assign(x.size(), {});
        m.assign(x.size(), 0.0);
        for (const Element& e : elements)
            for (int n : e.node) m[n] += density * gradients(e).area / 4;
    }

    struct Gradients {
        std::array<Vec<2>, 4> dN;
        double area;
    };
    /// Of the shape functions (1 +- xi)(1 +- eta)/4 at xi = eta = 0.
    Gradients gradients(const Element& e) const
    {
        constexpr std::array<double, 4> xi{-1, 1, 1, -1}, eta{-1, -1, 1, 1};
        Mat<2> J{};  // dx/d(xi, eta)
        for (int n = 0; n < 4; ++n)
            for (int a = 0; a < 2; ++a) {
                J(a, 0) += xi[n] / 4 * x[e.node[n]][a];
                J(a, 1) += eta[n] / 4 * x[e.node[n]][a];
            }
        const double det = J(0, 0) * J(1, 1) - J(0, 1) * J(1, 0);
        Gradients g{.dN = {}, .area = 4 * det};
        for (int n = 0; n < 4; ++n)
            g.dN[n] = {(J(1, 1) * xi[n] - J(1, 0) * eta[n]) / (4 * det), (J(0, 0) * eta[n] - J(0, 1) * xi[n]) / (4 * det)};
        return g;
    }

    /// `kick` is the step of the velocities, half of dt at the start.
    void step(double kick, double dt)
    {
        std::vector<Vec<2>> f(x.size(), Vec<2>{});
        for (const Element& e : elements) {
            const Gradients g = gradients(e);
            for (int n = 0; n < 4; ++n) f[e.node[n]] -= g.area * (e.sigma * g.dN[n]);
        }
        for (std::size_t n = 0; n < x.size(); ++n) {
            v[n] += kick * (f[n] * (1 / m[n]) + gravity);
            constrain(static_cast<int>(n), v[n]);
        }
        for (Element& e : elements) {
            const Gradients g = gradients(e);
            Mat<2> L{};
            for (int n = 0; n < 4; ++n) L += outer(v[e.node[n]], g.dN[n]);
            e.F     = e.F + dt * (L * e.F);
            e.sigma = in_plane(e.law.cauchy(e.F));
        }
        for (std::size_t n = 0; n < x.size(); ++n) x[n] += dt * v[n];
    }
};

}  // namespace ordo::test
