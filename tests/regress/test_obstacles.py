"""Rigid obstacles: bodies slide and stick on them as rigid bodies do, forces move those with mass, and a restart keeps all of it."""

import math
import shutil
import struct
import unittest

import numpy

from harness import InTemporaryDirectory, contents, has_gmsh, has_hdf5, history, ordo

GRAVITY, SLOPE = 10.0, math.radians(30)
LENGTH, HEIGHT = 1.0, 0.5  # m, of the block
SETTLE, RAMP = 0.6, 0.3  # s


def frame_of(angle):
    """Along the slope, out of it, and a corner of the block, whose grid's lines are turned by the angle (degrees)."""
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    return (c, s), (-s, c), (0.6 if angle else 0.3, 0.337)


def mesh(angle, nx=20, ny=10):
    """A block of quadrilaterals, as text of a Gmsh file."""
    along, out, corner = frame_of(angle)
    points = [[corner[k] + along[k] * LENGTH * i / nx + out[k] * HEIGHT * j / ny for k in (0, 1)] for j in range(ny + 1) for i in range(nx + 1)]
    nodes = "".join(f"{k + 1} {x!r} {y!r} 0\n" for k, (x, y) in enumerate(points))
    first = [j * (nx + 1) + i + 1 for j in range(ny) for i in range(nx)]
    cells = "".join(f"{k + 1} 3 2 1 1 {a} {a + 1} {a + nx + 2} {a + nx + 1}\n" for k, a in enumerate(first))
    return (f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{len(points)}\n{nodes}$EndNodes\n"
            f"$Elements\n{len(first)}\n{cells}$EndElements\n")


def particles(angle, nx=20, ny=10):
    along, out, corner = frame_of(angle)
    rows = ["x,y,volume"]
    for j in range(ny):
        for i in range(nx):
            a, b = LENGTH * (i + 0.5) / nx, HEIGHT * (j + 0.5) / ny
            rows.append(",".join(repr(v) for v in (*(corner[k] + along[k] * a + out[k] * b for k in (0, 1)), LENGTH * HEIGHT / nx / ny)))
    return "\n".join(rows) + "\n"


def incline(angle, friction, method, *, end, shape="mesh", more=""):
    """A block that settles, damped, under the part of gravity across the slope, then feels that along it grow and slides undamped."""
    along, out, corner = frame_of(angle)
    ramp = f"min(1, max(0, (t - {SETTLE})/{RAMP}))"
    force = ", ".join(f'"{-GRAVITY * math.cos(SLOPE) * out[k]!r} + {GRAVITY * math.sin(SLOPE) * along[k]!r}*{ramp}"' for k in (0, 1))
    return f"""\
[grid]
size = [3.2, {1.2 if angle == 0 else 2.6}]
spacing = 0.1
[method]
{method}
[[material]]
name = "rubber"
density = 1000.0
young = 1e6
poisson = 0.3
[[body]]
material = "rubber"
shape = "{shape}"
file = "block.{"msh" if shape == "mesh" else "csv"}"
body_force = [{force}]
[[obstacle]]
name = "floor"
shape = "half-space"
point = [{corner[0]}, {corner[1]}]
normal = [{out[0]!r}, {out[1]!r}]
friction = {friction}
[time]
cfl = 0.4
[[stage]]
name = "settle"
duration = {SETTLE}
damping = "local"
factor = 0.7
[[stage]]
name = "slide"
duration = {end}
damping = "none"
[output]
per_body = true
interval = 10
{more}"""


BLOCK = """\
gravity = {gravity}
[grid]
size = [2.0, 1.2, 1.2]
spacing = 0.1
[method]
{method}
[time]
end = {end}
[[material]]
name = "rubber"
density = 1000.0
young = 1e6
poisson = 0.3
[[body]]
name = "block"
material = "rubber"
shape = "box"
lower = [0.4, 0.4, 0.31]
upper = [0.8, 0.8, 0.61]
[output]
per_body = true
interval = 10
{more}
"""
MASS = 48.0  # kg, of this block
CPDI, POINTS = 'preset = "cpdi1"', 'preset = "mpm"\nscheme = "musl"'
FLOOR = '[[obstacle]]\nname = "floor"\nshape = "half-space"\npoint = [0, 0, 0.31]\nnormal = [0, 0, 1]\nfriction = 0.5\n'


