"""Scheme `static` against exact answers (cases/static), elements of order 5 and the load at collapse; midpoint against explicit steps.

Grids are coarse, so that a run takes seconds; finer ones are in the README of each case and in docs/implicit.md.
"""

import os
import unittest

import numpy
import test_benchmarks  # as modules: the tests of a class that is imported would run here too
import test_contact
from harness import ROOT, InTemporaryDirectory, frames, has_hdf5, history, ordo, particle_data, read_vtk
from test_cases import run_case
from vtk.util.numpy_support import vtk_to_numpy


def corners(file):
    return vtk_to_numpy(read_vtk(file).GetPoints().GetData())


def elastica(load):
    """Tip (x, y) of a thin cantilever of length 1, bent downwards by the end load P L^2/(E I): shooting with the curvature at the clamp."""
    def ends(curvature, steps=2000):
        h, angle, bend, x, y = 1 / steps, 0.0, curvature, 0.0, 0.0
        for _ in range(steps):  # the midpoint rule
            a, b = angle + h / 2 * bend, bend - h / 2 * load * numpy.cos(angle)
            x, y = x + h * numpy.cos(a), y + h * numpy.sin(a)
            angle, bend = angle + h * b, bend - h * load * numpy.cos(a)
        return bend, x, y
    low, high = 0.0, load
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if ends(middle)[0] < 0 else (low, middle)
    return ends(middle)[1:]


def bisect(f, low, high):
    """Where f changes its sign from - to +, for each component."""
    low, high = numpy.broadcast_arrays(low, high)
    for _ in range(60):
        middle = (low + high) / 2
        low, high = numpy.where(f(middle) < 0, middle, low), numpy.where(f(middle) < 0, high, middle)
    return middle


