// Artificial viscosity: a pressure in compression that spreads shocks over a few cells.
#pragma once

#include "kernels/averaging.hpp"
#include "particles/batch.hpp"

#include <cmath>

namespace ordo {

/// q = rho h (quadratic^2 h t^2 - linear c t) for t = tr d < 0, else zero: von Neumann & Richtmyer (1950, J. Appl. Phys. 21:232)
/// and Landshoff (1955, LA-1930). c is the speed of P-waves at rest, h the smallest spacing of the grid.
struct ArtificialViscosity {
    double linear = 0.0, quadratic = 0.0;
    double h = 0.0;  ///< m

    bool is_on() const { return linear > 0 || quadratic > 0; }

    /// nu of q = rho nu |t|, m^2/s, from q/rho and c: h (quadratic^2 h |t| + linear c).
    double diffusivity(double q_over_rho, double c) const
    {
        const double half = linear * c * h / 2, root = quadratic * h;
        return half + std::sqrt(half * half + root * root * q_over_rho);
    }
};

/// After a step of particles [begin, end) whose displacement gradients are in `increments`: the work of q in the step, per initial
/// volume, and the next q.
template <int D>
void update_artificial_pressure(const Sweep<D>& sweep, const ArtificialViscosity& by, int begin, int end)
{
    const Sweep<D> s = sweep;
    for (int first = begin; first < end; first += Batch::size) {
        const Batch b     = Batch::of(first, end);
        const Lanes theta = dilation(load(s.increments, Batch{b.first - s.increment_first, b.count}));
        const Lanes V     = load(s.p.V, b);
        const Lanes before =
            s.p.cell && !s.is_past ? V : V / (Lanes(1.0) + theta);  // corners of cells move after this, or (USF) have moved
        store(s.p.q_work, b, load(s.p.q_work, b) - load(s.p.q, b) * before * theta / load(s.p.V0, b));
        const Lanes c    = each_particle(b, [&](int i) { return s.materials[s.p.material[i]].wave_speed(); });
        const Lanes rate = larger(Lanes(0.0), theta * (-1 / s.dt)), rho = load(s.p.m, b) / V;
        store(s.p.q, b, by.h * rho * rate * ((by.quadratic * by.quadratic * by.h) * rate + by.linear * c));
    }
}

}  // namespace ordo
