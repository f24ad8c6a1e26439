"""Stages: gravity relaxes, laws, bodies and boundaries change, in one run that restarts."""

import re
import shutil
import unittest

import numpy

from harness import contents, edit, frames, has_hdf5, history, ordo
from test_initial_stress import COLUMN, ELASTIC, LAWS, Runs

# A cut of 0.4 x 0.4 m at the left of a ground of 1.6 x 1 m, first elastic under its weight.
CUT = """\
gravity = [0.0, -10.0]
[grid]
size = [1.6, 1.2]
spacing = 0.1
[[material]]
name = "first"
density = 1000.0
young = 1e6
poisson = 0.3
[[material]]
name = "soil"
model = "mohr-coulomb"
density = 1000.0
young = 1e6
poisson = 0.3
friction_angle = 30.0
dilation_angle = 0.0
cohesion = 1e3
tension_cutoff = 500.0
[[body]]
name = "ground"
material = "first"
shape = "box"
lower = [0.0, 0.0]
upper = [1.6, 0.6]
[[body]]
name = "bank"
material = "first"
shape = "box"
lower = [0.4, 0.6]
upper = [1.6, 1.0]
[[body]]
name = "fill"
material = "first"
shape = "box"
lower = [0.0, 0.6]
upper = [0.4, 1.0]
[[boundary]]
face = ["x-min", "x-max"]
type = "symmetry"
[[boundary]]
face = "y-min"
type = "fixed"
[[boundary]]
name = "strut"
region = {shape = "box", lower = [0.35, 0.6], upper = [0.45, 1.0]}
type = "fixed"
stages = ["dig"]
[[traction]]
name = "load"
body = "bank"
face = "y-max"
value = 2e3
stages = ["load"]
[[stage]]
name = "gravity"
duration = 4.0
residual = 1e-3
damping = "kinetic"
[[stage]]
name = "dig"
duration = 0.1
materials = {ground = "soil", bank = "soil"}
remove = ["fill"]
[[stage]]
name = "load"
duration = 0.2
damping = "local"
factor = 0.7
[output]
interval = 0.05
fields = ["stress", "displacement"]
particles = "points"
per_body = true
[[probe]]
name = "fill"
particle = [0.2, 0.8]
[[probe]]
name = "toe"
particle = [0.45, 0.65]
"""


def whole(seen):
    names = ("total_energy", "potential_energy", "dissipated_energy", "boundary_work", "traction_work", "damped_energy", "stage_energy")
    return sum(seen[name] for name in names if name in seen)


