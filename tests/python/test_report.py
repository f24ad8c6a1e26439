"""Reports: what a page holds, and what headless Chromium shows of it."""

import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import types
import unittest

import numpy as np
from support import ROOT, InTemporaryDirectory, block, needs_hdf5, program

import ordo
from ordo import _units

try:
    from vtkmodules import vtkIOXML  # noqa: F401  (frames are read by it)
except ImportError:
    raise unittest.SkipTest("no VTK: apt-get install python3-vtk9") from None

from ordo.report import _particles, write


def run(folder, name, **changes):
    """Runs the block and returns the folder of its results."""
    sim = ordo.Simulation(ordo.Case.from_dict(block(**changes)), threads=1)
    sim.run(output=folder / name)
    return folder / name


class Frames(InTemporaryDirectory):
    def test_frames_are_what_was_written(self):
        sim = ordo.Simulation(ordo.Case.from_dict(block(output={"interval": 0.01, "fields": ["velocity"]})))
        sim.run(output=self.dir / "run")
        frames = ordo.frames(self.dir / "run")
        self.assertEqual((len(frames), frames.times[0], frames.times[-1]), (3, 0.0, sim.t))
        order = np.argsort(sim.particles.id)
        last = frames[-1]
        np.testing.assert_array_equal(last.x[:, :2], sim.particles.x[order])
        np.testing.assert_array_equal(last.fields["velocity"][:, :2], sim.particles.v[order])
        self.assertEqual((last.dim, last.corners.shape, last.time), (2, (len(sim.particles), 4, 3), sim.t))
        self.assertEqual([frame.time for frame in frames[1:]], frames.times[1:].tolist())

    def test_bad_folders(self):
        with self.assertRaisesRegex(ordo.InputError, "particles.pvd: there is no such file"):
            ordo.frames(self.dir)
        (self.dir / "particles.pvd").write_text("<VTKFile")
        with self.assertRaisesRegex(ordo.InputError, "is not a list of frames"):
            ordo.frames(self.dir)
        (self.dir / "particles.pvd").write_text('<VTKFile><Collection><DataSet timestep="0" file="lost.vtu"/></Collection></VTKFile>')
        with self.assertRaisesRegex(ordo.InputError, "lost.vtu: there is no such file"):
            ordo.frames(self.dir)[0]


class Command(InTemporaryDirectory):
    def report(self, *args):
        return subprocess.run([sys.executable, "-m", "ordo.report", *map(str, args)], cwd=self.dir, capture_output=True, text=True, timeout=300, check=False)

    def test_the_hint_of_a_run_works(self):
        (self.dir / "block.toml").write_text(str(ordo.Case.from_dict(block(output={"interval": 0.01}))))
        said = program("run", "block.toml", "--output", "it's here", cwd=self.dir).stderr
        hint = re.search(r"to look at it: (.*)", said)[1]
        done = subprocess.run(hint.replace("python3", sys.executable), shell=True, cwd=self.dir, env={**os.environ, "PYTHONPATH": ""}, capture_output=True, text=True, timeout=300, check=False)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertRegex(done.stdout, r"^wrote it's here/report.html, [\d.]+ MB\n$")
        self.assertEqual(sorted(p.name for p in (self.dir / "it's here").glob("*.part")), [])

    def test_bad_input(self):
        folder = run(self.dir, "run", output={"interval": 0.01, "fields": ["velocity"]})
        (self.dir / "notes.html").write_text("mine")
        (self.dir / "empty").mkdir()
        for args, code, words in [(["nowhere"], 2, "nowhere: there is no such folder"), (["empty"], 2, "holds neither case.toml"),
                                  (["run", "--fields", "heat"], 2, "no field heat; they have body, material, velocity"), (["run", "--every", 0], 2, "every must be"),
                                  (["run", "--limit", 1e-4], 2, "two frames take"), (["run", "-o", "notes.html"], 1, "is there and is no report"),
                                  (["run", "-o", "no/folder/r.html"], 1, "cannot be written")]:
            done = self.report(*args)
            self.assertEqual(done.returncode, code, args)
            self.assertIn(words, done.stderr)
            self.assertNotIn("Traceback", done.stderr)
        self.assertEqual((self.dir / "notes.html").read_text(), "mine")
        last = sorted(folder.glob("*.vtu"))[-1]
        last.write_bytes(last.read_bytes()[:2000])
        done = self.report("run")
        self.assertEqual(done.returncode, 2)
        self.assertIn(f"{last.name}: is no VTU file, or only a part of one", done.stderr)
        self.assertFalse((folder / "report.html").exists())

    def test_verify_json_that_is_none(self):
        for text in ("[", "{}", '[{"case": 1}]'):
            (self.dir / "verify.json").write_text(text)
            self.assertIn("is not what `ordo verify --data` writes", self.report(".").stderr)


