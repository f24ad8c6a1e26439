"""Cells, meshes and tractions from outside: what is drawn, what is conserved, what the answer should be."""

import unittest

import numpy
from harness import ROOT, InTemporaryDirectory, has_gmsh, history, ordo, particle_data, read_vtk

BLOCK = """\
[grid]
dim = 2
size = 1.0
spacing = 0.125

[method]
preset = "cpdi2"

[time]
end = 0.02
dt = 0.001

[[material]]
name = "rubber"
density = 1000.0
young = 1e4
poisson = 0.3

[[body]]
name = "block"
material = "rubber"
shape = "box"
lower = [0.25, 0.25]
upper = [0.75, 0.75]

[output]
directory = "out"
interval = 0.02
fields = ["stress", "mass", "volume"]
"""
PULL = """
[[traction]]
body = "block"
face = "x-max"
type = "dead"
value = [3.0, -1.0]
"""
MESH = 'name = "block"\nmaterial = "rubber"\nshape = "mesh"\nfile = "{}"\n'
BOX = 'name = "block"\nmaterial = "rubber"\nshape = "box"\nlower = [0.25, 0.25]\nupper = [0.75, 0.75]\n'
QUAD, TRIANGLE = 9, 5
DOMAINS = ("mpm", "ugimp", "cpgimp", "cpdi1", "cpdi2", "cpdi2t")


def corners(frame):
    """The corners of each cell, counter-clockwise."""
    return [numpy.array(frame.GetCell(k).GetPoints().GetData()) for k in range(frame.GetNumberOfCells())]


def area(x):
    return 0.5 * sum(x[k - 1][0] * x[k][1] - x[k][0] * x[k - 1][1] for k in range(len(x)))


class Domains(InTemporaryDirectory):
    def run_case(self, text, *args):
        self.write("case.toml", text)
        self.run_good("case.toml", *args)
        return self.dir / "out"


class Cells(Domains):
    def test_cells_are_drawn_without_gaps(self):
        for preset, kind, count in (("cpdi2", QUAD, 64), ("cpdi2t", TRIANGLE, 128)):
            with self.subTest(preset):
                out = self.run_case(BLOCK + PULL, "--set", f"method.preset={preset}")
                frame = read_vtk(out / "particles_000001.vtu")
                cells = corners(frame)
                self.assertEqual({frame.GetCellType(k) for k in range(frame.GetNumberOfCells())}, {kind})
                self.assertEqual(len(cells), count)
                numpy.testing.assert_allclose([area(x) for x in cells], particle_data(frame)["volume"], rtol=1e-12)
                # 9 x 9 corners, each drawn by every cell that has it
                self.assertEqual(len({tuple(numpy.round(x, 12)) for c in cells for x in c}), 81)

    def test_every_preset_keeps_mass_and_momentum(self):
        for preset in DOMAINS + ("bsmpm", "ddmpm"):
            with self.subTest(preset):
                rows = history(self.run_case(BLOCK + PULL, "--set", f"method.preset={preset}"))
                self.assertAlmostEqual(rows["mass"][-1], 250, places=9)
                # Force times time; velocities live half a step before.
                self.assertAlmostEqual(rows["momentum_x"][-1], 0.5 * 3.0 * 0.0195, delta=1e-10)
                self.assertAlmostEqual(rows["momentum_y"][-1], -0.5 * 0.0195, delta=1e-10)


