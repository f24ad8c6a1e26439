"""Contact between bodies: momentum, energy, true gaps, the same bits for any threads and over restarts, across periodic
boundaries, what columns and frames hold, and what is refused.
"""

import itertools
import math
import shutil
import unittest

import numpy
from harness import CASE, ROOT, InTemporaryDirectory, arrays, contents, edit, frames, has_hdf5, history, ordo, particle_data, read_vtk
from test_bad_input import split_mark
from vtk.util.numpy_support import vtk_to_numpy

# Two disks, 4 cells a radius, gap 0.021 m, that meet head on along a line at 0.4 rad to the grid and part.
RADIUS, SPACING, SPEED, ANGLE, HALF_GAP = 0.2, 0.05, 0.1, 0.4, 0.0105
REACH = RADIUS + HALF_GAP


def disk(name, place, velocity, more="cells = 'polar'\n"):
    return (f"[[body]]\nname = '{name}'\nmaterial = 'rubber'\nshape = 'ball'\nradius = {RADIUS}\n{more}"
            f"center = [{place[0]!r}, {place[1]!r}]\nvelocity = [{velocity[0]}, {velocity[1]}]\n")


def disks(*more, velocities=None, shift=0.0, cells="cells = 'polar'\n"):
    c, s = math.cos(ANGLE), math.sin(ANGLE)
    first, second = velocities or ((SPEED * c, SPEED * s), (-SPEED * c, -SPEED * s))
    return f"""\
[grid]
size = 1.0
spacing = {SPACING}

[method]
preset = "cpdi1"

[time]
end = 1.6
cfl = 0.3

[[material]]
name = "rubber"
density = 1000.0
young = 1000.0
poisson = 0.3

""" + disk("one", (0.5 + shift - REACH * c, 0.5 - REACH * s), first, cells) + disk("other", (0.5 + shift + REACH * c, 0.5 + REACH * s), second, cells) + \
        "[output]\ninterval = 0.2\nper_body = true\n" + "".join(more)


def contact(*lines):
    return "[[contact]]\nbodies = ['one', 'other']\ntype = 'frictional'\n" + "".join(line + "\n" for line in lines)


def glancing(*more, mu=0.3, **options):
    """The disks pass each other, turn and rub."""
    c, s = math.cos(ANGLE + 0.7), math.sin(ANGLE + 0.7)
    return disks(contact(f"friction = {mu}"), *more, velocities=((f"'{SPEED * c}'", f"'{SPEED * s}'"), (f"'{-SPEED * c}'", f"'{-SPEED * s}'")), **options)


class Contact(InTemporaryDirectory):
    def run_case(self, text, *args, output="out"):
        self.write("case.toml", text)
        self.run_good("case.toml", "--output", output, *args)
        return {name: numpy.array(values) for name, values in history(self.dir / output).items()}


