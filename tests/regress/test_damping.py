"""Damping: energies decay as given, loads come to rest at their static stress, and `damped_energy` closes the balance."""

import unittest

import numpy
from vtk.util.numpy_support import vtk_to_numpy

from harness import InTemporaryDirectory, contents, frames, has_hdf5, history, particle_data, read_vtk

# A block in free flight, which also vibrates if its velocity varies.
FLYING = """\
[grid]
size = [4.0, 1.0]
spacing = 0.1
[time]
end = 1.0
[[material]]
name = "rubber"
density = 1000.0
young = 1e5
poisson = 0.3
[[body]]
material = "rubber"
shape = "box"
lower = [0.3, 0.3]
upper = [0.8, 0.8]
velocity = [1.0, 0.0]
[damping]
type = "viscous"
rate = 0.5
"""

# A bar of length 1 between rollers in its first mode: v = 0.02 sin(pi x/2), frequency (pi/2) c.
BAR = """\
[grid]
dim = 1
size = 1.2
spacing = 0.025
[time]
end = 2.0
[[material]]
name = "steel"
density = 1000.0
young = 1e5
poisson = 0.0
[[body]]
material = "steel"
shape = "box"
lower = 0.0
upper = 1.0
velocity = "0.02*sin(pi*x/2)"
[[boundary]]
face = "x-min"
type = "fixed"
[damping]
type = "viscous"
rate = 1.0
"""

# A column under its weight, which shortens by 0.4 %.
COLUMN = """\
gravity = [0.0, -10.0]
[grid]
size = [0.2, 1.2]
spacing = 0.1
[time]
end = 1.5
[[material]]
name = "soil"
density = 1000.0
young = 1e6
poisson = 0.3
[[body]]
material = "soil"
shape = "box"
lower = [0.0, 0.0]
upper = [0.2, 1.0]
[[boundary]]
face = ["x-min", "x-max"]
type = "symmetry"
[[boundary]]
face = "y-min"
type = "fixed"
[output]
interval = 0.5
fields = ["stress"]
particles = "points"
"""
LOCAL, KINETIC = '[damping]\ntype = "local"\nfactor = 0.7\n', '[damping]\ntype = "kinetic"\n'
PRESETS = ("mpm", "ugimp", "cpdi1", "apic", "cpdi2", "bsmpm", "mls-bsmpm", "polypic", "usf", "musl")


def whole(seen):
    """All energies and works of each row: constant up to the error of the method."""
    names = ("total_energy", "potential_energy", "dissipated_energy", "boundary_work", "traction_work", "body_force_work", "damped_energy")
    return sum(numpy.array(seen[name]) for name in names)


class Damping(InTemporaryDirectory):
    def run_case(self, text, *more):
        self.run_good(self.write("case.toml", text), "--output", "out", *more)
        return {name: numpy.array(column) for name, column in history(self.dir / "out").items()}

    def test_free_flight(self):
        """The velocity decays by exp(-rate t) in each step, so to round-off."""
        seen = self.run_case(FLYING)
        kinetic = seen["kinetic_energy"]
        self.assertLess(abs(kinetic / kinetic[0] - numpy.exp(-2 * 0.5 * seen["time"])).max(), 1e-10)
        self.assertLess(abs(whole(seen) / kinetic[0] - 1).max(), 1e-10)

    def test_vibration(self):
        """Damping by velocity takes rate/2 from the exponent of the amplitude, so the energy decays by exp(-rate t)."""
        seen = self.run_case(BAR)
        energy, t = seen["total_energy"], seen["time"]
        period = 4 / numpy.sqrt(1e5 / 1000)
        start = energy[t < period].mean()
        for k in (1, 2, 4):
            window = (t >= k * period) & (t < (k + 1) * period)
            self.assertAlmostEqual(energy[window].mean() / start, numpy.exp(-k * period), delta=0.01)
        self.assertLess(abs(whole(seen) / energy[0] - 1).max(), 0.02)

    def test_column_comes_to_rest(self):
        """The stress is the weight above, with no oscillation left. Undamped, the column swings to twice the static settlement, so
        damping takes a quarter of what gravity gives there."""
        free = self.run_case(COLUMN)
        given = abs(free["potential_energy"] - free["potential_energy"][0]).max()
        self.assertGreater(free["kinetic_energy"][-200:].max(), 0.1 * given)
        for damping in (LOCAL, KINETIC):
            for preset in PRESETS:
                with self.subTest(damping=damping, preset=preset):
                    more = ("--set", f"method.scheme={preset}") if preset in ("usf", "musl") else ("--set", f"method.preset={preset}")
                    seen = self.run_case(COLUMN + damping, *more)
                    self.assertLess(seen["kinetic_energy"][-200:].max(), 1e-6 * given)
                    self.assertAlmostEqual(seen["damped_energy"][-1] / given, 0.25, delta=0.025)
                    self.assertTrue((numpy.diff(seen["damped_energy"]) >= 0).all())
                    self.assertLess(abs(whole(seen) - whole(seen)[0]).max(), 0.05 * given)
                    last = read_vtk(frames(self.dir / "out")[-1][1])
                    depth = 1.0 - vtk_to_numpy(last.GetPoints().GetData())[:, 1]
                    stress = particle_data(last)["stress"].reshape(-1, 9)
                    inner = depth > 0.1  # the free surface is smeared over a cell
                    error = stress[:, 4] + 1e4 * depth
                    self.assertLess(abs(error)[inner].max(), 0.035 * 1e4)  # hats: the stress of a cell is constant, h/4 off at its particles
                    means = [error[inner][(depth[inner] // 0.1) == k].mean() for k in range(1, 10)]
                    self.assertLess(abs(numpy.array(means)).max(), 0.01 * 1e4)
                    self.assertLess(abs(stress[:, 0] - 0.3 / 0.7 * stress[:, 4])[inner].max(), 0.01 * 1e4)

    @unittest.skipUnless(has_hdf5(), "checkpoints need HDF5")
    def test_restart_and_threads(self):
        """The same bytes in one part, and in two on different numbers of threads."""
        for damping in (LOCAL, KINETIC, '[damping]\ntype = "viscous"\nrate = 10.0\n'):
            with self.subTest(damping):
                case = self.write("case.toml", COLUMN + "[checkpoint]\nsteps = 37\n" + damping)
                short = ("--set", "output.interval=0.04", "--overwrite")
                self.run_good(case, "--output", "whole", *short, "--set", "time.end=0.3")
                self.run_good(case, "--output", "parts", *short, "--set", "time.end=0.17", "--threads", "3")
                self.run_good(case, "--output", "parts", *short[:2], "--set", "time.end=0.3", "--restart", "latest")
                whole, parts = contents(self.dir / "whole"), contents(self.dir / "parts")
                self.assertEqual(whole.keys(), parts.keys())
                self.assertEqual([name for name in whole if whole[name] != parts[name]], [])


if __name__ == "__main__":
    unittest.main()
