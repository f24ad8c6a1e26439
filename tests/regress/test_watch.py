"""What [watch] sets ends a run in the step it happens, with a message that says where; else it is a warning."""

import re

from harness import CASE, ROOT, TWO_DISKS, InTemporaryDirectory, contents, edit, frames, history, ordo, read_vtk

# Gravity along a periodic axis: the block falls for ever, and its speed is all that it gets.
FALLING = edit(
    CASE,
    ("end = 0.01", "end = 0.02"),
    ('shape = "ball"\ncenter = 0.5\nradius = 0.25\n', "shape = 'box'\nlower = 0.25\nupper = 0.75\n"),
    "[[boundary]]\nface = 'x-min'\ntype = 'periodic'\n",
)
GAINS = (TWO_DISKS, "--set", "method.preset=mpm", "--set", "watch.energy_growth=0.3", "--output", "out")


class Watch(InTemporaryDirectory):
    def run_case(self, *args):
        return ordo("run", *args, "--overwrite", "--quiet", "--threads", 1, cwd=self.dir)

    def assert_fails(self, *args, says):
        done = self.run_case(*args)
        self.assertEqual(done.returncode, 1, done.stderr)
        for text in says:
            self.assertIn(text, done.stderr)
        for _, path in frames(self.dir / "out"):
            read_vtk(path)
        self.assertEqual(frames(self.dir / "out")[-1][0], history(self.dir / "out")["time"][-1])

    def test_energy(self):
        self.assert_fails(*GAINS, says=("the method has added", "step ", "particle", "of body", "watch.energy_growth"))
        total = history(self.dir / "out")["total_energy"]
        self.assertGreater(total[-1], 1.3 * total[0])
        self.assertLessEqual(max(total[:-1]), 1.3 * total[0])

    def test_energy_that_is_not_fatal(self):
        done = self.run_case(*GAINS, "--set", "watch.fatal=[]")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stderr.count("the method has added"), 1)
        self.assertRegex(done.stderr, r"energy in \d+ steps")
        self.assertIn("fatal = []", (self.dir / "out" / "case.toml").read_text())

    def test_energy_of_gravity_is_no_growth(self):
        case = self.write("case.toml", edit(CASE, ("[grid]\n", "gravity = [0.0, -5.0]\n[grid]\n"), "[watch]\nenergy_growth = 0.01\n"))
        self.run_good(case, "--output", "out")
        self.assertGreater(history(self.dir / "out")["kinetic_energy"][-1], 0)

    def test_energy_of_gravity_along_a_period(self):
        case = self.write("case.toml", edit(FALLING, ("[grid]\n", "gravity = [5e4, 0.0]\n[grid]\n"), ("dt = 0.001", "dt = 0.0001"), "[watch]\nenergy_growth = 0.01\n"))
        self.run_good(case, "--output", "out")
        rows = history(self.dir / "out")
        self.assertGreater(rows["kinetic_energy"][-1] / rows["mass"][-1], 0.5 * (5e4 * 0.0195) ** 2)

    def test_energy_without_any_to_compare_with(self):
        """Silent: nothing has given energy yet."""
        self.run_good(self.write("case.toml", CASE), "--set", "watch.energy_growth=0")

    def test_energy_by_default(self):
        """README's block with methods that gain energy in its impact: they end, and are told what to choose."""
        block = re.search(r"```toml\n(.*?)```", (ROOT / "README.md").read_text(), re.S)[1]
        case = self.write("case.toml", block)
        for preset in ("impm", "mls-bsmpm", "tls-mpm", "tls-ddmpm", "tls-bsmpm"):
            with self.subTest(preset):
                done = self.run_case(case, "--overwrite", "--set", f"method.preset={preset}")
                self.assertEqual(done.returncode, 1, done.stderr)
                self.assertRegex(done.stderr, r"the method has added .*use cpls-limited or cpdi1")
        for preset in ("ugimp", "cpdi1", "cpdi2", "bscpdi2", "bsmpm", "apic"):
            with self.subTest(preset):
                self.run_good(case, "--overwrite", "--set", f"method.preset={preset}")

    def test_round_off_is_no_growth(self):
        """A stiff block at rest, with a load that begins at 0: round-off of the strain energy is far above what was given yet."""
        stiff = edit(CASE, ("young = 1000.0", "young = 1e9"), ("dt = 0.001", "cfl = 0.4"), ("end = 0.01", "end = 1e-3"))
        self.run_good(self.write("case.toml", stiff + 'body_force = ["1e-3*t", 0]\n'), "--output", "out")

    def test_work_is_no_growth(self):
        """A block that a plane pushes, a pressure presses and a force drives gains what these give, and no more."""
        self.write("case.toml", WORKED)
        self.run_good("case.toml", "--output", "out", "--set", "watch.energy_growth=0.02")
        seen = history(self.dir / "out")
        for column in ("boundary_work", "traction_work", "body_force_work"):
            self.assertLess(seen[column][-1], -1.0)

    def test_time_step_that_particles_outrun(self):
        case = self.write("case.toml", edit(FALLING, ("[grid]\n", "gravity = [2e4, 0.0]\n[grid]\n")))
        self.assert_fails(case, "--output", "out", "--set", "watch.fatal=['time-step']", says=("step ", "above the limit", "particle", "time.cfl"))
        done = self.run_case(case, "--output", "out")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("above the limit", done.stderr)

    def test_dropped_pivots(self):
        case = self.write("case.toml", edit(CASE, "particles_per_cell = 1\n[method]\npreset = 'wls'\n"))
        self.run_good(case, "--output", "out")
        self.assertGreater(history(self.dir / "out")["dropped_pivots"][-1], 0)
        self.assert_fails(case, "--output", "out", "--set", "watch.fatal=['dropped-pivots']", says=("pivots of fits were dropped, first near (", "step 1,"))

    def test_does_not_change_files(self):
        case = self.write("case.toml", edit(CASE, ("end = 0.01", "end = 0.1"), "velocity = '0.1*x'\n"))
        self.run_good(case, "--output", "plain")
        self.run_good(case, "--output", "watched", "--set", "watch.energy_growth=1e3")
        plain, watched = contents(self.dir / "plain"), contents(self.dir / "watched")
        self.assertEqual([name for name in plain if plain[name] != watched[name]], ["case.toml"])