class Impact(Contact):
    SCHEMES = ("usf", "usl", "musl")

    def test_momentum_is_kept(self):
        for preset, scheme in itertools.product(("cpdi1", "cpdi2", "cpdi2t", "bscpdi2"), self.SCHEMES):
            with self.subTest(preset, scheme=scheme):
                seen = self.run_case(glancing(), "--set", f"method.preset={preset}", "--set", f"method.scheme={scheme}")
                scale = seen["mass"][0] * SPEED
                self.assertGreater(numpy.abs(seen["contact_0_force_x"]).max(), 0.1 * scale)
                for axis in "xy":
                    change = seen[f"momentum_{axis}"] - seen[f"momentum_{axis}"][0]
                    self.assertLess(numpy.abs(change).max(), 1e-13 * scale, axis)

    def test_an_impact_adds_no_energy(self):
        rows = [*itertools.product(("cpdi1", "cpdi2", "cpdi2t", "bscpdi2"), self.SCHEMES), *itertools.product(("cpls", "icpdi1", "icpdi2", "bscpls"), ("usl",))]
        for preset, scheme in rows:
            with self.subTest(preset, scheme=scheme):
                seen   = self.run_case(disks(contact()), "--set", f"method.preset={preset}", "--set", f"method.scheme={scheme}")
                energy = seen["total_energy"] / seen["total_energy"][0]
                self.assertLess(seen["kinetic_energy"].min(), 0.5 * seen["kinetic_energy"][0], "they never met")
                self.assertEqual(seen["contact_0_force_x"][-1], 0.0, "they did not part")
                self.assertLess(energy.max(), 1.001)
                self.assertGreater(energy[-1], 0.7)
                self.assertGreater(seen["contact_0_dissipation"][-1], 0.0)
                self.assertEqual(numpy.abs(seen["contact_0_friction_work"]).max(), 0.0)

    def test_less_energy_is_lost_on_finer_meshes(self):
        for preset in ("cpls", "icpdi1"):
            with self.subTest(preset):
                left = []
                for spacing in (0.05, 0.025):
                    seen = self.run_case(disks(contact()), "--set", f"method.preset={preset}", "--set", f"grid.spacing={spacing}", "--set", "time.cfl=0.2")
                    left.append(seen["total_energy"][-1] / seen["total_energy"][0])
                    self.assertLess(seen["total_energy"].max(), (1 + 1e-9) * seen["total_energy"][0])
                self.assertGreater(left[0], 0.75)
                self.assertGreater(left[1], 0.9)

    def test_energy_and_works_of_an_impact_add_up(self):
        """Musl keeps the energy of waves, so what is lost is lost in the contact."""
        seen  = self.run_case(glancing(), "--set", "method.preset=cpdi2", "--set", "method.scheme=musl", "--set", "grid.spacing=0.025")
        total = seen["total_energy"] + seen["contact_0_friction_work"] + seen["contact_0_dissipation"]
        self.assertGreater(seen["contact_0_friction_work"][-1], 0.1 * total[0])
        self.assertGreater(seen["contact_0_dissipation"][-1], 0.02 * total[0])
        self.assertLess(numpy.abs(total / total[0] - 1).max(), 0.005)

    def test_the_account_of_an_impact_closes(self):
        """With what the scheme takes, whatever that is."""
        for preset, scheme in (("cpdi1", "usl"), ("cpdi1", "musl"), ("cpls", "usl"), ("bscpls", "usl")):
            with self.subTest(preset, scheme=scheme):
                seen  = self.run_case(glancing(), "--set", f"method.preset={preset}", "--set", f"method.scheme={scheme}")
                taken = [seen[name] for name in ("contact_0_friction_work", "contact_0_dissipation", "stress_update_energy", "projection_energy")]
                total = seen["total_energy"] + sum(taken)
                self.assertGreater(seen["contact_0_friction_work"][-1], 0.05 * total[0])
                self.assertLess(numpy.abs(total / total[0] - 1).max(), 1e-12)

    def test_they_meet_when_their_circles_do(self):
        for preset in ("cpdi1", "cpdi2", "cpls", "bscpdi2"):
            with self.subTest(preset):
                seen = self.run_case(disks(contact()), "--set", f"method.preset={preset}", "--set", "grid.spacing=0.025", "--set", "time.end=0.12", "--set", "time.cfl=0.05")
                gap   = 2 * (HALF_GAP - SPEED * seen["time"])  # of free flight, at the end of the step
                meets = numpy.flatnonzero(seen["contact_0_force_x"] != 0)
                self.assertGreater(len(meets), 0)
                self.assertLess(abs(gap[meets[0]]), 0.02 * 0.025)

    def test_they_meet_across_a_periodic_boundary(self):
        periodic = "[[boundary]]\nface = 'x-min'\ntype = 'periodic'\n"
        for preset in ("cpdi1", "cpdi2", "cpls"):
            with self.subTest(preset):
                inside, across = (self.run_case(glancing(periodic, shift=shift), "--set", f"method.preset={preset}") for shift in (0.0, 0.5))
                self.assertGreater(numpy.abs(inside["contact_0_force_x"]).max(), 1.0)
                for name in ("kinetic_energy", "strain_energy", "momentum_x", "contact_0_force_x", "contact_0_force_y", "contact_0_friction_work", "contact_0_dissipation"):
                    scale = max(numpy.abs(inside[name]).max(), 1e-3)
                    self.assertLess(numpy.abs(across[name] - inside[name]).max(), 1e-8 * scale, name)


# A block on a plate: it sticks until 0.06 s and slides from 0.1 s on.
BLOCK = """\
gravity = [0.0, -10.0]

[grid]
size = [1.5, 0.75]
spacing = 0.125

[method]
preset = "cpdi2"

[time]
end = 0.2
cfl = 0.3

[[material]]
name = "rubber"
density = 1000.0
young = 1.0e6
poisson = 0.3

[[body]]
name = "one"
material = "rubber"
shape = "box"
lower = [0.0, 0.0]
upper = [1.5, 0.27]

[[body]]
name = "other"
material = "rubber"
shape = "box"
lower = [0.27, 0.27]
upper = [0.77, 0.52]
body_force = ["60*t", 0.0]

[[boundary]]
name = "ground"
face = "y-min"
type = "fixed"

[output]
per_body = true
interval = 0.02

""" + ("[checkpoint]\nsteps = 7\n\n" if has_hdf5() else "") + contact("friction = 0.3")


