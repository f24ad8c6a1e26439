"""Stresses at the start: those that are given, in the state of each law, and the ground stays at rest under its weight."""

import unittest

import numpy
from vtk.util.numpy_support import vtk_to_numpy

from harness import InTemporaryDirectory, edit, frames, history, ordo, particle_data, read_vtk

ELASTIC = "young = 1e7\npoisson = 0.3\n"
GRAINS = "friction_angle = 30.0\ndilation_angle = 0.0\ncohesion = 2e3\n"
LAWS = {  # keys of the material; all have c and angles so that K0 = 0.5 lies inside
    "j2": ELASTIC + "yield = 1e5\n",
    "mohr-coulomb": ELASTIC + GRAINS + "tension_cutoff = 1e3\n",
    "drucker-prager": ELASTIC + GRAINS,
    "jaumann-elastic": ELASTIC,
    "cam-clay": "shear = 4e6\nswelling_index = 0.01\ncompression_index = 0.05\ncritical_slope = 1.2\nreference_pressure = 1e4\npreconsolidation = 6e4\n",
}

# A column of weight 1e4 Pa/m between rollers, 1 m below the surface of the ground.
COLUMN = """\
gravity = [0.0, -10.0]
[grid]
size = [0.4, 1.4]
spacing = 0.1
[time]
end = 0.2
[[material]]
name = "soil"
model = "{law}"
density = 1000.0
{keys}
[[body]]
name = "ground"
material = "soil"
shape = "box"
lower = [0.0, 0.0]
upper = [0.4, 1.0]
k0 = 0.5
surface = 2.0
[[traction]]
body = "ground"
face = "y-max"
type = "dead"
value = [0.0, -1e4]
[[boundary]]
face = ["x-min", "x-max"]
type = "symmetry"
[[boundary]]
face = "y-min"
type = "fixed"
[output]
interval = 0.05
fields = ["stress", "displacement"]
particles = "points"
"""
IN_3D = (
    ("gravity = [0.0, -10.0]", "gravity = [0.0, 0.0, -10.0]"),
    ("size = [0.4, 1.4]\nspacing = 0.1", "size = [0.4, 0.4, 1.2]\nspacing = 0.2"),
    ("lower = [0.0, 0.0]\nupper = [0.4, 1.0]", "lower = [0.0, 0.0, 0.0]\nupper = [0.4, 0.4, 1.0]"),
    ('face = "y-max"', 'face = "z-max"'),
    ("value = [0.0, -1e4]", "value = [0.0, 0.0, -1e4]"),
    ('face = ["x-min", "x-max"]', 'face = ["x-min", "x-max", "y-min", "y-max"]'),
    ('face = "y-min"\ntype', 'face = "z-min"\ntype'),
)

class Runs(InTemporaryDirectory):
    def run_case(self, text, *more, output="out"):
        self.run_good(self.write("case.toml", text), "--output", output, *more)
        return {name: numpy.array(column) for name, column in history(self.dir / output).items()}

    def particles(self, frame, output="out"):
        """Places, stresses and displacements of a frame."""
        data = read_vtk(frames(self.dir / output)[frame][1])
        fields = particle_data(data)
        return vtk_to_numpy(data.GetPoints().GetData()), fields["stress"].reshape(-1, 3, 3), fields["displacement"]

    def assert_refused(self, text, *says):
        done = ordo("check", self.write("case.toml", text), cwd=self.dir)
        self.assertEqual(done.returncode, 2, done.stderr)
        for one in says:
            self.assertIn(one, done.stderr)


