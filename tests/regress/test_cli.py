"""The commands around a run: help, check with --set, list and bench.

At the end the way a run fails: what the message says and what is left on the disk.
"""

import json
import os
import subprocess
import tomllib

from harness import CASE, HANG, ORDO, PRESETS, ROOT, InTemporaryDirectory, arrays, edit, frames, history, ordo, particle_data, read_vtk

SHAPES = ("ball", "box", "ring", "cylinder", "particles")
FIELDS = ("displacement", "velocity", "stress", "energy_density")
MATERIALS = ("neo-hookean", "st-venant-kirchhoff", "jaumann-elastic", "linear-rate-1d")
BENCH_KEYS = {"material", 
    "method", "dim", "set", "particles", "cells_per_axis", "courant_number", "steps", "repeats", "threads", "seconds",
    "particle_steps_per_second", "ns_per_particle", "bytes_per_particle", "resident_bytes_per_particle", "setup_bytes_per_particle",
    "node_visits_per_particle", "mass_solves_per_step", "mass_iterations_per_step", "flops_per_particle_step",
    "traffic_bytes_per_particle_step", "flops_per_particle", "traffic_bytes_per_particle", "peak_gflops", "bandwidth_gb_per_second",
    "share_of_peak_flops", "share_of_bandwidth", "version", "commit", "build",
}
STAGES = ["sort", "body_force", "scatter", "fit", "nodes", "gather"]

# --set argument, path to the value in the resolved case, the value
OVERRIDES = [
    ("grid.spacing=0.125", ("grid", "spacing"), [0.125, 0.125]),
    ("grid.size=[1, 2]", ("grid", "size"), [1.0, 2.0]),
    ("method.preset=mpm", ("method", "preset"), "mpm"),
    ('method.preset="ugimp"', ("method", "preset"), "ugimp"),
    ("title=a disk, at rest", ("title",), "a disk, at rest"),
    ("title=sigma = 3 # of it", ("title",), "sigma = 3 # of it"),
    ("body.0.velocity=[0,0]", ("body", 0, "velocity"), [0.0, 0.0]),
    ("body.0.velocity=['0.1*x', 2]", ("body", 0, "velocity"), ["0.1*x", 2.0]),
    ("body.0.velocity.1=0.5", ("body", 0, "velocity"), [0.0, 0.5]),
    ("body.0.particles_per_cell=9", ("body", 0, "particles_per_cell"), [3, 3]),
    ("material.0.young=2e3", ("material", 0, "young"), 2000.0),
    ("output.grid=true", ("output", "grid"), True),
    ("gravity=[0, -9.81]", ("gravity",), [0.0, -9.81]),
    ("boundary=[{face='x-min', type='fixed'}]", ("boundary", 0, "type"), "fixed"),
]


def without_comments(text):
    return "\n".join(line for line in text.splitlines() if not line.startswith("#"))


