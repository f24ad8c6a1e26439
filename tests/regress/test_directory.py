"""Nothing that lies in an output directory is ever lost, and two runs never write to one."""

import os
import re
import shutil
import subprocess
import time
import unittest
import unittest.mock

from harness import CASE, HANG, InTemporaryDirectory, contents, edit, frames, has_hdf5, ordo, start

ENDLESS = edit(CASE, ("end = 0.01\ndt = 0.001", "end = 1e6\ndt = 0.001"), "[output]\ninterval = 0.1\n")
NO_LOCKS = """#include <errno.h>
int flock(int descriptor, int operation) { (void)descriptor; (void)operation; errno = ENOLCK; return -1; }
"""


class Directory(InTemporaryDirectory):
    def setUp(self):
        super().setUp()
        self.write("case.toml", CASE)

    def run_case(self, *args):
        return ordo("run", "case.toml", "--output", "out", "--threads", 1, "--quiet", *args, cwd=self.dir)

    def assert_refused(self, *args, says):
        """And nothing changes."""
        before = contents(self.dir)
        done = self.run_case(*args)
        self.assertEqual(done.returncode, 2, done.stderr)
        for text in says:
            self.assertIn(text, done.stderr)
        self.assertEqual(contents(self.dir), before)

    def start_endless(self, preload=None):
        self.write("endless.toml", ENDLESS)
        process = start("run", "endless.toml", "--output", "out", "--threads", 1, "--quiet", cwd=self.dir, preload=preload)
        self.addCleanup(self.kill, process)
        until = time.monotonic() + HANG
        while not (self.dir / "out" / "particles_000003.vtu").exists():
            self.assertIsNone(process.poll())
            self.assertLess(time.monotonic(), until)
        return process

    def kill(self, process):
        process.kill()
        process.communicate(timeout=HANG)


LAUNCHERS = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS")  # each says how many processes there are


class ManyProcesses(Directory):
    """Under mpiexec or srun each process would do the same. test_ranks.py has `ordo run`."""

    def run_as_one_of(self, variable, count, *args):
        with unittest.mock.patch.dict(os.environ, {variable: count}):
            return ordo(*args, cwd=self.dir)

    def test_are_refused(self):
        before = contents(self.dir)
        for variable in LAUNCHERS:
            for command in (("check", "case.toml"), ("verify", "homogeneous"), ("list", "methods")):
                done = self.run_as_one_of(variable, "4", *command)
                self.assertEqual((done.returncode, done.stdout), (2, ""))
                for text in ("one of 4 processes", variable, "without mpiexec"):
                    self.assertIn(text, done.stderr)
        self.assertEqual(contents(self.dir), before)

    def test_one_is_not(self):
        for variable in LAUNCHERS:
            self.assertEqual(self.run_as_one_of(variable, "1", "check", "case.toml").returncode, 0)
            self.assertEqual(self.run_as_one_of(variable, "4", "--version").returncode, 0)


class Results(Directory):
    def test_are_not_overwritten(self):
        self.assertEqual(self.run_case().returncode, 0)
        self.assert_refused(says=("out holds the results of an earlier run", "--restart latest", "--output", "--overwrite"))
        self.assert_refused("--set", "method.preset=mpm", says=("holds the results",))

    def test_are_overwritten_on_demand(self):
        """Only files that the list names."""
        self.assertEqual(self.run_case("--set", "output.interval=0.001").returncode, 0)
        mine = {"notes.txt": "mine", "particles.png": "mine", "other.part": "mine", "backup/history.csv": "mine"}
        (self.dir / "out" / "backup").mkdir()
        for name, text in mine.items():
            self.write("out/" + name, text)
        done = self.run_case("--overwrite", "--set", "output.interval=0.005")
        self.assertEqual(done.returncode, 0, done.stderr)
        there = contents(self.dir / "out")
        for name, text in mine.items():
            self.assertEqual(there.pop(name), text.encode())
        self.run_good("case.toml", "--output", "fresh", "--set", "output.interval=0.005")
        self.assertEqual(there, contents(self.dir / "fresh"))

    def test_list(self):
        self.run_good("case.toml", "--output", "out", "--set", "output.grid=true", *(("--set", "checkpoint.steps=3") if has_hdf5() else ()))
        names = [line for line in (self.dir / "out" / "files.txt").read_text().splitlines() if not line.startswith("#")]
        self.assertEqual(sorted([*names, "files.txt"]), sorted(contents(self.dir / "out")))

    def test_a_list_that_names_files_elsewhere(self):
        self.assertEqual(self.run_case().returncode, 0)
        self.write("victim", "mine")
        with (self.dir / "out" / "files.txt").open("a") as files:
            files.write(f"../victim\n{self.dir}/victim\n")
        self.assertEqual(self.run_case("--overwrite").returncode, 0)
        self.assertEqual((self.dir / "victim").read_text(), "mine")

    def test_files_of_others_under_names_of_results(self):
        (self.dir / "out").mkdir()
        for name in ("history.csv", "case.toml", "particles_000007.vtu", "probe_x.csv", "files.txt/x"):
            with self.subTest(name):
                path = self.dir / "out" / name
                path.parent.mkdir(exist_ok=True)
                path.write_text("mine")
                for args in ((), ("--overwrite",)):
                    if "/" not in name:
                        self.assert_refused(*args, says=("out holds " + name, "move it away"))
                    else:
                        self.assertNotEqual(self.run_case(*args).returncode, 0)
                        self.assertEqual(path.read_text(), "mine")
                shutil.rmtree(path.parent)
                (self.dir / "out").mkdir(exist_ok=True)

    def test_overwrite_and_restart(self):
        self.assert_refused("--overwrite", "--restart", "latest", says=("--overwrite", "--restart"))

    def test_check_says_so(self):
        self.assertEqual(self.run_case().returncode, 0)
        done = ordo("check", "case.toml", "--output", "out", cwd=self.dir)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("# out holds results", done.stdout)

    def test_a_refused_restart_leaves_no_directory(self):
        done = ordo("run", "case.toml", "--output", "some/where/out", "--restart", "latest", cwd=self.dir)
        self.assertEqual(done.returncode, 2)
        self.assertEqual([p.name for p in self.dir.iterdir()], ["case.toml"])


