"""Images: a case moved along a periodic axis, an obstacle written a period further, and half of a case between planes of symmetry do the same."""

import re
import unittest

import numpy
from harness import InTemporaryDirectory, history, ordo

START = """\
gravity = [0.0, -5.0]
[grid]
size = [2.0, 1.0]
spacing = 0.1
[time]
end = 0.06
[[material]]
name = "m"
density = 1000.0
young = 1e6
poisson = 0.3
[[boundary]]
face = "x-min"
type = "periodic"
"""


def method(preset, *lines):
    return f'[method]\npreset = "{preset}"\n' + "".join(line + "\n" for line in lines)


class Images(InTemporaryDirectory):
    def run_case(self, text, *args):
        self.run_good(self.write("case.toml", text), "--output", "out", *args)
        return {name: numpy.array(column) for name, column in history(self.dir / "out").items()}

    def assert_same(self, one, other, names, part=1e-9):
        for name in names:
            self.assertLess(numpy.abs(one[name] - other[name]).max(), part * max(1e-3, numpy.abs(one[name]).max()), name)


class Obstacles(Images):
    """A block falls on an obstacle whose image lies below it."""

    BLOCK = '[[body]]\nname = "a"\nmaterial = "m"\nshape = "box"\nlower = [0.7, 0.5]\nupper = [1.3, 0.8]\nvelocity = [0.3, -1.0]\n'
    NAMES = ("momentum_x", "momentum_y", "total_energy", "o_force_x", "o_force_y", "o_moment_z", "o_rotation_z", "o_work")

    def seen_at(self, preset, obstacle, moved):
        lower, upper, center = ([x + moved, y] for x, y in ((0.6, 0.2), (1.4, 0.5), (1.0, 0.2)))
        shape = f'shape = "box"\nlower = {lower}\nupper = {upper}\n' if "box" in obstacle else f'shape = "ball"\ncenter = {center}\nradius = 0.3\n'
        rest  = {"box turns": "rotation = 1.0\nfriction = 0.4\n", "ball with mass": "mass = 100.0\nfriction = 0.4\n", "box tied": 'type = "tied"\nvelocity = [0.5, 0.1]\n'}[obstacle]
        scheme = ('scheme = "musl"',) if preset == "mpm" else ()
        return self.run_case(START + method(preset, *scheme) + self.BLOCK + '[[obstacle]]\nname = "o"\n' + shape + rest)

    def test_one_written_a_period_further(self):
        for preset, obstacle in (("cpdi1", "box turns"), ("mpm", "box turns"), ("cpdi1", "ball with mass"), ("cpdi1", "box tied")):
            here = self.seen_at(preset, obstacle, 0.0)
            self.assertGreater(numpy.abs(here["o_force_y"]).max(), 100)
            for moved in (2.0, -2.0):
                with self.subTest(preset, obstacle=obstacle, moved=moved):
                    self.assert_same(here, self.seen_at(preset, obstacle, moved), self.NAMES)

    def test_too_deep_in_an_image(self):
        deep = self.BLOCK.replace("[0.7, 0.5]", "[0.7, 0.3]")
        for moved in (0.0, 2.0, -4.0):
            text = START + method("cpdi1") + deep + f'[[obstacle]]\nshape = "box"\nlower = [{0.6 + moved}, 0.2]\nupper = [{1.4 + moved}, 0.5]\n'
            done = ordo("check", self.write("case.toml", text), cwd=self.dir)
            self.assertEqual(done.returncode, 2, done.stderr)

    def test_a_half_space_does_not_turn_into_the_seam(self):
        text = START + method("cpdi1") + self.BLOCK + '[[obstacle]]\nshape = "half-space"\npoint = [0.0, 0.5]\nnormal = [0.0, 1.0]\nrotation = 0.1\n'
        done = ordo("check", self.write("case.toml", text), cwd=self.dir)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("rotation", done.stderr)