class Static(unittest.TestCase):
    def run_static(self, file, *args):
        seen, directory, _ = run_case(self, "static", "--threads", "1", *args, file=file)
        self.assertEqual(seen["step_halvings"][-1], 0)
        return seen, frames(directory)

    def test_the_elastica_is_that_of_the_literature(self):
        for load, x, y in ((1, 0.05643, 0.30172), (2, 0.16064, 0.49346)):  # Mattiasson (1981), IJNME 17:145
            self.assertAlmostEqual(1 - elastica(load)[0], x, delta=2e-5)
            self.assertAlmostEqual(elastica(load)[1], y, delta=2e-5)

    def test_cantilever_is_an_elastica(self):
        x, y  = elastica(2.0)
        tips  = []
        for spacing in (0.5, 0.25, 0.125):
            seen, files = self.run_static("case.toml", "--set", f"grid.spacing={spacing}", "--set", "output.interval=1")
            start, end  = corners(files[0][1]), corners(files[-1][1])
            tip         = start[:, 0] > 20 - 1e-6
            tips.append((end[tip] - start[tip])[:, :2].mean(axis=0))
            self.assertLess(seen["newton_iterations"][-1], 60)  # of ten steps
        self.assertAlmostEqual((20 + tips[-1][0]) / 20, x, delta=0.01 * x)
        self.assertAlmostEqual(-tips[-1][1] / 20, y, delta=0.01 * y)
        first, second = numpy.diff(tips, axis=0)[:, 1]
        self.assertAlmostEqual(numpy.log2(first / second), 2, delta=0.2)  # 2.04

    def test_column_has_the_stress_of_its_weight(self):
        lame, mu, weight = 5e5 * 0.3 / (1.3 * 0.4), 5e5 / 2.6, 2000 * 10

        def stress(F):
            return (lame * numpy.log(F) + mu * (F * F - 1)) / F

        X, errors = numpy.linspace(0, 9, 2001), []
        F         = bisect(lambda F: stress(F) + weight * (9 - X), numpy.full(len(X), 0.3), 1.0)
        self.assertLess(F.min(), 0.8)  # large strains
        u = numpy.concatenate([[0], numpy.cumsum((F[1:] + F[:-1]) / 2 - 1) * (X[1] - X[0])])
        for spacing in (0.25, 0.125):
            seen, files = self.run_static("case-column.toml", "--set", f"grid.spacing={spacing}")
            start, end  = (particle_data(read_vtk(file)) for _, file in (files[0], files[-1]))
            height      = start["position"][:, 1]
            load        = weight * (9 - height)
            self.assertLess(numpy.abs(end["stress"][:, 4] + load).max(), weight * spacing / 3.5)  # the stress of a cell
            errors.append(numpy.sqrt(numpy.mean((end["position"][:, 1] - height - numpy.interp(height, X, u)) ** 2)))
            self.assertAlmostEqual(seen["floor_force_y"][-1] / (weight * 9 * 0.5), 1, delta=1e-6)
            self.assertEqual(seen["kinetic_energy"][-1], 0.0)
        self.assertLess(errors[0], 1e-3 * numpy.abs(u).max())
        self.assertAlmostEqual(numpy.log2(errors[0] / errors[1]), 2, delta=0.3)

    def test_ring_follows_lame_then_hill(self):
        k, outer  = 100, 2.0
        _, files = self.run_static("case-ring.toml")
        start    = particle_data(read_vtk(files[0][1]))
        r        = numpy.hypot(*start["position"][:, :2].T)
        normal   = start["position"][:, :2] / r[:, None]
        for time, file in files[3:]:
            p    = 130 * time
            data = particle_data(read_vtk(file))
            c    = max(float(bisect(lambda c: 2 * k * numpy.log(c) + k * (1 - c * c / outer ** 2) - p, 1.0, outer)), 1.0)
            if c == 1.0:  # elastic: Lame
                radial = p / (outer ** 2 - 1) * (1 - outer ** 2 / r ** 2)
            else:         # Hill (1950), ch. V
                radial = numpy.where(r < c, -p + 2 * k * numpy.log(r), -k * c * c * (1 / r ** 2 - 1 / outer ** 2))
            sigma = data["stress"].reshape(-1, 3, 3)[:, :2, :2]
            found = numpy.einsum("ni,nij,nj->n", normal, sigma, normal)
            self.assertLess(numpy.sqrt(numpy.mean((found - radial) ** 2)), 0.04 * p, time)
            flows = data["plastic_strain"] > 1e-6
            if c > 1.05:
                self.assertAlmostEqual(r[flows].max(), c, delta=0.06)
            displacement = ((data["position"] - start["position"])[:, :2] * normal).sum(axis=1)
            rim          = r > 1.95
            stress       = 2 * k * c * c / outer ** 2 if c > 1 else 2 * p / (outer ** 2 - 1)
            exact        = (1 - 0.49 ** 2) * outer / 1e5 * stress * outer / r[rim].mean()
            self.assertAlmostEqual(displacement[rim].mean() / exact, 1, delta=0.03)


class ShippedCasesAtRest(unittest.TestCase):
    """Cases that reach rest by slow loading give the same by `static`, in some load steps."""

    def test_cook_membrane(self):
        reference = test_benchmarks.CookMembrane.STATIC[0.49][0]
        seen, directory, _ = run_case(self, "cook-membrane", "--threads", "1", "--set", "method.scheme=static", "--set",
                                      "time.end=2.2e-3", "--set", "time.dt=0.22e-3", "--set", "output.interval=2.2e-3")
        files      = frames(directory)
        start, end = corners(files[0][1]), corners(files[-1][1])
        tip        = numpy.argmin(numpy.hypot(start[:, 0] - 0.048, start[:, 1] - 0.060))
        for a in (0, 1):
            self.assertAlmostEqual((end[tip] - start[tip])[a] / reference[a], 1, delta=0.02)

    def test_strip_footing(self):
        seen, _, _ = run_case(self, "strip-footing", "--threads", "1", "--set", "method.scheme=static", "--set", "time.dt=3",
                              "--set", "output.interval=60")
        load = -2 * seen["footing_force_y"][-1] / 0.002
        self.assertAlmostEqual(load / (2 + numpy.pi), 1, delta=0.07)  # 5.1 % by explicit steps on this grid
        self.assertLess(seen["newton_iterations"][-1], 100)

    def test_strip_footing_on_nearly_incompressible_clay(self):
        seen, _, _ = run_case(self, "strip-footing", "--threads", "1", "--set", "method.scheme=static", "--set", "time.dt=4",
                              "--set", "output.interval=60", "--set", "material.0.poisson=0.499", "--set", "grid.spacing=0.0625")
        load = -2 * seen["footing_force_y"][-1] / 0.002
        self.assertAlmostEqual(load / (2 + numpy.pi), 1, delta=0.03)
        self.assertLess(seen["newton_iterations"][-1], 120)


