"""Runs under mpiexec write what one process writes, byte by byte, whatever happens to them.

Needs the ranks of -DORDO_RANKS=ON beside the program, and mpiexec.
"""

import os
import pathlib
import shutil
import signal
import subprocess
import time
import unittest
import unittest.mock

from harness import CASE, HANG, ORDO, ROOT, InTemporaryDirectory, contents, edit, frames, has_hdf5, ordo, read_vtk, start

IS_NIGHTLY = "ORDO_NIGHTLY" in os.environ
# More ranks than cores, as root in containers; OpenMPI's variables do nothing with other MPIs.
FREE = {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "OMPI_MCA_hwloc_base_binding_policy": "none",
    "OMPI_MCA_mpi_yield_when_idle": "1",
    "OMPI_MCA_btl_base_warn_component_unused": "0",
    "OMPI_MCA_btl_vader_single_copy_mechanism": "none",  # containers may forbid it
}


def mpiexec_works():
    try:
        return subprocess.run(["mpiexec", "-n", "2", "true"], env={**os.environ, **FREE}, capture_output=True, timeout=60).returncode == 0
    except (OSError, subprocess.TimeoutExpired):
        return False


HAS_LIBRARY = (pathlib.Path(ORDO).parent / "libordo_ranks.so").exists()
HAS_RANKS = HAS_LIBRARY and mpiexec_works()

FLIGHT = """\
gravity = [0.3, -1.0]
[grid]
dim = 2
size = [2.0, 1.0]
spacing = 0.0625
[time]
end = 0.24
cfl = 0.3
[[material]]
name = "rubber"
density = 1000.0
young = 1000.0
poisson = 0.3
[[body]]
name = "left"
material = "rubber"
shape = "ball"
center = [0.4, 0.5]
radius = 0.22
velocity = ["3 - 2*y", "0.5*x"]
[[body]]
name = "right"
material = "rubber"
shape = "box"
lower = [1.2, 0.0]
upper = [1.5, 0.4]
velocity = ["-1", "0"]
body_force = ["0", "0.2*t"]
[[boundary]]
face = ["y-min", "x-max"]
type = "symmetry"
[output]
interval = 0.04
grid = true
per_body = true
[checkpoint]
steps = 20
[[probe]]
name = "mass-point"
particle = [0.4, 0.5]
[[probe]]
name = "place"
point = [0.9, 0.5]
"""