class Limits(InTemporaryDirectory):
    """A page stays below its limit, and says what it leaves out."""

    def test_coarser_then_fewer_frames(self):
        folder = run(self.dir, "run", grid__spacing=0.03125, output={"interval": 0.001})
        sizes, notes = [], []
        whole = write(folder).read_text(encoding="utf-8")
        packed = sum(map(len, re.findall(r'id="(?:place|offset|field) [^>]*>(.*?)</script>', whole)))
        rest = len(whole.encode()) - packed + 25_000
        for limit in (10, (rest + 0.5 * packed) / 1e6, (rest + 0.1 * packed) / 1e6):
            page = write(folder, self.dir / f"{limit}.html", limit=limit)
            self.assertLess(page.stat().st_size, limit * 1e6)
            data = self.data_of(page)
            sizes.append(len(data["particles"]["times"]))
            notes.append(" ".join(data["notes"]))
            self.assertEqual((data["particles"]["times"][0], data["particles"]["times"][-1]), (0.0, 0.02))
        self.assertEqual((sizes[0], notes[0]), (21, ""))
        self.assertGreater(sizes[0], sizes[2])
        self.assertIn(f"{sizes[2]} of 21 frames are shown", notes[2])
        self.assertRegex(notes[2], "Places are rounded to 1/3[12] of a small particle's size. Fields are rounded to 1/254 of their range.")

    def data_of(self, page):
        return json.loads(re.search(r'id="data">(.*?)</script>', page.read_text(encoding="utf-8"))[1])

    def test_what_numbers_are_good_to_is_said(self):
        """A grid that is large against its particles, and a domain that is large against the others."""
        far = run(self.dir, "far", grid={"size": [100.0, 1.0], "spacing": [0.125, 0.125]}, output={"interval": 0.01},
                  body=[{"material": "rubber", "shape": "box", "lower": [x, 0.25], "upper": [x + 0.25, 0.5]} for x in (0.25, 98.0)])
        data = self.data_of(write(far))
        self.assertRegex(" ".join(data["notes"]), r"Places are rounded to 1/4\d of a small particle's size")  # 65534 steps in 98 m
        found = _particles.Survey(None, 2, "axes", size=1.0, small=1.0, scalars=[], reach=200.0)
        about = {"step": [1 / 512] * 3, "side": 200.0 / 32767}
        self.assertIn("1/164 of", _particles.notes_on(about, found, _particles.PRECISIONS[0])[0])

    def test_outliers(self):
        values = np.linspace(-1.0, 1.0, 1000)
        values[[3, 5, 7]] = 1e25, np.nan, 1e39
        frame = types.SimpleNamespace(fields={"stress": values})
        one = _particles.Scalar("stress", "stress", 0)
        one.see(frame)
        one.settle()
        self.assertTrue(one.is_clipped)
        self.assertLess(one.step(65534), 1e-3)
        self.assertEqual((one.low, round(one.high, 0)), (-1.0, 21.0))
        codes = _particles.codes(one.of(frame), one.low, one.step(65534), 65534)
        self.assertEqual(codes[[3, 5, 7]].tolist(), [65535, 0, 0])
        np.testing.assert_allclose(one.low + one.step(65534) * (codes[10:] - 1.0), values[10:], atol=one.step(65534))

    def test_units(self):
        """Those of the texts of the laws, and of docs/output.md."""
        texts = "".join(file.read_text(encoding="utf-8") for file in (ROOT / "src/material").glob("*.hpp"))
        columns = dict(re.findall(r'HistoryColumn\{"(\w+)",\s+"[^"]*?(?:, ([A-Z][\w/^]*))?"\}', texts))
        self.assertGreaterEqual(len(columns), 5)
        for name, unit in columns.items():
            self.assertEqual(_units.field_unit(name, 2), unit.replace("^3", "³"), name)
        for name, unit in {"internal_energy": "J/m³", "stress_xx": "Pa", "mass": "kg/m", "deformation_gradient_xy": "", "plastic_strain": "", "time": "s"}.items():
            self.assertEqual(_units.field_unit(name, 2), unit, name)
        for name, unit in {"dt": "s", "kinetic_energy": "J/m", "projection_momentum_x_before": "kg/s", "density_x": "m", "force_rotation_z": "rad/s",
                           "floor_moment_z": "N", "a_b_friction_work": "J/m", "a_dissipation": "J/m", "center_x": "m", "angular_momentum_z": "kg m/s",
                           "dropped_pivots": "", "stage": "", "pressure_force_x": "N/m"}.items():
            self.assertEqual(_units.column_unit(name, 2), unit, name)

    def test_files_of_others(self):
        folder = run(self.dir, "run", output={"interval": 0.01, "per_body": True}, probe=[{"name": "a", "particle": [0.5, 0.5]}])
        (folder / "body_notes.csv").write_text("mine")
        (folder / "probe_a.csv").write_text("time,x\n1,\n")
        data = self.data_of(write(folder))
        self.assertEqual(sorted(data["tables"]), ["body_0", "history"])
        self.assertEqual(data["notes"], [f"{folder / 'probe_a.csv'}: is not a table of numbers."])

    def test_wrong_arguments(self):
        folder = run(self.dir, "run", output={"interval": 0.01})
        for arguments in ({"every": 1.5}, {"every": "2"}, {"limit": "60"}, {"limit": float("nan")}, {"fields": "velocity"}, {"fields": [1]}, {"directory": None}):
            with self.assertRaises(ordo.InputError, msg=arguments):
                write(**{"directory": folder, **arguments})
        with self.assertRaisesRegex(ordo.OutputError, "cannot be written"):
            write(folder, self.dir)
        (self.dir / "elsewhere.html").symlink_to(folder / "real.html")
        write(folder, self.dir / "elsewhere.html")
        self.assertTrue((self.dir / "elsewhere.html").is_symlink() and (folder / "real.html").is_file())

    @needs_hdf5
    def test_obstacles_after_a_restart(self):
        """Their places are those of the files, although history.csv begins late."""
        case = block(obstacle=[{"name": "post", "shape": "box", "lower": [0.8, 0.8], "upper": [0.9, 0.95], "velocity": [5.0, 0.0], "rotation": 20.0}],
                     output={"interval": 0.005}, grid__origin=[500000.0, 4000000.0])
        case["body"][0] |= {"lower": [500000.25, 4000000.25], "upper": [500000.75, 4000000.75]}
        case["obstacle"][0] |= {"lower": [500000.8, 4000000.8], "upper": [500000.9, 4000000.95]}
        sim = ordo.Simulation(ordo.Case.from_dict(case), threads=1)
        sim.run(until=0.01)
        sim.save(self.dir / "half.h5")
        (self.dir / "case.toml").write_text(str(ordo.Case.from_dict(case)))
        program("run", "case.toml", "--restart", "half.h5", "--output", "late", cwd=self.dir)
        data = self.data_of(write(self.dir / "late"))
        (post,) = data["particles"]["obstacles"]
        np.testing.assert_allclose(post["places"][:3], [500000.9, 4000000.875, 0], atol=1e-5)
        np.testing.assert_allclose(np.reshape(post["triangles"], (-1, 3)).min(axis=0), [-0.05, -0.075, 0], atol=1e-5)
        self.assertIn("How far post had turned before the first row of history.csv is not known.", data["notes"])

    def test_a_hostile_title(self):
        title = "</script><script>document.title = 'lost'</script><!-- &amp; \u2028 {{scripts}}"
        folder = run(self.dir, "run", title=title)
        text = write(folder).read_text(encoding="utf-8")
        self.assertEqual(json.loads(re.search(r'id="data">(.*?)</script>', text)[1])["case"]["title"], title)
        self.assertEqual(text.count("<script"), text.count("</script>"))


