"""Walls: bodies rise from them freely, slide along them with Coulomb's friction, and are pushed by them."""

import itertools
import math
import re
import unittest

import numpy

from harness import InTemporaryDirectory, contents, has_hdf5, history, ordo, presets

GRAVITY = 10.0
BLOCK = (1.0, 0.5, 0.2)  # m, along the wall, across it, and along z
PARTICLE = 0.05  # m
BREAK_ALONE = ("tls-mpm", "tls-ddmpm", "tls-bsmpm")


def block_on_wall(dim, angle, preset, *, speed=0.0, friction=0.0, pull=0.0, end, velocity=None):
    """A case with a block on a wall that is turned by `angle` (degrees) against the grid's lines, and its particles.

    The block starts with `speed` away from the wall, to which gravity pulls it. If there is a `pull`, gravity grows from 0 in 0.3 s, so
    that the block settles without bouncing, then an acceleration along the wall grows from 0 to `pull` in 0.3 s. `velocity` is that of
    the wall."""
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    along, normal = numpy.array([c, s, 0]), numpy.array([-s, c, 0])
    corner = numpy.array([0.7, 0.4, 0.1])
    rows = ["x,y,z,volume,r1x,r1y,r1z,r2x,r2y,r2z,r3x,r3y,r3z" if dim == 3 else "x,y,volume,r1x,r1y,r2x,r2y"]
    half = PARTICLE / 2
    edges = (half * along, half * normal, numpy.array([0, 0, half]))[:dim]
    for k in itertools.product(*(range(round(length / PARTICLE)) for length in BLOCK[:dim])):
        at = [(i + 0.5) * PARTICLE for i in k] + [0] * (3 - dim)
        x = corner + at[0] * along + at[1] * normal + numpy.array([0, 0, at[2]])
        rows.append(",".join(repr(float(v)) for v in [*x[:dim], PARTICLE**dim, *(e[a] for e in edges for a in range(dim))]))

    def text(v):
        return "[" + ", ".join(repr(float(x)) for x in v[:dim]) + "]"

    weight, tilt = (f"sin(pi/2*min(1, max(0, t - {start})/0.3))^2" for start in (0.0, 0.3))
    force = ", ".join(f'"{float(GRAVITY * normal[a])!r}*(1 - {weight}) + {float(pull * along[a])!r}*{tilt}"' for a in range(dim))
    case = f"""\
gravity = {text(-GRAVITY * normal)}
[grid]
dim = {dim}
size = {text([3.0, 3.0, 0.4])}
spacing = 0.1
[method]
preset = "{preset}"
[time]
end = {end}
[[material]]
name = "rubber"
density = 1000.0
young = 1e6
poisson = 0.3
[[body]]
material = "rubber"
shape = "particles"
file = "block.csv"
velocity = {text(speed * normal)}
{f"body_force = [{force}]" if pull else ""}
[[boundary]]
type = "wall"
normal = {text(2 * normal)}
point = {text(corner)}
friction = {friction!r}
[output]
fields = ["velocity"]
interval = {end}
"""
    if velocity is not None:
        case = case.replace("friction =", f"value = {text(velocity * normal)}\nfriction =")
    return case, "\n".join(rows) + "\n", along