class Sliding(Contact):
    def test_friction_reaches_its_limit_and_no_more(self):
        seen = self.run_case(BLOCK)
        push, drag, t = -seen["contact_0_force_y"], numpy.abs(seen["contact_0_force_x"]), seen["time"]
        self.assertLess((drag - 0.3 * push).max(), 0.01 * push.max())  # the plate bends a little
        for low, high, least, most in ((0.15, 0.2, 0.29, 0.301), (0.03, 0.04, 0.0, 0.27)):
            part = drag[(t > low) & (t < high)].sum() / push[(t > low) & (t < high)].sum()
            self.assertTrue(least < part < most, part)

    def test_types_without_friction_and_without_slip(self):
        kinds, ways = {}, {}
        for kind in ("frictionless", "no-slip", "tied"):
            kinds[kind] = self.run_case(edit(BLOCK, ("type = 'frictional'\nfriction = 0.3", f"type = '{kind}'")))
            body        = history(self.dir / "out", "body_1.csv")
            ways[kind]  = body["center_x"][-1] - body["center_x"][0]
        free = 60 * 0.2**3 / 6
        self.assertAlmostEqual(ways["frictionless"] / free, 1, delta=0.01)
        for kind in ("no-slip", "tied"):
            self.assertLess(abs(ways[kind]), 0.05 * free, kind)
        push = numpy.abs(kinds["frictionless"]["contact_0_force_y"]).max()
        self.assertLess(numpy.abs(kinds["frictionless"]["contact_0_force_x"]).max(), 1e-3 * push)  # the plate bends a little

    @unittest.skipUnless(has_hdf5(), "ordo was built without HDF5")
    def test_restarts_in_stick_and_in_slip_write_the_same_bytes(self):
        for preset, points in (("cpdi1", "vertices"), ("cpdi2", "faces"), ("cpls", "vertices")):
            self.write("case.toml", BLOCK)
            method = ("--set", f"method.preset={preset}", "--set", f'contact.0.points="{points}"')
            self.run_good("case.toml", "--output", "whole", *method)
            for end in ("0.05", "0.15"):
                with self.subTest(preset, end=end):
                    shutil.rmtree(self.dir / "parts", ignore_errors=True)
                    self.run_good("case.toml", "--output", "parts", *method, "--set", f"time.end={end}", "--threads", 2)
                    self.run_good("case.toml", "--output", "parts", *method, "--restart", "latest")
                    self.assert_same_files("whole", "parts")

    def test_spheres_have_the_same_bytes_for_any_threads_and_after_restarts(self):
        case = ROOT / "cases" / "two-spheres-contact" / "case.toml"
        for preset, points in (("cpls", "vertices"), ("cpdi2", "faces")):
            with self.subTest(preset):
                sets = ("--set", "grid.spacing=0.1", "--set", f"method.preset={preset}", "--set", f'contact.0.points="{points}"')
                if has_hdf5():
                    sets = (*sets, "--set", "checkpoint.steps=20")
                self.run_good(case, "--output", "whole", *sets)
                self.run_good(case, "--output", "two", *sets, "--threads", 2)
                self.assert_same_files("whole", "two")
                if has_hdf5():
                    shutil.rmtree(self.dir / "parts", ignore_errors=True)
                    self.run_good(case, "--output", "parts", *sets, "--set", "time.end=1.2", "--threads", 2)  # they rub
                    self.run_good(case, "--output", "parts", *sets, "--restart", "latest")
                    self.assert_same_files("whole", "parts")

    def test_the_same_bytes_for_any_threads(self):
        for name, text, points in (("block", BLOCK, "vertices"), ("disks", glancing(), "vertices"), ("disks on faces", glancing(), "faces")):
            for threads in (1, 2, 3):
                self.run_case(text, "--set", "time.cfl=0.3", "--set", f'contact.0.points="{points}"', "--overwrite", "--threads", threads, output=f"threads {threads}")
            one = contents(self.dir / "threads 1")
            for threads in (2, 3):
                with self.subTest(name, threads=threads):
                    self.assertEqual(contents(self.dir / f"threads {threads}"), one)


