"""What a run writes: VTK's readers open every frame, and its sums agree with history.csv.

Bodies deform by an initial velocity that varies in space, so that no energy or stress is trivial.
"""

import itertools
import re

import numpy
import vtk
from vtk.util.numpy_support import vtk_to_numpy

from harness import CASE, PRESETS, TWO_DISKS, InTemporaryDirectory, arrays, contents, edit, frames, history, ordo, particle_data, read_vtk

HISTORY = (
    "time,dt,mass,momentum_x,momentum_y,momentum_z,kinetic_energy,strain_energy,total_energy,potential_energy,dissipated_energy,"
    "projection_mass_before,projection_mass_after,projection_momentum_x_before,projection_momentum_y_before,"
    "projection_momentum_z_before,projection_momentum_x_after,projection_momentum_y_after,projection_momentum_z_after,"
    "dropped_pivots,fallback_nodes,boundary_work,traction_work,body_force_work,artificial_viscosity_work,damped_energy,"
    "nodal_kinetic_energy,unresolved_kinetic_energy,stress_update_energy,projection_energy,filter_energy,half_step_energy"
)
FIELDS = ["displacement", "velocity", "stress", "deformation_gradient", "density", "mass", "volume", "pressure", "von_mises", "energy_density"]
VERTEX, DOMAINS = 1, {1: 3, 2: 9, 3: 12}  # VTK's line, quad, hexahedron

DEFORMING = edit(CASE, ("radius = 0.25\n", "radius = 0.25\nvolumes = 'lattice'\n"), ("end = 0.01", "end = 0.2"), ("dt = 0.001", "dt = 0.01"), ("spacing = 0.25", "spacing = 0.125"), "velocity = '0.5*cos(4*x)'\n")
STRETCHED_DISK = ["time.end=0.2", "body.0.velocity=['0.5*x', '-0.3*x*y']"]

# Everything that the resolved case must carry to the next run.
RICH = edit(
    CASE,
    ("[grid]", "gravity = [0.0, -0.5]\n[grid]"),
    ("dt = 0.001", "cfl = 0.3"),
    ("end = 0.01", "end = 0.3"),
    """
[[body]]
name = "points \\"at\\" the right"
material = "rubber"
shape = "particles"
file = "data/points.csv"
velocity = ["-0.1", "0.1*sin(pi*Y)"]
body_force = ["0.01*t", 0]

[[boundary]]
face = "y-min"
type = "velocity"
value = ["free", "0.01*sin(t)"]

[[boundary]]
face = ["x-min", "x-max"]
type = "symmetry"

[output]
grid = true
interval = 0.1
history_interval = 2

[[probe]]
name = "tip"
particle = [0.9, 0.5]

[[probe]]
name = "middle"
point = 0.5
""",
)


def sizes(data):
    """Length, area or volume of every cell by VTK."""
    measure = vtk.vtkCellSizeFilter()
    measure.SetInputData(data)
    measure.Update()
    measured = arrays(measure.GetOutput().GetCellData())
    return measured["Length"] + measured["Area"] + measured["Volume"]


