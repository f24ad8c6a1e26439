"""A run that is restarted from a checkpoint is the run that was never interrupted, byte by byte; a bad checkpoint is refused.

The case drifts through a periodic box, some cells in all, so that particles are sorted between the parts.
"""

import random
import shutil
import signal
import subprocess
import time
import unittest

from harness import CASE, HANG, InTemporaryDirectory, contents, edit, frames, has_hdf5, history, ordo, presets, start

BOX = "shape = 'box'\nlower = 0.25\nupper = 0.75\nvelocity = '20 + 0.1*sin(2*pi*x)'\n"
HALF = "shape = 'box'\nlower = [{}, 0.25]\nupper = [{}, 0.75]\nvelocity = '20'\n"
PERIODIC = edit(
    CASE,
    ("spacing = 0.25", "spacing = 0.0625"),
    ("end = 0.01\ndt = 0.001", "end = 0.006\ndt = 0.0002"),
    ('shape = "ball"\ncenter = 0.5\nradius = 0.25\n', BOX),
    "[[boundary]]\nface = ['x-min', 'y-min']\ntype = 'periodic'\n"
    "[output]\ngrid = true\nper_body = true\ninterval = 0.0011\nhistory_interval = 2\n"
    "[checkpoint]\nsteps = 6\n"
    "[[probe]]\nname = 'centre'\nparticle = 0.5\n[[probe]]\nname = 'place'\npoint = 0.5\n",
)
FACES = {1: "['x-min']", 2: "['x-min', 'y-min']", 3: "['x-min', 'y-min', 'z-min']"}
CHANGES = {  # fem has no grid, and cpdi2e an interface
    "fem": (("[[probe]]\nname = 'place'\npoint = 0.5\n", ""), ("grid = true\n", "")),
    "spline3": (("spacing = 0.0625", "spacing = 0.125"),),
    **{f"spline{k}": ((BOX, BOX.replace("0.25", "0.0").replace("0.75", "1.0")),) for k in (4, 5)},  # that of spline3 is free, these fill the grid
    "cpdi2e": ((BOX, HALF.format(0.25, 0.5) + "[[body]]\nmaterial = 'rubber'\n" + HALF.format(0.5, 0.75)),),
}
NEWEST = "checkpoint_000000015.h5"  # of the first half


def resealed(checkpoint):
    """With the checksum of what is in it now (FNV-1a, first of what is behind the head)."""
    text = checkpoint[:512].split(b"checksum")[0]
    total = 0xCBF29CE484222325
    for byte in checkpoint[512:] + text:
        total = (total ^ byte) * 0x100000001B3 % 2**64
    return (text + b"checksum %016x\n" % total).ljust(512, b"\0") + checkpoint[512:]


