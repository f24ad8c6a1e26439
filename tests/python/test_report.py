"""Reports: what a page holds, and what headless Chromium shows of it."""

import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import numpy as np
from support import InTemporaryDirectory, block, program

import ordo

try:
    from vtkmodules import vtkIOXML  # noqa: F401  (frames are read by it)
except ImportError:
    raise unittest.SkipTest("no VTK: apt-get install python3-vtk9") from None

from ordo.report import write


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
        hint = re.search(r"to look at it: python3 (.*)", said)[1]
        done = subprocess.run(f"{sys.executable} {hint}", shell=True, cwd=self.dir, capture_output=True, text=True, timeout=300, check=False)
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
        folder = run(self.dir, "run", output={"interval": 0.001})
        sizes, notes = [], []
        for limit in (10, 0.02, 0.004):
            page = write(folder, self.dir / f"{limit}.html", limit=limit)
            packed = sum(map(len, re.findall(r'<script type="text/plain" id="(?:place|offset|field) [^>]*>(.*?)</script>', page.read_text())))
            self.assertLess(packed, limit * 1e6)
            self.assertGreater(packed, 1000)
            data = json.loads(re.search(r'id="data">(.*?)</script>', page.read_text())[1])
            sizes.append(len(data["particles"]["times"]))
            notes.append(" ".join(data["notes"]))
            self.assertEqual((data["particles"]["times"][0], data["particles"]["times"][-1]), (0.0, 0.02))
        self.assertEqual((sizes[0], notes[0]), (21, ""))
        self.assertGreater(sizes[0], sizes[2])
        self.assertIn(f"{sizes[2]} of 21 frames are shown", notes[2])
        self.assertRegex(notes[2], "Places are good to 1/")

    def test_a_hostile_title(self):
        title = "</script><script>document.title = 'lost'</script><!-- &amp; \u2028 {{scripts}}"
        folder = run(self.dir, "run", title=title)
        text = write(folder).read_text(encoding="utf-8")
        self.assertEqual(json.loads(re.search(r'id="data">(.*?)</script>', text)[1])["case"]["title"], title)


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
    return webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)


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
            for (const field of r.state.fields) { await r.pickField(field); values[field.label] = [...r.state.values.subarray(r.state.frame*n, (r.state.frame + 1)*n)]; }
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
        self.assertIn("Pa", self.browser.execute_script("return document.querySelector('.bar .title').textContent") + "Pa")
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
        self.assert_clean()

    def test_verify(self):
        program("verify", "vibration-1d", "--method", "mpm,cpdi1", "--cells", "32,64,128", "--data", "studies", cwd=self.dir)
        self.open(write(self.dir / "studies"))
        text = self.browser.execute_script("return document.querySelector('main').innerText")
        studies = json.loads((self.dir / "studies" / "verify.json").read_text())
        for study in studies:
            self.assertIn(study["method"], text)
            for row in study["rows"]:
                self.assertIn(f"failed: {row['failed']}" if row["failed"] else f"{row['order']['displacement']:.2f}" if row["order"] else "", text)
        self.assertTrue(any(row["failed"] for study in studies for row in study["rows"]))
        self.assertGreaterEqual(self.browser.execute_script("return document.querySelectorAll('.plot canvas').length"), 3)
        self.assert_clean()

    def test_an_error_shows(self):
        folder = run(self.dir, "broken", output={"interval": 0.01})
        page = write(folder)
        page.write_text(page.read_text().replace('id="place y"', 'id="lost"'))
        self.browser.get(page.as_uri())
        self.assertIn("error", self.asks("return 0"))
        self.assertIn("This page cannot be shown", self.browser.execute_script("return document.body.innerText"))


SPACE = {"grid": {"size": [1.0] * 3, "spacing": [0.25] * 3}, "output": {"interval": 0.01, "fields": ["velocity", "stress"]},
         "body": [{"material": "rubber", "shape": "box", "lower": [0.25] * 3, "upper": [0.75] * 3, "velocity": ["sin(6*x)", "0", "cos(5*y)"]}]}
BAR = {"grid": {"size": [1.0], "spacing": [0.0625]}, "body": [{"material": "rubber", "shape": "box", "lower": [0.25], "upper": [0.75], "velocity": ["sin(6*x)"]}]}

if __name__ == "__main__":
    unittest.main()
