"""Figures and movies of runs (`python/ordo_figures.py`): no warnings, nothing cut or overlapping, right units, one line of error.

Figures are looked at through matplotlib before they are written, not by their pixels.
"""

import itertools
import os
import shutil
import subprocess
import sys
import unittest

import matplotlib.image
import numpy as np
from harness import CASE, ROOT, InTemporaryDirectory, edit, frames, ordo

sys.path.insert(0, str(ROOT / "python"))

import ordo_figures as figures  # noqa: E402

SCRIPT = ROOT / "python" / "ordo_figures.py"
GALLERY = ROOT / "python" / "ordo_gallery.py"
# pyparsing, which matplotlib brings, adds warnings about matplotlib itself where warnings are errors.
STRICT = [sys.executable, "-W", "error", "-W", "ignore:::pyparsing"]

MOVING = edit(CASE, "velocity = '0.1*x'\n[output]\ninterval = 0.002\nfields = ['velocity', 'stress', 'von_mises', 'mass']\n")
TALL = edit(MOVING, ("dim = 2\nsize = 1.0", "size = [0.6, 4.0]"), ("spacing = 0.25", "spacing = 0.1"), ("shape = \"ball\"", "shape = \"box\""),
            ("center = 0.5\nradius = 0.25", "lower = [0.2, 0.0]\nupper = [0.4, 3.5]"))
FLAT = edit(TALL, ("size = [0.6, 4.0]", "size = [4.0, 0.6]"), ("lower = [0.2, 0.0]\nupper = [0.4, 3.5]", "lower = [0.0, 0.2]\nupper = [3.5, 0.4]"))
FALLING = edit(CASE, ("[grid]", "gravity = [0.0, -10.0]\n[grid]"), ("end = 0.01", "end = 0.1"))
PRESET = "[method]\npreset = '{}'\n"


class Figures(InTemporaryDirectory):
    def run_case(self, name, text):
        self.run_good(self.write(f"{name}.toml", text), "--output", self.dir / name)
        return str(self.dir / name)

    def run_dim(self, dim, preset="cpdi1"):
        return self.run_case(f"{dim}d-{preset}", edit(MOVING, ("dim = 2", f"dim = {dim}"), PRESET.format(preset)))

    def call(self, *args, script=SCRIPT, env=None):
        return subprocess.run([*STRICT, str(script), *map(str, args)], cwd=self.dir, capture_output=True, text=True, check=False,
                              env={**os.environ, **(env or {})})

    def draw(self, *args, **more):
        done = self.call(*args, **more)
        self.assertEqual((done.returncode, done.stderr), (0, ""), args)

    def refused(self, *args, told=(), **more):
        """Exit code 2 and one line."""
        done = self.call(*args, **more)
        self.assertEqual((done.returncode, len(done.stderr.splitlines()), done.stdout), (2, 1, ""), done.stderr)
        self.assertTrue(done.stderr.startswith("ordo_figures.py: "), done.stderr)
        for text in told:
            self.assertIn(text, done.stderr)


