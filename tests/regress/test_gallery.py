"""The figures of the papers: one of every kind from tiny runs, its numbers those of the JSON, the same bytes twice."""

import json
import math
import subprocess
import sys

import matplotlib.image
import numpy as np
from harness import ORDO, ROOT, InTemporaryDirectory, ordo

sys.path.insert(0, str(ROOT / "python"))

import ordo_gallery as gallery  # noqa: E402

SCRIPT = ROOT / "python" / "ordo_gallery.py"
BAR = gallery.Run("vibration-1d", "mpm,cpls", (4, 8), 2)
RING = gallery.Run("ring", "cpdi1,cpls", (10,), 4)
VORTEX = gallery.Run("vortex", "mpm,cpdi1", (8,), 4, ("cfl=0.1",))
WAVE = gallery.Run("bar-large-strain", "mpm,tls-bsmpm", (5,), 4, ("end=0.001",))
TIMED = gallery.Run("vibration-1d", "cpdi1", (4, 8), 2, timed=True)
HANGING = gallery.Run("bimaterial-bar", "cpdi2,fem", (1, 3), set=("end=0.02",))
TURNING = gallery.Run("bimaterial-ring", "cpdi2", (20,), set=("end=1e-5",))
DISKS = gallery.CaseRun("two-disks", ("time.end=0.05",))
FIRST, SECOND = gallery.Style("first"), gallery.Style("second", gallery.BLUE, "s", "--")

FIGURES = {
    "errors": (gallery.convergence_figure, [BAR, RING], {"panels": [[
        ("displacement", "error", "displacement", [(BAR, "mpm", FIRST), (BAR, "cpls", SECOND)]),
        ("stress", "published", "stress", [(RING, "cpls", FIRST)])]]}),
    "all-errors": (gallery.all_errors_figure, [BAR], {"panels": [("cpls", [(BAR, "cpls", "-", "")])]}),
    "history": (gallery.history_figure, [BAR, DISKS], {"panels": [
        ("bar", "energy, J", [(BAR, "cpls", 8, "kinetic_energy", FIRST), (BAR, "cpls", 8, "kinetic_energy_exact", SECOND)]),
        ("less exact", "difference, J", [(BAR, "cpls", 8, "kinetic_energy - kinetic_energy_exact", FIRST)]),
        ("disks", "energy, J", [(DISKS, "", 0, "total_energy", FIRST)])]}),
    "momentum": (gallery.momentum_figure, [RING], gallery.momenta("", "", "", RING, 10, 1).options),
    "map": (gallery.map_figure, [RING], {"names": ("displacement", "stress"), "panels": [(RING, "cpdi1", 10, "CPDI")], "first": 1}),
    "shapes": (gallery.configuration_figure, [VORTEX], {"panels": [(VORTEX, "mpm", 8, "points"), (VORTEX, "cpdi1", 8, "domains")]}),
    "speeds": (gallery.configuration_figure, [VORTEX], {"panels": [(VORTEX, "cpdi1", 8, "domains")], "value": True}),
    "stress": (gallery.stress_figure, [WAVE], {"panels": [("bar", [(WAVE, "mpm", FIRST), (WAVE, "tls-bsmpm", SECOND)])], "limits": (-1e4, 1e4)}),
    "quantity": (gallery.convergence_figure, [HANGING], {"slopes": False, "panels": [[
        ("displacement of A", "quantities", "displacement error", [(HANGING, "cpdi2", FIRST), (HANGING, "fem", SECOND)])]]}),
    "profile": (gallery.profile_figure, [HANGING, TURNING], {"panels": [
        ("bar", "y, m", gallery.stress_along_y, [(HANGING, "cpdi2", FIRST), (HANGING, "fem", SECOND)]),
        ("ring", "angle, degrees", lambda p: gallery.radial_stress_around(p, 3.075, 3.1), [(TURNING, "cpdi2", FIRST)])]}),
    "times": (gallery.cost_figure, [TIMED], {"panels": [("a", "h", "per_step", [(TIMED, "cpdi1", FIRST)]), ("b", "seconds", "error", [(TIMED, "cpdi1", FIRST)])]}),
}