def driver():
    """Headless Chromium that keeps its console; skips the tests where there is none."""
    try:
        from selenium import webdriver
        from selenium.webdriver.chrome.options import Options
        from selenium.webdriver.chrome.service import Service
    except ImportError:
        raise unittest.SkipTest("no browser: apt-get install chromium chromium-driver python3-selenium") from None
    if not pathlib.Path("/usr/bin/chromedriver").exists():
        raise unittest.SkipTest("no browser: apt-get install chromium chromium-driver")
    options = Options()
    options.binary_location = "/usr/bin/chromium"
    for one in ("--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--window-size=1300,1000", "--no-first-run",
                "--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-quic", "--disable-dev-shm-usage"):
        options.add_argument(one)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    without = {name: value for name, value in os.environ.items() if name != "LD_PRELOAD"}  # an instrumented module's sanitizer
    return webdriver.Chrome(service=Service("/usr/bin/chromedriver", env=without), options=options)


class Page(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.browser = driver()
        cls.addClassCleanup(cls.browser.quit)
        cls.browser.set_script_timeout(120)
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.dir = pathlib.Path(folder.name)

    def open(self, page):
        self.browser.get(page.resolve().as_uri())
        self.assertEqual(self.asks("return await window.report.then(() => 'shown')"), "shown")
        self.asks("document.querySelectorAll('.plot').forEach((box) => box.make()); return 0")  # they wait until they are in sight

    def asks(self, body):
        """What an asynchronous function in the page returns; `r` is the report."""
        code = f"const done = arguments[0]; (async () => {{ const r = await window.report; {body} }})().then(done, (e) => done('error: ' + e.stack))"
        return self.browser.execute_async_script(code)

    def picture(self):
        """Counts of the colours of the canvas."""
        return self.asks("""r.viewer.draw();
            const gl = r.viewer.renderer.getContext(), [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight], bytes = new Uint8Array(4*w*h);
            gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
            const found = {};
            for (let k = 0; k < bytes.length; k += 4) { if (bytes[k + 3]) { const c = bytes.slice(k, k + 3).join(); found[c] = (found[c] ?? 0) + 1; } }
            return found;""")

    def slide(self, frame):
        self.browser.execute_script("const s = document.getElementById('time'); s.value = arguments[0]; s.dispatchEvent(new Event('input'))", frame)

    def assert_clean(self):
        self.assertEqual([line["message"] for line in self.browser.get_log("browser")], [])
        self.assertEqual(self.browser.execute_script("return performance.getEntriesByType('resource').map((e) => e.name)"), [])

    def assert_shows(self, folder, frame, tolerance):
        """Places, corners and fields in the page are those of the files."""
        expected = ordo.frames(folder)[frame]
        self.slide(frame)
        found = self.asks("""const {about} = r.viewer, n = about.count, places = [], values = {};
            for (let k = 0; k < n; ++k) { const x = r.viewer.at(k); places.push([x.x, x.y, x.z]); }
            for (const field of r.state.fields) { await r.pickField(field); values[field.label] = [...r.state.values.subarray(r.state.frame*n, (r.state.frame + 1)*n)].map((v) => v + field.base); }
            const offsets = r.viewer.offsets.map((planes) => planes.map((p) => [...p.subarray(r.state.frame*n, (r.state.frame + 1)*n)]));
            return {places, values, offsets, middle: about.middle, side: about.side, corners: about.corners, kind: about.kind, times: about.times,
                    steps: Object.fromEntries(about.fields.map((f) => [f.name, f.step]))};""")
        self.assertNotIsInstance(found, str, found)
        self.assertAlmostEqual(found["times"][frame], expected.time, delta=1e-12)
        size = np.ptp(expected.corners, axis=1).max() or 0.05
        np.testing.assert_allclose(found["places"], expected.x, atol=tolerance * size)
        if found["kind"] != "points":
            offsets = (np.moveaxis(np.array(found["offsets"], float), 2, 0) - found["middle"]) * found["side"]
            dim = offsets.shape[2]
            if found["kind"] == "axes":
                offsets = np.einsum("cs,nsd->ncd", np.array(found["corners"]), offsets)
            np.testing.assert_allclose(offsets, (expected.corners - expected.x[:, None])[..., :dim], atol=2 * tolerance * size)
        stress, velocity, steps = expected.fields["stress"], expected.fields["velocity"], found["steps"]
        np.testing.assert_allclose(found["values"]["stress xx"], stress[:, 0], rtol=1e-6, atol=0.51 * steps["stress_xx"])
        np.testing.assert_allclose(found["values"]["velocity x"], velocity[:, 0], rtol=1e-6, atol=0.51 * steps["velocity_x"])
        self.assertLess(steps["velocity_x"], 1e-4)
        if "velocity (size)" in found["values"]:
            np.testing.assert_allclose(found["values"]["velocity (size)"], np.linalg.norm(velocity, axis=1), atol=2 * steps["velocity_x"])
        self.assertEqual(found["values"]["body"], expected.fields["body"].tolist())

    def test_a_plane_run(self):
        folder = run(self.dir, "plane", output={"interval": 0.002, "fields": ["velocity", "stress", "density"]}, probe=[{"name": "middle", "particle": [0.5, 0.5]}])
        self.open(write(folder))
        self.assertEqual(self.browser.execute_script("return document.querySelector('.bar .title').textContent"), "velocity (size), m/s")
        first = self.picture()
        self.assertGreater(len(first), 20)                # many colours
        self.assert_shows(folder, 4, 1 / 400)
        self.slide(0)
        self.assertNotEqual(self.picture(), first)
        self.assertEqual(self.browser.execute_script("return document.getElementById('clock').textContent"), "0 s")
        titles = self.browser.execute_script("return [...document.querySelectorAll('h2')].map((h) => h.textContent)")
        self.assertEqual(titles, ["Particles", "Energy", "Momentum", "Columns of history.csv", "probe middle", "Case"])
        drawn = self.browser.execute_script("""return [...document.querySelectorAll('.plot canvas')].map((c) => {
            const bytes = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; return new Set(new Uint32Array(bytes.buffer)).size; })""")
        self.assertGreater(min(drawn), 5)
        history = ordo.history(folder)
        time, *curves = self.browser.execute_script("return document.querySelector('.plot').plot.data.map((values) => [...values])")
        np.testing.assert_allclose(time, history["time"], rtol=1e-6)
        np.testing.assert_allclose(curves[:2], [history["kinetic_energy"], history["strain_energy"]], rtol=1e-6)
        np.testing.assert_allclose(curves[-1], history["total_energy"], rtol=1e-6)
        self.assert_clean()

    def test_colours_are_where_particles_are(self):
        """The pixel at a particle's centre has the colour of its value."""
        folder = run(self.dir, "coloured", output={"interval": 0.01, "fields": ["velocity"]})
        for points in (False, True):
            self.open(write(folder, points=points))
            found = self.asks("""r.viewer.outlines = false; r.viewer.draw();
                const gl = r.viewer.renderer.getContext(), ratio = gl.drawingBufferHeight/r.viewer.box.clientHeight, map = colourBytes("viridis", 256), rows = [];
                for (let k = 0; k < r.viewer.about.count; ++k) {
                  const [x, y] = r.viewer.pixel(r.viewer.at(k)), pixel = new Uint8Array(4);
                  gl.readPixels(Math.round(x*ratio), gl.drawingBufferHeight - Math.round(y*ratio), 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
                  const value = r.state.values[r.state.frame*r.viewer.about.count + k] + r.state.choice.base;
                  const at = Math.round(255*(value - r.state.low)/(r.state.high - r.state.low));
                  rows.push([...pixel.slice(0, 3), ...map.slice(4*at, 4*at + 3)]);
                }
                return rows;""")
            self.assertNotIsInstance(found, str, found)
            np.testing.assert_allclose(np.array(found)[:, :3], np.array(found)[:, 3:], atol=3)

    def test_ranges(self):
        folder = run(self.dir, "ranges", output={"interval": 0.01, "fields": ["density"]})
        self.open(write(folder))
        density = np.concatenate([frame.fields["density"] for frame in ordo.frames(folder)])

        def ends(*typed):
            for name, text in typed:
                self.browser.execute_script("const i = document.getElementById(arguments[0]); i.value = arguments[1]; i.dispatchEvent(new Event('change'))", name, text)
            return self.asks("return [r.state.low, r.state.high, document.getElementById('low').value, document.querySelectorAll('input.bad').length]")

        self.asks("await r.pickField(r.state.fields.find((f) => f.name === 'density')); return 0")
        low, high, *_ = ends()
        np.testing.assert_allclose([low, high], [density.min(), density.max()], rtol=1e-9)
        self.assertEqual(ends(("low", "999.5"))[::2], [999.5, "999.5"])
        self.assertEqual(ends(("high", "1001,25"))[:2], [999.5, 1001.25])
        for bad in ("", "many", "2000"):
            self.assertEqual(ends(("low", bad)), [999.5, 1001.25, bad, 1])
        self.browser.execute_script("[...document.querySelectorAll('button')].find((b) => b.textContent === '98 %').click()")
        np.testing.assert_allclose(ends()[:2], np.quantile(density, [0.01, 0.99]), rtol=1e-3)
        self.browser.execute_script("[...document.querySelectorAll('button')].find((b) => b.textContent === 'This frame').click()")
        last = ordo.frames(folder)[-1].fields["density"]
        np.testing.assert_allclose(ends()[:2], [last.min(), last.max()], rtol=1e-7)
        self.assert_clean()

    def test_play_turns_the_pages(self):
        folder = run(self.dir, "played", output={"interval": 0.0005})
        self.open(write(folder))
        self.slide(0)
        frames = self.asks("""const seen = []; r.state.speed = 20; r.setPlaying(true);
            while (r.state.playing) { seen.push(r.state.frame); await new Promise((go) => requestAnimationFrame(go)); }
            return [...new Set(seen), r.state.frame];""")
        self.assertGreater(len(set(frames)), 3)
        self.assertEqual(frames[-1], 40)
        self.assert_clean()

    def test_dark_and_light(self):
        folder = run(self.dir, "looks", output={"interval": 0.01})
        self.open(write(folder))
        colours = []
        for _ in range(2):
            self.browser.execute_script("document.getElementById('look').click()")
            colours.append(self.browser.execute_script("return [getComputedStyle(document.body).backgroundColor, document.documentElement.dataset.look]"))
        self.assertEqual({look for _, look in colours}, {"dark", "light"})
        self.assertNotEqual(colours[0][0], colours[1][0])
        self.assert_clean()

    def test_zoom_turn_and_pick(self):
        folder = run(self.dir, "turned", **SPACE)
        self.open(write(folder))
        self.assert_shows(folder, 1, 1 / 400)
        before = self.picture()
        self.asks("r.viewer.camera.position.set(3, 1, 1); r.viewer.controls.update(); return 0")
        turned = self.picture()
        self.assertNotEqual(turned, before)
        found = self.asks("const [x, y] = r.viewer.pixel(r.viewer.at(3)); return [r.viewer.pick(x, y) !== null, r.viewer.pick(-500, -500)]")
        self.assertEqual(found, [True, None])
        picture = self.asks("const c = r.save(); const p = c.getContext('2d').getImageData(c.width - 150, 100, 16, 100).data; return new Set(p).size")
        self.assertGreater(picture, 20)  # the colour bar is in it
        self.asks("r.viewer.home(); return 0")
        self.assertEqual(self.picture(), before)
        self.assert_clean()

    def test_cells_points_and_a_bar(self):
        for name, changes in (("cells", {"method__preset": "cpdi2"}), ("points", {"method__preset": "apic"}), ("bar", BAR), ("triangles", {"method__preset": "cpdi2t"})):
            folder = run(self.dir, name, output={"interval": 0.01, "fields": ["velocity", "stress"]}, **changes)
            self.open(write(folder))
            self.assertGreater(len(self.picture()), 10, name)
            self.assert_shows(folder, 2, 1 / 400)
            self.assert_clean()

    def test_obstacles_turn(self):
        folder = run(self.dir, "obstacles", obstacle=[
            {"name": "wheel", "shape": "ball", "center": [0.5, 0.14], "radius": 0.1, "rotation": 20.0, "velocity": [0.5, 0.0]},
            {"name": "floor", "shape": "half-space", "point": [0.0, 0.02], "normal": [0.0, 1.0]}], output={"interval": 0.005})
        self.open(write(folder))
        found = self.asks("return r.viewer.about.obstacles.map((o) => [o.places.slice(-3), o.turns.slice(-4)])")
        np.testing.assert_allclose(found[0][0], [0.51, 0.14, 0], atol=1e-4)
        np.testing.assert_allclose(found[0][1], [0, 0, np.sin(0.2), np.cos(0.2)], atol=2e-2)
        greys = {c for c in self.picture() if len(set(c.split(","))) == 1}
        self.assertTrue({"158,158,158", "138,138,138"} <= greys, greys)
        floor = self.asks("return r.viewer.about.obstacles[1]")
        corners = np.reshape(floor["triangles"], (-1, 3)) + floor["places"][:3]
        np.testing.assert_allclose([corners.min(axis=0)[0], *corners.max(axis=0)], [0.0, 1.0, 0.02, 0.0], atol=1e-6)
        self.asks("r.viewer.obstaclesShown = false; return 0")
        self.assertFalse({"158,158,158", "138,138,138"} & set(self.picture()))
        self.assert_clean()

    def test_verify(self):
        program("verify", "vibration-1d", "--method", "mpm,cpdi1", "--cells", "32,64,128", "--data", "studies", cwd=self.dir)
        self.open(write(self.dir / "studies"))
        text = self.browser.execute_script("return document.querySelector('main').innerText")
        studies = json.loads((self.dir / "studies" / "verify.json").read_text())
        for study in studies:
            self.assertIn(study["method"], text)
            for row in study["rows"]:
                self.assertIn(f"failed: {row['failed']}" if row["failed"] else f"{row['order']['displacement']:.2f}" if row["order"] else str(row["particles"]), text)
        self.assertTrue(any(row["failed"] for study in studies for row in study["rows"]))
        self.assertGreaterEqual(self.browser.execute_script("return document.querySelectorAll('.plot canvas').length"), 3)
        self.assert_clean()

    def test_an_error_shows(self):
        folder = run(self.dir, "broken", output={"interval": 0.01})
        page = write(folder)
        page.write_text(page.read_text().replace('id="place y"', 'id="lost"'))
        self.browser.get(page.as_uri())
        self.assertIn("error", self.asks("return 0"))
        text = self.browser.execute_script("return document.body.innerText")
        self.assertIn("The particles cannot be shown", text)
        self.assertIn("Energy", text)


SPACE = {"grid": {"size": [1.0] * 3, "spacing": [0.25] * 3}, "output": {"interval": 0.01, "fields": ["velocity", "stress"]},
         "body": [{"material": "rubber", "shape": "box", "lower": [0.25] * 3, "upper": [0.75] * 3, "velocity": ["sin(6*x)", "0", "cos(5*y)"]}]}
BAR = {"grid": {"size": [1.0], "spacing": [0.0625]}, "body": [{"material": "rubber", "shape": "box", "lower": [0.25], "upper": [0.75], "velocity": ["sin(6*x)"]}]}

if __name__ == "__main__":
    unittest.main()