class Commands(Figures):
    def test_no_warnings_of_runs(self):
        runs = {f"{dim}d-{preset}": self.run_dim(dim, preset) for dim in (1, 2, 3) for preset in ("mpm", "cpdi1")}
        for name, run in runs.items():
            with self.subTest(name):
                self.draw("energies", run, "-o", "energies.png")
                self.draw("snapshots", run, "-o", "snapshots.png", "--times", "0,0.01", "--curve", "energies")
                self.draw("movie", run, "-o", "movie.gif", "--every", 3)
        self.draw("energies", *runs.values(), "-o", "several.pdf")
        self.draw("snapshots", runs["2d-mpm"], "-o", "curve.svg", "--times", 0, "--field", "stress_xy", "--curve", "history.csv:mass,momentum_x",
                  "--limits=-1,1", "--walls", "0.1,0.9")
        self.draw("summary", *runs.values())

    def test_no_warnings_of_studies(self):
        ordo("verify", "vibration-1d", "--method", "mpm,cpdi1", "--cells", "4,8", "--data", "bar", cwd=self.dir)
        ordo("verify", "dispersion", "--method", "mpm", "--set", "steps=0", "--json", "waves.json", cwd=self.dir)
        self.draw("convergence", "bar/verify.json", "-o", "errors")
        self.draw("convergence", "waves.json", "-o", "waves")
        self.draw("runs", "bar/verify.json", "-o", "errors", script=GALLERY)
        self.assertEqual({p.name for p in (self.dir / "errors").iterdir()}, {"vibration-1d.png", "vibration-1d-history.png"})

    def test_a_single_row(self):
        run = self.run_dim(1)
        path = self.dir / "1d-cpdi1" / "history.csv"
        path.write_text("".join(path.read_text().splitlines(keepends=True)[:2]))
        self.draw("energies", run, "-o", "energies.png")

    def test_bad_use(self):
        run = self.run_dim(2)
        self.refused("energies", "missing", "-o", "a.png", told=["missing", "give the directory of a run"])
        self.refused("energies", run, "-o", "missing/a.png", told=["-o missing/a.png", "there is no directory"])
        self.refused("energies", run, "-o", "a.xyz", told=[".png"])
        self.refused("energies", run, run, "-o", "a.png", "--labels", "one", told=["1 names for 2 runs"])
        self.refused("snapshots", run, "-o", "a.png", "--times", 0, "--field", "heat", told=["no field heat", "von_mises"])
        self.refused("snapshots", run, "-o", "a.png", "--times", 0, "--curve", "history.csv:heat", told=["no column heat", "strain_energy"])
        self.refused("convergence", self.write("a.json", "[1]").name, "-o", "b", told=["ordo verify --json"])
        self.write("2d-cpdi1/particles.pvd", "<VTKFile/>")
        self.refused("movie", run, "-o", "a.gif", told=["names no frames"])


class MissingModules(Figures):
    """A module that cannot be imported, before the true one in the path."""

    def without(self, name):
        self.write(f"{name}.py", f"raise ImportError('No module named {name}')")
        return {"PYTHONPATH": str(self.dir)}

    def test_numpy_and_matplotlib(self):
        for name in ("numpy", "matplotlib"):
            with self.subTest(name):
                env = self.without(name)
                told = [f"No module named {name}", f"python3-{name}", "pip install numpy matplotlib vtk"]
                self.refused("summary", "run", told=told, env=env)
                self.refused("runs", "verify.json", "-o", "plots", told=told, env=env, script=GALLERY)
                (self.dir / f"{name}.py").unlink()

    def test_vtk_only_for_particles(self):
        run, env = self.run_dim(2), self.without("vtkmodules")
        self.refused("snapshots", run, "-o", "a.png", "--times", 0, told=["No module named vtkmodules", "python3-vtk9"], env=env)
        self.refused("movie", run, "-o", "a.gif", told=["No module named vtkmodules", "python3-vtk9"], env=env)
        self.draw("energies", run, "-o", "a.png", env=env)