class Output(Contact):
    def test_frames_add_up_to_the_columns(self):
        seen   = self.run_case(glancing())
        in_contact = 0
        for time, file in frames(self.dir / "out", "contact"):
            (row,) = numpy.flatnonzero(numpy.abs(seen["time"] - time) < 1e-9)
            force  = [seen[f"contact_0_force_{axis}"][row] for axis in "xyz"]
            if not any(force):
                continue
            in_contact += 1
            data  = read_vtk(file)
            found = arrays(data.GetPointData())
            place = vtk_to_numpy(data.GetPoints().GetData())
            sign  = numpy.where(found["body"] == 0, 1.0, -1.0)[:, None]
            total = (sign * found["area"][:, None] * found["traction"]).sum(axis=0)
            numpy.testing.assert_allclose(total, force, atol=1e-12 * numpy.abs(force).max())
            moment = numpy.cross(place, sign * found["area"][:, None] * found["traction"]).sum(axis=0)
            self.assertAlmostEqual(moment[2] / seen["contact_0_moment_z"][row], 1, delta=1e-9)
            pushes = (found["traction"] * found["normal"]).sum(axis=1)
            numpy.testing.assert_allclose(pushes, found["pressure"], rtol=1e-9)
            rubs = numpy.linalg.norm(found["traction"] - pushes[:, None] * found["normal"], axis=1)
            self.assertLess((rubs - 0.3 * found["pressure"]).max(), 1e-9 * found["pressure"].max())
            self.assertLess(numpy.abs((found["slip"] * found["normal"]).sum(axis=1)).max(), 1e-12)
            numpy.testing.assert_allclose(numpy.linalg.norm(found["normal"], axis=1), 1, atol=1e-12)
            self.assertLess(numpy.abs(found["gap"]).max(), 0.1 * SPACING)
            self.assertGreater(found["pressure"].min(), 0.0)
            self.assertEqual(set(found["contact"]), {0})
        self.assertGreater(in_contact, 2)

    def test_each_pair_has_columns(self):
        third = disk("third", (1.2, 1.2), (0.0, 0.0))
        seen  = self.run_case(disks("[[contact]]\nbodies = 'all'\ntype = 'frictionless'\nname = 'touch'\n", third), "--set", "time.end=0.05", "--set", "grid.size=1.5")
        self.assertEqual({name.split("_force")[0] for name in seen if name.startswith("touch")} & {"touch_one_other", "touch_one_third", "touch_other_third"},
                         {"touch_one_other", "touch_one_third", "touch_other_third"})


class Notes(Contact):
    def test_stairs_of_round_bodies(self):
        for cells, count in (("cells = 'polar'\n", 0), ("", 2)):
            self.write("case.toml", disks(contact(), cells=cells))
            done = ordo("check", "case.toml", cwd=self.dir)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual((done.stdout + done.stderr).count('cells = "polar" fit it'), count)


UNLIKE = """\
[grid]
size = [1.0, 1.5]
spacing = 0.1
[method]
preset = "bscpdi2"
[time]
end = 3.0
[damping]
type = "viscous"
rate = 15.0
[[material]]
name = "rubber"
density = 1000.0
young = 1.0e6
poisson = 0.0
[[body]]
name = "low"
material = "rubber"
shape = "box"
lower = [0.2, 0.0]
upper = [0.8, 0.537]
[[body]]
name = "high"
material = "rubber"
shape = "box"
lower = [0.2, 0.537]
upper = [0.8, 1.1]
particles_per_cell = [3, 3]
[[traction]]
body = "high"
face = "y-max"
type = "pressure"
value = "1000*min(1, t/0.5)"
[[boundary]]
name = "floor"
face = "y-min"
type = "symmetry"
[[contact]]
bodies = ["low", "high"]
type = "frictionless"
points = "faces"
[output]
interval = 1.5
fields = ["stress"]
"""


class UnlikeFaces(Contact):
    """Blocks of 2 and of 3 particles a cell pass an even pressure on; with points at vertices the stress next to them is 6 % off."""

    def stress(self, points):
        self.run_case(UNLIKE, "--set", f'contact.0.points="{points}"', output=points)
        found  = particle_data(read_vtk(frames(self.dir / points)[-1][1]))
        stress = found["stress"].reshape(-1, 3, 3)[:, 1, 1]
        near   = numpy.abs(found["position"][:, 1] - 0.537) < 0.1
        return numpy.mean((stress[near] / -1000 - 1) ** 2) ** 0.5

    def test_points_on_faces_pass_even_pressure_on(self):
        self.assertLess(self.stress("faces"), 0.004)
        self.assertGreater(self.stress("vertices"), 0.03)