class Commands(InTemporaryDirectory):
    def good(self, *args, cwd=None):
        done = ordo(*args, cwd=cwd or self.dir)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def test_help(self):
        for command in ([], ["run"], ["check"], ["list"], ["bench"]):
            with self.subTest(command):
                self.assertIn("--help", self.good(*command, "--help"))

    def test_version(self):
        self.assertRegex(self.good("--version"), r"^ordo \d+\.\d+\.\d+ \(\w+\)\ncompiler +(g\+\+|.*[Cc]lang) .+\n"
                         r"instructions +(avx512|avx2|any)\nOpenMP +(yes|no)\nHDF5 +(yes|no) \(checkpoints\)\nGmsh +(yes|no) \(meshes\)\n$")

    def test_check_prints_a_valid_case(self):
        for name, text in (("minimal", CASE), ("two disks", (ROOT / "cases/two-disks/case.toml").read_text())):
            with self.subTest(name):
                first = self.good("check", self.write("case.toml", text))
                again = self.good("check", self.write("case.toml", first))
                self.assertEqual(without_comments(again), without_comments(first))

    def test_the_time_step_ends_at_the_limit_of_the_method(self):
        """`cfl` is dt (c + |v|)/h up to 0.7071 with stress last; a scheme without that limit goes on."""
        for cfl, scheme, wanted in ((0.4, "usl", 0.4), (0.7, "usl", 0.7), (1.0, "usl", 0.707), (1.0, "musl", 1.0)):
            with self.subTest(cfl=cfl, scheme=scheme):
                case = edit(CASE, ("dt = 0.001", f"cfl = {cfl}"), f'\n[method]\npreset = "mpm"\nscheme = "{scheme}"\n')
                self.assertIn(f"(Courant number {wanted:.3g})", self.good("check", self.write("case.toml", case)))

    def test_a_method_that_is_never_stable_is_announced(self):
        for preset, warned in (("impm", True), ("impm-adjoint", False), ("mpm", False), ("tls-mpm", True)):
            with self.subTest(preset):
                case = self.write("case.toml", edit(CASE, f'\n[method]\npreset = "{preset}"\n'))
                done = ordo("check", case, cwd=self.dir)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertEqual("warning" in done.stderr, warned, done.stderr)
                self.assertNotIn("warning", ordo("run", case, "--quiet", cwd=self.dir).stderr)

    def test_check_writes_nothing(self):
        self.good("check", self.write("case.toml", CASE))
        self.assertEqual([p.name for p in self.dir.iterdir()], ["case.toml"])

    def test_overrides(self):
        self.write("case.toml", edit(CASE, "velocity = [0, 0]\n"))
        for text, path, wanted in OVERRIDES:
            with self.subTest(text):
                value = tomllib.loads(self.good("check", "case.toml", "--set", text))
                for key in path:
                    value = value[key]
                self.assertEqual(value, wanted)

    def test_the_last_override_wins(self):
        resolved = self.good("check", self.write("case.toml", CASE), "--set", "time.end=1", "--set", "time.end=2")
        self.assertEqual(tomllib.loads(resolved)["time"]["end"], 2.0)

    def test_lists(self):
        everything = self.good("list")
        for page, names in (("methods", PRESETS), ("shapes", SHAPES), ("materials", MATERIALS), ("fields", FIELDS)):
            text = self.good("list", page)
            self.assertIn(text, everything)
            for name in names:
                with self.subTest(name):
                    self.assertRegex(text, rf"(?m)^  {name} ")
        self.assertIn("two-disks", self.good("list", "cases", cwd=ROOT))

    def test_the_reference_page_names_every_key(self):
        page = self.good("list", "input")
        resolved = tomllib.loads(self.good("check", self.write("case.toml", CASE)))
        for table in resolved.values():
            for key in (table[0] if isinstance(table, list) and isinstance(table[0], dict) else table if isinstance(table, dict) else ()):
                with self.subTest(key):
                    self.assertIn(f"| `{key}` |", page)

    def bench(self, *args):
        return json.loads(self.good("bench", *args, "--threads", "1", "--json", "-"))

    def test_bench(self):
        options = ["--dim", "2", "--method", "cpdi1", "--particles", "2000", "--steps", "2", "--threads", "1"]
        printed = json.loads(self.good("bench", *options, "--json", "-"))
        self.good("bench", *options, "--json", "speed.json")
        for result in (printed, json.loads((self.dir / "speed.json").read_text())):
            self.assertEqual(BENCH_KEYS, set(result))
            self.assertEqual((result["method"], result["dim"], result["steps"], result["threads"]), ("cpdi1", 2, 2, 1))
            self.assertAlmostEqual(result["particles"], 2000, delta=500)
            self.assertGreater(result["particle_steps_per_second"], 0)
            self.assertEqual(list(result["ns_per_particle"]), [*STAGES, "other"])
        text = self.good("bench", *options)
        for words in ("cpdi1 2D, neo-hookean: ", "M particle-steps/s", "% of the peak", "% of the bandwidth", "resident at most"):
            self.assertIn(words, text)

    def test_bench_of_materials(self):
        for law in ("j2", "mohr-coulomb", "johnson-cook", "ogden"):
            with self.subTest(law):
                result = self.bench("--dim", "2", "--material", law, "--particles", "500", "--steps", "1")
                self.assertEqual(result["material"], law)
                self.assertGreater(result["particle_steps_per_second"], 0)

    def test_bench_counts_work(self):
        """Of four nodes; what a particle-step is counted to cost does not depend on how it was timed."""
        once, thrice = (self.bench("--dim", "2", "--method", "mpm", "--particles", "2000", "--steps", steps, "--repeat", repeats)
                        for steps, repeats in (("1", "1"), ("2", "3")))
        self.assertEqual((once["repeats"], thrice["repeats"]), (1, 3))
        self.assertEqual(once["node_visits_per_particle"], 4)
        for key in ("flops_per_particle_step", "traffic_bytes_per_particle_step", "bytes_per_particle"):
            self.assertEqual(once[key], thrice[key])
        for key, parts in (("flops_per_particle_step", "flops_per_particle"), ("traffic_bytes_per_particle_step", "traffic_bytes_per_particle")):
            self.assertEqual(list(once[parts]), STAGES)
            self.assertAlmostEqual(sum(once[parts].values()), once[key])

    def test_bench_shares(self):
        """Small problems lie in caches and may pass the bandwidth of the memory; this one is far below."""
        result = self.bench("--method", "cpdi2", "--particles", "4000", "--steps", "2")
        for share, amount, ceiling in (("share_of_peak_flops", "flops_per_particle_step", "peak_gflops"),
                                       ("share_of_bandwidth", "traffic_bytes_per_particle_step", "bandwidth_gb_per_second")):
            self.assertGreater(result[share], 0)
            self.assertLess(result[share], 1)
            self.assertAlmostEqual(result[share], result[amount] * result["particle_steps_per_second"] / result[ceiling] / 1e9)

    def test_bench_memory(self):
        result = self.bench("--particles", "100000", "--steps", "1")
        self.assertGreater(result["resident_bytes_per_particle"], result["bytes_per_particle"])
        self.assertLess(result["resident_bytes_per_particle"], 10 * result["bytes_per_particle"])
        self.assertLessEqual(result["setup_bytes_per_particle"], result["resident_bytes_per_particle"])

    def test_bench_set(self):
        """Axes by name, with or without their section, as one preset or another has them."""
        options = ["--dim", "2", "--particles", "500", "--steps", "1"]
        consistent = self.bench(*options, "--method", "bsmpm")
        lumped = self.bench(*options, "--method", "bsmpm", "--set", "mass=lumped", "--set", "method.scheme=usl")
        self.assertEqual(lumped["set"], ["mass=lumped", "method.scheme=usl"])
        self.assertGreater(consistent["mass_iterations_per_step"], consistent["mass_solves_per_step"])
        self.assertEqual(lumped["mass_solves_per_step"], 0)
        splines = self.bench(*options, "--method", "mpm", "--set", "basis=bspline2")
        self.assertEqual(splines["flops_per_particle_step"], lumped["flops_per_particle_step"])

    def test_bench_all(self):
        options = ["--all", "--dim", "2", "--particles", "300", "--steps", "1"]
        rows = self.bench(*options)
        self.assertEqual({row["dim"] for row in rows}, {2})
        self.assertLessEqual(set(PRESETS), {row["method"] for row in rows})
        for row in rows:
            with self.subTest(row["method"]):
                self.assertEqual(set(row), BENCH_KEYS)
                self.assertGreater(row["flops_per_particle_step"], 0)
                self.assertGreater(row["traffic_bytes_per_particle_step"], 0)
                self.assertGreater(row["share_of_peak_flops"], 0)
                self.assertGreater(row["share_of_bandwidth"], 0)
        self.assertEqual([row["method"] for row in self.bench("--all", "--particles", "100", "--steps", "1")],
                         2 * [row["method"] for row in rows])

    def test_bench_all_names_what_is_refused(self):
        rows = self.bench("--all", "--dim", "1", "--particles", "100", "--steps", "1", "--set", "samples=corners")
        refused = {row["method"]: row["refused"] for row in rows if "refused" in row}
        self.assertIn("only least squares have samples", refused["mpm"])
        self.assertNotIn("icpdi1", refused)
        text = self.good("bench", "--all", "--dim", "1", "--particles", "100", "--steps", "1", "--set", "samples=corners")
        self.assertRegex(text, r"(?m)^mpm +1 +refused: .*only least squares have samples: set samples to particles$")

    def test_bench_machine(self):
        result = self.bench("--machine")
        self.assertEqual(set(result), {"threads", "peak_gflops", "bandwidth_gb_per_second", "build"})

    def test_quiet_says_nothing(self):
        done = ordo("run", self.write("case.toml", CASE), "--quiet", "--output", "out", cwd=self.dir)
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))

    def test_default_directory(self):
        (self.dir / "falling").mkdir()
        for name, directory in (("falling/case.toml", "results/falling"), ("drop.toml", "results/drop")):
            with self.subTest(name):
                self.run_good(self.write(name, CASE))
                self.assertTrue((self.dir / directory / "particles.pvd").exists())

    def test_no_interval_of_the_history_loses_the_end(self):
        self.run_good(self.write("case.toml", CASE), "--output", "out", "--set", "output.history_interval=7")
        self.assertEqual(history(self.dir / "out")["time"][-1], 0.01)


