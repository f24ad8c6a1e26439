#!/usr/bin/env python3
"""Plants faults in the numerics, one by one, and shows that the tests catch each.

Every row of FAULTS is a mistake that a programmer could make: a sign, a factor, a missing term, a wrong time level. All of
them are planted at once into a copy of the sources, as choices at run time, so that one build serves all; the environment
variable ORDO_FAULT chooses one. The tests of the table must pass without a fault, and of the tests of a fault one must fail
with it: by an assertion, a crash, or ten times its usual time.

    scripts/planted_faults.py
    scripts/planted_faults.py --only internal-force-sign,volume-without-J
    scripts/planted_faults.py --list
    nice scripts/planted_faults.py --dir /tmp/planted --markdown faults.md

Exit code: 0 when all faults are caught, 1 when one survives, 2 when that cannot be said: wrong usage, a text of the table
that is not in the sources exactly once, a build that fails, tests that fail without a fault.
"""

import argparse
import concurrent.futures
import dataclasses
import os
import pathlib
import re
import resource
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
HEADER = "planted.hpp"
HEADER_TEXT = """// The choice among the faults of scripts/planted_faults.py; included before everything else.
#pragma once

#include <cstdlib>

namespace ordo {

inline const int planted_fault = [] {
    const char* number = std::getenv("ORDO_FAULT");
    return number ? std::atoi(number) : 0;
}();

/// Whether this fault was chosen; constants have none.
constexpr bool planted(int fault) { return !__builtin_is_constant_evaluated() && planted_fault == fault; }

}  // namespace ordo
"""


@dataclasses.dataclass
class Fault:
    """What stands between @ and @ in a text of a file below src/ becomes something wrong. Where it ends with ; it is a
    statement, else an expression. Tests are LAYER:SUITE.TEST of the binaries test_LAYER."""

    name: str
    what: str
    file: str
    places: list  # of (text with marks, what is wrong instead)
    tests: list


def fault(name, what, file, text, wrong, *tests):
    return Fault(name, what, file, [(text, wrong)], list(tests))


NAIVE_SCATTER = "pass:Scatter.EqualsTheNaiveLoop"
NAIVE_GATHER = "pass:Gather.EqualsTheNaiveLoop"
LITERAL_BAR = "pass:Step.SchemesEqualTheLiteralBar"
COX_DE_BOOR = "unit:Splines.AreThoseOfCoxAndDeBoor"
CELL_INTEGRALS = "unit:CellWeights.AreTheIntegrals"
PLANES = "unit:Condition.PlanesActFromTheirNodeOutwards"
BOUNDARY_TYPES = "unit:ConditionTypes.ActOnTheirComponents"
ENERGY_DERIVATIVE = "unit:Materials.StressIsTheDerivativeOfTheEnergy"
RESULTANTS = "pass:Tractions.ForceAndMomentAreExact"
MOTIONS = "verify:Manufactured.DerivativesAreThoseOfTheMotion"
BAR_STUDIES = "verify:Quick/Studies.MeetTheirBars/vibration_1d"
BOX_STUDIES = "verify:Quick/Studies.MeetTheirBars/bent_box"
BLOCK_ON_SLOPE = "pass:ContactImpulses.HoldABlockOnASlope"
CONTACT_AREAS = "pass:ContactPoints.HaveTheGapAndTheAreaOfBothSidesIn2D"
ONE_SWEEP = "pass:ContactImpulses.SolveAnEvenInterfaceInOneSweepIn2D"