class Pressure(Domains):
    def test_a_pressure_on_all_faces_is_the_stress(self):
        """Slowly, a block under p comes to sigma = -p I."""
        load = '\n[[traction]]\nbody = "block"\nface = "all"\nvalue = "10*min(t/2, 1)"\n'
        for preset in ("cpdi1", "cpdi2", "cpdi2t"):
            out = self.run_case(BLOCK + load, "--set", f"method.preset={preset}", "--set", "time.end=3", "--set", "time.dt=0.01",
                                "--set", "output.interval=3", "--set", "method.pic_fraction=0.02")
            stress = particle_data(read_vtk(out / "particles_000001.vtu"))["stress"].mean(axis=0)
            with self.subTest(preset):
                self.assertAlmostEqual(stress[0], -10, delta=0.1)
                self.assertAlmostEqual(stress[4], -10, delta=0.1)
                self.assertAlmostEqual(stress[1], 0, delta=0.1)


    def force(self, *args):
        """The force along x of a dead load of 100 Pa."""
        rows = history(self.run_case(BLOCK + PULL, "--set", "traction.0.value=[100, 0]", *args))
        return rows["momentum_x"][-1] / 0.0195

    def test_a_list_of_faces_is_their_union(self):
        for faces, area in (("['x-max']", 0.5), ("['x-max', 'x-max']", 0.5), ("['x-max', 'x-min']", 1.0), ("['x-max', 'all']", 2.0)):
            with self.subTest(faces):
                self.assertAlmostEqual(self.force("--set", f"traction.0.face={faces}"), 100 * area, places=8)

    def test_outer_faces_of_a_round_body_are_all_of_them(self):
        ball = ('--set', 'body.0.shape=ring', '--set', 'body.0.center=[0.5, 0.5]', '--set', 'body.0.radius=0.3', '--set', 'body.0.inner_radius=0.1')
        text = BLOCK.replace("lower = [0.25, 0.25]\nupper = [0.75, 0.75]\n", "")
        forces = {}
        for faces in ("all", "outer", "inner"):
            rows = history(self.run_case(text + PULL, "--set", "traction.0.value=[100, 0]", "--set", f"traction.0.face={faces}", *ball))
            forces[faces] = rows["momentum_x"][-1]
        self.assertGreater(forces["inner"], 0)
        self.assertAlmostEqual(forces["inner"] + forces["outer"], forces["all"], places=8)

    def test_the_seam_of_a_periodic_body_is_no_face(self):
        text = BLOCK.replace("lower = [0.25, 0.25]\nupper = [0.75, 0.75]", "lower = [0.0, 0.25]\nupper = [1.0, 0.75]")
        wall = '\n[[boundary]]\nface = "x-min"\ntype = "periodic"\n'
        self.write("case.toml", text + wall + PULL)
        done = ordo("check", "case.toml", cwd=self.dir)
        self.assertEqual(done.returncode, 2)
        self.assertIn('no face "x-max"', done.stderr)


class Meshes(Domains):
    @unittest.skipUnless(has_gmsh(), "ordo was built without Gmsh")
    def test_a_mesh_is_a_body(self):
        mesh = MESH.format(ROOT / "tests" / "data" / "square.msh")
        text = BLOCK.replace(BOX, mesh).replace("size = 1.0", "size = 2.0")
        self.write("case.toml", text)
        for preset in ("cpdi2", "cpdi2t", "mpm", "cpdi1"):
            for group, area in ((None, 1.0), ("left", 0.5)):
                with self.subTest(preset, group=group):
                    more = () if group is None else ("--set", f"body.0.group={group}")
                    self.run_good("case.toml", "--set", f"method.preset={preset}", *more)
                    fields = particle_data(read_vtk(self.dir / "out" / "particles_000001.vtu"))
                    self.assertAlmostEqual(fields["mass"].sum() / 1000, area, places=9)

    def test_bad_meshes(self):
        for name, why in (("missing.msh", "missing.msh"), ("cube_tets.msh", "3")):
            with self.subTest(name):
                self.write("case.toml", BLOCK.replace(BOX, MESH.format(ROOT / "tests" / "data" / name)))
                done = ordo("check", "case.toml", cwd=self.dir)
                self.assertEqual(done.returncode, 2)
                self.assertIn("body[0].file", done.stderr)
                if "built without Gmsh" not in done.stderr:
                    self.assertIn(why, done.stderr)
