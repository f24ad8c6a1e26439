"""A law with history that is one header and one row (tests/own_law): read, sorted, written, checkpointed and restarted without a
change elsewhere. Its stresses are those of jaumann-elastic, byte by byte.

ORDO_OWN_LAW is the path of the program that has it.
"""

import os
import subprocess
import unittest
from unittest import mock

import harness
import numpy
from harness import CASE, ORDO, InTemporaryDirectory, contents, edit, frames, has_hdf5, particle_data, read_vtk

OWN = os.environ["ORDO_OWN_LAW"]
STEPS = 30
# Two bodies side by side of both laws, which drift some cells through a periodic box, so that particles are sorted and batches
# are of both. The wave from the first to the second makes stresses.
BOTH = edit(
    CASE,
    ("spacing = 0.25", "spacing = 0.0625"),
    ("end = 0.01\ndt = 0.001", "end = 0.006\ndt = 0.0002"),
    ('name = "rubber"\n', 'name = "rubber"\nmodel = "jaumann-elastic"\n'),
    ('shape = "ball"\ncenter = 0.5\nradius = 0.25\n', "shape = 'box'\nlower = [0.25, 0.25]\nupper = [0.5, 0.75]\nvelocity = '20 + sin(7*x)'\n"),
    '[[material]]\nname = "counting"\nmodel = "jaumann-elastic"\ndensity = 1000.0\nyoung = 2000.0\npoisson = 0.3\n'
    "[[body]]\nmaterial = 'counting'\nshape = 'box'\nlower = [0.5, 0.25]\nupper = [0.75, 0.75]\nvelocity = '20'\n"
    "[[boundary]]\nface = ['x-min', 'y-min']\ntype = 'periodic'\n"
    "[output]\ninterval = 0.003\nfields = ['velocity', 'stress', 'energy_density']\n"
    "[checkpoint]\nsteps = 6\n",
)
COUNTING = edit(
    BOTH,
    ('name = "counting"\nmodel = "jaumann-elastic"\n', 'name = "counting"\nmodel = "step-counter"\nweight = 2.5\n'),
    ("'energy_density'", "'energy_density', 'steps_seen', 'time_seen'"),
)


@unittest.skipUnless(has_hdf5(), "ordo was built without HDF5")
class OwnLaw(InTemporaryDirectory):
    def setUp(self):
        super().setUp()
        own = mock.patch.object(harness, "ORDO", OWN)
        own.start()
        self.addCleanup(own.stop)

    def run_own(self, text, output, *args):
        self.write("case.toml", text)
        self.run_good("case.toml", "--output", output, *args)
        return [particle_data(read_vtk(path)) for _, path in frames(self.dir / output)]

    def test_history_is_carried(self):
        for preset in ("cpdi1", "bsmpm", "cpdi2"):
            for scheme in ("usf", "usl", "musl"):
                with self.subTest(preset, scheme=scheme):
                    changes = ("--set", f"method.preset={preset}", "--set", f"method.scheme={scheme}")
                    plain = self.run_own(BOTH, f"{preset}-{scheme}-plain", *changes)
                    counted = self.run_own(COUNTING, f"{preset}-{scheme}", *changes)
                    self.assertEqual(len(counted), 3)
                    for steps, a, b in zip((0, STEPS // 2, STEPS), plain, counted):
                        updates = max(0, steps - 1) if scheme == "usf" else steps  # first, by the step that led here
                        of_law = b["material"] == 1
                        self.assertTrue(of_law.any() and not of_law.all())
                        numpy.testing.assert_array_equal(b["steps_seen"][of_law], 1000 + 2.5 * (steps if scheme == "usf" else updates))
                        numpy.testing.assert_allclose(b["time_seen"][of_law], 0.0002 * updates, rtol=1e-13, atol=1e-18)
                        for name in ("steps_seen", "time_seen"):
                            self.assertTrue((b[name][~of_law] == 0).all())
                        for name in ("velocity", "stress", "energy_density"):
                            numpy.testing.assert_array_equal(a[name], b[name])
                    self.assertGreater(numpy.abs(counted[-1]["stress"]).max(), 0.1)

    def test_restart(self):
        self.run_own(COUNTING, "whole")
        self.run_own(COUNTING, "parts", "--set", "time.end=0.003", "--threads", 2)
        self.run_good("case.toml", "--output", "parts", "--restart", "latest")
        whole, parts = contents(self.dir / "whole"), contents(self.dir / "parts")
        self.assertEqual(whole.keys(), parts.keys())
        self.assertEqual([name for name in whole if whole[name] != parts[name]], [])

    def test_input(self):
        listed = subprocess.run([OWN, "list", "materials"], capture_output=True, text=True, check=True).stdout
        self.assertRegex(listed, r"step-counter +jaumann-elastic that counts its steps")
        self.assertIn("| `weight` | number", subprocess.run([OWN, "list", "input"], capture_output=True, text=True, check=True).stdout)
        self.assertIn("`steps_seen`", subprocess.run([OWN, "list", "input"], capture_output=True, text=True, check=True).stdout)
        for change, message in (
            (("weight = 2.5\n", ""), "step-counter needs weight (what a step counts)"),
            (("weight = 2.5", "weight = 101"), "material[1].weight"),
            (('model = "step-counter"', 'model = "jaumann-elastic"'), "is not a parameter of jaumann-elastic"),
            (('name = "counting"\nmodel = "step-counter"\nweight = 2.5', 'name = "counting"'), 'no material of the case carries "steps_seen"'),
            (("spacing = 0.0625", "spacing = 0.0625\n[method]\npreset = 'spline3'"), "takes no material with history"),
        ):
            with self.subTest(message):
                self.write("case.toml", edit(COUNTING, change))
                done = harness.ordo("check", "case.toml", cwd=self.dir)
                self.assertEqual(done.returncode, 2)
                self.assertIn(message, done.stderr)
        self.write("case.toml", COUNTING)
        plain = subprocess.run([ORDO, "check", "case.toml"], cwd=self.dir, capture_output=True, text=True)
        self.assertEqual(plain.returncode, 2)
        self.assertIn("step-counter", plain.stderr)


if __name__ == "__main__":
    unittest.main()
