// The recursion of Cox and de Boor, from the distances between a place and the knots around it, and that of the coefficients of derivatives.
#pragma once

#include "base/config.hpp"

namespace ordo {

/// Values and slopes of the P + 1 functions of degree P that do not vanish between two knots (Piegl & Tiller, The NURBS Book,
/// 1997, A2.2). left[j] is the distance to the j-th knot before the place, right[j] to the j-th knot after it, j = 1 to P.
template <int P>
ORDO_FLAT inline void cox_de_boor(const double (&left)[P + 1], const double (&right)[P + 1], double (&w)[P + 1],
                                  double (&dw)[P + 1])
{
    w[0] = 1.0;
    for (int j = 1; j <= P; ++j) {
        double slope = 0.0, value = 0.0;
        for (int r = 0; r < j; ++r) {
            const double q = w[r] / (right[r + 1] + left[j - r]);
            w[r]           = value + right[r + 1] * q;
            value          = left[j - r] * q;
            dw[r]          = j * (slope - q);  // of degree j, from functions of degree j - 1; the last are those of degree P
            slope          = q;
        }
        w[j]  = value;
        dw[j] = j * slope;
    }
}

/// The derivative of order P in `span` of the functions from number `span` on, per cell^P. axis.knot(k) is knot k, in cells.
template <int P, class Axis>
void highest_derivative(const Axis& axis, int span, double (&of)[P + 1])
{
    double d[P + 1][P + 1] = {};  // row j: coefficient j of the current derivative, in terms of the splines' coefficients
    for (int j = 0; j <= P; ++j) d[j][j] = 1.0;
    for (int r = 1; r <= P; ++r)
        for (int j = P; j >= r; --j) {
            const int i         = span + j;
            const double factor = (P - r + 1) / (axis.knot(i - r + 1) - axis.knot(i - P));
            for (int k = 0; k <= P; ++k) d[j][k] = factor * (d[j][k] - d[j - 1][k]);
        }
    for (int k = 0; k <= P; ++k) of[k] = d[P][k];
}

}  // namespace ordo