class FailedRun(InTemporaryDirectory):
    """A ball thrown out of the grid."""

    def setUp(self):
        super().setUp()
        self.write("case.toml", edit(CASE, "velocity = [50, 0]\n"))
        self.done = ordo("run", "case.toml", "--output", "out", "--set", "time.end=1", "--set", "output.interval=0.004", cwd=self.dir)

    def test_message(self):
        self.assertEqual(self.done.returncode, 1)
        self.assertRegex(self.done.stderr, r"(?m)^ordo: the run failed: step \d+, t = [\d.e-]+ s: particle \d+ .*left the grid; .*boundary")

    def test_last_frame(self):
        time, path = frames(self.dir / "out")[-1]
        data = read_vtk(path)
        self.assertEqual(time, history(self.dir / "out")["time"][-1])
        self.assertEqual(arrays(data.GetFieldData())["TimeValue"], [time])
        moved = particle_data(data)["displacement"][:, 0]
        self.assertAlmostEqual(moved.min(), 50 * time, delta=1e-9, msg="the frame is not that of its time")
        self.assertEqual(list(self.dir.glob("out/*.part")), [])


class BrokenStreams(InTemporaryDirectory):
    """Lost data are a failure; lost messages are not, and nothing aborts."""

    def setUp(self):
        super().setUp()
        self.write("case.toml", CASE)
        self.full = open("/dev/full", "w")
        self.addCleanup(self.full.close)

    def code(self, *args, **streams):
        return subprocess.run([ORDO, *args], cwd=self.dir, **streams).returncode

    def test_full_stdout(self):
        for args in (["list"], ["check", "case.toml"], ["--help"], ["bench", "--particles", "100", "--steps", "1", "--json", "-"]):
            with self.subTest(args[0]):
                self.assertEqual(self.code(*args, stdout=self.full, stderr=subprocess.DEVNULL), 1)

    def test_full_stderr(self):
        self.assertEqual(self.code("run", "case.toml", stderr=self.full), 0)
        self.assertEqual(self.code("check", "case.toml", "--set", "x=1", stderr=self.full), 2)

    def test_reader_of_stdout_that_goes_away(self):
        read, write = os.pipe()
        os.close(read)
        done = subprocess.run([ORDO, "list"], cwd=self.dir, stdout=write, stderr=subprocess.PIPE)
        os.close(write)
        self.assertEqual((done.returncode, done.stderr), (141, b""))

    def test_reader_that_goes_away(self):
        process = subprocess.Popen([ORDO, "run", "case.toml"], cwd=self.dir, stderr=subprocess.PIPE)
        process.stderr.close()
        self.assertEqual(process.wait(timeout=HANG), 0)