class Walls(InTemporaryDirectory):
    def run_block(self, *args, **options):
        case, particles, along = block_on_wall(*args, **options)
        self.write("block.csv", particles)
        self.run_good(self.write("case.toml", case), "--output", "out")
        return history(self.dir / "out"), along

    def assert_rises(self, dim, angle, preset):
        """By v^2/(2 g), because nothing holds the block back."""
        seen, _ = self.run_block(dim, angle, preset, speed=2.0, end=0.205)  # the top is at 0.2 s; `imls-mpm` makes energy soon after
        rise = (max(seen["potential_energy"]) - seen["potential_energy"][0]) / (seen["mass"][0] * GRAVITY)
        self.assertAlmostEqual(rise, 0.2, delta=0.002)

    def test_a_block_that_is_thrown_up_rises(self):
        """With every preset that takes a wall, on and off the grid's lines."""
        case, particles, _ = block_on_wall(2, 0, "mpm", end=0.25)
        self.write("block.csv", particles)
        self.write("case.toml", case)
        checks = {name: ordo("check", "case.toml", "--set", f"method.preset={name}", cwd=self.dir) for name in presets()}
        refused = {name for name, done in checks.items() if done.returncode == 2}
        self.assertEqual(refused, {"cpdi2e", "spline3", "spline4", "spline5"})
        for preset, angle in itertools.product(sorted(checks.keys() - refused), [0, 17, 45]):
            with self.subTest(dim=2, angle=angle, preset=preset):
                if angle == 45 and preset in BREAK_ALONE:
                    self.assert_breaks_without_wall(preset)
                else:
                    self.assert_rises(2, angle, preset)
        for preset, angle in itertools.product(["mpm", "ugimp", "cpdi1", "cpdi2", "apic", "bsmpm", "ddmpm"], [0, 17, 45]):
            with self.subTest(dim=3, angle=angle, preset=preset):
                self.assert_rises(3, angle, preset)

    def assert_breaks_without_wall(self, preset):
        """TLS loses a block at 45 degrees to the grid in free flight."""
        case, particles, _ = block_on_wall(2, 45, preset, speed=2.0, end=0.22)
        self.write("block.csv", particles)
        case = re.sub(r"point = .*", "point = [-5.0, -5.0]", re.sub(r"normal = .*", "normal = [1.0, 1.0]", case))
        done = ordo("run", self.write("case.toml", case), "--output", "out", "--overwrite", cwd=self.dir)
        self.assertEqual(done.returncode, 1, done.stderr)

    def test_symmetry_holds_it(self):
        case, particles, _ = block_on_wall(2, 0, "cpdi1", speed=2.0, end=0.25)
        self.write("block.csv", particles)
        wall = case[case.index('type = "wall"') : case.index("[output]")]
        self.run_good(self.write("case.toml", case.replace(wall, 'type = "symmetry"\nface = "y-min"\nat = 0.4\n')), "--output", "out")
        seen = history(self.dir / "out")
        self.assertLess(max(seen["potential_energy"]) - seen["potential_energy"][0], 0.05 * seen["mass"][0] * GRAVITY)

    def velocity_along(self, *args, **options):
        seen, along = self.run_block(*args, **options)
        momentum = sum(numpy.array(seen["momentum_" + "xy"[a]]) * along[a] for a in range(2))
        return numpy.array(seen["time"]), momentum / seen["mass"][0]

    def test_a_block_on_a_slope(self):
        """A slope of 30 degrees: the block's velocity grows by g (sin a - friction cos a), or the block stays."""
        pull = GRAVITY * math.tan(math.radians(30))
        for angle, preset in itertools.product([0, 17, 30], ["cpdi1", "ugimp", "apic", "bsmpm", "ddmpm"]):
            with self.subTest("it slides", angle=angle, preset=preset):
                t, v = self.velocity_along(2, angle, preset, friction=0.3, pull=pull, end=1.1)
                late = t > 0.65
                grows = numpy.polyfit(t[late], v[late], 1)[0]
                self.assertAlmostEqual(grows / (pull - 0.3 * GRAVITY), 1, delta=0.01)
            with self.subTest("it stays", angle=angle, preset=preset):
                t, v = self.velocity_along(2, angle, preset, friction=1.2 * pull / GRAVITY, pull=pull, end=1.6)
                late = t > 0.6  # the second after the tilt
                moved = float(numpy.sum((v[1:] * numpy.diff(t))[late[1:]]))
                self.assertLess(abs(moved), 1e-3 * GRAVITY * 1.0**2 / 2)

    def test_a_wall_that_moves(self):
        case, particles, _ = block_on_wall(2, 17, "cpdi1", end=0.2, velocity=1.5)
        self.write("block.csv", particles)
        path = self.write("case.toml", case)
        self.run_good(path, "--output", "out")
        seen = history(self.dir / "out")
        raised = (seen["potential_energy"][-1] - seen["potential_energy"][0]) / (seen["mass"][0] * GRAVITY)
        self.assertGreater(raised, 0.28)  # the wall has come 0.3 m, the block bounces

    @unittest.skipUnless(has_hdf5(), "checkpoints need HDF5")
    def test_a_wall_that_moves_goes_on_after_a_restart(self):
        case, particles, _ = block_on_wall(2, 17, "cpdi1", end=0.2, friction=0.3, velocity=1.5)
        self.write("block.csv", particles)
        path = self.write("case.toml", case + "[checkpoint]\nsteps = 60\n")
        self.run_good(path, "--output", "whole")
        self.run_good(path, "--output", "parts", "--set", "time.end=0.1")
        self.run_good(path, "--output", "parts", "--restart", "latest")
        self.assertEqual(contents(self.dir / "whole"), contents(self.dir / "parts"))

    def test_bad_input(self):
        case, particles, _ = block_on_wall(2, 0, "mpm", end=0.1)
        self.write("block.csv", particles)
        for change, says in (
            (("normal = [-0.0, 2.0]\n", ""), "normal and point"),
            (("normal = [-0.0, 2.0]", "normal = [0.0, 0.0]"), "must not be zero"),
            (("normal = [-0.0, 2.0]", "normal = [0.0, -1.0]"), "lies in a wall"),
            (("type = \"wall\"", "type = \"wall\"\nface = \"y-min\""), "cannot be with face"),
            (("type = \"wall\"", "type = \"fixed\""), "for type \"wall\" only"),
            (("friction = 0.0", "friction = -1.0"), "friction"),
        ):
            with self.subTest(says):
                self.assertIn(change[0], case)
                done = ordo("check", self.write("bad.toml", case.replace(*change)), cwd=self.dir)
                self.assertEqual(done.returncode, 2, done.stdout)
                self.assertIn(says, done.stderr)
                self.assertIn("bad.toml:", done.stderr)


if __name__ == "__main__":
    unittest.main()