@unittest.skipUnless(HAS_RANKS, "this ordo was built without ranks (-DORDO_RANKS=ON), or mpiexec does not work here")
class Ranks(InTemporaryDirectory):
    def setUp(self):
        super().setUp()
        self.enterContext(unittest.mock.patch.dict(os.environ, FREE))

    def on(self, count, *args, threads=1, run=ordo, **how):
        return run("run", *args, "--threads", threads, cwd=self.dir, launcher=("mpiexec", "-n", str(count)), **how)

    def good_on(self, count, *args, **how):
        done = self.on(count, *args, "--quiet", **how)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done

    def assert_same_files(self, one, other):
        super().assert_same_files(one, other)
        self.assertGreater(len(contents(self.dir / one)), 5)

    def write_flight(self, *changes):
        text = FLIGHT if has_hdf5() else edit(FLIGHT, ("[checkpoint]\nsteps = 20\n", ""))
        self.write("case.toml", edit(text, *changes))

    def said_by_ordo(self, text):
        """What ordo says on stderr, without the launcher's remarks."""
        return [line for line in text.split("\n") if line.startswith("ordo")]

    # ---- the same files

    def test_every_file_is_that_of_one_process(self):
        self.write_flight()
        self.run_good("case.toml", "--output", "one")
        for count, threads in ((2, 2), (3, 1)):
            self.good_on(count, "case.toml", "--output", f"on{count}", threads=threads)
            self.assert_same_files("one", f"on{count}")

    def test_many_steps(self):
        """And sorts."""
        self.write_flight()
        for preset in ("cpdi1", "cpls", "cpdi2"):
            sets = ("--set", f"method.preset={preset}", "--set", "time.end=0.4", "--set", "time.cfl=0.1", "--set", "output.interval=0.2")
            self.run_good("case.toml", "--output", preset, *sets)
            rows = (self.dir / preset / "history.csv").read_text().splitlines()
            self.assertGreater(len(rows), 200)
            self.good_on(3, "case.toml", "--output", f"{preset}-three", *sets)
            self.assert_same_files(preset, f"{preset}-three")

    def test_frames_of_every_kind(self):
        """On more ranks than have tiles, some of them."""
        self.write_flight()
        kinds = {
            "compressed": ('output.compression="zlib"', "method.preset=cpdi2", "output.every=3"),
            "points": ('output.particles="points"', 'output.precision="float32"', "method.preset=cpdi2t"),
            "coarse": ("grid.spacing=0.25", "method.preset=mpm", 'output.fields=["stress", "deformation_gradient"]'),
        }
        for name, settings in kinds.items():
            with self.subTest(name):
                sets = [word for setting in ("time.end=0.08", *settings) for word in ("--set", setting)]
                self.run_good("case.toml", "--output", name, *sets)
                self.good_on(7, "case.toml", "--output", f"{name}-on7", *sets)
                self.assert_same_files(name, f"{name}-on7")

    def test_cases(self):
        """So many steps as take seconds; in the nightly on other numbers of ranks too, and the whole cases."""
        small = {
            ("two-disks", "cpls"): ("time.end=0.8", "output.interval=0.4"),
            ("two-balls", "cpdi1"): ("time.end=0.1", "output.interval=0.05", "grid.spacing=0.1"),
            ("cantilever", "cpdi2"): ("time.end=0.1", "output.interval=0.05"),
            ("wheel-on-sand", "apic"): ("time.end=0.1", "output.interval=0.05", "grid.spacing=0.08"),
        }
        for (name, preset), settings in small.items():
            case = ROOT / "cases" / name / "case.toml"
            plan = {settings: (1, 2, 3, 8), (): (2, 3)} if IS_NIGHTLY else {settings: (3,)}  # eight ranks on two cores take minutes for a whole case
            for changes, counts in plan.items():
                sets = [word for setting in (f"method.preset={preset}", *changes) for word in ("--set", setting)]
                alone = f"{name}-alone-{len(changes)}"
                self.run_good(case, "--output", alone, *sets)
                for count in counts:
                    with self.subTest(name, preset=preset, ranks=count, changes=changes):
                        self.good_on(count, case, "--output", f"{alone}-{count}", *sets)
                        self.assert_same_files(alone, f"{alone}-{count}")

    def test_stages(self):
        """Damping, a material and a body that changes or goes."""
        stages = (
            "[[material]]\nname = 'hard'\ndensity = 1000.0\nyoung = 3000.0\npoisson = 0.3\n"
            "[[stage]]\nname = 'fly'\nduration = 0.1\n"
            "[[stage]]\nname = 'damp'\nduration = 0.06\ndamping = 'kinetic'\nmaterials = {left = 'hard'}\n"
            "[[stage]]\nname = 'go'\nduration = 0.08\nremove = ['right']\n"
        )
        self.write_flight(("end = 0.24\n", ""), stages)
        for preset in ("cpls", "cpdi2"):
            self.run_good("case.toml", "--output", f"{preset}-one", "--set", f"method.preset={preset}")
            self.good_on(3, "case.toml", "--output", f"{preset}-three", "--set", f"method.preset={preset}")
            self.assert_same_files(f"{preset}-one", f"{preset}-three")

    @unittest.skipUnless(has_hdf5(), "ordo was built without HDF5")
    def test_restart_on_other_ranks(self):
        """Begun on three ranks; goes on on five, on one of mpiexec, and without it."""
        self.write_flight()
        self.run_good("case.toml", "--output", "whole")
        self.good_on(3, "case.toml", "--output", "half", "--set", "time.end=0.1")
        for count in (5, 1, 0):
            parts = f"parts{count}"
            shutil.copytree(self.dir / "half", self.dir / parts)
            if count == 0:
                self.run_good("case.toml", "--output", parts, "--restart", "latest")
            else:
                self.good_on(count, "case.toml", "--output", parts, "--restart", "latest")
            self.assert_same_files("whole", parts)

    # ---- errors

    def test_errors_are_told_once(self):
        self.write_flight()
        bad = {
            "unknown key": ("--set", "method.nonsense=1"),
            "not shared": ("--set", "method.preset=spline3"),
            "no checkpoint": ("--restart", "latest", "--output", "empty"),
        }
        for what, args in bad.items():
            with self.subTest(what):
                done = self.on(3, "case.toml", "--output", "out", *args) if "--output" not in args else self.on(3, "case.toml", *args)
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertEqual(len(self.said_by_ordo(done.stderr)), 1, done.stderr)
                self.assertFalse((self.dir / "out").exists())

    def test_a_file_that_cannot_be_read(self):
        self.write_flight(('shape = "box"\nlower = [1.2, 0.0]\nupper = [1.5, 0.4]\n', 'shape = "particles"\nfile = "nowhere.csv"\n'))
        done = self.on(3, "case.toml", "--output", "out")
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertEqual(len(self.said_by_ordo(done.stderr)), 1, done.stderr)
        self.assertIn("nowhere.csv", done.stderr)
        self.assertFalse((self.dir / "out").exists())

    def test_a_library_that_cannot_be_loaded(self):
        self.write_flight()
        place = self.dir / "broken"
        place.mkdir()
        shutil.copy(ORDO, place)
        (place / "libordo_ranks.so").write_text("nonsense")
        line = ["mpiexec", "-n", "3", place / "ordo", "run", "case.toml", "--output", "out"]
        done = subprocess.run(line, cwd=self.dir, text=True, capture_output=True, timeout=HANG)
        self.assertNotEqual(done.returncode, 0)
        said = self.said_by_ordo(done.stderr)
        self.assertEqual(len(said), 1, done.stderr)
        self.assertIn("libordo_ranks.so cannot be loaded", said[0])
        self.assertFalse((self.dir / "out").exists())

    def test_a_particle_that_fails_is_that_of_one_process(self):
        """In each corner of the grid, so on any rank."""
        self.write_flight(('face = ["y-min", "x-max"]', 'face = "y-min"'))
        for name, velocity in (("right", ["3", "0.5"]), ("top", ["0.5", "4"]), ("left", ["-4", "0"])):
            with self.subTest(name):
                args = ("case.toml", "--set", "time.end=2", "--set", "output.interval=0.2", "--set", f"body.0.velocity={velocity}".replace("'", '"'))
                line = [ORDO, "run", *args, "--output", f"{name}-one", "--threads", "1"]
                alone = subprocess.run(line, cwd=self.dir, text=True, capture_output=True, timeout=HANG)
                self.assertEqual(alone.returncode, 1, alone.stderr)
                done = self.on(3, *args, "--output", f"{name}-three")
                self.assertEqual(done.returncode, 1, done.stderr)
                failed = [line for line in self.said_by_ordo(alone.stderr) if "the run failed" in line]
                self.assertEqual(len(failed), 1)
                self.assertEqual([line for line in self.said_by_ordo(done.stderr) if "the run failed" in line], failed)
                self.assert_same_files(f"{name}-one", f"{name}-three")

    def limited(self, kilobytes, *args):
        """Three ranks, of which the one that writes may write no longer files."""
        limit = ["bash", "-c", f'[ "$OMPI_COMM_WORLD_RANK$PMI_RANK" != 0 ] || ulimit -f {kilobytes}; exec "$@"', "-"]
        line = ["mpiexec", "-n", "3", *limit, ORDO, "run", "case.toml", "--output", "out", "--threads", "1", "--quiet", *args]
        done = subprocess.run(line, cwd=self.dir, text=True, capture_output=True, timeout=HANG)
        self.assertEqual(done.returncode, 1, done.stderr)
        said = self.said_by_ordo(done.stderr)
        self.assertEqual(len(said), 1, done.stderr)
        self.assertRegex(said[0], "cannot be (written|created|made|copied)")
        self.assertEqual(list(self.dir.glob("out/*.part")), [])

    def test_files_that_may_not_grow(self):
        """One message, whole files."""
        self.write_flight()
        for kilobytes in (1, 20):
            shutil.rmtree(self.dir / "out", ignore_errors=True)
            self.limited(kilobytes)

    @unittest.skipUnless(has_hdf5(), "ordo was built without HDF5")
    def test_a_run_goes_on_once_files_may_grow(self):
        self.write_flight()
        self.run_good("case.toml", "--output", "whole")
        self.good_on(3, "case.toml", "--output", "out", "--set", "time.end=0.1")
        self.limited(20, "--restart", "latest")
        self.good_on(2, "case.toml", "--output", "out", "--restart", "latest")
        self.assert_same_files("whole", "out")

    # ---- ends

    def wait_for(self, file, process):
        limit = time.monotonic() + HANG
        while not file.exists():
            self.assertIsNone(process.poll(), "the run has ended")
            self.assertLess(time.monotonic(), limit, f"{file} was never written")
            time.sleep(0.01)

    @unittest.skipUnless(has_hdf5(), "ordo was built without HDF5")
    def test_signals_and_a_killed_rank(self):
        """After USR1, TERM or a killed rank the run goes on to the files of one that was never interrupted."""
        # With keep = 1 the checkpoint of a late signal takes the place of no other.
        longer = ("--set", "time.end=0.9", "--set", "output.interval=0.1", "--set", "grid.size=[6.0, 1.0]", "--set", "checkpoint.keep=1")
        self.write_flight()
        self.run_good("case.toml", "--output", "whole", *longer)
        for what in ("USR1", "TERM", "KILL 0", "KILL 1", "KILL 2"):
            with self.subTest(what):
                process = self.on(3, "case.toml", "--output", what, *longer, run=start, start_new_session=True)
                self.addCleanup(process.kill)
                self.wait_for(self.dir / what / "particles_000002.vtu", process)
                if what.startswith("KILL"):
                    ranks = subprocess.run(["pgrep", "-s", str(process.pid), "-x", "ordo"], capture_output=True, text=True).stdout.split()
                    self.assertEqual(len(ranks), 3)
                    os.kill(int(ranks[int(what[-1])]), signal.SIGKILL)
                else:
                    process.send_signal(getattr(signal, "SIG" + what))
                _, err = process.communicate(timeout=HANG)
                self.assertNotEqual(process.returncode, 0, err)
                self.assertLessEqual(len([line for line in self.said_by_ordo(err) if "error" in line or "stopped" in line]), 1, err)
                if what == "USR1":
                    self.assertIn(f"stopped by signal {int(signal.SIGUSR1)}", err)
                for _, path in frames(self.dir / what):
                    read_vtk(path)
                self.good_on(2, "case.toml", "--output", what, "--restart", "latest", *longer)
                self.assert_same_files("whole", what)


class WithoutRanks(InTemporaryDirectory):
    """A launcher's processes would each run the case."""

    @unittest.skipIf(HAS_LIBRARY, "this ordo has ranks")
    def test_are_refused_with_the_remedy(self):
        self.write("case.toml", CASE)
        done = subprocess.run([ORDO, "run", "case.toml", "--output", "out"], cwd=self.dir, text=True, capture_output=True, env={**os.environ, "PMI_SIZE": "4"})
        self.assertEqual(done.returncode, 2)
        for text in ("one of 4 processes", "-DORDO_RANKS=ON", "--threads"):
            self.assertIn(text, done.stderr)
        self.assertFalse((self.dir / "out").exists())

    @unittest.skipUnless(HAS_RANKS, "this ordo has no ranks")
    def test_a_launcher_of_another_mpi_is_refused(self):
        self.write("case.toml", CASE)
        done = subprocess.run([ORDO, "run", "case.toml", "--output", "out"], cwd=self.dir, text=True, capture_output=True, env={**os.environ, **FREE, "PMI_SIZE": "4"})
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("another MPI", done.stderr)
        self.assertFalse((self.dir / "out").exists())