class Stages(Runs):
    def test_excavation(self):
        """The first stage ends at rest, before its time, with the weight above as stress; then the fill is gone, and each boundary
        and traction acts in its stage; the energies of all rows add up."""
        seen = self.run_case(CUT)
        stage, t, dt = seen["stage"], seen["time"], seen["dt"]
        self.assertEqual(sorted(set(stage)), [0, 1, 2])
        last = [int(numpy.flatnonzero(stage == k)[-1]) for k in range(3)]
        self.assertLess(t[last[0]], 3.0)
        self.assertAlmostEqual(t[last[0] + 1], 4.0 + dt[last[0] + 1], 9)
        self.assertAlmostEqual(t[last[1]], 4.1, 9)
        self.assertAlmostEqual(t[last[2]], 4.3, 9)
        self.assertLess(seen["kinetic_energy"][last[0]], 1e-6 * seen["strain_energy"][last[0]])
        # At rest: stresses at the end of the stage are the weight above.
        k = [time for time, _ in frames(self.dir / "out")].index(t[last[0]])
        x, stress, _ = self.particles(k)
        inner = (x[:, 1] < 0.85) & (x[:, 1] > 0.15)
        self.assertLess(abs(stress[:, 1, 1] + 1e4 * (1.0 - x[:, 1]))[inner].max(), 0.035 * 1e4)  # h/4 and the settlement
        # The fill is gone, and its mass with it.
        self.assertAlmostEqual(seen["mass"][last[0]], 1600.0, 6)
        self.assertAlmostEqual(seen["mass"][last[1]], 1440.0, 6)
        self.assertEqual(len(self.particles(-1)[0]), len(x) - 64)
        self.assertLess(history(self.dir / "out", "body_2.csv")["time"][-1], 3.0)
        self.assertLess(history(self.dir / "out", "probe_fill.csv")["time"][-1], 3.0)
        self.assertAlmostEqual(history(self.dir / "out", "probe_toe.csv")["time"][-1], 4.3, 9)
        # Each acts in its stage only.
        for column, own in (("strut_force_x", 1), ("load_force_y", 2)):
            size = [abs(seen[column][stage == k]).max() for k in range(3)]
            for other in {0, 1, 2} - {own}:
                self.assertEqual(size[other], 0.0)
            self.assertGreater(size[own], 100.0)
        self.assertAlmostEqual(seen["load_force_y"][last[2]], -2e3 * 1.2, delta=20)
        # The law yields at the wall of the cut, and not before.
        self.assertEqual(seen["dissipated_energy"][last[0]], 0.0)
        self.assertGreater(seen["dissipated_energy"][last[2]], 0.0)
        self.assertLess(abs(whole(seen) - whole(seen)[0]).max(), 0.03 * abs(seen["potential_energy"] - seen["potential_energy"][0])[: last[0]].max())

    def test_new_law_keeps_the_stress(self):
        """From a function of F to laws with elastic strain or stress: within the yield surface nothing moves."""
        for law, keys in LAWS.items():
            with self.subTest(law):
                case = edit(COLUMN.format(law="neo-hookean", keys=ELASTIC), ("k0 = 0.5\nsurface = 2.0\n", ""), ("end = 0.2\n", ""))
                case += f'[[material]]\nname = "next"\nmodel = "{law}"\ndensity = 1000.0\n{keys}'
                case += '[[stage]]\nname = "rest"\nduration = 3.0\nresidual = 1e-4\ndamping = "kinetic"\n'
                case += '[[stage]]\nname = "next"\nduration = 0.02\nmaterials = {ground = "next"}\n'
                seen = self.run_case(case)
                times = [t for t, _ in frames(self.dir / "out")]
                k = max(n for n, t in enumerate(times) if t < 3.0)
                before, after = self.particles(k)[1], self.particles(-1)[1]
                self.assertGreater(times[-1], 3.0)
                self.assertGreater(abs(before).max(), 1.8e4)
                self.assertLess(abs(after - before).max(), 1e-3 * 2e4)
                self.assertEqual(seen["dissipated_energy"][-1], 0.0)

    def test_stress_that_a_new_law_cannot_have(self):
        """Clay has pressure always, and a column without weight and load has none."""
        case = edit(COLUMN.format(law="neo-hookean", keys=ELASTIC), ("k0 = 0.5\nsurface = 2.0\n", ""), ("end = 0.2\n", ""),
                    ("gravity = [0.0, -10.0]\n", ""), ("value = [0.0, -1e4]", "value = [0.0, 0.0]"))
        case += f'[[material]]\nname = "next"\nmodel = "cam-clay"\ndensity = 1000.0\n{LAWS["cam-clay"]}'
        case += '[[stage]]\nname = "rest"\nduration = 0.01\n[[stage]]\nname = "next"\nduration = 0.01\nmaterials = {ground = "next"}\n'
        done = ordo("run", self.write("case.toml", case), "--output", "out", "--quiet", cwd=self.dir)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertRegex(done.stderr, r"t = 0.01 s: particle \d+ of body 0 at \(.*\): the law cam-clay of its new material cannot have its stress")
        self.assertEqual(len(frames(self.dir / "out")), 2)

    def test_residual_that_is_not_reached(self):
        case = self.write("case.toml", edit(CUT, ("duration = 4.0", "duration = 0.02")))
        done = ordo("run", case, "--output", "out", "--quiet", cwd=self.dir)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertRegex(done.stderr, r'stage "gravity" ends with a residual of [0-9.e+-]+, above 0.001: .*a longer duration')

    def test_no_rest_at_a_peak(self):
        """Undamped, the column swings through turning points and peaks of kinetic energy, and none of them is rest."""
        case = edit(CUT, ('residual = 1e-3\ndamping = "kinetic"', "residual = 0.05"), ("duration = 4.0", "duration = 0.5"))
        done = ordo("run", self.write("case.toml", case), "--output", "out", "--quiet", cwd=self.dir)
        self.assertEqual(done.returncode, 1, done.stderr)

    def test_check_shows_stages(self):
        done = ordo("check", self.write("case.toml", CUT), cwd=self.dir)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn('# stage "gravity": t = 0 to 4 s, to a residual of 0.001, kinetic damping\n', done.stdout)
        self.assertRegex(done.stdout, '# stage "dig": t = 4 to 4.1 s; without "fill"; "bank" becomes soil; .*"ground" becomes soil\n')
        self.assertIn("end = 4.3", done.stdout)
        again = ordo("check", self.write("again.toml", done.stdout), cwd=self.dir)
        self.assertEqual(re.sub(r"results/\w+", "", again.stdout), re.sub(r"results/\w+", "", done.stdout))

    @unittest.skipUnless(has_hdf5(), "checkpoints need HDF5")
    def test_restart_in_each_stage(self):
        """A run that is stopped in any stage and goes on, and one on other threads, write the same bytes."""
        case = self.write("case.toml", CUT + "[checkpoint]\nsteps = 1\nkeep = 100000\n")
        for preset in ("cpdi1", "cpdi2", "bsmpm"):
            more = ("--set", f"method.preset={preset}", "--set", "stage.0.residual=0.02", "--set", "grid.spacing=0.2")
            shutil.rmtree(self.dir / "whole", ignore_errors=True)
            self.run_good(case, "--output", "whole", *more)
            results = contents(self.dir / "whole")
            seen = history(self.dir / "whole")
            firsts = [seen["stage"].index(k) for k in range(3)]
            self.run_good(case, "--output", "threads", *more, "--threads", "3")
            self.assertEqual(results, contents(self.dir / "threads"))
            for step in (5, firsts[1] - 1, firsts[1], firsts[1] + 3, firsts[2] - 1, firsts[2] + 4):
                with self.subTest(preset=preset, step=step):
                    shutil.rmtree(self.dir / "parts", ignore_errors=True)
                    shutil.copytree(self.dir / "whole", self.dir / "parts")
                    self.run_good(case, "--output", "parts", *more, "--restart", self.dir / "parts" / f"checkpoint_{step:09}.h5")
                    parts = contents(self.dir / "parts")
                    self.assertEqual(results.keys(), parts.keys())
                    self.assertEqual([name for name in results if results[name] != parts[name]], [])


if __name__ == "__main__":
    unittest.main()