class TwoRuns(Directory):
    def assert_others_refused(self, process):
        for args in ((), ("--overwrite",), ("--restart", "latest")):
            with self.subTest(args=args):
                done = self.run_case(*args)
                self.assertEqual(done.returncode, 2, done.stderr)
                if args:
                    self.assertIn(f"another run writes there (process {process.pid} on ", done.stderr)
        self.assertIsNone(process.poll())

    def assert_takes_over(self):
        self.assertTrue((self.dir / "out" / "run.lock").exists())
        for _, path in frames(self.dir / "out"):
            self.assertTrue(path.exists())
        done = self.run_case("--overwrite")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertFalse((self.dir / "out" / "run.lock").exists())

    def test_the_second_is_refused_while_the_first_lives(self):
        process = self.start_endless()
        self.assert_others_refused(process)
        self.kill(process)
        self.assert_takes_over()

    @unittest.skipIf(shutil.which("cc") is None, "no C compiler")
    def test_where_the_file_system_has_no_locks(self):
        source, library = self.write("flock.c", NO_LOCKS), self.dir / "flock.so"
        subprocess.run(["cc", "-shared", "-fPIC", "-o", library, source], check=True)
        process = self.start_endless(preload=library)
        done = ordo("run", "case.toml", "--output", "out", "--overwrite", cwd=self.dir, preload=library)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("another run writes there", done.stderr)
        self.kill(process)
        lock = self.dir / "out" / "run.lock"
        ours = lock.read_text()
        lock.write_text(re.sub(r" on .*", " on elsewhere", ours))  # whether that lives cannot be known
        done = ordo("run", "case.toml", "--output", "out", "--overwrite", cwd=self.dir, preload=library)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("remove run.lock if that run is over", done.stderr)
        lock.write_text(ours)
        done = ordo("run", "case.toml", "--output", "out", "--overwrite", cwd=self.dir, preload=library)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_two_at_once(self):
        """Of runs that start together one writes; the others change nothing."""
        self.write("endless.toml", ENDLESS)
        for _ in range(5):
            runs = [start("run", "endless.toml", "--output", "out", "--overwrite", "--threads", 1, "--quiet", cwd=self.dir) for _ in range(4)]
            until = time.monotonic() + HANG
            while sum(r.poll() is None for r in runs) > 1 and time.monotonic() < until:
                time.sleep(0.01)
            alive = [r for r in runs if r.poll() is None]
            self.assertEqual(len(alive), 1)
            self.assertEqual([r.returncode for r in runs if r not in alive], [2, 2, 2])
            self.kill(alive[0])
            for r in runs:
                r.communicate(timeout=HANG)

    def test_killed_at_any_moment_and_overwritten(self):
        """Lists name only files that are there, and files of the user stay."""
        self.write("endless.toml", ENDLESS)
        (self.dir / "out").mkdir()
        self.write("out/notes.txt", "mine")
        for k in range(25):
            process = start("run", "endless.toml", "--output", "out", "--overwrite", "--threads", 1, "--quiet", "--set", "output.interval=0.002", cwd=self.dir)
            time.sleep(0.005 * k)
            self.assertIsNone(process.poll())
            self.kill(process)
            if (self.dir / "out" / "particles.pvd").exists():
                for _, path in frames(self.dir / "out"):
                    self.assertTrue(path.exists())
            self.assertEqual((self.dir / "out" / "notes.txt").read_text(), "mine")


class Patterns(Directory):
    def sweep(self, *args):
        return [ordo("run", "case.toml", "--quiet", "--output", "results/{case}-{hash}", "--set", f"material.0.young={young}", *args, cwd=self.dir)
                for young in (1000, 2000, 3000)]

    def test_a_sweep(self):
        for done in self.sweep():
            self.assertEqual(done.returncode, 0, done.stderr)
        directories = sorted(p.name for p in (self.dir / "results").iterdir())
        self.assertEqual(len(directories), 3)
        for name in directories:
            self.assertRegex(name, f"^{self.dir.name}-[0-9a-f]{{10}}$")
        self.assertEqual([done.returncode for done in self.sweep()], [2, 2, 2])  # they have been run
        self.assertEqual([done.returncode for done in self.sweep("--overwrite")], [0, 0, 0])
        self.assertEqual(sorted(p.name for p in (self.dir / "results").iterdir()), directories)

    def test_unknown_words(self):
        done = ordo("run", "case.toml", "--output", "results/{date}", cwd=self.dir)
        self.assertEqual(done.returncode, 2)
        self.assertIn("{date} is unknown; {case} and {hash}", done.stderr)


if __name__ == "__main__":
    unittest.main()
