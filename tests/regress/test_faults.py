"""What the machine does to a run: files that may not grow, a full disk, directories that may not be written to.

The run ends with a message and exit code 1; what is there is whole, and the PVD lists files that open.
"""

import os
import pathlib
import resource
import shutil
import subprocess
import unittest

from harness import CASE, HANG, ORDO, InTemporaryDirectory, contents, edit, frames, has_hdf5, read_vtk

LONG = edit(
    CASE,
    ("end = 0.01", "end = 1.0"),
    ("spacing = 0.25", "spacing = 0.03125"),
    "velocity = '0.1*(x - 0.5)'\n[output]\ngrid = true\ninterval = 0.004\n[checkpoint]\nsteps = 5\n[[probe]]\nname = 'a'\nparticle = 0.5\n",
)


class Faults(InTemporaryDirectory):
    def run_case(self, *args, **how):
        arguments = [ORDO, "run", "case.toml", "--quiet", "--threads", "1", *map(str, args)]
        return subprocess.run(arguments, cwd=self.dir, text=True, capture_output=True, timeout=HANG, **how)

    def write_case(self):
        self.write("case.toml", LONG if has_hdf5() else edit(LONG, ("[checkpoint]\nsteps = 5\n", "")))

    def limited(self, size, *args):
        """A run whose files may not grow beyond so many bytes."""
        return self.run_case(*args, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size)))

    def assert_ends_whole(self, done, directory):
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertRegex(done.stderr, "cannot be (written|created|made|copied)")
        self.assertEqual(list(directory.glob("*.part")), [])
        for kind in ("particles", "grid"):
            if (directory / f"{kind}.pvd").exists():
                for _, path in frames(directory, kind):
                    read_vtk(path)
        for table in directory.glob("*.csv"):
            self.assertTrue(table.read_text().endswith("\n"))

    def test_files_that_may_not_grow(self):
        """Frames have 246 kB, the history in the end 267 kB."""
        self.write_case()
        files = {}
        for size in (10, 500, 2000, 20_000, 100_000, 256_000):
            with self.subTest(size):
                shutil.rmtree(self.dir / "out", ignore_errors=True)
                done = self.limited(size, "--output", "out")
                if "OMP: Error #179" in done.stderr:
                    continue  # clang's OpenMP needs 1 kB of a file before main
                self.assert_ends_whole(done, self.dir / "out")
                files[size] = len(list((self.dir / "out").glob("*")))
        self.assertLess(files[2000], 5)
        self.assertGreater(files[256_000], 100)

    @unittest.skipUnless(has_hdf5(), "ordo was built without HDF5")
    def test_checkpoints_that_may_not_grow(self):
        """Once there is room the run goes on as if nothing had happened."""
        self.write("case.toml", edit(LONG, ("end = 1.0", "end = 0.02"), ("grid = true\ninterval = 0.004\n", "fields = []\ninterval = 0.02\n")))
        self.assertEqual(self.run_case("--output", "whole").returncode, 0)
        checkpoint = max(p.stat().st_size for p in pathlib.Path(self.dir / "whole").glob("*.h5"))
        frame = max(p.stat().st_size for p in pathlib.Path(self.dir / "whole").glob("*.vtu"))
        self.assertLess(frame, checkpoint)
        for size in (frame + 1, (frame + checkpoint) // 2, checkpoint - 1):
            with self.subTest(size):
                shutil.rmtree(self.dir / "out", ignore_errors=True)
                self.assertEqual(self.run_case("--output", "out", "--set", "time.end=0.01").returncode, 0)
                done = self.limited(size, "--output", "out", "--restart", "latest")
                self.assert_ends_whole(done, self.dir / "out")
                self.assertEqual(self.run_case("--output", "out", "--restart", "latest").returncode, 0)
                self.assertEqual(contents(self.dir / "out"), contents(self.dir / "whole"))

    def test_full_disk(self):
        self.write_case()
        place = self.dir / "disk"
        place.mkdir()
        for size in (64, 300, 1000, 3000):
            mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}k", "tmpfs", place], capture_output=True)
            if mounted.returncode != 0:
                self.skipTest("may not mount a small disk here")
            try:
                with self.subTest(size):
                    self.assert_ends_whole(self.run_case("--output", place / "out"), place / "out")
            finally:
                subprocess.run(["umount", place], check=True)

    def test_directory_that_is_lost(self):
        self.write_case()
        process = subprocess.Popen([ORDO, "run", "case.toml", "--quiet", "--output", "out"], cwd=self.dir, text=True, stderr=subprocess.PIPE)
        self.addCleanup(process.kill)
        while not (self.dir / "out" / "particles_000001.vtu").exists():
            self.assertIsNone(process.poll())
        os.rename(self.dir / "out", self.dir / "elsewhere")
        _, err = process.communicate(timeout=HANG)
        self.assertEqual(process.returncode, 1, err)
        self.assertIn("out/", err)
        self.assert_whole_lists()

    def assert_whole_lists(self):
        for _, path in frames(self.dir / "elsewhere"):
            read_vtk(path)

    @unittest.skipIf(os.geteuid() == 0, "root may write everywhere")
    def test_read_only_directory(self):
        self.write_case()
        (self.dir / "out").mkdir(mode=0o500)
        done = self.run_case("--output", "out")
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("not writable", done.stderr)

    def test_results_that_may_not_be_replaced(self):
        """A directory stands where a file should go; it is as good as a file of the user."""
        self.write_case()
        (self.dir / "out" / "history.csv").mkdir(parents=True)
        done = self.run_case("--output", "out")
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("holds history.csv", done.stderr)
