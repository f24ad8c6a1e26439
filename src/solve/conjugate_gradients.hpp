// Preconditioned conjugate gradients for eight right-hand sides at once, for the consistent mass matrix and fits of splines. The
// caller owns vectors and products; its sums must not depend on the number of threads.
#pragma once

#include "base/lanes.hpp"

namespace ordo {

/// a/b in the lanes where b is positive, else 0: sides that are solved or not needed do not change.
inline Lanes quotient(const Lanes& a, const Lanes& b)
{
    Lanes r(0.0);
    for (int k = 0; k < 8; ++k)
        if (b[k] > 0) r[k] = a[k] / b[k];
    return r;
}

/// Vectors u, r, z, p, q of A u = b; at the start r = b - A u and p = 0.
template <class S>
concept ConjugateSystem = requires(S s, const Lanes& factor)
{
    s.is_done();              // true if r is small enough
    s.precondition();         // z = P^-1 r; returns r z
    s.turn(factor);           // p = z + factor p
    s.multiply();             // q = A p; returns p q
    s.add_direction(factor);  // u += factor p, r -= factor q
};

/// Solves A u = b (Hestenes & Stiefel 1952). Returns the number of iterations, at most `most`; the caller checks is_done().
template <ConjugateSystem S>
int conjugate_gradients(S&& system, int most)
{
    Lanes before(0.0);
    int k = 0;
    for (; k < most && !system.is_done(); ++k) {
        const Lanes now = system.precondition();
        system.turn(quotient(now, before));
        system.add_direction(quotient(now, system.multiply()));
        before = now;
    }
    return k;
}

}  // namespace ordo
