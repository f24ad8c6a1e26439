// Hexahedra of one eighth of a sphere of radius 0.5 m in the middle of a cube of half-side 1 m: the mesh of
// cases/bimaterial-sphere/make_mesh.py, which describes how it is built.
#pragma once

#include "particles/cell_seeding.hpp"

#include <cmath>
#include <numbers>

namespace ordo::verification {

/// Seven blocks: a core of n^3 cells, three blocks of n^2 x inner cells from its outer faces to the sphere, and three of
/// n^2 x outer cells from there to the cube.
struct SphereMesh {
    static constexpr double radius = 0.5;
    int n = 5, inner = 3, outer = 7;

    /// The cells, those of the sphere first.
    std::vector<CornerPoints<3>> cells() const
    {
        std::vector<CornerPoints<3>> all;
        IndexBox<3>{{}, Index<3>::filled(n)}.for_each([&](const Index<3>& k) {
            CornerPoints<3> cell{};
            for (int c = 0; c < 8; ++c)
                cell.x[c] = core({1.0 * (k[0] + (c & 1)) / n, 1.0 * (k[1] + (c >> 1 & 1)) / n, 1.0 * (k[2] + (c >> 2)) / n});
            all.push_back(cell);
        });
        for (int layer = 0; layer < inner + outer; ++layer)
            for (int axis = 0; axis < 3; ++axis)
                IndexBox<2>{{}, Index<2>::filled(n)}.for_each([&](const Index<2>& k) {
                    CornerPoints<3> cell{};
                    for (int c = 0; c < 8; ++c) {
                        Vec<3> u{};
                        u[axis]           = 1.0;
                        u[(axis + 1) % 3] = 1.0 * (k[0] + (c & 1)) / n;
                        u[(axis + 2) % 3] = 1.0 * (k[1] + (c >> 1 & 1)) / n;
                        cell.x[c]         = shell(u, layer + (c >> 2));
                    }
                    all.push_back(cell);
                });
        return all;
    }

  private:
    /// The node of the bulged core at the place u of the unit cube.
    static Vec<3> core(const Vec<3>& u)
    {
        constexpr double length = 0.27, bulge[] = {0.15, 0.07};
        Vec<3> x{};
        for (int a = 0; a < 3; ++a) {
            const double v = u[(a + 1) % 3] * u[(a + 1) % 3], w = u[(a + 2) % 3] * u[(a + 2) % 3];
            x[a] = length * u[a] * (1 - bulge[0] * (v + w) + bulge[1] * v * w);
        }
        return x;
    }
    /// The node of a layer on the line from place u on the core's faces (u_a = 1 for one a) through the sphere to the cube.
    Vec<3> shell(const Vec<3>& u, int layer) const
    {
        Vec<3> cube{};  // at equal angles
        for (int a = 0; a < 3; ++a) cube[a] = u[a] == 1 ? 1 : std::tan(u[a] * std::numbers::pi / 4);
        const double distance = norm(cube);
        const Vec<3> sphere   = (radius / distance) * cube;
        if (layer <= inner) {
            const double f = 1.0 * layer / inner;
            return (1 - f) * core(u) + f * sphere;
        }
        const double f    = 1.0 * (layer - inner) / outer;
        const double part = f * (f + (1 - f) * (1 - radius) / (distance - radius));
        return (1 - part) * sphere + part * cube;
    }
};

}  // namespace ordo::verification