def run_block(test, spacing, *args):
    """The history of the block under its own weight, in one step of `midpoint`."""
    return run_case(test, "static", "--set", f"grid.spacing={spacing}", "--set", "method.scheme=midpoint", "--set",
                    "method.newton_tolerance=1e-10", "--set", 'output.fields=["displacement"]', *args, file="case-block.toml")[0]


class Multigrid(unittest.TestCase):
    """Linear iterations of a step do not grow with the number of unknowns, here 13000 and 52000; 1.3 million where ORDO_NIGHTLY is set."""

    def test_iterations_do_not_grow(self):
        counts = []
        for spacing in (0.0125, 0.00625) + (0.00125,) * ("ORDO_NIGHTLY" in os.environ):
            seen = run_block(self, spacing)
            self.assertEqual(seen["newton_iterations"][-1], 3)
            counts.append(seen["linear_iterations"][-1])
        self.assertLessEqual(max(counts), 13)
        self.assertLessEqual(max(counts) - min(counts), 2)


class CutCells(unittest.TestCase):
    """Iterations do not depend on how little of a cell a body has at its sides."""

    def iterations(self, part, *args):
        spacing = 0.0125
        lower   = [0.2 - part * spacing, 0.0]
        upper   = [1.2 + part * spacing, 1.0 + part * spacing]
        return run_block(self, spacing, "--set", f"body.0.lower={lower}", "--set", f"body.0.upper={upper}", *args)["linear_iterations"][-1]

    def test_iterations_do_not_depend_on_the_cut(self):
        for preset in ("cpdi1", "bscpdi2"):
            with self.subTest(preset):
                linear = [self.iterations(part, "--set", f"method.preset={preset}") for part in (0.5, 0.1, 1e-3, 1e-6)]
                self.assertLessEqual(max(linear), 12)
                self.assertLessEqual(max(linear) - min(linear), 1)

    def test_they_do_without_the_ghost_penalty(self):
        self.assertGreater(self.iterations(0.1, "--set", "method.preset=bscpdi2", "--set", "method.ghost_penalty=0"), 20)


@unittest.skipUnless(has_hdf5(), "ordo was built without HDF5")
class Restarts(InTemporaryDirectory):
    """A run of load steps that is restarted is the run that was never interrupted, its iterations too."""

    def test_files_are_the_same(self):
        case = (ROOT / "cases" / "strip-footing" / "case.toml").read_text() + "[checkpoint]\nsteps = 1\n"
        self.write("case.toml", case)
        args = ("--threads", 1, "--set", "grid.spacing=0.25", "--set", "method.scheme=static", "--set", "time.dt=6", "--set", "output.interval=6")
        self.run_good("case.toml", "--output", "whole", *args)
        self.run_good("case.toml", "--output", "parts", *args, "--set", "time.end=24")
        self.run_good("case.toml", "--output", "parts", *args, "--restart", "latest")
        self.assert_same_files("whole", "parts")
        rows = numpy.genfromtxt(self.dir / "whole" / "newton.csv", delimiter=",", names=True)
        seen = history(self.dir / "whole")
        self.assertEqual(rows["linear_iterations"].sum(), seen["linear_iterations"][-1])
        self.assertEqual((rows["part"] > 0).sum(), seen["newton_iterations"][-1])
        self.assertEqual(rows["residual"][-1], seen["newton_residual"][-1])