class Tied(Images):
    def test_bodies_tied_across_the_seam(self):
        """Two halves of a ring of material, tied where they touch, in the middle of the grid and at its seam."""
        def seen(moved):
            boxes = "".join(f'[[body]]\nname = "{name}"\nmaterial = "m"\nshape = "box"\nlower = [{lower + moved:.3f}, 0.3]\nupper = [{lower + 0.5 + moved:.3f}, 0.7]\n'
                            f'velocity = {speed}\n' for name, lower, speed in (("a", 0.1, [0, 0.2]), ("b", 0.6, [0.1, -0.2])))
            return self.run_case(START + method("cpdi1") + boxes + '[[contact]]\nbodies = "all"\ntype = "tied"\n')
        here, across = seen(0.0), seen(1.4)
        self.assertGreater(numpy.abs(here["contact_0_force_y"]).max(), 100)
        self.assert_same(here, across, ("momentum_x", "momentum_y", "kinetic_energy", "strain_energy"), 1e-7)


class Tractions(Images):
    def test_on_a_body_across_the_seam(self):
        """The nodal forces of quadratures and those of faces, which both have images."""
        for preset, lines in (("impm", ()), ("impm-adjoint", ()), ("tls-mpm", ()), ("cpdi1", ('quadrature = "gauss"',)), ("cpdi1", ())):
            def seen(moved):
                body = f'[[body]]\nname = "a"\nmaterial = "m"\nshape = "box"\nlower = [{0.5 + moved}, 0.3]\nupper = [{1.0 + moved}, 0.7]\n'
                return self.run_case(START + method(preset, *lines) + body + '[[traction]]\nname = "push"\nbody = "a"\nface = ["x-min", "y-max"]\nvalue = "2000*t"\n')
            with self.subTest(preset, lines=lines):
                here, across = seen(0.0), seen(1.1)
                self.assert_same(here, across, ("momentum_x", "momentum_y", "traction_work"), 1e-8)
                self.assertAlmostEqual(here["momentum_x"][-1], 1.44, delta=0.02)


class Halves(Images):
    """A block in 3D that sticks to the ground: whole, and half of it on a plane of symmetry."""

    @staticmethod
    def block(low, contact, sweeps, high=0.2):
        return f"""\
gravity = [0.0, -10.0, 0.0]
[grid]
origin = [0.0, 0.0, {2 * low}]
size = [1.2, 0.7, {(high if high < 0.2 else 0.4) - 2 * low}]
spacing = 0.1
[method]
preset = "cpdi1"
[time]
end = 0.05
[[material]]
name = "m"
density = 1000.0
young = 1e6
poisson = 0.3
[[body]]
name = "a"
material = "m"
shape = "box"
lower = [0.4, 0.3, {low}]
upper = [0.8, 0.5, {high}]
velocity = [0.5, -0.2, 0.0]
[[obstacle]]
name = "o"
shape = "half-space"
point = [0.0, 0.3, 0.0]
normal = [0.0, 1.0, 0.0]
{contact}
sweeps = {sweeps}
""" + ('[[boundary]]\nface = ["z-min"' + (', "z-max"' if high < 0.2 else "") + ']\ntype = "symmetry"\n' if low == 0 else "")

    def test_a_slab_as_thick_as_a_cell(self):
        """Between two planes of symmetry it sticks as in 2D, however many sweeps."""
        for sweeps in (1, 10):
            with self.subTest(sweeps=sweeps):
                slab = self.run_case(self.block(0.0, 'type = "no-slip"', sweeps, high=0.1))
                flat = self.run_case(re.sub(r"\[([^][,]+), ([^][,]+), [^][,]+\]", r"[\1, \2]", self.block(0.0, 'type = "no-slip"', sweeps, high=0.1)).split("[[boundary]]")[0])
                for name in ("momentum_x", "momentum_y", "o_friction_work"):
                    self.assertLess(numpy.abs(10 * slab[name] - flat[name]).max(), 0.02 * numpy.abs(flat[name]).max(), name)

    def test_half_of_a_block(self):
        for contact in ('type = "no-slip"', "friction = 0.8"):
            with self.subTest(contact):
                whole, half = (self.run_case(self.block(low, contact, 8)) for low in (-0.2, 0.0))
                for name in ("momentum_x", "momentum_y", "o_friction_work", "total_energy"):
                    self.assertLess(numpy.abs(2 * half[name] - whole[name]).max(), 0.01 * numpy.abs(whole[name]).max(), name)
                self.assertGreater(whole["o_friction_work"][-1], 0)


if __name__ == "__main__":
    unittest.main()