class Gallery(InTemporaryDirectory):
    def setUp(self):
        super().setUp()
        self.runner = gallery.Runner(ORDO, str(self.dir / "runs"), jobs=1)

    def draw(self, name, again=""):
        """The numbers of a figure; the PNG has colours and is neither empty nor cut to nothing."""
        function, runs, options = FIGURES[name]
        self.runner.run_all(runs)
        output = self.dir / f"{name}{again}.png"
        figure = gallery.Figure(name, "", "", "", runs, function, options)
        numbers = function({r: self.runner.results(r) for r in runs}, figure, str(output))
        image = matplotlib.image.imread(output)[..., :3]
        self.assertGreater((image.min(axis=2) < 0.9).sum(), 500, name)
        return numbers

    def row(self, run, method, cells):
        with open(self.runner.directory(run) + "/verify.json", encoding="utf-8") as stream:
            (study,) = [s for s in json.load(stream) if s["method"] == method]
        (row,) = [r for r in study["rows"] if r["cells"] == cells]
        return row

    def test_every_kind_twice(self):
        for name, (_, _, options) in FIGURES.items():
            with self.subTest(name):
                numbers = self.draw(name)
                self.assertEqual(json.dumps(gallery.rounded(numbers)), json.dumps(gallery.rounded(self.draw(name, "-again"))))
                self.assertEqual((self.dir / f"{name}.png").read_bytes(), (self.dir / f"{name}-again.png").read_bytes())
                self.assertTrue(numbers and options)

    def test_errors_are_those_of_the_json(self):
        numbers = self.draw("errors")
        curve = numbers["displacement"]["second"]
        wanted = [self.row(BAR, "cpls", n)["error"]["displacement"] for n in (4, 8)]
        self.assertEqual((curve["h"], curve["error"]), ([0.25, 0.125], wanted))
        self.assertAlmostEqual(curve["order"][0], math.log2(wanted[0] / wanted[1]), places=12)
        velocity = self.draw("all-errors")["cpls"]["velocity_grid"]
        self.assertEqual(velocity["error"], [self.row(BAR, "cpls", n)["error_l2"]["velocity_grid"] for n in (4, 8)])

    def test_failed_meshes_are_no_points(self):
        self.draw("shapes")
        study = self.runner.results(VORTEX).study("mpm")
        self.assertIsNotNone(study["rows"][0]["failed"])
        self.assertEqual(gallery.error_curve_of(study, "error", "displacement"), {"h": [], "error": [], "order": [], "failed": [0.125]})

    def test_histories_end_with_the_row(self):
        drawn = self.draw("history")
        last = drawn["bar"]
        quantities = self.row(BAR, "cpls", 8)["quantities"]
        self.assertAlmostEqual(last["first"]["last"] / quantities["kinetic_energy"], 1, places=9)
        self.assertAlmostEqual(last["second"]["last"] / quantities["kinetic_energy_exact"], 1, places=9)
        self.assertEqual(drawn["less exact"]["first"]["last"], last["first"]["last"] - last["second"]["last"])
        table = self.runner.results(BAR).table(self.row(BAR, "cpls", 8), "history")
        self.assertEqual(len(table["time"]), self.row(BAR, "cpls", 8)["steps"] + 1)
        self.assertAlmostEqual(table["grid_momentum_x"][-1] / quantities["momentum_grid_x"], 1, places=9)

    def test_maps_have_the_rms_of_the_row(self):
        numbers = self.draw("map")
        for name in ("displacement", "stress"):
            self.assertAlmostEqual(numbers[name]["CPDI"]["rms"] / self.row(RING, "cpdi1", 10)["error"][name], 1, places=9)

    def test_momentum(self):
        numbers = self.draw("momentum")["change"]
        self.assertLess(numbers["CPDI"]["largest"], 1e-12)
        self.assertAlmostEqual(numbers["CPLS"]["largest"] / self.row(RING, "cpls", 10)["quantities"]["largest_momentum_defect"], 1, delta=0.1)

    def test_stress_has_the_error_of_the_row(self):
        self.assertEqual(self.draw("stress")["bar"]["first"]["relative error"], self.row(WAVE, "mpm", 5)["error_relative"]["stress"])

    def test_quantities_are_those_of_the_json(self):
        curve = self.draw("quantity")["displacement of A"]["first"]
        self.assertEqual(curve["error"], [self.row(HANGING, "cpdi2", n)["quantities"]["displacement error"] for n in (1, 3)])

    def test_profiles_are_of_the_particles_on_the_line(self):
        """Along the bar every particle from below; around the ring the 193 of a row, their radial stress that of the history."""
        drawn = self.draw("profile")
        p = self.runner.results(HANGING).table(self.row(HANGING, "cpdi2", 1), "particles")
        self.assertEqual((drawn["bar"]["first"]["least"], drawn["bar"]["first"]["largest"]), (p["stress_yy"].min(), p["stress_yy"].max()))
        y, stress = gallery.stress_along_y({name: values[::-1] for name, values in p.items()})
        np.testing.assert_array_equal(np.diff(y), np.full(17, 0.5))
        self.assertEqual(stress[0], p["stress_yy"][p["reference_y"] == 0.25])
        row = self.row(TURNING, "cpdi2", 20)
        angle, _ = gallery.radial_stress_around(self.runner.results(TURNING).table(row, "particles"), 3.075, 3.1)
        np.testing.assert_allclose(angle, (np.arange(193) + 0.5) * 90 / 193, atol=1e-9)
        history = self.runner.results(TURNING).table(row, "history")
        self.assertAlmostEqual(drawn["ring"]["first"]["mean"] / history["stress_B"][-1], 1, places=9)

    def test_domains_meet(self):
        """Corners of neighbours in the undeformed bar are the same places; the domains fill it."""
        run = gallery.Run("vibration-1d", "cpdi1", (4,), 2, ("amplitude=0",))
        self.runner.run_all([run])
        p = self.runner.results(run).table(self.row(run, "cpdi1", 4), "particles")
        np.testing.assert_allclose(np.sort(p["corner1_x"])[:-1], np.sort(p["corner0_x"])[1:], atol=1e-14)
        self.assertAlmostEqual(p["volume"].sum(), 1, places=14)

    def test_what_is_there_is_not_run_again(self):
        self.assertEqual(list(self.runner.run_all([BAR])), [BAR])
        self.assertEqual(self.runner.run_all([BAR]), {})