class Dynamics(unittest.TestCase):
    """The swing of a cantilever by `midpoint` with ten times the step of the explicit scheme."""

    def test_swing_is_that_of_explicit_steps(self):
        least = {}
        for scheme, args in (("musl", []), ("midpoint", ["--set", "time.cfl=5", "--set", "method.mass=consistent"])):
            _, directory, _ = run_case(self, "cantilever", "--threads", "1", "--set", f"method.scheme={scheme}", "--set", "time.end=0.7",
                                       *args)
            tip = numpy.genfromtxt(directory / "probe_tip.csv", delimiter=",", names=True)
            k   = tip["displacement_y"].argmin()
            least[scheme] = tip["displacement_y"][k], tip["time"][k], len(tip)
        self.assertAlmostEqual(least["midpoint"][0] / least["musl"][0], 1, delta=0.004)
        self.assertAlmostEqual(least["midpoint"][1] / least["musl"][1], 1, delta=0.01)
        self.assertLess(least["midpoint"][2], least["musl"][2] / 10)


SLOPE = '''title = "A block on a rigid slope of 14.5 degrees"
gravity = [2.5, -9.682458365518542]
[grid]
size = [2.0, 1.0]
spacing = 0.1
[method]
preset = "cpdi1"
scheme = "static"
[time]
end = 1.0
dt = 0.5
[[material]]
name = "rubber"
density = 1000.0
young = 1.0e6
poisson = 0.3
[[body]]
name = "block"
material = "rubber"
shape = "box"
lower = [0.53, 0.23]
upper = [1.53, 0.73]
[[obstacle]]
name = "slope"
shape = "half-space"
point = [0.0, 0.23]
normal = [0.0, 1.0]
friction = 0.3
[output]
interval = 1.0
'''


class Obstacles(test_contact.Contact):
    WEIGHT = 500 * 2.5, 500 * 9.682458365518542  # along and across the slope, N

    def test_friction_holds_a_block(self):
        for preset in ("cpdi1", "cpdi2", "bscpdi2"):
            with self.subTest(preset):
                seen = self.run_case(SLOPE, "--set", f"method.preset={preset}")
                self.assertAlmostEqual(seen["slope_force_x"][-1] / self.WEIGHT[0], 1, delta=1e-6)
                self.assertAlmostEqual(-seen["slope_force_y"][-1] / self.WEIGHT[1], 1, delta=1e-6)

    def test_too_little_friction_has_no_answer(self):
        done = ordo("run", self.write("case.toml", SLOPE), "--quiet", "--set", "obstacle.0.friction=0.2", cwd=self.dir)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("free to move", done.stderr)

    def test_a_long_step_does_not_jump_over_a_slab(self):
        slab = SLOPE.replace('shape = "half-space"\npoint = [0.0, 0.23]\nnormal = [0.0, 1.0]', 'shape = "box"\nlower = [0.2, 0.2]\nupper = [1.9, 0.3]')
        for scheme in ("midpoint", "newmark"):
            with self.subTest(scheme):
                seen = self.run_case(slab, "--set", f"method.scheme={scheme}", "--set", "time.dt=0.35", "--set", "time.end=0.35", "--set",
                                     "gravity=0", "--set", "obstacle.0.friction=0", "--set", "body.0.velocity=[0.0, -2.0]", "--set",
                                     "body.0.lower=[0.53, 0.5]", "--set", "body.0.upper=[1.53, 0.9]", "--set", "method.mass=consistent")
                self.assertGreater(seen["step_halvings"][-1], 0)
                self.assertGreater(seen["momentum_y"][-1], 0)  # it has turned round

    def test_a_block_slides(self):
        seen = self.run_case(SLOPE, "--set", "method.scheme=midpoint", "--set", "time.dt=0.005", "--set", "obstacle.0.friction=0.1",
                             "--set", "time.end=0.4")
        late   = seen["time"] > 0.2  # all points slide
        across = -seen["slope_force_y"][late]
        self.assertLess(numpy.abs(seen["slope_force_x"][late] - 0.1 * across).max(), 1e-6 * across.max())
        self.assertAlmostEqual(seen["momentum_x"][-1] / (0.4 * (self.WEIGHT[0] - 0.1 * self.WEIGHT[1])), 1, delta=0.03)


if __name__ == "__main__":
    unittest.main()