class Movies(Figures):
    def test_gif(self):
        try:
            from PIL import Image
        except ImportError:
            self.skipTest("PIL is missing")
        run = self.run_dim(2)
        count = len(frames(run))
        self.assertEqual(count, 6)
        for every, expected in ((1, 6), (4, 2)):
            self.draw("movie", run, "-o", "movie.gif", "--fps", 5, "--every", every)
            with Image.open(self.dir / "movie.gif") as movie:
                self.assertEqual((movie.n_frames, movie.info["duration"]), (expected, 200))

    def test_mp4(self):
        if not shutil.which("ffmpeg") or not shutil.which("ffprobe"):
            self.skipTest("ffmpeg is missing")
        self.draw("movie", self.run_dim(3), "-o", "movie.mp4", "--field", "stress_xx")
        probe = ["ffprobe", "-v", "error", "-count_frames", "-show_entries", "stream=nb_read_frames", "-of", "csv=p=0", "movie.mp4"]
        self.assertEqual(subprocess.run(probe, cwd=self.dir, capture_output=True, text=True, check=True).stdout.strip(), "6")

    def test_nothing_to_write_it_with(self):
        run = self.run_dim(2)
        self.refused("movie", run, "-o", "movie.mp4", told=["ffmpeg", "apt-get install ffmpeg", ".gif"], env={"PATH": ""})
        self.refused("movie", run, "-o", "movie.avi", told=[".mp4 or .gif"])
        broken = self.write("ffmpeg", "#!/bin/sh\nexit 3\n")
        broken.chmod(0o755)
        self.refused("movie", run, "-o", "movie.mp4", told=["ffmpeg ends", ".gif"], env={"PATH": str(self.dir)})

    def test_limits_are_those_of_all_frames(self):
        """Frames before and after the largest value have its colour scale too, and places of all."""
        run = self.run_case("falling", edit(FALLING, "[output]\ninterval = 0.02\nfields = ['velocity']\n"))
        all_frames = [figures.Frame(str(path)) for _, path in frames(run)]
        scene = figures.Scene(iter(all_frames))
        speeds = [f.scalar("velocity") for f in all_frames]
        self.assertEqual((scene.norm.vmin, scene.norm.vmax), (0, max(s.max() for s in speeds)))
        self.assertGreater(scene.norm.vmax, 3 * speeds[1].max())
        self.assertEqual((scene.low[1], scene.high[1]), (all_frames[-1].corners[..., 1].min(), all_frames[0].corners[..., 1].max()))


class Energies(Figures):
    def table(self, **columns):
        table = np.zeros(3, [(name, float) for name in ("time", "kinetic_energy", "strain_energy", "total_energy", "potential_energy", *columns)])
        table["kinetic_energy"], table["strain_energy"] = [0, 3, 1], [0, 1, 4]
        table["total_energy"] = [0, 4, 5]
        for name, values in columns.items():
            table[name] = values
        return table

    def test_zero_columns_are_not_drawn(self):
        self.assertEqual(self.drawn(self.table()), {"kinetic": [0, 3, 1], "strain": [0, 1, 4], "sum": [0, 4, 5]})
        self.assertEqual(list(self.drawn(self.table(traction_work=0))), ["kinetic", "strain", "sum"])

    def drawn(self, table):
        return {label: list(values) for label, _, values in figures.energy_curves(table)}

    def test_gravity_is_its_change(self):
        table = self.table()
        table["potential_energy"] = [100, 96, 95]
        self.assertEqual(self.drawn(table), {"kinetic": [0, 3, 1], "strain": [0, 1, 4], "gravity": [0, -4, -5], "sum": [0, 0, 0]})
        table["potential_energy"] = 100  # bodies that stay at one height
        self.assertEqual(list(self.drawn(table)), ["kinetic", "strain", "sum"])

    def test_work_counts_in_the_sum(self):
        drawn = self.drawn(self.table(boundary_work=[0, 0, 1], traction_work=[0, -4, -4], body_force_work=[0, 0, -2]))
        self.assertEqual(drawn["sum"], [0, 0, 0])
        self.assertEqual(list(drawn), ["kinetic", "strain", "taken by boundaries", "taken by tractions", "taken by body forces", "sum"])

    def test_contacts_count_in_the_sum(self):
        drawn = self.drawn(self.table(a_friction_work=[0, 1, 1], a_dissipation=[0, 0, 1], punch_friction_work=[0, 0, 1], punch_dissipation=0, punch_work=[0, -6, -8]))
        self.assertEqual((drawn["taken by friction"], drawn["lost in impacts"], drawn["taken by obstacles"]), ([0, 1, 2], [0, 0, 1], [0, -6, -8]))
        self.assertEqual(drawn["sum"], [0, -1, 0])

    def test_a_later_column_is_a_row(self):
        self.addCleanup(setattr, figures, "ENERGIES", figures.ENERGIES)
        figures.ENERGIES = figures.ENERGIES + [("damping_work", "taken by damping", figures.BROWN)]
        drawn = self.drawn(self.table(damping_work=[0, 1, 2]))
        self.assertEqual((drawn["taken by damping"], drawn["sum"]), ([0, 1, 2], [0, 5, 7]))

    def test_a_falling_body_keeps_the_sum(self):
        history = figures.read_history(self.run_case("falling", FALLING))
        drawn = {label: values for label, _, values in figures.energy_curves(history)}
        self.assertGreater(np.ptp(drawn["kinetic"]), 1)
        self.assertLess(np.ptp(drawn["sum"]), 0.05 * np.ptp(drawn["gravity"]))