def block(more, *, method=CPDI, gravity="[0.0, 0.0, -10.0]", end=0.3):
    return BLOCK.format(gravity=gravity, method=method, end=end, more=more)


def triangles_of_box(low, high, n):
    r = []
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        for above in (False, True):
            for i in range(n):
                for j in range(n):
                    corners = []
                    for u, v in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)):
                        x = [0.0, 0.0, 0.0]
                        x[a] = high[a] if above else low[a]
                        x[b] = (low[b] * (n - u) + high[b] * u) / n
                        x[c] = (low[c] * (n - v) + high[c] * v) / n
                        corners.append(x)
                    p, q, s, t = corners if above else (corners[0], corners[3], corners[2], corners[1])
                    r += [(p, q, s), (p, s, t)]
    return r


def binary_stl(triangles):
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *(x for corner in t for x in corner), 0) for t in triangles)
    return b"box".ljust(80) + struct.pack("<I", len(triangles)) + body


def text_stl(triangles):
    facets = "".join("facet normal 0 0 0\nouter loop\n" + "".join(f"vertex {x} {y} {z}\n" for x, y, z in t) + "endloop\nendfacet\n" for t in triangles)
    return f"solid box\n{facets}endsolid box\n"


class Obstacles(InTemporaryDirectory):
    def slide(self, angle, friction, method, **more):
        """Times, velocity down the slope and place along it after the ramp, and places across it of the whole run."""
        self.write("block.msh", mesh(angle))
        self.write("block.csv", particles(angle))
        self.write("case.toml", incline(angle, friction, method, **more))
        self.run_good("case.toml", "--output", "run")
        along, out, _ = frame_of(angle)
        b = history(self.dir / "run", "body_0.csv")
        rows = [k for k, t in enumerate(b["time"]) if t > SETTLE + RAMP + 0.1]
        v = [(along[0] * b["momentum_x"][k] + along[1] * b["momentum_y"][k]) / b["mass"][k] for k in rows]
        place = [along[0] * b["center_x"][k] + along[1] * b["center_y"][k] for k in rows]
        across = [out[0] * x + out[1] * y for x, y in zip(b["center_x"], b["center_y"])]
        return [b["time"][k] for k in rows], v, place, across

    def assert_slides(self, angle, method, **more):
        t, v, _, across = self.slide(angle, 0.3, method, end=0.9, **more)
        mean_t, mean_v = sum(t) / len(t), sum(v) / len(v)
        slope = sum((a - mean_t) * (b - mean_v) for a, b in zip(t, v)) / sum((a - mean_t) ** 2 for a in t)
        self.assertAlmostEqual(slope / (GRAVITY * (math.sin(SLOPE) - 0.3 * math.cos(SLOPE))), 1.0, delta=0.01)
        self.assertLess(max(abs(x - across[0]) for x in across), 5e-3)

    @unittest.skipUnless(has_gmsh(), "ordo was built without Gmsh")
    def test_slides_at_any_angle_to_the_grid(self):
        for angle in (0, 17, 30):
            for preset in ("cpdi2", "bscpdi2"):
                with self.subTest(angle=angle, preset=preset):
                    self.assert_slides(angle, f'preset = "{preset}"')

    def test_points_slide(self):
        apic, splines = 'preset = "apic"\nscheme = "musl"', 'preset = "bsmpm"\nmass = "lumped"\nscheme = "musl"'
        for angle, method in ((0, POINTS), (17, POINTS), (0, apic), (17, apic), (17, splines)):
            with self.subTest(angle=angle, method=method):
                self.assert_slides(angle, method, shape="particles")

    @unittest.skipUnless(has_gmsh(), "ordo was built without Gmsh")
    def test_sticks_for_ten_thousand_steps(self):
        t, _, place, _ = self.slide(17, 0.7, 'preset = "cpdi2"', end=11.0)
        self.assertGreater(len(t), 9000)
        self.assertLess(abs(place[-1] - place[0]), 1e-6 * GRAVITY * (t[-1] - t[0]) ** 2 / 2)
        self.assertLess(abs(place[-1] - place[len(place) // 2]), 2e-5)  # it swings, but does not creep

    def test_points_stick(self):
        for method in (POINTS, 'preset = "apic"\nscheme = "musl"'):
            with self.subTest(method=method):
                _, _, place, _ = self.slide(17, 0.7, method, end=2.0, shape="particles")
                self.assertLess(abs(place[-1] - place[0]), 1e-3)  # a hundredth of a cell, in which the points settle

    def test_shapes_are_one_floor(self):
        """A half-space, a box and its surface in triangles: the same contact."""
        low, high = (0.1, 0.1, 0.1), (1.9, 1.1, 0.31)
        triangles = triangles_of_box(low, high, 7)
        (self.dir / "binary.stl").write_bytes(binary_stl(triangles))
        self.write("text.stl", text_stl(triangles))
        (self.dir / "open.stl").write_bytes(binary_stl([t for t in triangles if all(x[2] == high[2] for x in t)]))
        (self.dir / "large.stl").write_bytes(binary_stl([[[1000 * v for v in x] for x in t] for t in triangles]))
        shapes = {
            "half-space": 'shape = "half-space"\npoint = [0, 0, 0.31]\nnormal = [0, 0, 2]',
            "box": 'shape = "box"\nlower = [0.1, 0.1, 0.1]\nupper = [1.9, 1.1, 0.31]',
            **{name: f'shape = "stl"\nfile = "{name}.stl"' for name in ("binary", "text", "open")},
            "large": 'shape = "stl"\nfile = "large.stl"\nscale = 0.001',
        }
        tilted = f"[{GRAVITY * math.sin(SLOPE)}, 0.0, {-GRAVITY * math.cos(SLOPE)}]"
        for method in (CPDI, POINTS):
            ends = {}
            for name, shape in shapes.items():
                self.write("case.toml", block(f'[[obstacle]]\nname = "floor"\nfriction = 0.3\n{shape}\n', method=method, gravity=tilted))
                self.run_good("case.toml", "--output", "run")
                h, b = history(self.dir / "run"), history(self.dir / "run", "body_0.csv")
                ends[name] = [b["center_x"][-1], b["center_z"][-1], h["floor_friction_work"][-1]]
            exact = 0.4 + 0.2 + GRAVITY * (math.sin(SLOPE) - 0.3 * math.cos(SLOPE)) * 0.3**2 / 2
            self.assertAlmostEqual(ends["box"][0], exact, delta=2e-3)
            for name, end in ends.items():
                with self.subTest(shape=name, method=method):
                    for one, other in zip(end, ends["half-space"]):
                        self.assertAlmostEqual(one, other, delta=1e-6)  # coordinates in files are floats

    def test_belt(self):
        """A belt drags the block at mu g until both move alike; its work is what friction takes and the block gains."""
        self.write("case.toml", block(FLOOR.replace("0.5", "0.3") + "velocity = [1.0, 0.0, 0.0]\n", end=0.7))
        self.run_good("case.toml", "--output", "run")
        h = history(self.dir / "run")
        slides = [k for k, t in enumerate(h["time"]) if 0.1 < t < 0.3]
        for k in slides:
            self.assertAlmostEqual(h["momentum_x"][k] / MASS, 3.0 * h["time"][k], delta=0.03)
        self.assertAlmostEqual(h["momentum_x"][-1] / MASS, 1.0, delta=0.01)
        self.assertAlmostEqual(h["floor_x"][-1], 0.7, delta=1e-12)
        self.assertAlmostEqual(h["floor_friction_work"][-1], MASS / 2, delta=0.02 * MASS)
        self.assertAlmostEqual(-h["floor_work"][-1], h["floor_friction_work"][-1] + MASS / 2, delta=0.02 * MASS)
        mean = sum(h["floor_force_z"]) / len(h["floor_force_z"])
        self.assertAlmostEqual(mean / (-10 * MASS), 1.0, delta=0.02)

    def test_free_impact_keeps_momentum(self):
        """A heavy ball hits a free block, off its centre: momenta to round-off, the energy of the ball by the work on it."""
        mass, spin, v = 20.0, [0.0, 3.0, 1.0], [2.0, 0.1, -0.3]
        ball = f"""[[obstacle]]
name = "ball"
shape = "ball"
center = [0.18, 0.6, 0.5]
radius = 0.2
velocity = {v}
rotation = {spin}
mass = {mass}
friction = 0.4
"""
        inertia = 0.4 * mass * 0.2**2
        for method in (CPDI, 'preset = "bscpdi2"', 'preset = "cpls"', POINTS):
            with self.subTest(method=method):
                self.write("case.toml", block(ball, method=method, gravity="[0.0, 0.0, 0.0]", end=0.1))
                self.run_good("case.toml", "--output", "run")
                h = history(self.dir / "run")
                for a, axis in enumerate("xyz"):
                    total = [p + mass * u for p, u in zip(h[f"momentum_{axis}"], h[f"ball_velocity_{axis}"])]
                    self.assertLess(max(abs(p - mass * v[a]) for p in total), 1e-13 * mass * 2.1)
                kinetic = [sum(mass * h[f"ball_velocity_{a}"][k] ** 2 + inertia * h[f"ball_rotation_{a}"][k] ** 2 for a in "xyz") / 2
                           for k in range(len(h["time"]))]
                self.assertLess(h["ball_velocity_x"][-1], 1.0)
                for k, energy in enumerate(kinetic):
                    self.assertAlmostEqual(energy - kinetic[0], h["ball_work"][k], delta=1e-11)

    def test_mass_rests_and_rolls(self):
        """A ball rests on the block with its weight; a driven wheel falls freely where it is not held."""
        self.write("case.toml", block(FLOOR + """[[obstacle]]
name = "ball"
shape = "ball"
center = [0.6, 0.6, 0.71]
radius = 0.1
mass = 5
friction = 0.5
[[obstacle]]
name = "wheel"
bodies = "block"
shape = "cylinder"
axis = "y"
center = [0.6, 0.6, 1.1]
radius = 0.05
height = 0.3
mass = 1
held = ["x", "y", "z", "rotation"]
"""))
        refused = ordo("run", "case.toml", cwd=self.dir)
        self.assertEqual(refused.returncode, 2)
        self.assertIn("obstacle[2].held: holds all motion, so mass has no effect; remove both", refused.stderr)
        text = (self.dir / "case.toml").read_text().replace('held = ["x", "y", "z", "rotation"]', 'held = ["y", "rotation"]\nrotation = [0, "t", 0]')
        self.write("case.toml", text.replace("[output]", '[damping]\ntype = "local"\nfactor = 0.7\n[output]'))
        self.run_good("case.toml", "--output", "run", "--set", "time.end=0.4")
        h = history(self.dir / "run")
        late = [k for k, t in enumerate(h["time"]) if 0.15 < t < 0.29]  # before the wheel lands
        force = sum(h["ball_force_z"][k] for k in late) / len(late)
        self.assertAlmostEqual(force, 50.0, delta=1.0)
        self.assertAlmostEqual(h["wheel_rotation_y"][-1], 0.4, delta=0.02)
        self.assertEqual(h["wheel_velocity_y"][-1], 0.0)
        free_fall = -10 * 0.27  # until it meets the block: from 1.05 to 0.61 takes 0.297 s
        before = max(k for k, t in enumerate(h["time"]) if t < 0.27)
        self.assertAlmostEqual(h["wheel_velocity_z"][before], free_fall, delta=0.03)

    def test_tied(self):
        self.write("case.toml", block("""[[obstacle]]
name = "top"
shape = "box"
lower = [0.3, 0.3, 0.61]
upper = [1.2, 1.0, 0.7]
type = "tied"
velocity = ["0.3*min(t/0.2, 1)", 0, 0]
[damping]
type = "viscous"
rate = 20
""", end=0.5))
        self.run_good("case.toml", "--output", "run")
        h, b = history(self.dir / "run"), history(self.dir / "run", "body_0.csv")
        self.assertAlmostEqual(h["top_force_z"][-1], -10 * MASS, delta=0.02 * 10 * MASS)
        self.assertAlmostEqual(b["center_x"][-1] - b["center_x"][0], h["top_x"][-1] - h["top_x"][0], delta=2e-3)

    def test_threads_and_restart(self):
        """In the middle of stick, on a table that turns, below a ball that rolls."""
        more = """[[obstacle]]
name = "table"
shape = "cylinder"
center = [0.6, 0.6, 0.21]
radius = 0.5
height = 0.2
friction = 0.8
rotation = [0, 0, "min(t/0.1, 1)*2"]
[[obstacle]]
name = "ball"
shape = "ball"
center = [0.62, 0.6, 0.81]
radius = 0.2
mass = 20
friction = 0.5
velocity = [0, 0, -1]
rotation = [0, 5, 0]
"""
        checkpoints = "[checkpoint]\nsteps = 60\nkeep = 9\n" if has_hdf5() else ""
        for method in (CPDI, POINTS):
            with self.subTest(method=method):
                self.write("case.toml", block(more + checkpoints, method=method, end=0.15))
                for threads in ("1", "3"):
                    self.run_good("case.toml", "--output", threads, "--threads", threads)
                one, other = contents(self.dir / "1"), contents(self.dir / "3")
                self.assertEqual([k for k in one if one[k] != other[k]], [])
                h = history(self.dir / "1")
                self.assertLess(h["ball_force_z"][60], 1e3)
                self.assertGreater(max(h["table_friction_work"]), 0)
                if not has_hdf5():
                    continue
                shutil.copytree(self.dir / "1", self.dir / "again", dirs_exist_ok=True)
                self.run_good("case.toml", "--output", "again", "--restart", "again/checkpoint_000000060.h5", "--threads", "2")
                again = contents(self.dir / "again")
                self.assertEqual([k for k in one if one[k] != again.get(k)], [])

    def test_refused(self):
        def half_space(text):
            return '[[obstacle]]\nshape = "half-space"\npoint = [0, 0, 0.31]\nnormal = [0, 0, 1]\n' + text

        box = '[[obstacle]]\nshape = "box"\nlower = [0.1, 0.1, 0.1]\nupper = [1.9, 1.1, 0.31]\n'
        ball = '[[obstacle]]\nshape = "ball"\ncenter = [0.6, 0.6, 0.8]\nradius = 0.1\n'
        (self.dir / "open.stl").write_bytes(binary_stl(triangles_of_box((0, 0, 0), (1, 1, 0.2), 1)[:-1]))
        (self.dir / "turned.stl").write_bytes(binary_stl([t[::-1] for t in triangles_of_box((0, 0, 0), (1, 1, 0.2), 1)]))
        (self.dir / "short.stl").write_bytes(binary_stl(triangles_of_box((0, 0, 0), (1, 1, 0.2), 1))[:-7])
        stl = '[[obstacle]]\nshape = "stl"\nfile = "{}.stl"\n{}'
        rows = [
            (half_space("mass = 3\n"), 'obstacle[0].mass: cannot be with a half-space, which has no end; take a box, or remove mass'),
            (half_space("radius = 3\n"), 'obstacle[0].radius: has no meaning for the shape "half-space"; remove it'),
            ('[[obstacle]]\nshape = "ball"\ncenter = [0, 0, 0]\n', "obstacle[0].radius: is missing"),
            (half_space("speed = 3\n"), 'obstacle[0].speed'),
            (half_space('points = "face"\n'), 'obstacle[0].points: must be one of vertices, faces (got "face"). Did you mean "faces"?'),
            ('[[obstacle]]\nshape = "half-space"\npoint = [0, 0, 0.31]\nnormal = [0, 0, 0]\n', "obstacle[0].normal: must not be zero"),
            (half_space('velocity = ["x", 0, 0]\n'), "must be a function of t alone: an obstacle is rigid"),
            (half_space("rotation = 3\n"), "obstacle[0].rotation: must be three numbers"),
            (half_space('held = "x"\n'), "obstacle[0].held: needs mass; without it all motion is as given"),
            (half_space('bodies = "blocks"\n'), 'obstacle[0].bodies: there is no [[body]] called "blocks". Did you mean "block"?'),
            (half_space('bodies = ["block", "block"]\n'), "obstacle[0].bodies: names a body twice"),
            (half_space('type = "frictionless"\nfriction = 0.3\n'), 'obstacle[0].friction: is of type "frictional"; remove it'),
            (half_space('[[boundary]]\nface = "z-min"\ntype = "periodic"\n'), "obstacle[0].normal: has a component along the periodic axis z"),
            (half_space("").replace("0.31", "0.4"), 'begins 0.09 m deep in obstacle "obstacle_0"'),
            (box.replace("0.31", "0.05"), "obstacle[0].upper: must be above lower along each axis"),
            (ball + 'mass = 1\nvelocity = [0, 0, "t"]\n', "obstacle[0].velocity: must be numbers with mass"),
            (ball + "mass = 1\n" + half_space('name = "obstacle_0"\n'), 'obstacle[1].name: "obstacle_0" names an obstacle and another'),
            (box + "mass = 1\ncenter = [1, 0.6, 0.3]\n", "obstacle[0].center: cannot be with mass"),
            (stl.format("none", ""), "none.stl: STL: cannot be opened; paths are relative to the case file"),
            (stl.format("short", ""), "short.stl: STL: says that it has 12 triangles, which need 684 bytes, but has 677; save it again as binary STL"),
            (stl.format("open", "mass = 1\n"), "obstacle[0].mass: cannot be: the surface has 3 open edges"),
            (stl.format("turned", "mass = 1\n"), "obstacle[0].mass: cannot be: the surface is inside out"),
        ]
        for text, says in rows:
            with self.subTest(text=text):
                self.write("case.toml", block(text))
                done = ordo("run", "case.toml", "--output", "run", cwd=self.dir)
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertIn(says, done.stderr)
                self.assertEqual(done.stderr.strip().count("\n"), 0, done.stderr)
                self.assertFalse((self.dir / "run").exists())
        methods = {
            'preset = "mpm"': 'with domain point or box needs scheme = "musl" with strain_velocity 0',
            'preset = "bsmpm"': "cannot be with a consistent mass matrix",
            'preset = "impm"': "cannot be with fits in the cells of the grid",
            'preset = "spline3"': "cannot be with spline fits",
        }
        for method, says in methods.items():
            with self.subTest(method=method):
                self.write("case.toml", block(FLOOR, method=method))
                done = ordo("run", "case.toml", "--output", "run", cwd=self.dir)
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertIn("obstacle[0].shape: " + says, done.stderr)
        self.write("case.toml", block(half_space('velocity = ["0", "0", "0.01*sqrt(0.005 - t)"]\n')))
        done = ordo("run", "case.toml", "--output", "nan", cwd=self.dir)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertRegex(done.stderr, r't = 0.0\d+ s: the velocity or rotation of obstacle "obstacle_0" is not a finite number')
        self.write("case.toml", block(half_space('name = "momentum"\n')))
        done = ordo("run", "case.toml", "--output", "run", cwd=self.dir)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("history.csv would have two columns momentum_x", done.stderr)
        self.write("case.toml", block(FLOOR + 'points = "faces"\n', method=POINTS))
        done = ordo("run", "case.toml", "--output", "run", cwd=self.dir)
        self.assertIn('obstacle[0].points: "faces" needs bodies with faces', done.stderr)