FAULTS = [
    # from particles to nodes
    fault("momentum-without-mass", "nodes get v instead of m v", "kernels/scatter.hpp",
          "mv[a] = @m * v[a]@;", "v[a]", NAIVE_SCATTER),
    fault("internal-force-sign", "f = +V sigma grad phi", "kernels/scatter.hpp",
          "f[a] = @-p.V[i]@ * p.sigma[i](a, d);", "p.V[i]", NAIVE_SCATTER),
    fault("body-force-without-mass", "f = phi b instead of phi m b", "kernels/scatter.hpp",
          "value += force(@p.m[i] * p.b[i]@);", "p.b[i]", "pass:Step.BodyForceField"),
    fault("traction-moment-transposed", "the moment of a traction acts transposed", "kernels/scatter.hpp",
          "flux[d] += force(column(@p.traction_moment[i]@, d));", "transpose(p.traction_moment[i])", RESULTANTS),
    fault("slope-of-both-axes", "a gradient takes slopes along two axes instead of one", "shape/stencil.hpp",
          "for (int b = 0; b < A; ++b) rest[b] = flux[b] * @s.value(A, k)@;", "s.slope(A, k)", NAIVE_SCATTER),
    fault("gradient-per-cell", "gradients of points are not divided by h", "shape/point.hpp",
          "d *= @T(g.inv_h[a])@;", "T(1.0)", "unit:Shapes.GradientsOfPointsAndBoxesAreDerivatives"),
    fault("corner-differences-once", "L of CPDI1 has one of the differences of corners along an edge too few", "shape/corners.hpp",
          "for (int c = @1@; c < 1 << d; ++c) X[d] += sum", "(d > 0 ? 2 : 1)", "unit:Shapes.FastFormsEqualThePlainOnes"),
    fault("gravity-without-dt", "the increment of gravity is g instead of dt g", "kernels/nodes.hpp",
          "padded(@dt * gravity@);", "gravity", "pass:Step.FreeFallIsExact"),

    # from outside
    fault("outside-work-twice", "the work of stresses from outside is not halved", "method/stress_update.cpp",
          "r += @0.5@ * J * (det(back)", "1.0", "pass:OutsideLaw.StoresTheWorkOfItsStresses"),
    fault("outside-step-without-strain", "dF of laws from outside is I", "method/stress_update.cpp",
          "put_full(@Mat<D>::identity() + increments_[i]@, out", "Mat<D>::identity()", "pass:OutsideLaw.IsTheLawOfTheTable"),
    fault("nodes-force-without-gravity", "forces that are shown have no gravity, which is taken off when they come back", "method/explicit.cpp",
          "force[a]    = n[NodeLane::increment + a] + @m * model().gravity[a]@;", "0.0", "pass:Outside.ForcesOnNodesAreBodyForces"),

    # from nodes to particles
    fault("volume-without-J", "V = V0 instead of J V0", "kernels/gather.hpp",
          "store(p.V, b, @J * load(p.V0, b)@);", "load(p.V0, b)", NAIVE_GATHER),
    fault("velocity-gradient-transposed", "F follows L^T", "kernels/gather.hpp",
          "Mat<D, Lanes> dtL = @nodes.velocity_gradients()@;", "transpose(nodes.velocity_gradients())", NAIVE_GATHER),
    fault("move-with-particle-velocity", "x moves with v_p instead of the velocity of the nodes", "kernels/gather.hpp",
          "place(s, b, load(s.p.x, b) + Lanes(s.dt) * @v@, move, report);", "load(s.p.v, b)", NAIVE_GATHER),
    fault("pic-on-top", "the PIC part is added instead of blended in", "kernels/gather.hpp",
          "next = @Lanes(1 - s.pic) * flip@ +", "flip", "pass:Gather.PicFractionBlends"),
    fault("usf-gradient-at-start", "USF takes the gradient at the end of a step for that at its start", "kernels/gather.hpp",
          "return @inverse(Mat<D, T>::identity() - dtL) * dtL@;", "dtL", LITERAL_BAR),

    # the order of a step and its times
    fault("kick-of-the-new-step", "velocities at half steps are kicked by dt instead of the mean of two steps",
          "method/explicit.cpp", "dt_kick = @0.5 * (s.dt_prev + dt)@;", "dt", LITERAL_BAR),
    fault("usf-half-step", "USF updates the stress over half of the step", "method/explicit.cpp",
          "deform(s, passes().deform, strain, @s.dt_prev@, Deform::past);", "0.5 * s.dt_prev", LITERAL_BAR),
    fault("musl-without-walls", "the second projection of MUSL ignores the walls", "method/explicit.cpp",
          "@constrain(s, strain, by, Velocity::remapped);@", "", LITERAL_BAR),
    fault("blend-the-wrong-way", "strain_velocity is the part of the projected velocity", "method/explicit.cpp",
          "blend_velocities(strain, nodes, s.field.tiles, @strain_velocity_of(method())@);", "1 - strain_velocity_of(method())",
          "pass:Step.StrainVelocityEqualsTheLiteralBar"),
    fault("xpic-filters-the-kick", "XPIC filters the velocities after the kick", "method/explicit.cpp",
          "@if (is_xpic) take_increments(term, s.field.tiles);@", "", "pass:Step.FiltersEqualTheLiteralBar"),
    fault("filter-lets-go", "terms of a filter are free where conditions hold nodes", "method/explicit.cpp",
          "@hold_term(s, term, by);@", "", "pass:Step.FiltersEqualTheLiteralBar"),
    fault("filter-hides-impulses", "boundaries do not hear what a filter takes from the nodes they hold", "method/explicit.cpp",
          "return @-term[node][NodeLane::mass]@ * std::exchange", "0.0 * -term[node][NodeLane::mass]",
          "pass:Presets/Balance.OfMomentum/fmpm_usl"),
    fault("account-of-the-whole-kick", "particles seem to gain all of the nodes' kick", "method/energy_account.hpp",
          "dt * (f - load) * u - @0.5 * mv[increment] * dv@;", "0.0",
          "pass:Presets/EnergyAccount.LosesNothingInTheProjectionByMass/cpdi1_usl"),
    fault("loads-as-stresses", "the account takes loads for stresses", "method/energy_account.hpp",
          "load = @loads ? loads[i][increment] : 0.0@;", "0.0", "pass:SchemeEnergy.OfFreeFallIsHalfAStep"),
    Fault("musl-moves-first", "MUSL moves before its second projection: weights at x^n+1", "method/explicit.cpp",
          [("@if (passes().keep) gather(s, passes().keep, nodes, dt);@",
            "if (passes().keep) gather(s, passes().keep, nodes, dt); if (passes().move) gather(s, passes().move, nodes, dt);"),
           ("@if (passes().move) gather(s, passes().move, nodes, dt);@", "")], [LITERAL_BAR]),
    Fault("corners-move-first", "corners of cells move before the stress update: gradients at x^n+1", "method/explicit.cpp",
          [("@if (keeps_corner_velocity(method())) keep_velocities(s, nodes);@",
            "if (keeps_corner_velocity(method())) keep_velocities(s, nodes); "
            "if (passes().move_corners) move_corners(s, nodes, dt);"),
           ("@if (passes().move_corners) move_corners(s, nodes, dt);@", "")],
          ["pass:FiniteElements.EqualPlainOnesOnATurningRing"]),
    fault("condition-at-whole-step", "boundary velocities are those of t + dt instead of t + dt/2", "method/explicit.cpp",
          "const Kick by{{@s.t_v + dt_kick@, dt}, dt_kick};", "s.t + dt", "pass:Enrichment.GripsKeepTheirCorners"),

    # boundary conditions
    fault("wall-on-wrong-side", "a condition holds the nodes on the inner side", "grid/condition.hpp",
          "return @outer_is_above@ ? x[axis] >= at", "!outer_is_above", PLANES),
    fault("upper-wall-node-free", "the node on an upper wall is not held", "grid/condition.hpp",
          "x[axis] >= @at - tolerance@", "at + tolerance", PLANES),
    fault("wall-keeps-increment", "a wall leaves the velocity increment, which FLIP reads", "grid/condition.hpp",
          "has_increment ? v - projected : @0.0@;", "increment", PLANES),
    fault("prescribed-increment-sign", "the increment of a prescribed velocity has the wrong sign", "grid/condition.hpp",
          "has_increment ? @v - projected@ : 0.0;", "projected - v", "unit:ConditionTypes.LaterConditionsWin"),
    fault("walls-pull", "a wall holds what leaves it", "grid/wall.hpp",
          "own.normal          = @std::max(0.0, before - dot(v - u[k], wall.normal) / nn)@;",
          "before - dot(v - u[k], wall.normal) / nn", "unit:Wall.LetsGoWhatLeavesAndHoldsWhatEnters"),
    fault("friction-without-limit", "friction stops every node", "grid/wall.hpp",
          "own.tangential    = @sticks ? sticking : (limit / size) * sticking@;", "sticking", "unit:Wall.RubsAfterCoulomb"),
    fault("walls-rub-at-rest", "a wall that moves rubs as if at rest", "grid/wall.hpp",
          "relative = along(is_free, @v - u[k]@)", "v", "unit:Wall.RubsAfterCoulomb"),
    fault("walls-stay", "a wall that moves acts from where it was at the start", "grid/wall.hpp",
          "return dot(@x - point - shift@, normal);", "x - point", "unit:Floor.MovesWithItsVelocity"),
    fault("walls-leave-increment", "a wall leaves the velocity increment, which FLIP reads", "grid/wall.hpp",
          "node[NodeLane::increment + a] += @v[a] - node[NodeLane::velocity + a]@;", "0.0",
          "unit:Floor.ActsOnNodesInItAndOnItsSurface"),
    fault("walls-forget", "walls do not hold again what MUSL projects again", "grid/wall.hpp",
          "if (@grip == Grip::slips@ &&", "false", "unit:Floor.HoldsTheSameNodesAgain"),
    fault("symmetry-holds-tangent", "symmetry holds the tangential components", "grid/condition.hpp",
          "case ConditionType::symmetry: return @component == axis@;", "component != axis", BOUNDARY_TYPES),

    fault("displacement-late", "a displacement takes the velocity of half a step before", "grid/condition.hpp",
          "return (at_time(@when.t + 0.5 * when.dt@) - at_time", "when.t", "pass:Account.DisplacementsAreExact"),
    fault("bodies-hold-all", "the condition of a body holds the nodes of all bodies", "method/pass_scheme.cpp",
          "while (end < tile.end && @of[end] == body@) ++end;", "true", "pass:Account.DisplacementsAreExact"),
    fault("coupled-walls-pull", "with a consistent mass matrix a wall holds what leaves it", "method/wall_contact.cpp",
          "? @!(r.normal[static_cast<std::size_t>(at - c.closed.begin())] < -least_force(c))@", "true", "pass:Bases/OneWall.PushesAndRubs/0"),
    fault("coupled-friction-drives", "friction with a consistent mass matrix acts along the slip", "method/wall_contact.cpp",
          "? @(-r.limit / size) * now@ : c.rubbing;", "(r.limit / size) * now", "pass:Bases/OneWall.PushesAndRubs/1"),
    fault("coupled-lanes-apart", "components that a wall couples are solved apart", "method/mass_matrix.cpp",
          "if (@held.empty()@) return sums;", "true", "pass:Bases/OneWall.PushesAndRubs/0"),
    fault("impulse-without-mass", "the force of a boundary forgets the mass of the nodes", "grid/condition.hpp",
          "return @node[NodeLane::mass]@ *", "1.0", "pass:Presets/Balance.OfMomentum/mpm_usl"),
    fault("reaction-of-force-alone", "the force of a boundary with a consistent mass matrix forgets the inertia",
          "method/explicit.cpp", "return row > 0 ? @weighted(s.field.mass.q[row], a) - was@ : 0.0;", "-was",
          "pass:Presets/Balance.OfMomentum/bsmpm_usl"),
    fault("work-of-last-force", "tractions work with the force after the step alone", "method/external_work.cpp",
          "0.5 * dot(@before.force + after.force@,", "2.0 * after.force", "pass:Account.WorkOfTractions"),

    # bases
    fault("hat-slope-sign", "the slope of the lower hat has the wrong sign", "shape/hat.hpp",
          "dw[0]                  = @Lanes(-1.0)@;", "Lanes(1.0)", NAIVE_SCATTER),
    fault("hats-exchanged", "the hats of a corner are exchanged", "shape/hat.hpp",
          "w[1] = @y - cell@;\n        w[0] = 1 - w[1];\n        return true;", "1 - (y - cell)",
          "unit:Shapes.CornersGiveTheirSums"),
    fault("cubic-spline-term", "a factor 2 in the cubic spline", "shape/bspline.hpp",
          "w[1]  = @2.0 / 3 - t * t * (1 - 0.5 * t)@;", "2.0 / 3 - t * t * (1 - t)", COX_DE_BOOR),
    fault("spline-without-upper-knots", "splines at the upper wall do not see the repeated knots", "shape/bspline.hpp",
          "right[j] = @smaller(j, after + 1)@ - t;", "j", COX_DE_BOOR),
    fault("greville-off-by-a-knot", "the places of splines are means of the wrong knots", "grid/lattice.hpp",
          "sum += knot(a, @k - margin + j - p@);", "k - margin + j - p - 1", "unit:Condition.PlanesActFromTheirGrevillePoint"),
    fault("wall-splines-whole", "the integrals of splines at walls are those of inner ones", "grid/lattice.hpp",
          "const int span = @knot(a, j + 1) - knot(a, j - p)@;", "p + 1", COX_DE_BOOR),
    fault("ddmpm-edge", "ddmpm takes half differences where the material ends", "shape/dual_domain.hpp",
          "g.inv_h[a] * (@before && after ? 0.5 : 1.0@)", "0.5", "unit:DualDomain.GradientIsThatOfItsDefinition"),

    # domains of particles
    fault("gimp-half-normaliser", "GIMP divides by l instead of 2 l", "shape/hat.hpp",
          "const T norm = @T(1.0) / (high - low)@;", "T(2.0) / (high - low)", "unit:Shapes.MomentsIn1D"),
    fault("gimp-spline-point-weight", "a point of the means of splines over boxes counts twice", "shape/interval_mean.hpp",
          "add(middle - gauss * half, @half * norm@, w);", "2 * half * norm", "unit:Shapes.MomentsIn1D"),
    fault("cpgimp-stretched-twice", "cpGIMP stretches the current box by the whole F", "kernels/evolve.hpp",
          "half    = load(@s.p.half0@, b);", "s.p.half", NAIVE_GATHER),
    fault("cpdi1-edges-times-F", "CPDI1 takes r0 F instead of F r0", "kernels/evolve.hpp",
          "Mat<D, Lanes> r = @load(s.p.F, b) * load(s.p.edges0, b)@;", "load(s.p.edges0, b) * load(s.p.F, b)",
          "unit:Shapes.StretchLimitScalesParallelepipeds"),
    fault("cpdi1-dual-transposed", "the dual vectors of CPDI1 are transposed", "shape/corners.hpp",
          "return @cofactor(r)@ * (w / det(r));", "transpose(cofactor(r))",
          "unit:CellWeights.OfParallelepipedsAreThoseOfHalfEdges"),
    fault("cpdi2-corner-weight", "half of the trapezium's part in the corner weights of CPDI2", "shape/cell_weights.hpp",
          "is_exact ? @X / (3.0 * V)@ : 0.0", "X / (6.0 * V)", CELL_INTEGRALS),
    fault("hexahedron-gradient-term", "a term of the gradients of hexahedra is missing", "shape/cell_weights.hpp",
          "G[1]        = @cross(a[2], a[4]) + third * cross(a[3], a[5])@;", "cross(a[2], a[4])", CELL_INTEGRALS),
    fault("tetrahedron-volume", "the volume of a tetrahedron is J/3", "shape/cell_weights.hpp",
          "J * (@D == 3 ? 1.0 / 6.0 : 1.0 / D@);", "1.0 / D", "unit:CellWeights.OfSimplices"),
    fault("cell-at-corner-mean", "a cell's particle is at the mean of its corners", "shape/corners.hpp",
          "center += @k.w[c]@ * (x[c] - x[0]);", "(1.0 / k.count)", NAIVE_GATHER),

    # least squares
    fault("cell-centre-at-node", "distances to the centre of a cell are taken from its lower node", "shape/weights.hpp",
          "return @y - 0.5 * halves - target@;", "y - target", "unit:Moments.SpreadEqualsAdd"),
    fault("moments-to-mirrored-targets", "sums of windows go to the targets of their rows in reverse", "kernels/moment_windows.hpp",
          "x * g.stride[0] + @t@ * g.stride[A]", "W - 1 - t", "unit:Moments.SpreadEqualsAdd"),
    fault("shepard-not-normalised", "the mean of degree 0 is not divided by the weights", "kernels/moments.hpp",
          "return @get(record, products + field * unknowns) / weight(record)@;", "get(record, products + field * unknowns)",
          "unit:Reconstruction.OfDegreeZeroIsShepard"),
    fault("pivot-kept", "a pivot made of round-off is not dropped", "kernels/ldl.hpp",
          "D[j]                  = @is_dropped ? 0.0 : d@;", "d", "unit:Reconstruction.OfDeficientSamplesEqualsGramSchmidt"),
    fault("imls-takes-mean", "IMLS, too, takes the mean where one pivot is dropped", "kernels/velocity_fit.hpp",
          "if (@choices.is_whole && fit.dropped > 0@) {", "fit.dropped > 0", "pass:VelocityFit.OfParticlesOnAPlane"),
    fault("limiter-takes-all", "a limited fit is taken whole", "kernels/velocity_fit.hpp",
          "return @explained <= none * left@ ?", "false", "pass:VelocityFit.EqualsThePlainSum", "verify:StableCourantNumber.HoldsForLimitedFits"),
    fault("limiter-of-one-component", "only the last component decides on a limited fit", "kernels/velocity_fit.hpp",
          "@explained += slopes;@", "explained = slopes;", "pass:VelocityFit.EqualsThePlainSum"),
    fault("cpls-corner-velocity", "corners of CPLS have the velocity of their particle", "kernels/velocity_fit.hpp",
          "@v_c[a] += Lr(a, d) * side;@", "", "pass:VelocityFit.LinearFieldIsReproduced"),
    fault("shared-corners-again", "corners count once for each cell that shares them", "kernels/velocity_fit.hpp",
          "@if (!(p.samples[i] >> c & 1)) continue;@", "", "pass:VelocityFit.EqualsThePlainSum"),
    fault("tls-without-mean", "Taylor least squares fit the field instead of what differs from its mean", "kernels/taylor.hpp",
          "= @b[j] - m * b[0] - mean * (M::get(record_, j) - m * M::get(record_, 0))@;", "b[j] - m * b[0]",
          "unit:TaylorLeastSquares.EqualsHouseholder"),
    fault("gauss-points-at-quarters", "Gauss points stand at the quarters of a cell", "kernels/taylor.hpp",
          "r[a] = @k >> a & 1 ? g : -g@;", "k >> a & 1 ? 0.25 : -0.25", "unit:TaylorLeastSquares.EqualsHouseholder"),
    fault("gauss-weight-whole", "each Gauss point has the volume of the whole cell", "kernels/cell_fields.hpp",
          "set_point<D, true>(q, k + g, x, @V / points@, u);", "V", "pass:TaylorQuadrature.MassAndMomentumAreKept"),
    fault("adjoint-constant-at-walls", "gradients of cells go on beyond walls as constants", "method/reconstruction.cpp",
          "record(cell)[q] = @is_linear ? one * 2.0 - record(second)[q] : one@;", "one",
          "pass:AdjointGradient.OfQuadraticVelocityIsExactWithHats"),

    # particles that carry a field
    fault("affine-inertia-inside", "D_p is h^2/4, also beside walls and for cubic splines", "shape/affine_point.hpp",
          "inertia += @dw[k] * d@;", "0.25 * w[k]",
          "pass:Affine.LinearFieldGoesToNodesAndBack"),
    fault("affine-arm-sign", "the affine velocity at a node is v - L (x_i - x_p)", "kernels/affine.hpp",
          "mL[a] = @p.m[i]@ * p.L[i](a, d);", "-p.m[i]", "pass:Affine.LinearFieldGoesToNodesAndBack"),
    fault("polynomial-not-orthogonal", "the quadratic of polynomial PIC is orthogonal in even weights only", "kernels/affine.hpp",
          "= @P[1][k] * (P[1][k] - third / second) - second@;", "P[1][k] * P[1][k] - second",
          "pass:Polynomials.NodalFieldsSurviveTheParticles"),

    # the consistent mass matrix
    fault("mass-row-of-its-own", "entries before the diagonal are those behind it", "kernels/mass_rows.hpp",
          "sum[2 * d] += from[before] * @entries[static_cast<std::ptrdiff_t>(before) * H::size + d]@;", "a[d]",
          "pass:MassMatrix.RowsMultiplyAsParticlesDo"),
    fault("lumped-rows-lose-mass", "what rows lose to lumped ones is not put on their diagonal", "method/mass_matrix.cpp",
          "m.diagonal[i] = @nodes[m.rows.node(i)][NodeLane::mass] - m.p[i][coupled] * m.q[i][coupled]@;", "0.0",
          "pass:MassMatrix.SolutionEqualsTheDenseOne"),
    fault("prescribed-taken-as-fixed", "the projection takes prescribed velocities as fixed ones", "method/mass_matrix.cpp",
          "@if (first == NodeLane::velocity && is_prescribed) continue;@", "",
          "pass:MassMatrix.PrescribedVelocitiesReachTheParticles"),

    # splines fitted to particles
    fault("stages-forced-at-start", "body forces of all stages are those at the start of the step", "spline/scheme.cpp",
          "this->evaluate_external_forces(s, t + @scheme.at[k] * dt@);", "0.0", BAR_STUDIES),
    fault("stage-too-early", "a stage goes as far as the one before it", "spline/scheme.cpp",
          "further = is_last ? 0.0 : dt * @scheme.at[k + 1]@,", "scheme.at[k]", BAR_STUDIES),
    fault("density-of-start", "the density that is fitted is that of the initial volumes", "spline/fit.cpp",
          "r[SplineLane::density] = @p.m[i] / p.V[i]@;", "p.m[i] / p.V0[i]", BAR_STUDIES),
    fault("unit-density", "the mass matrix of splines forgets the density", "spline/integrals.cpp",
          "return @scratch_->density[k]@;", "point_weight(scratch_->body.points, k)", BAR_STUDIES),
    fault("one-weight-for-all", "fits weigh all fields of the particles with the first weight", "spline/matrix.hpp",
          "const Lanes weight        = halves(entry[0], @entry[W - 1]@);", "entry[0]", "unit:SplineMatrix.IsTheSumOverPoints"),
    fault("entry-of-the-row", "entries of splines are found at the row's function, also where the column's comes first", "spline/matrix.hpp",
          "const double* const entry = t + (@least@ * (B + 1)", "(B + r)", "unit:SplineMatrix.IsTheSumOverPoints"),
    fault("cholesky-keeps-pivots", "pivots of the incomplete factor are those of the matrix", "solve/incomplete_cholesky.hpp",
          "pivot -= @row[k] * row[k]@;", "0.0", "unit:IncompleteCholesky.SolvesBands"),
    fault("surface-solved-loosely", "systems of bodies with free surfaces are solved to 1e-13", "spline/fit.cpp",
          "if (@is_within(best)@ || further", "is_within(enough)", "verify:Quick/Studies.MeetTheirBars/vibration_free"),
    fault("axis-sums-once", "sums along the axes count entries beside the diagonal once", "spline/matrix.hpp",
          "times[a]    = @distance[a] > 0@ ? 2.0 : 1.0;", "false", "unit:SplineMatrix.IsTheSumOverPoints"),
    fault("grid-without-last-point", "the last of the Gauss points of a cell along x is left out", "spline/matrix.hpp",
          "for (int g = 1; g < @count@; ++g)  // along x", "count - 1", "unit:SplineMatrix.TakesGridsOfPoints"),
    fault("null-space-fed", "the velocity that no spline holds grows instead of being damped", "spline/scheme.cpp",
          "work.v0[i] -= model().method.null_damping * (@work.v0[i] - work.v_at[i]@);", "work.v_at[i] - work.v0[i]",
          "pass:SplineFit.VelocitiesThatNoSplineHoldsDecay"),
    fault("walls-let-acceleration", "walls hold the velocity of splines but not their acceleration", "spline/scheme.cpp",
          "@acceleration_free_[b.axis][b.outer_is_above][SplineLane::acceleration + c] = 0.0;@", "",
          "pass:SplineFit.FrozenLatticesAreNeutral"),
    fault("gradient-of-other-axes", "the projected gradient takes slopes along the other axes", "spline/integrals.cpp",
          "matrices[a] = @a == b@ ? &slopes_[a]", "a != b", "pass:SplineFit.FindsPolynomialsAndTheirGradients"),
    fault("force-of-other-axes", "forces of splines take slopes along the other axes", "spline/integrals.cpp",
          "matrices[a] = @a == b@ ? &slopes_back_[a]", "a != b", BOX_STUDIES),
    fault("gradient-behind-F", "F' = F L instead of L F", "spline/scheme.cpp",
          "const Mat<D> slope         = @L * p.F[i]@;", "p.F[i] * L", "pass:SplineFit.DeformationFollowsTheGradient"),
    fault("cut-force-sign", "forces of cut bodies have the wrong sign", "spline/integrals.cpp",
          "r[SplineLane::acceleration + a] = @-sigma[stress_lane<D>(a, b)]@;", "sigma[stress_lane<D>(a, b)]",
          "pass:FreeSurface.FrozenLatticesAreNeutral"),
    fault("surface-fed", "jumps of the velocity at free surfaces grow instead of decaying", "spline/integrals.cpp",
          "work.body.v.multiply(work.ghost_weight * @-rate@,", "rate", "pass:FreeSurface.JumpsOfVelocityDecay"),
    fault("surface-stays", "a free surface stays where it was", "spline/fit.cpp",
          "model().surface[k](@p.X[i]@)", "p.x[i]", "verify:Quick/Studies.MeetTheirBars/vibration_free"),
    fault("cut-line-whole", "points of a cut cell have the weight of their line alone", "spline/cut_rule.hpp",
          "use(with_axis<D>(foot, axis, y[0]), @of_foot * weight@);", "weight", "unit:CutRule.IntegratesOverCurvedBodies"),
    fault("jump-of-equal-factors", "each derivative of a spline has the factor of the first", "grid/cox_de_boor.hpp",
          "const double factor = @(P - r + 1)@ / (axis", "P", "unit:GhostPenalty.IsTheJumpOfTheHighestDerivative"),

    # enriched corners and contact
    fault("contact-not-seen", "corners stay nodes of their own where another part is near: parts do not meet",
          "method/enrichment.cpp", "if (@writes[k].first == writes[k - 1].first && writes[k].second != writes[k - 1].second@)",
          "false", "pass:Enrichment.PartsMeetOnTheGrid"),
    fault("wall-holds-what-leaves", "a wall holds corners that leave it and lets go those that come", "method/enrichment.cpp",
          "|| @outwards * (before[NodeLane::velocity + b.axis] - b.velocity(b.axis, x, when)) > 0@;",
          "outwards * (before[NodeLane::velocity + b.axis] - b.velocity(b.axis, x, when)) < 0",
          "pass:Enrichment.ConditionsHoldOnCorners"),
    fault("kept-velocity-as-momentum", "kept velocities of corners are taken as momenta", "method/enrichment.cpp",
          "node[NodeLane::velocity + a] = @node[NodeLane::mass] * p.corner_velocity[c][a]@;", "p.corner_velocity[c][a]",
          "pass:Enrichment.KeptVelocitiesKeepMomentum"),
    fault("enriched-step-of-one-axis", "the time step of enriched cells forgets waves along both axes", "method/enrichment.cpp",
          "return stiffened * @(D * m.lambda + 2 * m.mu)@ * k.V", "(m.lambda + 2 * m.mu)", "pass:FiniteElements.TimeStepLimitIsSafe"),

    # tractions
    fault("pressure-pulls", "a pressure acts outwards", "method/tractions.cpp",
          "return @-traction.value[0](place)@ * area", "traction.value[0](place)", RESULTANTS),
    fault("stairs-count-whole", "each stair of a round body counts with its whole area", "setup/true_shape.cpp",
          "return smooth.stairs > 0 ? @std::max(0.0, dot(normal, smooth.normal(center)))@", "1.0",
          "unit:Setup.RoundFacesHaveTheirArea"),
    fault("cut-particles-keep-mass", "particles that a round face cuts get their volume, but not their mass", "setup/build.cpp",
          "p.m[i] *= @factor@;", "1.0", "unit:Setup.RoundBodiesHaveTheirVolume"),
    fault("dead-load-follows", "a dead load acts on the current area", "method/tractions.cpp",
          "return load.share * norm(@load.area0@) * evaluate", "area", RESULTANTS),
    fault("area-turned-by-F", "areas follow F instead of its cofactor", "method/tractions.cpp",
          "return {@cofactor(p.F[i])@ * load.area0,", "p.F[i]", RESULTANTS),

    # periodic axes
    fault("halo-overwrites", "images overwrite the nodes that they repeat", "grid/halo.hpp",
          "@nodes[p.image][k] += nodes[p.ghost][k];@", "nodes[p.image][k] = nodes[p.ghost][k];", "unit:Halo.PeriodicImages"),
    fault("image-below-zero", "images below the period are not wrapped", "grid/lattice.hpp",
          "return @((k - margin) % n + n) % n@ + margin;", "(k - margin) % n", "unit:Halo.PeriodicImages"),
    fault("turns-sign", "periods travelled are counted backwards", "method/layout.cpp",
          "@particles.turns[i][a] += static_cast<int>(turns);@", "particles.turns[i][a] -= static_cast<int>(turns);",
          "pass:Step.PeriodicAxesHaveNoSeam"),
    fault("corners-leave-period", "corners are put back into the period the wrong way", "shape/corners.hpp",
          "for (Vec<D>& c : x) @c[a] -= p.turns[i][a] * (g.cells[a] * g.h[a]);@",
          "c[a] += p.turns[i][a] * (g.cells[a] * g.h[a]);",
          "unit:Shapes.CellsOutsideThePeriodAreTheSame"),

    # materials
    fault("neo-hookean-without-J", "the Kirchhoff stress is taken for the Cauchy stress", "material/neo_hookean.hpp",
          "return make_stress(@s * inv_J@, p * inv_J);", "s", ENERGY_DERIVATIVE),
    fault("neo-hookean-right-tensor", "F^T F instead of F F^T", "material/neo_hookean.hpp",
          "T(mu) * (@F * transpose(F)@ - Mat<D, T>::identity());", "transpose(F) * F", ENERGY_DERIVATIVE),
    fault("neo-hookean-energy-log", "the logarithm of the stored energy counts half", "material/neo_hookean.hpp",
          "(ddot(F, F) - T(D) - @T(2) * l@);", "l", ENERGY_DERIVATIVE),
    fault("green-strain-doubled", "the Green strain is F^T F - I", "material/st_venant_kirchhoff.hpp",
          "return @T(0.5)@ * (transpose(F) * F - Mat<D, T>::identity());", "T(1)", ENERGY_DERIVATIVE),
    fault("venant-without-J", "St. Venant-Kirchhoff's stress is not divided by J", "material/st_venant_kirchhoff.hpp",
          "return make_stress(@F * S * transpose(F) * inv_J@, p * inv_J);", "F * S * transpose(F)", ENERGY_DERIVATIVE),
    fault("jaumann-spin-sign", "the Jaumann rate turns the stress backwards", "material/jaumann_elastic.hpp",
          "const Mat<D, T> w = half * (@M - transpose(M)@);", "transpose(M) - M",
          "unit:Materials.JaumannLawTurnsWithRigidRotations"),
    fault("jaumann-increment-unturned", "the stress increment of the Jaumann law does not turn: first order",
          "material/jaumann_elastic.hpp", "= Q * in_plane(sigma) * transpose(Q) + @q * s * transpose(q)@;", "s",
          "unit:Materials.JaumannLawSimpleShearIsSecondOrder"),
    fault("jaumann-energy-of-plane", "the compliance of the plane for all of the stress", "material/jaumann_elastic.hpp",
          "T(lambda / (@3 * lambda@ + 2 * mu)) * tr * tr", "D * lambda", "unit:Materials.JaumannLawUniaxialStrain"),
    fault("jaumann-lateral-forgets", "the stress across the plane is that of the last step alone", "material/jaumann_elastic.hpp",
          "return make_stress(turned, @sigma(2, 2) + p@);", "p", "unit:Materials.JaumannLawUniaxialStrain"),
    fault("neo-hookean-no-lateral", "no stress across the plane", "material/neo_hookean.hpp",
          "return make_stress(s * inv_J, @p * inv_J@);", "T(0)", "unit:Materials.SmallStrainLimit"),
    fault("increments-of-first-piece", "laws see the increments of the first piece of a tile", "method/stress_update.cpp",
          "s.increment_first = @first@;", "begin", "pass:Gather.BatchesOfAnyLengthAndMaterial"),
    fault("batch-of-two-materials", "a batch takes the law of its first particle", "kernels/stress.hpp",
          "while (count < b.count && @material[first + count] == material[first]@) ++count;", "true",
          "pass:Gather.BatchesOfAnyLengthAndMaterial"),
    fault("linear-rate-forgets", "the linear rate law forgets the stress it had", "material/linear_rate_1d.hpp",
          "return @sigma + make_stress(T(young) * step.G, T(0))@;", "make_stress(T(young) * step.G, T(0))", "unit:Materials.LinearRateLawOfWobbes"),
    fault("poisson-plane-stress", "lambda has the 1 - nu of plane stress instead of 1 - 2 nu", "material/material.hpp",
          "E * nu / ((1 + nu) * @(1 - 2 * nu)@)", "(1 - nu)", "verify:LayeredBody.RingSwingsAboutItsStaticStresses"),

    # automatic differentiation and manufactured solutions
    fault("dual-product-rule", "the product rule of dual numbers has one term", "base/dual.hpp",
          "@a.slope * b.value + a.value * b.slope@};", "a.slope * b.value", "unit:Dual.FirstAndSecondDerivative"),
    fault("jet-cross-term", "second derivatives of products lack a term", "verification/jet.hpp",
          "@a.curvature[k] * b.value + a.value * b.curvature[k] + a.slope[i] * b.slope[j] + a.slope[j] * b.slope[i]@;",
          "a.curvature[k] * b.value + a.value * b.curvature[k] + a.slope[i] * b.slope[j]", MOTIONS),
    fault("manufactured-cauchy", "the body force is made of Div sigma instead of Div P", "verification/solution.hpp",
          "const auto P  = @in_plane(sigma) * cofactor(k.F)@;", "in_plane(sigma)", MOTIONS),
    fault("manufactured-sign", "the body force has + Div P", "verification/solution.hpp",
          "const T scale = T(@-1.0 / density@);", "1.0 / density", MOTIONS),

    # averages, artificial viscosity and branches
    fault("averages-mix-bodies", "bodies share the averages", "kernels/averaging.hpp",
          "records[record][@2 * k@] += weight * V[i] * u[i];", "0", "pass:Averaging.IsItsDefinitionAndSelfAdjoint"),
    fault("averages-without-seam", "averages end at the seam of a periodic axis", "method/averaging.cpp",
          "@s.field.halo.copy(records);@", "", "pass:Averaging.IsItsDefinitionAndSelfAdjoint"),
    fault("averages-of-strains-alone", "forces come from the stresses of single particles", "method/averaging.cpp",
          "- (p.q ? p.q[i] : 0.0); });\n    @average(model.method, s, mean);@", "",
          "pass:Averaging.ForcesDoTheWorkOfAveragedStrains"),
    fault("averages-by-new-volumes", "dilations are averaged with the volumes after the step", "method/averaging.cpp",
          "mean[i] = p.J[i];\n    });\n    @average(model.method, s, mean);@", "prepare_averages(model, s); average(model.method, s, mean);",
          "pass:Averaging.KeepsTheTotalVolume"),
    fault("averages-forget", "laws without memory have averages of dilations, not of volumes", "method/averaging.cpp",
          "return @model.materials[p.material[i]].law->is_hyperelastic@;", "false", "pass:Averaging.RemembersVolumes"),
    fault("viscosity-in-expansion", "artificial viscosity acts in expansion too", "kernels/artificial_viscosity.hpp",
          "@larger(Lanes(0.0), theta * (-1 / s.dt))@", "theta * (-1 / s.dt)", "pass:ArtificialViscosity.IsItsFormula"),
    fault("branch-relaxes-once", "a Maxwell branch relaxes after the deformation only", "material/branches.hpp",
          "@e.dev                 = T(keep) * e.dev;@", "", "unit:Branches.AreSecondOrderAgainstTheirRateEquation"),
    fault("branch-loses-nothing", "what a branch loses is not counted", "material/branches.hpp",
          "@dissipated += T(shear * (1 - keep * keep)) * (before + square(at.dev));@", "", "unit:Branches.RelaxExactlyAtRest"),
    fault("apex-missed", "drucker-prager returns to the cone beyond its apex", "material/drucker_prager.hpp",
          "const T beyond = @choose(f, choose(left, T(0.0), T(1.0)), T(0.0))@;", "T(0.0)", "unit:DruckerPrager.Apex"),
    fault("flow-as-friction", "drucker-prager dilates by its friction", "material/drucker_prager.hpp",
          "T d_theta = T(K > 0 ? @eta_flow@ : 0.0) * lambda", "eta", "unit:DruckerPrager.Oedometer"),
    fault("mohr-never-softens", "mohr-coulomb keeps its strength", "material/mohr_coulomb.hpp",
          "const MohrCoulombPyramid now = pyramid(@primal(alpha)@);", "0.0", "unit:MohrCoulomb.Softening"),
    fault("clay-hardens-in-dilation", "the size of cam-clay grows with its volume", "material/cam_clay.hpp",
          "return T(pc) * exp(x * T(@-1@ / law.hardening));", "1", "unit:CamClay.IsotropicCompression"),
    fault("clay-flow", "the flow of cam-clay is that of an ellipse of the double size", "material/cam_clay.hpp",
          "return x - multiplier * (size(x) - T(@2.0@) * law", "1.0", "unit:CamClay.AgreesWithItsRateEquations"),
    fault("johnson-cook-rate", "the rate of johnson-cook is a strain", "material/johnson_cook.hpp",
          "factor += T(C) * log(lambda / T(rate * @dt@));", "1.0", "unit:JohnsonCook.YieldStress"),
    fault("johnson-cook-cold", "plastic work does not heat johnson-cook", "material/johnson_cook.hpp",
          "set_lane(h[kTemperature], k, before + @heating@ * rest * lambda);", "0.0", "unit:JohnsonCook.HeatsAsRigidPlastic"),
    fault("shock-energy", "the energy of a shock is that of the pressure at its start", "material/johnson_cook.hpp",
          "(lane(h[kPressure], k) + @cold@) * half", "lane(h[kPressure], k)", "unit:JohnsonCook.ShockIsOnTheHugoniot"),
    fault("fluid-half-viscous", "viscous stress is eta d", "material/fluid.hpp",
          "return T(@2.0@) * eta * d;", "1.0", "unit:Fluid.NewtonianShear"),
    fault("bingham-rate", "the shear rate of bingham's fluid is the norm of d", "material/fluid.hpp",
          "larger(sqrt(T(@2.0@) * square(d))", "1.0", "unit:Fluid.BinghamShear"),
    fault("grains-without-rate", "mu-i has the friction of fast flow", "material/mu_i.hpp",
          "H = trial * most + a * @ends@;", "most", "unit:MuI.FrictionOfTheRate"),
    fault("ogden-swells", "stretches of ogden are not isochoric", "material/ogden.hpp",
          "tau += T(modulus[k]) * exp(T(-exponent[k] / @3@) * volume)", "2", "unit:Materials.StressIsTheDerivativeOfTheEnergy"),
    fault("voce-without-hardening", "j2 yields at the stress of the start of the step", "material/j2.hpp",
          "T lambda             = (q - yield_stress(alpha)) * T(1 / (@three_g + hardening@));", "three_g",
          "unit:J2.UniaxialStrain"),

    # time steps and sums
    fault("stable-step-of-full-cells", "the limit of hats and USL is that of full cells", "method/courant.cpp",
          "if (@mode * part > 1@) limit", "false", "verify:StableCourantNumber.IsSharp"),
    fault("stable-step-of-plain-masses", "FMPM takes the steps of lumped mass", "method/courant.cpp",
          "(s.filter == Filter::fmpm ? @s.filter_order@ : 1.0)", "1.0",
          "verify:StableCourantNumber.IsThatOfTheSpectrumWithFilters"),
    fault("step-without-speed", "the time step forgets |v|", "method/courant.cpp",
          "speed = @speeds.wave(i) + norm(particles.v[i])@;", "speeds.wave(i)",
          "pass:Step.TimeStepIsThatOfTheFastestParticle"),
    fault("step-above-limit", "a time step by cfl may pass the limit of the method", "method/courant.cpp",
          "std::min(cfl * courant_scale(model) * crossing, @stable_courant_number(model)@", "1e9",
          "pass:Step.TimeStepIsThatOfTheFastestParticle"),
    fault("step-of-domains-at-rest", "domains that grow leave the limit of the consistent mass as it was", "method/courant.cpp",
          "strains    = @of_domains && has_limit_of_strain(model.method)@;", "false && of_domains",
          "pass:Step.LimitOfConsistentMassFallsWithDomains"),
    fault("kinetic-energy-doubled", "the kinetic energy is m v^2", "method/diagnostics.cpp",
          "add(kinetic, @0.5@ * m * dot(v, v));", "1.0", "pass:Step.TotalsAreSumsOverParticles"),
    fault("strain-energy-of-V", "strain energy is summed over current volumes", "material/laws.cpp",
          "return @V0@ * law.energy(F);", "V", "pass:Step.TotalsAreSumsOverParticles"),
    fault("spare-lanes-have-mass", "spare lanes of the last batch count in the sums", "method/diagnostics.cpp",
          "@one[lane] = 0.0;@", "", "pass:Step.TotalsAreSumsOverParticles"),

    # ranks
    fault("tile-before-its-message", "a tile does not wait for the records that it adds to", "grid/rim_plan.hpp",
          "add(in[{before->rank, one.colour}], node, @&one@);", "nullptr", "unit:Relay.SumsAreThoseOfOneProcess"),
    fault("message-before-its-tile", "a record goes to the next rank before it has been added to", "grid/rim_plan.hpp",
          "add(out[{one.rank, one.colour}], node, @before@);", "nullptr", "unit:Relay.SumsAreThoseOfOneProcess"),
    fault("tile-before-its-neighbours", "tiles of ranks do not wait for those of lower colours", "grid/tiles.hpp",
          "if (@colour(next) <= colour(here)@) return;", "true", "unit:Relay.SumsAreThoseOfOneProcess"),
    fault("tiles-by-particles", "ranks divide particles, whatever they cost", "method/sharing.cpp",
          "divide(ranks, tiles, list(), @has_times@, s.cuts), {}, {}};", "false", "pass:Ranks.TilesThatTakeLongerWeighMore"),
    fault("rim-without-zeros", "tiles that share only a node to which one adds zero run at once", "grid/tiles.hpp",
          "@(tile[a] + 1) * width_ + halo_ + lattice_.basis.degree + 1@, lattice_.nodes[a]);\n        }\n        return r;\n    }\n"
          "    /// The tiles that may write", "(tile[a] + 1) * width_ + halo_ + lattice_.basis.degree", "unit:Relay.SumsAreThoseOfOneProcess"),
    fault("rim-of-a-smaller-halo", "tiles reach a node less for the plan than they write to", "grid/tiles.hpp",
          "r.lo[a] = std::max(tile[a] * width_ - @halo_@, 0);", "(halo_ - 1)", "unit:Relay.SumsAreThoseOfOneProcess"),
    fault("sums-not-shared", "ranks keep the part of a sum that they had", "grid/rim_plan.hpp",
          "if (@rank == before->rank || !needs(rank)@) continue;", "true", "unit:Relay.SumsAreThoseOfOneProcess"),
    fault("sums-not-where-counted", "a rank counts blocks of which it has only the nodes that its tiles reach", "grid/rim_plan.hpp",
          "return is_whole || @rank == counting@ ||", "false", "unit:Relay.SumsAreThoseOfOneProcess"),
    fault("sums-where-tiles-write-only", "ranks lack nodes that they read beyond the reach of their tiles, and images", "grid/rim_plan.hpp",
          "const bool is_whole                      = @holders.is_needed_whole(block)@;", "false", "unit:Relay.SumsAreThoseOfOneProcess"),
    fault("blocks-not-told", "a rank clears the blocks only that its own particles touch", "grid/rim_plan.hpp",
          "r[static_cast<std::size_t>(@rank@)].push_back(number);", "index", "unit:Relay.SumsAreThoseOfOneProcess"),
    fault("merged-by-place-alone", "particles that arrive are merged by their place in a tile, of whatever tile", "particles/travel.hpp",
          "return @a.place < b.place@;", "a.place.place < b.place.place", "unit:Travel.KeepsTheOrderOfOneProcess"),
    fault("arrivals-behind", "particles that arrive come after those that were there", "particles/travel.hpp",
          "arrivals[static_cast<std::size_t>(come)].place < @places[static_cast<std::size_t>(i)]@;", "OldPlace{}", "unit:Travel.KeepsTheOrderOfOneProcess"),
    fault("arrivals-unsorted", "particles of several ranks stay in their order before the sort", "particles/travel.hpp",
          "return merged.at(field, offset, @order.empty() ? k : order[k]@);", "k", "unit:Travel.KeepsTheOrderOfOneProcess"),
    fault("first-sort-by-place", "particles that ranks have made are merged by their place on their rank", "method/sharing.cpp",
          "{0, static_cast<std::uint64_t>(@p.id[i]@)};", "i", "pass:Ranks.EveryPresetHasTheBitsOfOneProcessIn2D"),
    fault("volume-of-a-share", "a round body has its true volume on each rank", "setup/build.cpp",
          "(is ? of_cut : of_whole) += @V0@;", "seeded.made.has(id) ? V0 : 0.0", "unit:Setup.SharesOfRanksMakeUpTheWhole"),
    fault("tie-not-even", "exact sums round ties up", "base/exact_sum.hpp",
          "const bool is_odd_or_above   = @(mantissa & 1) != 0 || is_more@;", "true", "unit:ExactSum.RoundsToNearestTiesToEven"),

    # material points of shapes
    fault("left-edge-particles", "particles start at the left edges of their sub-cells", "particles/seeding.hpp",
          "seed.x[a] = box.lower[a] + @(k[a] + 0.5)@ * s[a];", "k[a]", "unit:Seeding.BoxesAreFilledExactlyWhereverTheyLie"),
    fault("seed-domain-doubled", "half-edges of box seeds are whole edges", "particles/seeding.hpp",
          "s[a]                = length / n[a];\n        seed.volume *= s[a];\n        seed.edges(a, a) = @s[a] / 2@;", "s[a]",
          "unit:CellSeeding.BoxesShareTheirCorners"),
    fault("polar-volume-without-r", "polar cells have the volume dr da", "particles/seeding.hpp",
          ".volume = @r * dr * da * dz@", "dr * da * dz", "unit:Seeding.PolarCellsHaveExactVolumes"),
    # outlines
    fault("outline-by-areas", "normals at corners are means by areas", "shape/curved_face.hpp",
          "return @cross(next, last) * (1.0 / (dot(next, next) * dot(last, last)))@;", "cross(next, last)",
          "unit:Outline.NormalsAreExactOnCirclesAndSpheres"),
    fault("outline-without-edges", "edges of bodies are rounded", "shape/curved_face.hpp",
          "if (@!(cosine > least)@) return;", "false", "unit:Outline.RimsAreSharpAndSidesRound"),
    fault("faces-flat", "faces are flat", "shape/curved_face.hpp",
          "return @u * v * (T(to_next_[i]) * v + T(to_last_[(i + 1) % count_]) * u)@;", "T(0.0)",
          "unit:CurvedFace.IsOfFourthOrderOnCirclesAndSpheres"),
    fault("contact-from-behind", "faces that look the same way are in contact", "shape/face_search.hpp",
          "|| @!(dot(foot.normal, n) < kFacing)@) continue;", "false", "unit:FaceSearch.EndsAtTheOutline"),
    # contact
    fault("contact-without-anchors", "points that stick forget how far they have slipped", "method/contact_points.cpp",
          "point.anchor      = @turned(old->anchor, old->normal, point.normal)@;", "Vec<D>{}", BLOCK_ON_SLOPE),
    fault("contact-area-of-face", "each corner of a face in contact counts all of it", "method/contact_points.cpp",
          "const double share = 0.5 * @placed_.shares(face)[corner]@;",
          "norm(face_area(slave_.corners_of(face, x_.data()).data(), slave_.faces[face].count))", CONTACT_AREAS),
    fault("contact-one-sided", "only the first body of a pair has contact points", "method/contact_points.cpp",
          "for (int side = 0; side < @2@; ++side) {\n            const int own = pair.surface[side], other = pair.surface[1 - side];\n"
          "            if (vertices", "1", CONTACT_AREAS),
    fault("contact-on-flat-faces", "bodies meet on flat faces", "method/contact_points.cpp",
          "normals_                        = @corner_normals(*outline_, x_->data(), is_near)@;", "corner_normals(*outline_, x_->data(), is_near, 0.0)", "pass:ContactPoints.LieOnCurvedFaces"),
    fault("contact-normal-of-slave", "the normal is out of the wrong body", "method/contact_points.cpp",
          "r.normal = @found.foot.normal@;", "-1.0 * found.foot.normal", CONTACT_AREAS),
    fault("contact-faces-in-the-middle", "impulses at Gauss points act on all corners of the face alike", "method/contact_step.cpp",
          "outline.vertices[of][c]), @inside.weight[c]@", "1.0 / outline.faces[of].count", "pass:ContactPoints.OfFacesSeeTheVelocitiesAtTheirPlacesIn2D"),
    fault("contact-hasty-push-out", "overlaps are taken back in one step", "method/contact_step.cpp",
          "return @(point.gap > 0 ? kClose : kPushOut) * rate(point) * point.gap@;", "point.gap / dt_", ONE_SWEEP),
    fault("contact-late-friction", "friction follows the normal impulse before the sweep", "method/contact_step.cpp",
          "const double limit = pair.friction * @point.p@ + dt_kick_", "p", ONE_SWEEP),
    fault("contact-resists-alone", "the row sum of a contact point has only its own body", "method/contact_step.cpp",
          "d += @std::fabs(weight) * at[row]@;", "weight > 0 ? at[row] : Vec<D>{}", ONE_SWEEP),
    fault("stiffening-forgotten", "waves of St. Venant-Kirchhoff's law are as fast as at rest", "material/st_venant_kirchhoff.hpp",
          "return {@std::max(at_rest, pulled + largest * largest * at_rest)@, 0.0};", "at_rest", "unit:Materials.StVenantKirchhoffStiffens"),
    fault("friction-forgets-pressure", "the tangent of friction on an obstacle forgets that pressure changes it", "implicit/obstacle_forces.cpp",
          "(along - outer(way, way)) + @pair.friction * k * outer(way, n)@;", "Mat<D>{}", "sweep:Implicit.TangentIsTheDerivativeOnObstacles"),
    fault("tangent-without-averages", "the tangent of an implicit step forgets how averages change", "implicit/particle_forces.cpp",
          "const double d_factor  = w[i] * (@d_mean_part_[i]@ * ratio_[i]", "0.0", "sweep:Implicit.TangentIsTheDerivativeIn2D"),
    fault("averages-once", "forces of an implicit step take the average once", "implicit/particle_forces.cpp",
          "stress_[i] + (@w[i] * mean_part_[i] * ratio_[i]@ - part_[i])", "part_[i]", "sweep:Implicit.TangentIsTheDerivativeIn2D"),
    fault("midpoint-velocity", "velocities after a step of the midpoint rule are the means over it", "implicit/step_equations.cpp",
          "after = @2 * u[k] / dt_ - velocity_[k]@;", "u[k] / dt_", "pass:ImplicitSteps.MidpointKeepsEnergyAndAngularMomentum"),
    fault("inertia-of-euler", "inertia of the midpoint rule is that of implicit Euler", "implicit/step_equations.cpp",
          "inertia_ = @2 / (dt * dt)@;", "1 / (dt * dt)", "pass:ImplicitSteps.MidpointKeepsEnergyAndAngularMomentum"),
    fault("reaction-pulls", "reactions of implicit steps have the wrong sign", "implicit/step_equations.cpp",
          "return @-dt_ * residual@;", "dt_ * residual", "pass:ImplicitSteps.StaticPressIsExact"),
    fault("newmark-forgets-start", "steps of newmark have no forces of their start", "implicit/step_equations.cpp",
          "start_factor_     = @(0.5 - beta) / beta@;", "0.0", "verify:Schemes.AreSecondOrder"),
    fault("parts-of-steps-add", "forces of all parts of an implicit step add up", "implicit/scheme.cpp",
          "for (ExactSum& f : e.force) @f.clear();@", ";", "pass:ImplicitSteps.HardStepsAreHalved"),
    fault("load-steps-forget", "a load step begins at rest", "implicit/step_equations.cpp",
          "guess_[unknown(row, a)] = @dt_ * one.velocity[a]@;", "0.0", "pass:ImplicitSteps.LoadStepsBeginLikeTheLast"),
    fault("cut-through-neighbours", "parts of a matrix are cut where they are joined", "solve/direct_solver.cpp",
          "[&](int j) { return @mark_[j] == 0@; });", "mark_[j] == 1", "unit:DirectSolver.CutsMatricesOfBodies"),
    fault("roots-forget-diagonals", "symmetric parts of a matrix lose the diagonals of what others leave", "solve/direct_solver.cpp",
          "Eigen::Index i = has_roots ? @j@ : 0;", "j + 1", "unit:DirectSolver.CutsMatricesOfBodies"),
    fault("averaged-matrix", "the matrix of averaged steps has a particle's own dilation only", "implicit/tangent_matrix.cpp",
          "change[ab * width + k] = @part * cell.mean[k] / total@;", "0.0", "sweep:Implicit.TangentIsTheDerivativeIn2D"),
    fault("one-row-of-a-block", "blocks of the matrix of an implicit step have the row of their first component only", "implicit/block_rows.hpp",
          "p.value[(D * m + @a@) * width", "0", "sweep:Implicit.TangentIsTheDerivativeIn2D"),
]


