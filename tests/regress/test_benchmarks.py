"""Shipped cases against solutions of other programs, experiments and closed forms: plasticity, nearly incompressible bodies, fluids.

Grids are coarse, so that a run takes seconds; finer ones are in the README of each case.
"""

import unittest

import numpy
from harness import ROOT, frames, particle_data, read_vtk
from test_cases import run_case
from vtk.util.numpy_support import vtk_to_numpy


def extent(data):
    """The largest coordinates that the domains of the particles reach."""
    return vtk_to_numpy(data.GetPoints().GetData()).max(axis=0)


def noise(data, spacing):
    """Root mean square of the pressure less its mean over the particles of the same cell of the grid."""
    cells    = particle_data(data)
    pressure = cells["pressure"]
    _, where = numpy.unique(numpy.floor(cells["position"] / spacing), axis=0, return_inverse=True)
    mean     = numpy.bincount(where, pressure) / numpy.bincount(where)
    return numpy.sqrt(numpy.mean((pressure - mean[where]) ** 2))


class TaylorBar(unittest.TestCase):
    """Finite elements of another program: reference.csv in plane strain; radius and length of axisymmetric ones in 3D."""

    def last(self, *args, **file):
        seen, directory, _ = run_case(self, "taylor-bar", "--threads", "1", *args, **file)
        return seen, read_vtk(frames(directory)[-1][1]), directory

    def test_plane_bar_follows_finite_elements(self):
        seen, _, directory = self.last()
        reference = numpy.genfromtxt(ROOT / "cases/taylor-bar/reference.csv", delimiter=",", skip_header=1, names=True)
        for time, file in frames(directory):
            width, length, _ = extent(read_vtk(file))
            self.assertAlmostEqual(width / numpy.interp(time, reference["t"], reference["half_width"]), 1, delta=0.05)
            self.assertAlmostEqual(length / numpy.interp(time, reference["t"], reference["length"]), 1, delta=0.01)
        start = seen["kinetic_energy"][0]
        for column, name in (("kinetic_energy", "kinetic"), ("dissipated_energy", "dissipated")):
            expected = numpy.interp(seen["time"], reference["t"], reference[name])
            self.assertLess(numpy.abs(seen[column] / start - expected).max(), 0.025, column)
        total = seen["total_energy"] + seen["dissipated_energy"] + seen["boundary_work"] + seen["artificial_viscosity_work"]
        self.assertLess(total.max(), 1.001 * start)
        self.assertGreater(total.min(), 0.975 * start)

    def test_particles_of_their_own_lock(self):
        found = {}
        for averaging in ("cell", "none"):
            seen, data, _ = self.last("--set", "method.preset=ugimp", "--set", f"method.averaging={averaging}")
            found[averaging] = noise(data, 0.0004), seen["strain_energy"][-1] / seen["kinetic_energy"][0]
        self.assertLess(found["cell"][0], found["none"][0] / 3)  # pressure that alternates
        self.assertAlmostEqual(found["cell"][1], 0.0027, delta=0.002)  # the elements' elastic energy at the end
        self.assertGreater(found["none"][1], 0.01)                     # locked in

    def test_rod_has_the_length_and_radius_of_axisymmetric_elements(self):
        found = {}
        for averaging in ("cell", "none"):
            seen, data, _ = self.last("--set", f"method.averaging={averaging}", file="case-3d.toml")
            radius, other, length = extent(data)
            self.assertAlmostEqual(radius, other, delta=1e-6 * radius)
            found[averaging] = radius / 7.199e-3, length / 21.426e-3
            total = seen["total_energy"] + seen["dissipated_energy"] + seen["boundary_work"]
            self.assertLess(numpy.ptp(total), 0.04 * total[0])
        self.assertAlmostEqual(found["cell"][0], 1, delta=0.05)
        self.assertAlmostEqual(found["cell"][1], 1, delta=0.02)
        self.assertLess(found["none"][0], found["cell"][0] - 0.02)  # the foot locks


class CookMembrane(unittest.TestCase):
    """Elements of order 5 with the same law: displacement of the upper right corner in m, lowest period in s, lambda."""

    STATIC = {0.3: ((-7.978e-3, 8.697e-3), 1.0723e-3, 120.291e6),
              0.45: ((-6.385e-3, 7.409e-3), 0.9616e-3, 721.746e6),
              0.49: ((-5.927e-3, 7.021e-3), 0.9278e-3, 3929.506e6)}

    def tip(self, ratio, averaging):
        """The mean displacement of the corner over the last period, over its reference, and the noise of the pressure at the end."""
        reference, period, lame = self.STATIC[ratio]
        _, directory, _ = run_case(self, "cook-membrane", "--threads", "1", "--set", f"material.0.lambda={lame}",
                                   "--set", f"method.averaging={averaging}")
        all_frames = frames(directory)
        corners = [(time, vtk_to_numpy(read_vtk(file).GetPoints().GetData())) for time, file in all_frames if time == 0
                   or time > all_frames[-1][0] - period]
        start = corners[0][1]
        tip   = numpy.argmin(numpy.hypot(start[:, 0] - 0.048, start[:, 1] - 0.060))
        mean  = numpy.mean([x[tip, :2] - start[tip, :2] for _, x in corners[1:]], axis=0)
        return mean / reference, noise(read_vtk(all_frames[-1][1]), 0.004)

    def test_tip_has_its_static_place(self):
        for ratio in self.STATIC:
            with self.subTest(ratio):
                displacement, _ = self.tip(ratio, "cell")
                self.assertLess(numpy.abs(displacement - 1).max(), 0.03)

    def test_particles_of_their_own_lock(self):
        averaged, alone = self.tip(0.49, "cell"), self.tip(0.49, "none")
        self.assertLess(alone[0][1], 0.96)
        self.assertGreater(alone[1], 3 * averaged[1])