class InitialStress(Runs):
    def assert_at_rest(self, case, axis, preset, moves=1e-9, changes=1e-9):
        """Stresses are those given, and stay. `moves`: of the settlement without k0; `changes`: of the largest stress."""
        self.run_case(case, "--set", f"method.preset={preset}")
        x, start, _ = self.particles(0)
        vertical = -1e4 * (2.0 - x[:, axis])
        for a in range(3):
            self.assertLess(abs(start[:, a, a] - (1.0 if a == axis else 0.5) * vertical).max(), 1e-9 * 2e4)
        _, end, moved = self.particles(-1)
        settled = 2e4 / 1e7  # what the weight would do without k0
        self.assertLess(abs(moved).max(), moves * settled)
        self.assertLess(abs(end - start).max(), changes * 2e4)

    def test_column_stays_at_rest(self):
        for law, keys in LAWS.items():
            case = COLUMN.format(law=law, keys=keys)
            for preset in ("mpm", "cpdi1", "cpdi2", "bscpdi2"):
                with self.subTest(law=law, preset=preset):
                    self.assert_at_rest(case, 1, preset)
            with self.subTest(law=law, dim=3):
                self.assert_at_rest(edit(case, *IN_3D), 2, "cpdi1")

    def test_methods_that_do_not_balance_a_linear_stress(self):
        """Without load; domains that spread beyond the surface move it by round-off times the stress over the mass there."""
        case = COLUMN.format(law="j2", keys=LAWS["j2"])
        case = case[: case.index("[[traction]]")] + case[case.index("[[boundary]]") :]
        case = edit(case, ("surface = 2.0\n", "overburden = 0.0\n"))
        for preset in ("ugimp", "bsmpm", "apic", "mls-bsmpm"):
            with self.subTest(preset):
                self.run_case(case, "--set", f"method.preset={preset}")
                _, start, _ = self.particles(0)
                _, end, moved = self.particles(-1)
                self.assertLess(abs(moved).max(), 1e-3 * 1e4 / 1e7)
                self.assertLess(abs(end - start).max(), 0.03 * 1e4)

    def test_without_it_the_column_falls(self):
        case = edit(COLUMN.format(law="j2", keys=LAWS["j2"]), ("k0 = 0.5\nsurface = 2.0\n", ""))
        self.run_case(case)
        self.assertGreater(abs(self.particles(-1)[2]).max(), 0.3 * 2e4 / 1e7)

    def test_layers_and_uniform_stress(self):
        """An overburden stands for a layer; the axis of gravity may be x; a uniform stress is as given."""
        one = COLUMN.format(law="j2", keys=LAWS["j2"])
        self.run_case(one)
        start = self.particles(0)[1]
        self.run_case(edit(one, ("surface = 2.0", "overburden = 1e4")))
        self.assertLess(abs(self.particles(0)[1] - start).max(), 1e-6)
        self.run_case(edit(one, ("k0 = 0.5\nsurface = 2.0", "initial_stress = [-1e3, -2e3, -3e3]")))
        self.assertLess(abs(self.particles(0)[1] - numpy.diag([-1e3, -2e3, -3e3])).max(), 1e-6)
        for changes, given in (((), [-1e3, -2e3, -3e3, 400.0]), (IN_3D, [-1e3, -2e3, -3e3, 400.0, 500.0, -600.0])):
            self.run_case(edit(one, ("k0 = 0.5\nsurface = 2.0", f"initial_stress = {given}"), *changes))
            xx, yy, zz, xy, yz, zx = [*given, 0.0, 0.0][:6]
            self.assertLess(abs(self.particles(0)[1] - numpy.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])).max(), 1e-6)

    def test_stiff_rock_near_the_surface(self):
        """Strains of 1e-9 leave few digits of the stress: that is round-off, not a yield surface."""
        stiff = LAWS["mohr-coulomb"].replace("1e7", "5e10").replace("1.0e7", "5e10")
        self.assertIn("5e10", stiff)
        path = self.write("case.toml", edit(COLUMN.format(law="mohr-coulomb", keys=stiff), ("surface = 2.0", "surface = 1.0")))
        done = ordo("check", path, cwd=self.dir)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_impossible_stresses_are_refused(self):
        one = COLUMN.format(law="mohr-coulomb", keys=LAWS["mohr-coulomb"])
        self.assert_refused(edit(one, ("k0 = 0.5", "k0 = 0.2")), "body[0].k0", "outside the yield surface of mohr-coulomb", "(0.")
        self.assert_refused(edit(one, ("model = \"mohr-coulomb\"\n", ""), (LAWS["mohr-coulomb"], ELASTIC)), "body[0].k0", "neo-hookean is a function of F")
        self.assert_refused(edit(one, ("surface = 2.0", "surface = 0.5")), "body[0].surface", "lies below the particle at")
        self.assert_refused(edit(one, ("gravity = [0.0, -10.0]\n", "")), "body[0].k0", "needs gravity along one axis")
        self.assert_refused(edit(COLUMN.format(law="cam-clay", keys=LAWS["cam-clay"]), ("k0 = 0.5\nsurface = 2.0", "initial_stress = [1e3, 1e3, 1e3]")), "body[0].initial_stress", "the elasticity of cam-clay cannot have")


if __name__ == "__main__":
    unittest.main()