class Broken(Exception):
    """What keeps the faults from being judged."""


# ---- planting --------------------------------------------------------------------------------------------------------


def span_of(text, source, who):
    """The begin and end of what is marked in a text, in a source that has the text exactly once."""
    before, right, after = text.split("@")
    count = source.count(before + right + after)
    if count != 1:
        raise Broken(f"fault {who}: {before + right + after!r} is there {count} times instead of once")
    begin = source.index(before + right + after) + len(before)
    return begin, begin + len(right)


def choice(number, right, wrong):
    if right.endswith(";"):
        return f"{{ if (ordo::planted({number})) {{ {wrong} }} else {{ {right} }} }}"
    return f"(ordo::planted({number}) ? ({wrong}) : ({right}))"


def planted_sources():
    """The files that have faults with all of them in, by name below ROOT. The number of a fault is its place in FAULTS."""
    edits = {}
    for number, f in enumerate(FAULTS, 1):
        name = f"src/{f.file}"
        source = (ROOT / name).read_text()
        for text, wrong in f.places:
            begin, end = span_of(text, source, f"{f.name}, {name}")
            edits.setdefault(name, []).append((begin, end, choice(number, source[begin:end], wrong), f.name))
    sources = {}
    for name, of_file in edits.items():
        source, following = (ROOT / name).read_text(), None
        for begin, end, text, who in sorted(of_file, reverse=True):
            if following and end > following[0]:
                raise Broken(f"faults {who} and {following[1]} change the same text of {name}")
            source = source[:begin] + text + source[end:]
            following = begin, who
        sources[name] = source
    return sources