class Command(InTemporaryDirectory):
    def call(self, *args):
        return subprocess.run([sys.executable, str(SCRIPT), *args], cwd=self.dir, capture_output=True, text=True, check=False)

    def test_the_same_bytes_twice(self):
        for k in ("a", "b"):
            done = self.call("gallery", "--ordo", ORDO, "--quick", "--only", "wobbes-3,tran-18-20", "--work", f"work-{k}", "-o", k)
            self.assertEqual(done.returncode, 0, done.stderr)
        names = {p.name for p in (self.dir / "a").iterdir()}
        self.assertEqual(names, {"gallery.json", "wobbes-3.png", "tran-18-20.png"})
        for name in names:
            self.assertEqual((self.dir / "a" / name).read_bytes(), (self.dir / "b" / name).read_bytes(), name)

    def test_unknown_figure(self):
        done = self.call("gallery", "--ordo", ORDO, "--only", "tran-99")
        self.assertEqual(done.returncode, 1)
        self.assertIn("tran-99", done.stderr)

    def test_the_page_shows_every_figure(self):
        page = (ROOT / "docs" / "gallery.md").read_text()
        with open(ROOT / "docs" / "gallery" / "gallery.json", encoding="utf-8") as stream:
            drawn = {f["name"] for f in json.load(stream)}
        names = {f.name for f in gallery.gallery_figures()}
        self.assertEqual(drawn, names)
        for name in names:
            self.assertIn(f"gallery/{name}.png", page)
            self.assertTrue((ROOT / "docs" / "gallery" / f"{name}.png").exists(), name)


class Data(InTemporaryDirectory):
    """`ordo verify --data`."""

    CALL = ("verify", "vortex", "--method", "mpm,cpdi1", "--cells", "8", "--set", "cfl=0.1")

    def test_the_same_bytes_twice(self):
        for k, threads in (("a", 1), ("b", 2)):
            self.assertEqual(ordo(*self.CALL, "--threads", threads, "--data", k, cwd=self.dir).returncode, 0)
        names = sorted(p.name for p in (self.dir / "a").iterdir())
        self.assertEqual(len(names), 5, names)
        for name in names:
            self.assertEqual((self.dir / "a" / name).read_bytes(), (self.dir / "b" / name).read_bytes(), name)

    def test_it_changes_no_number(self):
        ordo(*self.CALL, "--data", "data", cwd=self.dir)
        ordo(*self.CALL, "--json", "plain.json", cwd=self.dir)
        with_data, plain = (json.loads((self.dir / f).read_text()) for f in ("data/verify.json", "plain.json"))
        for one, other in zip(with_data, plain):
            for a, b in zip(one["rows"], other["rows"]):
                self.assertEqual({k: v for k, v in a.items() if k != "files" and not k.startswith("seconds")},
                                 {k: v for k, v in b.items() if not k.startswith("seconds")})
                self.assertEqual({a[k] for k in a if k.startswith("seconds")}, {None})
                self.assertEqual(set(a["files"]), {"history", "particles"})
                for file in a["files"].values():
                    self.assertTrue((self.dir / "data" / file).exists())

    def test_figures_are_drawn_of_it(self):
        ordo(*self.CALL, "--figures", "plots", cwd=self.dir)
        names = {p.name for p in (self.dir / "plots").iterdir() if p.suffix == ".png"}
        self.assertLessEqual({"vortex-history.png", "vortex-map.png"}, names)

    def test_one_of_both(self):
        done = ordo(*self.CALL, "--data", "a", "--figures", "b", cwd=self.dir)
        self.assertEqual(done.returncode, 2)
        self.assertIn("--data", done.stderr)