@unittest.skipUnless(has_hdf5(), "ordo was built without HDF5")
class Restart(InTemporaryDirectory):
    def restart(self, *args):
        return self.run_good("case.toml", "--restart", "latest", *args)

    def assert_goes_on(self, *args):
        """The whole run, and the same in two parts on different numbers of threads."""
        for name in ("whole", "parts"):
            shutil.rmtree(self.dir / name, ignore_errors=True)
        self.run_good("case.toml", "--output", "whole", *args)
        self.run_good("case.toml", "--output", "parts", *args, "--set", "time.end=0.003", "--threads", 2)
        self.assertGreater(len(frames(self.dir / "parts")), 2)
        self.restart("--output", "parts", *args)
        self.assertAlmostEqual(history(self.dir / "parts")["time"][-1], 0.006, 12)
        self.assert_same_files("whole", "parts")

    def test_every_preset(self):
        names = presets()
        self.assertGreater(len(names), 20)
        for name in names:
            self.write("case.toml", edit(PERIODIC, *CHANGES.get(name, ())))
            with self.subTest(name):
                self.assert_goes_on("--set", f"method.preset={name}")

    def test_other_schemes_in_1d_and_3d(self):
        for dim, preset, scheme in ((1, "cpdi1", "usf"), (3, "bsmpm", "musl"), (3, "cpdi2", "usl"), (1, "impm", "usl")):
            self.write("case.toml", edit(PERIODIC, ("dim = 2", f"dim = {dim}"), ("spacing = 0.0625", "spacing = 0.125"), (FACES[2], FACES[dim])))
            with self.subTest(preset, dim=dim):
                self.assert_goes_on("--set", f"method.preset={preset}", "--set", f"method.scheme={scheme}")

    def test_many_particles(self):
        """Enough for the threads to share: 16384."""
        self.write("case.toml", edit(PERIODIC, ("spacing = 0.0625", "spacing = 0.0078125"), ("20 + 0.1", "5 + 0.1")))
        for preset in ("mpm", "cpdi1", "bsmpm"):
            with self.subTest(preset):
                self.assert_goes_on("--set", f"method.preset={preset}")

    def test_automatic_steps_that_do_not_end_at_the_end_of_a_part(self):
        self.write("case.toml", edit(PERIODIC, ("dt = 0.0002\n", "cfl = 0.3\n"), ("end = 0.006", "end = 0.0600123")))
        self.run_good("case.toml", "--output", "whole")
        for end in ("0.0171", "0.0412345"):
            self.run_good("case.toml", "--output", "parts", "--set", f"time.end={end}", *(("--restart", "latest") if end != "0.0171" else ()))
            self.assertEqual(history(self.dir / "parts")["time"][-1], float(end))
        self.restart("--output", "parts")
        self.assert_same_files("whole", "parts")

    def test_stopped_and_killed_at_random_moments(self):
        self.write("case.toml", edit(PERIODIC, ("end = 0.006", "end = 1.2"), ("interval = 0.0011", "interval = 0.05"), ("steps = 6", "steps = 50\nkeep = 1")))
        begin = time.monotonic()
        self.run_good("case.toml", "--output", "whole")
        seconds = time.monotonic() - begin  # sanitizers and neighbours make it many times as long
        moments, stops = random.Random(1), 0
        for part in range(200):
            is_first = not (self.dir / "parts" / "case.toml").exists() or not list((self.dir / "parts").glob("checkpoint_*.h5"))
            process = start("run", "case.toml", "--output", "parts", "--threads", 1, "--quiet", *(("--overwrite",) if is_first else ("--restart", "latest")), cwd=self.dir)
            try:
                process.wait(max(0.05, moments.uniform(0.02, 0.15) * seconds))
            except subprocess.TimeoutExpired:
                process.send_signal(moments.choice((signal.SIGTERM, signal.SIGINT, signal.SIGKILL)))
                stops += 1
            _, err = process.communicate(timeout=HANG)
            if process.returncode == 0:
                break
            self.assertIn(process.returncode, (143, 130, -9, -15, -2), err)
        else:
            self.fail("it never came to its end")
        self.assertGreater(stops, 2)
        self.assert_same_files("whole", "parts")

    def test_complete_run_is_left_alone(self):
        self.write("case.toml", PERIODIC)
        self.run_good("case.toml", "--output", "out")
        before = contents(self.dir / "out")
        self.restart("--output", "out")
        self.assertEqual(contents(self.dir / "out"), before)

    def test_named_file_in_another_directory(self):
        """The files there begin with the restart; what is in them is the same."""
        self.write("case.toml", PERIODIC)
        self.run_good("case.toml", "--output", "whole", "--set", "checkpoint.keep=10")
        self.run_good("case.toml", "--output", "branch", "--restart", "whole/checkpoint_000000018.h5")
        whole, branch = history(self.dir / "whole"), history(self.dir / "branch")
        for name, column in branch.items():
            self.assertEqual(column, whole[name][-len(column) :])
        self.assertEqual((self.dir / "whole" / frames(self.dir / "whole")[-1][1]).read_bytes(), frames(self.dir / "branch")[-1][1].read_bytes())

    def test_keeps_the_last(self):
        self.write("case.toml", PERIODIC)
        self.run_good("case.toml", "--output", "out")
        self.assertEqual(sorted(p.name for p in self.dir.glob("out/*.h5")), ["checkpoint_000000024.h5", "checkpoint_000000030.h5"])
        self.run_good("case.toml", "--output", "out", "--set", "checkpoint.keep=3", "--set", "checkpoint.steps=10")
        self.assertEqual(len(list(self.dir.glob("out/*.h5"))), 3)
        self.run_good("case.toml", "--output", "out", "--set", "checkpoint.steps=1000", "--set", "checkpoint.wall_minutes=1e-9", "--set", "checkpoint.keep=1000")
        self.assertEqual(len(list(self.dir.glob("out/*.h5"))), 30)

    # ---- refusals ----------------------------------------------------------------------------------------------------

    def half(self):
        """Half a run, with checkpoints at steps 12 and 15."""
        self.write("case.toml", PERIODIC)
        self.run_good("case.toml", "--output", "out", "--set", "time.end=0.003")
        return self.dir / "out" / NEWEST

    def assert_refused(self, *args, why):
        done = ordo("run", "case.toml", "--output", "out", *args, "--threads", 1, cwd=self.dir)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn(why, done.stderr)
        return done.stderr

    def assert_damage_refused(self, data, why):
        """Refused by name, and nothing is touched."""
        file = self.dir / "out" / NEWEST
        whole = file.read_bytes()
        file.write_bytes(data)
        before = contents(self.dir / "out")
        self.assert_refused("--restart", f"out/{NEWEST}", why=why)
        self.assertEqual(contents(self.dir / "out"), before)
        file.write_bytes(whole)

    def test_damaged(self):
        whole = self.half().read_bytes()
        for size in (0, 10, 600, len(whole) // 2, len(whole) - 1):
            self.assert_damage_refused(whole[:size], "truncated" if size > 16 else "not a checkpoint")
        self.assert_damage_refused(whole + b"x", "corrupted")
        places = random.Random(2)
        for place in (20, 300, 520, len(whole) - 1, *(places.randrange(512, len(whole)) for _ in range(20))):
            with self.subTest(place):
                self.assert_damage_refused(whole[:place] + bytes([whole[place] ^ 4]) + whole[place + 1 :], "out/")
        self.assert_damage_refused(b"solid nonsense\n" * 1000, "not a checkpoint of ordo")

    def test_latest_takes_the_newest_good_one(self):
        file = self.half()
        self.run_good("case.toml", "--output", "whole")
        file.write_bytes(file.read_bytes()[:-100])
        done = self.restart("--output", "out")
        self.assertIn("truncated", done.stderr)
        self.assert_same_files("whole", "out")
        for path in self.dir.glob("out/*.h5"):
            path.write_bytes(b"")
        self.assertEqual(self.assert_refused("--restart", "latest", why="that can be used").count("not a checkpoint of ordo"), 2)

    def test_other_version(self):
        file = self.half()
        whole = file.read_bytes()
        number = whole[:512].split(b"format ")[1].split(b"\n")[0]
        self.assert_damage_refused(whole.replace(b"format " + number, b"format " + b"9" * len(number), 1), "another version")
        version = whole[:512].split(b"version ")[1].split(b"\n")[0]
        self.assert_damage_refused(whole.replace(version, b"9" * len(version), 1), "written by ordo 9")
        self.assert_damage_refused(whole.replace(version, b"\x1b" * len(version), 1), "written by ordo \\x1b")

    def test_other_case(self):
        self.half()
        why = self.assert_refused("--restart", "latest", "--set", "method.preset=mpm", why="of another case")
        self.assertIn("mpm", why)
        self.assert_refused("--restart", "latest", "--set", "time.dt=0.0001", why="of another case")

    def test_other_files(self):
        """Particles may move to another folder, but not change."""
        self.write("p.csv", "x,y,volume\n0.45,0.5,0.004\n0.55,0.5,0.004\n")
        body = "shape = 'particles'\nfile = '{}'\nvelocity = 20\n"
        self.write("case.toml", edit(PERIODIC, (BOX, body.format("p.csv"))))
        self.assert_goes_on()
        (self.dir / "away").mkdir()
        (self.dir / "p.csv").rename(self.dir / "away" / "p.csv")
        self.write("case.toml", edit(PERIODIC, (BOX, body.format("away/p.csv"))))
        shutil.copytree(self.dir / "parts", self.dir / "out")
        self.restart("--output", "out", "--set", "time.end=0.007")
        self.write("away/p.csv", "x,y,volume\n0.45,0.5,0.004\n0.55,0.5,0.005\n")
        why = self.assert_refused("--restart", "latest", "--set", "time.end=0.008", why="of another case: [file] `p.csv, 41 bytes, checksum ")
        self.assertIn("` then, `p.csv, 41 bytes, checksum ", why)

    def test_other_program(self):
        """Is warned of: the last digits may differ."""
        file = self.half()
        whole = file.read_bytes()
        program = whole[:512].split(b"program ")[1].split(b"\n")[0]
        self.assertEqual(program.count(b"/"), 2)
        other = resealed(whole.replace(program, b"0" * len(program), 1))
        file.write_bytes(other)
        done = self.restart("--output", "out")
        self.assertIn("was written by " + "0" * len(program), done.stderr)

    def test_missing(self):
        self.write("case.toml", PERIODIC)
        self.assert_refused("--restart", "latest", why="there is no checkpoint in out")
        self.assert_refused("--restart", "out/none.h5", why="no such file")
        self.half()
        (self.dir / "out" / "particles_000001.vtu").unlink()
        self.assert_refused("--restart", "latest", why="particles_000001.vtu is missing")

    def test_results_of_another_run(self):
        """They are not mixed, and not touched."""
        file = self.half()
        self.run_good("case.toml", "--output", "other", "--set", "body.0.velocity=19")
        for name in ("checkpoint_000000024.h5", "checkpoint_000000030.h5"):
            (self.dir / "other" / name).unlink()
        shutil.copy(file, self.dir / "other" / NEWEST)
        before = contents(self.dir / "other")
        for which in (file, "latest"):
            done = ordo("run", "case.toml", "--output", "other", "--restart", which, cwd=self.dir)
            self.assertEqual(done.returncode, 2)
            self.assertIn("history.csv is of another run", done.stderr)
        self.assertEqual(contents(self.dir / "other"), before)

    def test_files_of_others_stay(self):
        file = self.half()
        copy = self.dir / "out" / "checkpoint_backup.h5"
        shutil.copy(file, copy)
        self.run_good("case.toml", "--output", "out", "--restart", copy)
        self.assertTrue(copy.exists())

    def test_another_interval(self):
        self.half()
        self.restart("--output", "out", "--set", "output.interval=0.0004")
        times = [t for t, _ in frames(self.dir / "out")]
        self.assertGreater(len([t for t in times if t > 0.003]), 6)

    def test_new_run_removes_them(self):
        self.half()
        self.run_good("case.toml", "--output", "out", "--set", "checkpoint.steps=1000", "--set", "time.end=0.0031")
        self.assertEqual([p.name for p in self.dir.glob("out/*.h5")], ["checkpoint_000000015.h5"])


class WithoutHdf5(InTemporaryDirectory):
    @unittest.skipIf(has_hdf5(), "ordo was built with HDF5")
    def test_says_what_to_install(self):
        self.write("case.toml", CASE)
        for args in (("--set", "checkpoint.steps=1"), ("--restart", "latest"), ("--restart", "case.toml")):
            done = ordo("run", "case.toml", *args, cwd=self.dir)
            self.assertEqual(done.returncode, 2)
            self.assertIn("libhdf5-dev", done.stderr)


if __name__ == "__main__":
    unittest.main()