def copy_sources(to):
    """The tracked files with the faults; what has not changed since the last copy stays, so that it need not be built again."""
    listed = subprocess.run(["git", "-C", ROOT, "ls-files", "-z"], capture_output=True, text=True)
    if listed.returncode != 0:
        raise Broken(f"git ls-files: {listed.stderr.strip()}")
    planted = planted_sources()
    files = {name: planted[name].encode() if name in planted else (ROOT / name).read_bytes()
             for name in listed.stdout.split("\0") if (ROOT / name).is_file()}
    files[HEADER] = HEADER_TEXT.encode()
    for old in to.rglob("*"):
        if old.is_file() and str(old.relative_to(to)) not in files:
            old.unlink()
    for name, content in files.items():
        file = to / name
        file.parent.mkdir(parents=True, exist_ok=True)
        if not file.is_file() or file.read_bytes() != content:
            file.write_bytes(content)


def build(source, binary, layers, jobs):
    configure = ["cmake", "-S", source, "-B", binary, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
                 "-DCMAKE_CXX_FLAGS_RELEASE=-O1 -DNDEBUG", f"-DCMAKE_CXX_FLAGS=-include {source / HEADER}",
                 "-DORDO_TESTS=ON", "-DORDO_GMSH=OFF", "-DORDO_FLATTEN=OFF"]
    compile_ = ["cmake", "--build", binary, "-j", str(jobs), "--target", *(f"test_{layer}" for layer in layers)]
    log = binary.parent / "build.log"
    with log.open("w") as out:
        for command in (configure, compile_):
            if subprocess.run(command, stdout=out, stderr=subprocess.STDOUT).returncode != 0:
                raise Broken(f"the copy does not build, see {log}")


