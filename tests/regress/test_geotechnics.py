"""Soils that fail, against limit loads and run-out laws."""

import math
import unittest

import numpy
from harness import frames, particle_data, read_vtk
from test_benchmarks import noise
from test_cases import run_case
from vtk.util.numpy_support import vtk_to_numpy

STRENGTH = 0.002  # s_u of cases/strip-footing, Pa


class Footing(unittest.TestCase):
    """Prandtl's load of clay, (2 + pi) s_u B; materials of nearly constant volume lock without averages."""

    def load_and_noise(self, cells, averaging):
        spacing = 1 / cells
        columns, directory, _ = run_case(self, "strip-footing", "--set", f"method.averaging={averaging}", "--set", f"grid.spacing={spacing}",
                                         "--set", "method.preset=ugimp")
        force = columns["footing_force_y"]
        data = read_vtk(frames(directory)[-1][1])
        return -2 * force[-len(force) // 20:].mean() / STRENGTH, noise(data, spacing) / STRENGTH

    def test_load_and_noise(self):
        exact = 2 + math.pi
        for cells, averaging, low, high, most_noise in ((8, "cell", 0.0, 0.07, 0.1), (16, "cell", 0.0, 0.03, 0.6), (8, "node", 0.0, 0.10, 2.0)):
            with self.subTest(cells=cells, averaging=averaging):
                load, noise = self.load_and_noise(cells, averaging)
                self.assertGreater(load / exact - 1, low)
                self.assertLess(load / exact - 1, high)
                self.assertLess(noise, most_noise)

    def test_single_particles_lock(self):
        load, noise = self.load_and_noise(8, "none")
        self.assertGreater(load, 1.5 * (2 + math.pi))
        self.assertGreater(noise, 5)

class Cut(unittest.TestCase):
    """A vertical cut stands up to gamma H/s_u = 3.78."""

    def slide(self, ratio):
        _, directory, _ = run_case(self, "vertical-cut", "--set", "grid.spacing=0.125", "--set", f"material.0.yield={math.sqrt(3) / ratio}")
        return [numpy.abs(particle_data(read_vtk(frame))["displacement"]).max() for _, frame in frames(directory)[-2:]]

    def test_stands_below_and_slides_above(self):
        before, stands = self.slide(3.6)
        self.assertLess(stands, 0.035)
        self.assertLess(abs(stands - before), 0.001)
        self.assertGreater(self.slide(4.6)[1], 2 * stands)


class Column(unittest.TestCase):
    """How far planar columns reach, d = d0 (1 + 1.2 a) (Lube et al. 2005), on grids of 20 cells in their height."""

    def test_run_out(self):
        for aspect in (0.5, 2.0):
            with self.subTest(aspect):
                _, directory, _ = run_case(self, "granular-column", "--set", f"body.0.upper=[0.1, {0.1 * aspect}]",
                                           "--set", f"grid.spacing={min(0.005, 0.005 * aspect)}", "--set", "grid.size=[0.45, 0.25]", "--set", "time.end=0.5")
                data = read_vtk(frames(directory)[-1][1])
                x = vtk_to_numpy(data.GetPoints().GetData())[:, 0]
                self.assertAlmostEqual(numpy.quantile(x, 0.999) / (0.1 * (1 + 1.2 * aspect)), 1.0, delta=0.15)


if __name__ == "__main__":
    unittest.main()