class Output(InTemporaryDirectory):
    def assert_close(self, got, wanted, scale=None, tolerance=1e-12):
        scale = numpy.abs(wanted) if scale is None else scale
        self.assertLessEqual(numpy.max(numpy.abs(got - wanted) - tolerance * scale), 0.0)

    def for_each_run(self):
        """Runs every case with every preset: name, dimension, preset, directory."""
        self.write("case.toml", DEFORMING)
        cases = [(f"{dim}D", dim, "case.toml", [f"grid.dim={dim}"]) for dim in (1, 2, 3)] + [("two disks", 2, TWO_DISKS, STRETCHED_DISK)]
        for (name, dim, file, overrides), preset in itertools.product(cases, PRESETS):
            directory = self.dir / f"{name} {preset}"
            settings = [*overrides, f"method.preset={preset}", "output.grid=true", "output.interval=0.05", f"output.fields={FIELDS}"]
            self.run_good(file, *(word for s in settings for word in ("--set", s)), "--output", directory)
            yield name, dim, preset, directory

    def test_frames_and_history(self):
        for name, dim, preset, directory in self.for_each_run():
            with self.subTest(name, preset=preset):
                self.assertEqual((directory / "history.csv").read_text().split("\n")[0], HISTORY)
                self.assertEqual([p.name for p in directory.iterdir() if p.suffix == ".part"], [])
                times = [time for time, _ in frames(directory)]
                self.assert_close(numpy.array(times), numpy.array([0, 0.05, 0.1, 0.15, 0.2]))
                first = particle_data(read_vtk(frames(directory)[0][1]))
                for time, path in frames(directory):
                    data = read_vtk(path)
                    self.check_cells(data, dim, preset)
                    self.check_fields(particle_data(data), first)
                    self.check_sums(particle_data(data), history(directory), time)
                    if time == 0 and preset != "mpm" or preset == "cpdi1":
                        self.assert_close(sizes(data), particle_data(data)["volume"], tolerance=1e-12 if time == 0 else 1e-10)
                    self.assertEqual(arrays(data.GetFieldData())["TimeValue"], [time])
                for time, path in frames(directory, "grid"):
                    self.check_grid(read_vtk(path), dim, history(directory), time)
                self.assertEqual([time for time, _ in frames(directory, "grid")], times[1:])

    def check_cells(self, data, dim, preset):
        fields = particle_data(data)
        self.assertEqual(set(arrays(data.GetCellData())) & set(arrays(data.GetPointData())), set())
        self.assertTrue({"id", "body", "material", *FIELDS} <= set(fields))
        numpy.testing.assert_array_equal(fields["id"], numpy.arange(data.GetNumberOfCells()))
        wanted = VERTEX if preset == "mpm" else DOMAINS[dim]
        self.assertEqual({data.GetCellType(k) for k in range(data.GetNumberOfCells())}, {wanted})

    def check_fields(self, now, first):
        F, stress = now["deformation_gradient"].reshape(-1, 3, 3), now["stress"].reshape(-1, 3, 3)
        pressure = -numpy.trace(stress, axis1=1, axis2=2) / 3
        deviator = stress + pressure[:, None, None] * numpy.eye(3)
        size = numpy.abs(stress).max()
        self.assert_close(now["density"] * now["volume"], now["mass"])
        self.assert_close(numpy.linalg.det(F) * first["volume"], now["volume"])
        self.assert_close(now["pressure"], pressure, scale=size)
        self.assert_close(now["von_mises"], numpy.sqrt(1.5 * (deviator**2).sum(axis=(1, 2))), scale=size)
        if "position" in now:
            self.assert_close(now["displacement"], now["position"] - first["position"], scale=1.0)

    def check_sums(self, fields, rows, time):
        row = rows["time"].index(time)
        m, v = fields["mass"], fields["velocity"]
        sums = {"mass": m, "kinetic_energy": 0.5 * m * (v**2).sum(axis=1), "strain_energy": fields["energy_density"] * fields["volume"]}
        sums.update({f"momentum_{axis}": m * v[:, a] for a, axis in enumerate("xyz")})
        for column, terms in sums.items():
            self.assert_close(terms.sum(), rows[column][row], scale=numpy.abs(terms).sum())
        self.assert_close(rows["total_energy"][row], rows["kinetic_energy"][row] + rows["strain_energy"][row])

    def check_grid(self, data, dim, rows, time):
        nodes, row = arrays(data.GetPointData()), rows["time"].index(time)
        self.assertEqual([n > 1 for n in data.GetDimensions()], [a < dim for a in range(3)])
        self.assertEqual(data.GetBounds(), tuple(x for a in range(3) for x in (0.0, 1.0 if a < dim else 0.0)))
        self.assert_close(nodes["mass"].sum(), rows["mass"][row])
        for a, axis in enumerate("xyz"):
            terms = nodes["mass"] * nodes["velocity"][:, a]
            self.assert_close(terms.sum(), rows[f"momentum_{axis}"][row], scale=numpy.abs(terms).sum())

    def test_grid_of_splines(self):
        """Values of a spline at the points of a grid add up to one, inside; the body crosses blocks of nodes and sorts."""
        case = edit(CASE, ("dim = 2", "dim = 1"), ("spacing = 0.25", "spacing = 0.02"), ("radius = 0.25", "radius = 0.05"), "velocity = -20\n[output]\ngrid = true\ninterval = 0.0001\n")
        for basis in ("bspline2", "bspline3"):
            settings = ["method.preset=bsmpm", f"method.basis={basis}", "time.dt=0.0001", "time.end=0.01"]
            self.run_good(self.write("case.toml", case), "--output", basis, *(a for s in settings for a in ("--set", s)))
            rows = history(self.dir / basis)
            for time, path in frames(self.dir / basis, "grid"):
                self.assert_close(arrays(read_vtk(path).GetPointData())["mass"].sum(), rows["mass"][rows["time"].index(time)])

    def write_rich_case(self):
        (self.dir / "data").mkdir()
        self.write("data/points.csv", "# two squares\nx, y, volume\n0.90, 0.5, 0.01\n0.95, 0.7, 0.01\n")
        return self.write("case.toml", RICH)

    def test_the_resolved_case_gives_the_same_files(self):
        self.run_good(self.write_rich_case(), "--output", "first", "--set", "method.preset=cpgimp", "--set", "material.0.density=900")
        elsewhere = self.dir / "elsewhere"
        elsewhere.mkdir()
        done = ordo("run", self.dir / "first" / "case.toml", "--output", "second", cwd=elsewhere)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(contents(elsewhere / "second"), contents(self.dir / "first"))
        self.assertEqual({p.name for p in self.dir.glob("first/*.csv")}, {"history.csv", "probe_tip.csv", "probe_middle.csv"})

    def test_compact_files(self):
        """Reals of 32 bits, zlib, points in the place of domains, some of the particles: the same numbers, in fewer bytes."""
        many = edit(DEFORMING, ("spacing = 0.125", "spacing = 0.0078125"), ("end = 0.2", "end = 0.001"), ("dt = 0.01", "dt = 0.0005"))
        for case, preset in ((many, "cpdi1"), (many, "mpm"), (DEFORMING, "cpdi2t"), (edit(DEFORMING, ("dim = 2", "dim = 3")), "cpdi2")):
            self.write("case.toml", case)
            self.run_good("case.toml", "--output", "whole", "--set", f"method.preset={preset}", "--set", "output.fields=['velocity', 'stress', 'density']")
            first, last = (frames(self.dir / "whole")[k][1] for k in (0, -1))
            whole = read_vtk(last)
            for single, packed, points, every in itertools.product((False, True), (False, True), (False, True), (1, 3)):
                with self.subTest(preset=preset, single=single, packed=packed, points=points, every=every):
                    style = {"precision": "float32" if single else "float64", "compression": "zlib" if packed else "none",
                             "particles": "points" if points else "domains", "every": every}
                    words = [w for key, value in style.items() for w in ("--set", f"output.{key}={value}")]
                    self.run_good("case.toml", "--output", "out", "--set", f"method.preset={preset}", "--set", "output.fields=['velocity', 'stress', 'density']", *words)
                    some = read_vtk(frames(self.dir / "out")[-1][1])
                    self.check_compact(some, whole, single, points, every)
                    if packed:
                        self.assertLess((self.dir / "out" / first.name).stat().st_size, first.stat().st_size)

    def check_compact(self, some, whole, single, points, every):
        tolerance = 1e-7 if single else 0.0
        got, wanted = particle_data(some), particle_data(whole)
        self.assertEqual(set(wanted) - set(got), {"position"} if points and "position" in wanted else set())
        for name, values in got.items():
            self.assertEqual(values.dtype, numpy.float32 if single and wanted[name].dtype == numpy.float64 else wanted[name].dtype, name)
            self.assert_close(values, wanted[name][::every], scale=numpy.max(numpy.abs(wanted[name])), tolerance=tolerance)
        places = vtk_to_numpy(some.GetPoints().GetData())
        if points:
            self.assertEqual(some.GetNumberOfCells(), 1)
            centres = wanted["position"] if "position" in wanted else vtk_to_numpy(whole.GetPoints().GetData())
            self.assert_close(places, centres[::every], scale=1.0, tolerance=tolerance)
        else:
            corners = vtk_to_numpy(whole.GetPoints().GetData()).reshape(whole.GetNumberOfCells(), -1, 3)[::every]
            self.assertEqual(some.GetNumberOfCells(), len(corners))
            self.assert_close(places, corners.reshape(-1, 3), scale=1.0, tolerance=tolerance)
        attributes = some.GetCellData() if some.GetCellData().GetNumberOfArrays() else some.GetPointData()
        stress = attributes.GetArray("stress")
        self.assertEqual([stress.GetComponentName(c) for c in range(9)], [a + b for a in "xyz" for b in "xyz"])

    def test_sums_of_each_body(self):
        """They add up to the history. A body that spins has its angular momentum and keeps it; what nothing acts on moves straight on."""
        other = "[[body]]\nmaterial = 'rubber'\nshape = 'box'\nlower = [1.5, 1.5]\nupper = [1.75, 1.75]\nvelocity = [0.1, 0.2]\n"
        spin = "velocity = ['-0.3*(y - 0.5)', '0.3*(x - 0.5)']\n"
        case = edit(CASE, ("size = 1.0", "size = 2.0"), ("end = 0.01", "end = 0.1"), ("spacing = 0.25", "spacing = 0.125"),
                    ("[grid]", "gravity = [0.0, -1.0]\n[grid]"), spin + other + "[output]\nper_body = true\nhistory_interval = 3\n")
        self.run_good(self.write("case.toml", case), "--output", "out")
        whole = history(self.dir / "out")
        bodies = [{k: numpy.array(v) for k, v in history(self.dir / "out", f"body_{k}.csv").items()} for k in range(2)]
        for body in bodies:
            self.assertEqual(list(body["time"]), whole["time"])
        for name in ("mass", "momentum_x", "momentum_y", "kinetic_energy", "strain_energy", "potential_energy"):
            tolerance = 1e-9 if name == "strain_energy" else 1e-12  # small strains: round-off is that of the stiffness
            self.assert_close(bodies[0][name] + bodies[1][name], numpy.array(whole[name]), scale=numpy.max(numpy.abs(whole[name])) + 1e-9,
                              tolerance=tolerance)
        t, disk, box = numpy.array(whole["time"]), *bodies
        radius, mass = 0.25, 1000 * numpy.pi * 0.25**2
        self.assertAlmostEqual(disk["mass"][0], mass, 9)
        spin = disk["angular_momentum_z"] - (disk["center_x"] * disk["momentum_y"] - disk["center_y"] * disk["momentum_x"])
        self.assertAlmostEqual(spin[0] / (0.3 * mass * radius**2 / 2), 1, delta=0.02)
        self.assertLess(numpy.max(numpy.abs(spin / spin[0] - 1)), 0.02)
        self.assert_close(box["center_x"], 1.625 + 0.1 * t, scale=1.0, tolerance=1e-9)
        self.assert_close(box["center_y"], 1.625 + 0.2 * t - t**2 / 2, scale=1.0, tolerance=1e-3)

    def test_check_says_how_large_files_are(self):
        self.write("case.toml", DEFORMING)
        self.run_good("case.toml", "--output", "out")
        done = ordo("check", "case.toml", cwd=self.dir)
        size, count = re.search(r"# a file of particles takes (\S+) MB, about (\d+) of them", done.stdout).groups()
        self.assertAlmostEqual(float(size) / ((self.dir / "out" / "particles_000001.vtu").stat().st_size / 1e6), 1, delta=0.02)
        self.assertLessEqual(abs(len(frames(self.dir / "out")) - int(count)), 1)

    def test_displacement_across_a_periodic_face(self):
        case = edit(CASE, ("end = 0.01", "end = 0.2"), "velocity = [5, 0]\n[[boundary]]\nface = 'x-min'\ntype = 'periodic'\n[[probe]]\nname = 'p'\nparticle = 0.5\n")
        for preset in PRESETS:
            with self.subTest(preset):
                self.run_good(self.write("case.toml", case), "--output", preset, "--set", f"method.preset={preset}")
                for time, path in frames(self.dir / preset)[::10]:
                    moved = particle_data(read_vtk(path))["displacement"][:, 0]
                    self.assert_close(moved, numpy.full_like(moved, 5 * time), scale=1.0, tolerance=1e-9)

    def test_a_shorter_run_leaves_nothing_of_a_longer_one(self):
        case = self.write_rich_case()
        self.run_good(case, "--output", "both")
        self.run_good(case, "--output", "both", "--set", "time.end=0.15")
        self.run_good(case, "--output", "short", "--set", "time.end=0.15")
        self.assertEqual(contents(self.dir / "both"), contents(self.dir / "short"))

    def test_output_beside_the_case_leaves_the_case_alone(self):
        (self.dir / "mine").mkdir()
        case = self.write("mine/case.toml", CASE + "# my notes\n")
        mine = {case: case.read_text(), self.write("mine/probe_of_last_year.csv", "0\n"): "0\n"}
        ordo("run", case, "--output", self.dir / "mine", cwd=self.dir)
        for path, text in mine.items():
            with self.subTest(path.name):
                self.assertTrue(path.exists(), "removed")
                self.assertEqual(path.read_text(), text)