# ---- running ---------------------------------------------------------------------------------------------------------


class Tests:
    """The test binaries of the copy."""

    def __init__(self, binary):
        self.binary = binary

    def command(self, layer, *options):
        return [self.binary / "tests" / f"test_{layer}", "--gtest_color=no", *options]

    def names(self, layer):
        """Of all tests of a layer."""
        listed = subprocess.run(self.command(layer, "--gtest_list_tests"), capture_output=True, text=True, check=True).stdout
        names, suite = set(), ""
        for line in listed.splitlines():
            word = line.split("#")[0].rstrip()
            if line.startswith("  "):
                names.add(suite + word.strip())
            else:
                suite = word
        return names

    def run(self, layer, tests, number, timeout=None):
        """Exit code and output of tests under a fault, which ends at the first assertion that fails; None after a timeout."""
        stop = ["--gtest_break_on_failure"] if number else []
        environment = os.environ | {"ORDO_FAULT": str(number), "OMP_NUM_THREADS": "1", "OMP_WAIT_POLICY": "passive"}
        try:
            done = subprocess.run(self.command(layer, "--gtest_filter=" + ":".join(tests), *stop), env=environment,
                                  timeout=timeout, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace")
        except subprocess.TimeoutExpired:
            return None, ""
        return done.returncode, done.stdout


def by_layer(tests):
    """Lists of tests by the binary that has them."""
    layers = {}
    for test in tests:
        layer, name = test.split(":")
        if name not in layers.setdefault(layer, []):
            layers[layer].append(name)
    return layers


def check_without_fault(tests, faults, jobs):
    """Every test of the table exists and passes. Returns the seconds of each."""
    wanted = by_layer(t for f in faults for t in f.tests)
    known = {layer: tests.names(layer) for layer in wanted}
    for f in faults:
        for layer, names in by_layer(f.tests).items():
            for name in names:
                if name not in known[layer]:
                    raise Broken(f"fault {f.name}: test_{layer} has no test {name}")
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        done = list(pool.map(lambda item: (item[0], *tests.run(*item, 0)), wanted.items()))
    seconds = {}
    for layer, code, output in done:
        if code != 0:
            failed = re.findall(r"^\[  FAILED  \] (\S+\.[^\s,]+)", output, re.MULTILINE)
            raise Broken(f"without a fault test_{layer} fails: {', '.join(sorted(set(failed))) or f'exit code {code}'}")
        for name, ms in re.findall(r"^\[       OK \] (\S+) \((\d+) ms\)", output, re.MULTILINE):
            seconds[f"{layer}:{name}"] = int(ms) / 1000
    return seconds


@dataclasses.dataclass
class Result:
    caught_by: str  # LAYER:SUITE.TEST, empty where the fault survives
    how: str
    seconds: float


def judge(tests, number, f, usual):
    """Runs the tests of a fault until one catches it."""
    begin = time.monotonic()
    for layer, names in by_layer(f.tests).items():
        timeout = max(60.0, 10 * sum(usual.get(f"{layer}:{name}", 0.0) for name in names))
        code, output = tests.run(layer, names, number, timeout)
        if code == 0:
            continue
        how = "time out" if code is None else "caught" if re.search(r": Failure$", output, re.MULTILINE) else "crash"
        running = re.findall(r"^\[ RUN      \] (\S+)", output, re.MULTILINE)
        return Result(f"{layer}:{running[-1] if running else names[0]}", how, time.monotonic() - begin)
    return Result("", "SURVIVED", time.monotonic() - begin)


def judge_all(tests, numbered, usual, jobs):
    """The results of the faults in their order, each printed when it and those before it are known."""
    width = max(len(f.name) for _, f in numbered)
    file_width = max(len(f.file) for _, f in numbered)
    print(f"{'fault':<{width}}  {'file below src':<{file_width}}  {'result':<8} {'s':>6}  tests")
    results = []
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for (_, f), r in zip(numbered, pool.map(lambda item: judge(tests, *item, usual), numbered)):
            print(f"{f.name:<{width}}  {f.file:<{file_width}}  {r.how:<8} {r.seconds:6.1f}  {', '.join(f.tests)}", flush=True)
            results.append(r)
    return results


def markdown(faults, results):
    rows = ["| fault | in `src/` | what is wrong | caught by |", "|---|---|---|---|"]
    for f, r in zip(faults, results):
        by = f"`{r.caught_by.replace(':', ' ')}`" if r.caught_by else "nothing"
        if r.how in ("crash", "time out"):
            by += f" ({r.how})"
        rows.append(f"| {f.name} | `{f.file}` | {f.what} | {by} |")
    return "\n".join(rows) + "\n"


# ---- command line ----------------------------------------------------------------------------------------------------


def names_of_faults(text):
    known = [f.name for f in FAULTS]
    names = text.split(",")
    for name in names:
        if name not in known:
            raise argparse.ArgumentTypeError(f"{name}: there is {', '.join(known)}")
    return names


def parse_options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dir", type=pathlib.Path, default=ROOT / "build" / "planted", help="for the copy and its build")
    parser.add_argument("--only", type=names_of_faults, metavar="NAME,...", help="these faults only")
    parser.add_argument("--list", action="store_true", help="print the table, once its texts are found in the sources")
    parser.add_argument("--jobs", type=int, choices=(1, 2), default=2, help="processes at a time")
    parser.add_argument("--markdown", type=pathlib.Path, metavar="FILE", help="file for the results")
    return parser.parse_args()


def run(options):
    numbered = [(k, f) for k, f in enumerate(FAULTS, 1) if not options.only or f.name in options.only]
    faults = [f for _, f in numbered]
    if options.list:
        planted_sources()
        for f in faults:
            print(f"{f.name}: {f.what} ({f.file}; {', '.join(f.tests)})")
        return 0
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    times = [time.monotonic()]
    directory = options.dir.resolve()
    directory.mkdir(parents=True, exist_ok=True)
    source, binary = directory / "source", directory / "build"
    copy_sources(source)
    build(source, binary, sorted(by_layer(t for f in faults for t in f.tests)), options.jobs)
    times.append(time.monotonic())
    tests = Tests(binary)
    usual = check_without_fault(tests, faults, options.jobs)
    times.append(time.monotonic())
    results = judge_all(tests, numbered, usual, options.jobs)
    times.append(time.monotonic())
    if options.markdown:
        options.markdown.write_text(markdown(faults, results))
    survived = sum(not r.caught_by for r in results)
    built, passed, judged = (end - begin for begin, end in zip(times, times[1:]))
    print(f"{len(results) - survived} of {len(results)} faults caught; {built:.0f} s to build, {passed:.0f} s for {len(usual)} "
          f"tests without a fault, {judged:.0f} s with faults, {(times[-1] - times[0]) / 60:.1f} min in all")
    return 1 if survived else 0


def main():
    try:
        return run(parse_options())
    except Broken as why:
        print(f"planted_faults: {why}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