class Pictures(Figures):
    """What is drawn, before it is written."""

    def setUp(self):
        super().setUp()
        self.addCleanup(setattr, figures, "save", figures.save)
        figures.save = self.keep

    def keep(self, figure, _):
        self.figure = figure
        figures.plt.close(figure)

    def check(self):
        """All texts of the figure; none leaves it, and no two overlap."""
        figure = self.figure
        figure.draw_without_rendering()
        boxes = []
        for a in figure.axes:
            texts = [a.title, *a.texts, *(a.get_legend().get_texts() if a.get_legend() else [])]
            if a.axison:
                for axis, limits in ((a.xaxis, a.get_xlim()), (a.yaxis, a.get_ylim())):
                    inside = [t for t in axis.get_major_ticks() if min(limits) <= t.get_loc() <= max(limits)]
                    texts += [axis.label, axis.get_offset_text(), *(t for tick in inside for t in (tick.label1, tick.label2))]
            boxes += [(t.get_text(), t.get_window_extent()) for t in texts if t.get_text() and t.get_visible()]
        width, height = figure.get_size_inches() * figure.dpi
        for text, box in boxes:
            self.assertTrue(-1 <= box.x0 and box.x1 <= width + 1 and -1 <= box.y0 and box.y1 <= height + 1, f"{text!r} is cut: {box}")
        for (text, a), (other, b) in itertools.combinations(boxes, 2):
            apart = a.x1 <= b.x0 + 1 or b.x1 <= a.x0 + 1 or a.y1 <= b.y0 + 1 or b.y1 <= a.y0 + 1
            self.assertTrue(apart, f"{text!r} and {other!r} overlap")
        return [text for text, _ in boxes]

    def snapshots(self, run, times=(0, 0.01), **options):
        figures.snapshots(run, "", times, **options)
        return self.check()

    def test_room_for_ticks_and_titles(self):
        """Columns and beams, of one panel and of several, beside curves and alone."""
        for name, text in (("tall", TALL), ("flat", FLAT)):
            run = self.run_case(name, text)
            for times, curve in itertools.product(((0.01,), (0, 0.005), (0, 0.002, 0.004, 0.01)), (None, "energies", "history.csv:momentum_x")):
                with self.subTest(f"{name}, {len(times)} times, {curve}"):
                    self.snapshots(run, times, field="von_mises", curve=curve)

    def test_panels_have_their_size(self):
        """Whatever room labels take; lengths are equal along both axes."""
        for name, text, times in (("tall", TALL, (0, 0.01)), ("flat", FLAT, (0, 0.005, 0.01))):
            self.snapshots(self.run_case(name, text), times)
            axes = self.figure.axes[0]
            sides = axes.get_window_extent().size / self.figure.dpi
            self.assertAlmostEqual(max(sides), figures.LONG, delta=0.02 * figures.LONG)
            self.assertGreater(min(sides), 0.98 * figures.SHORT)
            per_metre = axes.transData.transform([(1, 1)]) - axes.transData.transform([(0, 0)])
            self.assertAlmostEqual(per_metre[0][0] / per_metre[0][1], 1, places=6)

    def test_units(self):
        energy, mass = {1: "J/m²", 2: "J/m", 3: "J"}, {1: "kg/m²", 2: "kg/m", 3: "kg"}
        for dim in (1, 2, 3):
            run = self.run_dim(dim)
            self.assertIn(f"energy, {energy[dim]}", self.snapshots(run, curve="energies"))
            self.assertIn(f"kinetic energy, {energy[dim]}", self.snapshots(run, curve="history.csv:kinetic_energy"))
            self.assertIn(f"mass, {mass[dim]}", self.snapshots(run, field="mass"))
            self.assertIn("stress xx, Pa", self.snapshots(run, field="stress_xx"))
            self.assertIn("velocity x, m/s", self.snapshots(run, field="velocity_x"))
            self.assertIn("speed, m/s" if dim > 1 else "velocity, m/s", self.snapshots(run))

    def test_points_have_the_dimension_of_the_case(self):
        """Also where all of them lie on a line."""
        run = self.run_case("line", edit(MOVING, PRESET.format("mpm"), ("shape = \"ball\"", "shape = \"box\""),
                                         ("center = 0.5\nradius = 0.25", "lower = [0.0, 0.5]\nupper = [1.0, 0.75]\nparticles_per_cell = 1")))
        self.assertLessEqual({"x, m", "y, m"}, set(self.snapshots(run)))

    def test_axes_in_3d(self):
        for preset in ("mpm", "cpdi1"):
            run = self.run_dim(3, preset)
            for view in ((-60, 20), (-45, 10), (-125, -25), (0, 90), (-90, 0)):
                with self.subTest(f"{preset}, {view}"):
                    texts = self.snapshots(run, (0.01,), view=figures.View(*view))
                    seen = {"x, m", "y, m", "z, m"} - ({"z, m"} if view[1] == 90 else {"y, m"} if view[1] == 0 else set())
                    self.assertEqual({t for t in texts if t[1:] == ", m"}, seen)
                    self.assertGreaterEqual(len(self.figure.axes[0].texts), 3 * len(seen), "each axis has at least two numbers")

    def test_numbers_at_a_corner_have_room(self):
        """Those of x and y where both axes end."""
        cube = edit(MOVING, ("dim = 2", "dim = 3"), ("shape = \"ball\"", "shape = \"box\""),
                    ("center = 0.5\nradius = 0.25", "lower = 0.0\nupper = 1.0"))
        run = self.run_case("cube", cube)
        for view in ((-45, 10), (-60, 20), (30, 40), (200, -20)):
            with self.subTest(view):
                self.assertLessEqual({"0", "1"}, set(self.snapshots(run, view=figures.View(*view))))

    def test_a_scale_is_at_its_place(self):
        """Seen from the front, the tick of x = 0.5 stands below the middle of the ball."""
        self.snapshots(self.run_dim(3), (0,), view=figures.View(-90, 0))
        (tick,) = [t for t in self.figure.axes[0].texts if t.get_text() == "0.5" and t.get_va() == "top"]
        self.assertAlmostEqual(tick.xy[0], 0.5, places=12)

    def test_legend_is_not_on_the_curves(self):
        figures.energies([self.run_case("falling", FALLING)], "")
        self.check()
        (axes,) = self.figure.axes
        self.assertGreater(axes.get_legend().get_window_extent().y0, axes.get_window_extent().y1)

    def test_axes_of_errors_have_numbers(self):
        """Of two meshes, whose errors lie between two powers of ten."""
        study = {"method": "mpm", "failed": [], "errors": {"displacement": [(0.0625, 0.15), (0.125, 0.3)]}}
        figures.draw_convergence([study], "", ["mpm"], "bar", "")
        texts = self.check()
        self.assertLessEqual({"0.125", "0.0625"}, set(texts))
        self.assertGreaterEqual(len(set(texts) & {"0.05", "0.1", "0.2", "0.5"}), 2, texts)


if __name__ == "__main__":
    unittest.main()