class WaterColumn(unittest.TestCase):
    """Tait's water at rest: the weight above is the pressure, and the pressure gives the volume."""

    def test_pressure_is_the_weight_above(self):
        seen, directory, _ = run_case(self, "water-column", "--threads", "1")
        all_frames = frames(directory)
        start      = particle_data(read_vtk(all_frames[0][1]))["position"][:, 1]
        rest       = [read_vtk(file) for time, file in all_frames if time > 1 + 1e-9]  # a period of 4 L/c
        pressure   = numpy.mean([particle_data(data)["pressure"] for data in rest], axis=0)
        weight     = 1000 * 9.81 * (1 - start)
        rows       = [numpy.abs(start - row) < 0.0125 for row in numpy.arange(0.0125, 1, 0.025)]  # cells of the grid at the start
        self.assertEqual({numpy.count_nonzero(row) for row in rows}, {16})
        for row in rows:
            self.assertAlmostEqual(pressure[row].mean() / 9810, weight[row].mean() / 9810, delta=0.005)
        self.assertLess(numpy.sqrt(numpy.mean((pressure - weight) ** 2)), 0.01 * 9810)
        height = numpy.mean([extent(data)[1] for data in rest])
        self.assertAlmostEqual((1 - height) / (1 - 0.988473), 1, delta=0.01)
        force = seen["floor_force_y"][seen["time"] > 1].mean()
        self.assertAlmostEqual(force / (0.1 * 9810), 1, delta=0.005)
        self.assertLess(numpy.abs(particle_data(rest[-1])["velocity"]).max(), 2e-3)


class DamBreak(unittest.TestCase):
    """Martin & Moyce (1952), tables 2 and 6: t sqrt(2g/a) and front/a; t sqrt(g/a) and height/2a."""

    FRONT  = numpy.array([(0.84, 1.22), (1.43, 1.67), (1.98, 2.33), (2.51, 3.00), (2.98, 3.67), (3.33, 4.11)]).T
    HEIGHT = numpy.array([(0.77, 0.89), (1.28, 0.72), (1.84, 0.56), (2.45, 0.39), (3.06, 0.28)]).T
    A, G, CELL = 0.05715, 9.81, 0.005715

    def front(self, x, volume):
        """Where the water is A/10 deep, between the middles of columns of the grid, and its foremost particle."""
        depth  = numpy.bincount((x / self.CELL).astype(int), volume, minlength=100) / self.CELL
        last   = numpy.flatnonzero(depth >= self.A / 10)[-1]
        beyond = (depth[last] - self.A / 10) / (depth[last] - depth[last + 1])
        return min((last + 0.5 + beyond) * self.CELL, x.max()), x.max()

    def test_front_and_height_follow_the_experiment(self):
        seen, directory, _ = run_case(self, "dam-break", "--threads", "1", "--set", 'output.fields=["density", "mass"]')
        times, fronts, tips, heights = [], [], [], []
        for time, file in frames(directory):
            data   = read_vtk(file)
            points = vtk_to_numpy(data.GetPoints().GetData())  # of `apic`, whose particles are points
            cells  = particle_data(data)
            front, tip = self.front(points[:, 0], cells["mass"] / cells["density"])
            times.append(time)
            fronts.append(front / self.A)
            tips.append(tip / self.A)
            heights.append(points[points[:, 0] < 0.2 * self.A, 1].max() / (2 * self.A))
        when, expected = self.FRONT[0] / (2 * self.G / self.A) ** 0.5, self.FRONT[1]
        self.assertLess(numpy.abs(numpy.interp(when, times, fronts) / expected - 1).max(), 0.10)
        leads = numpy.interp(when, times, tips) / expected - 1
        self.assertGreater(leads.min(), 0.0)  # nothing slows an inviscid film
        self.assertLess(leads.max(), 0.15)
        heights = numpy.interp(self.HEIGHT[0] / (self.G / self.A) ** 0.5, times, heights)
        self.assertLess(numpy.abs(heights / self.HEIGHT[1] - 1).max(), 0.10)
        total = seen["total_energy"] + seen["potential_energy"] + seen["dissipated_energy"] + seen["boundary_work"]
        self.assertLess(numpy.ptp(total), 0.04 * numpy.ptp(seen["potential_energy"]))


if __name__ == "__main__":
    unittest.main()