# name, changes of two disks in contact, what the message points at, the remedy
FAULTS = [
    ("unknown body", [("bodies = ['one', 'other']", "bodies = @['one', 'othr']")], "contact[0].bodies", 'Did you mean "other"?'),
    ("a body twice", [("bodies = ['one', 'other']", "bodies = @['one', 'one']")], "contact[0].bodies", "names a body twice"),
    ("one body", [("bodies = ['one', 'other']", "bodies = @['one']")], "contact[0].bodies", "at least two bodies"),
    ("no bodies", [("bodies = ['one', 'other']\n", "")], "contact[0].bodies", "is missing"),
    ("friction without slip", [("type = 'frictional'", "type = 'no-slip'\nfriction = @0.3")], "contact[0].friction", "remove it"),
    ("adhesion without friction", [("type = 'frictional'", "type = 'frictionless'\nadhesion = @10")], "contact[0].adhesion", "remove it"),
    ("negative friction", [("type = 'frictional'", "type = 'frictional'\nfriction = @-0.3")], "contact[0].friction", "must be zero or positive"),
    ("unknown type", [("type = 'frictional'", "type = @'frictionles'")], "contact[0].type", 'Did you mean "frictionless"?'),
    ("no sweep", [("type = 'frictional'", "type = 'frictional'\nsweeps = @0")], "contact[0].sweeps", "at least 1"),
    ("a pair twice", ["[[contact]]\nbodies = @'all'\ntype = 'frictionless'\n"], "contact[1].bodies", "each pair has one"),
    ("the same name twice", [("type = 'frictional'", "type = 'frictional'\nname = 'ground'"), "[[boundary]]\nname = 'ground'\nface = 'y-min'\ntype = 'fixed'\n"], "contact[0].name", "names must differ"),
    ("unknown key", [("type = 'frictional'", "type = 'frictional'\n@frction = 0.3")], "contact[0].frction", 'Did you mean "friction"?'),
    ("points", [('preset = "cpdi1"', 'preset = "mpm"')], "contact[0].bodies", "use cpdi1"),
    ("boxes", [('preset = "cpdi1"', 'preset = "ugimp"')], "contact[0].bodies", "use cpdi1"),
    ("fitted splines", [('preset = "cpdi1"', 'preset = "spline3"')], "contact[0].bodies", "use bscpdi2"),
    ("consistent mass", [('preset = "cpdi1"', 'preset = "bscpdi2"\nmass = "consistent"\nscheme = "musl"')], "contact[0].bodies", 'mass = "lumped"'),
    ("enriched corners", [('preset = "cpdi1"', 'preset = "fem"')], "contact[0].bodies", "use cpdi2"),
    ("a body thinner than a cell", [("name = 'one'\nmaterial = 'rubber'\nshape = 'ball'\nradius = 0.2\ncells = 'polar'\n", "name = 'sheet'\nmaterial = 'rubber'\nshape = @'box'\nlower = [0.1, 0.02]\nupper = [0.9, 0.05]\n#"), ("'one', 'other'", "'sheet', 'other'")],
     "body[0].shape", "refine [grid] spacing"),
]


class BadInput(InTemporaryDirectory):
    def assert_refused(self, text, key, remedy):
        text, place = split_mark(text)
        self.write("case.toml", text)
        where = f"case.toml:{place}: {key}" if place else f": {key}"
        for command in ("check", "run"):
            done = ordo(command, "case.toml", cwd=self.dir)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
            self.assertIn(where, done.stderr)
            self.assertIn(remedy, done.stderr)
            self.assertEqual([p.name for p in self.dir.iterdir()], ["case.toml"])

    def test_contact(self):
        for name, changes, key, remedy in FAULTS:
            with self.subTest(name):
                self.assert_refused(edit(disks(contact()), *changes), key, remedy)

    def test_contact_in_one_dimension(self):
        line = edit(CASE, ("dim = 2", "dim = 1"), "[[body]]\nmaterial = 'rubber'\nshape = 'box'\nlower = 0.8\nupper = 1.0\n[method]\npreset = 'cpdi1'\n[[contact]]\nbodies = 'all'\n")
        self.assert_refused(line, "contact[0].bodies", "use a strip in 2D")

    def test_fits_in_cells(self):
        for preset in ("impm", "tls-mpm"):
            with self.subTest(preset):
                self.assert_refused(edit(disks(contact()), ('preset = "cpdi1"', f'preset = "{preset}"')), "contact[0].bodies", "use cpdi1")
        self.assert_refused(edit(disks(contact()), ('preset = "cpdi1"', 'preset = "cpdi1"\nprojection = "tls"')), "", "tls")


if __name__ == "__main__":
    unittest.main()
