"""Soils that fail, against limit loads and run-out laws."""

import math
import unittest

import numpy
from harness import frames, particle_data, read_vtk
from test_cases import run_case

STRENGTH = 0.002  # s_u of cases/strip-footing, Pa


class Footing(unittest.TestCase):
    """Prandtl's load of clay, (2 + pi) s_u B; materials of nearly constant volume lock without averages."""

    def load_and_noise(self, cells, averaging):
        spacing = 1 / cells
        columns, directory, _ = run_case(self, "strip-footing", "--set", f"method.averaging={averaging}", "--set", f"grid.spacing={spacing}",
                                         "--set", "method.preset=ugimp")
        force = columns["footing_force_y"]
        data = read_vtk(frames(directory)[-1][1])
        particles = particle_data(data)
        x = numpy.array([data.GetCell(k).GetBounds() for k in range(data.GetNumberOfCells())])
        cell = numpy.floor((x[:, 0] + x[:, 1]) / 2 / spacing) * 1000 + numpy.floor((x[:, 2] + x[:, 3]) / 2 / spacing)
        spread = [numpy.var(particles["pressure"][cell == k]) for k in numpy.unique(cell)]
        return -2 * force[-len(force) // 20:].mean() / STRENGTH, math.sqrt(numpy.mean(spread)) / STRENGTH

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


if __name__ == "__main__":
    unittest.main()