WORKED = """\
[grid]
size = [1.6, 1.0]
spacing = 0.1
[time]
end = 0.2
[[material]]
name = "rubber"
density = 1000.0
young = 1e5
poisson = 0.3
[[body]]
material = "rubber"
shape = "box"
lower = [0.0, 0.0]
upper = [1.0, 0.6]
body_force = [0.0, "10*t"]
[[boundary]]
name = "piston"
face = "x-min"
at = 0.0
type = "velocity"
value = ["2*min(t, 0.1)", 0]
[[traction]]
body = "body 0"
face = "y-max"
value = "-5e4*t"
"""

SPLASH = """\
gravity = [0.0, -10.0]
[grid]
size = [1.6, 1.2]
spacing = 0.05
[method]
preset = "cpdi1"
linear_viscosity = 0.06
quadratic_viscosity = 1.5
[time]
end = 0.2
[[material]]
name = "water"
model = "fluid"
density = 1000.0
sound_speed = 20.0
viscosity = 1.0
[[body]]
material = "water"
shape = "box"
lower = [0.2, 0.1]
upper = [0.7, 0.5]
velocity = [2.0, -1.0]
[[body]]
material = "water"
shape = "box"
lower = [0.75, 0.1]
upper = [1.1, 0.6]
velocity = [-2.0, -1.0]
[[boundary]]
face = "y-min"
type = "wall"
friction = 0.2
"""


class ArtificialViscosity(InTemporaryDirectory):
    def test_energy_that_it_gives_is_a_gain(self):
        """In a splash of long, thin domains it pushes them apart; before, what it gave hid the growth, to 1e5 times the energy."""
        self.write("case.toml", SPLASH)
        done = ordo("run", "case.toml", "--quiet", "--output", "out", cwd=self.dir)
        self.assertIn("the method has added", done.stderr)
        self.assertLess(history(self.dir / "out")["artificial_viscosity_work"][-1], 0)


HANGING = """\
gravity = [0.0, -10.0]
[grid]
size = [0.6, 1.8]
spacing = 0.1
[time]
end = 0.5
[[material]]
name = "rubber"
density = 1000.0
young = 2e4
poisson = 0.3
[[body]]
material = "rubber"
shape = "box"
lower = [0.2, 0.8]
upper = [0.4, 1.8]
[[boundary]]
face = "y-max"
type = "fixed"
"""


class Gaps(InTemporaryDirectory):
    """A beam hangs from its upper end and stretches to twice its length there: points tear off their clamp, domains do not."""

    def hang(self, preset, *more):
        self.write("case.toml", HANGING)
        return ordo("run", "case.toml", "--quiet", "--overwrite", "--set", f"method.preset={preset}", *more, cwd=self.dir)

    def test_points_that_lose_contact(self):
        for preset in ("apic", "bsmpm", "polypic", "ddmpm"):
            with self.subTest(preset):
                done = self.hang(preset)
                self.assertIn("points of body 0", done.stderr)
                self.assertIn("(numerical fracture); use a method with particle domains that deform, such as cpdi1", done.stderr)
                self.assertNotIn("numerical fracture", self.hang(preset, "--set", "material.0.young=3e4").stderr)
        done = self.hang("apic", "--set", "watch.fatal=['gaps']")
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r"the run failed: step \d+, t = .*\(numerical fracture\)")

    def test_boxes_that_tear_are_fast(self):
        """What has torn off and left the grid says that it is faster than waves, and which methods hold."""
        done = self.hang("ugimp", "--set", "material.0.young=3e3")
        self.assertRegex(done.stderr, r"left the grid; .*moves at [\d.]+ m/s and waves in it at 2.01 m/s: .*use a method whose domains deform and turn \(cpdi1\)")

    def test_domains_hold(self):
        for preset in ("cpdi1", "bscpdi2"):
            with self.subTest(preset):
                done = self.hang(preset, "--set", "time.end=1")
                self.assertEqual((done.returncode, done.stderr), (0, ""))
