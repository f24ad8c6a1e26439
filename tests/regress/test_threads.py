"""Every file is the same, byte by byte, for any number of threads.

The cases are large enough for several tiles of cells and several pieces of each reduction.
"""

from harness import CASE, PRESETS, TWO_DISKS, InTemporaryDirectory, contents, edit, history

FINE_DISKS = ["--set", "grid.spacing=0.025", "--set", "time.end=0.05", "--set", "output.interval=0.025", "--set", "output.grid=true"]

FORCED_CUBE = edit(
    CASE,
    ("dim = 2", "dim = 3"),
    ("spacing = 0.25", "spacing = 0.0625"),
    ("radius = 0.25", "radius = 0.35"),
    "velocity = '0.2*sin(5*x)'\nbody_force = ['sin(3*X + t)', 'x*y', 'exp(-z)']\n[method]\npreset = 'cpdi1'\n[output]\ngrid = true\ninterval = 0.005\n",
)

PERIODIC = edit(
    CASE,
    ("spacing = 0.25", "spacing = 0.03125"),
    ('shape = "ball"\ncenter = 0.5\nradius = 0.25\n', "shape = 'box'\nlower = [0.0, 0.25]\nupper = [1.0, 0.75]\nvelocity = ['10', '0.1*sin(2*pi*x)']\n"),
    "[[boundary]]\nface = 'x-min'\ntype = 'periodic'\n[output]\ngrid = true\n",
)


BAR = edit(
    CASE,
    ("dim = 2", "dim = 1"),
    ("spacing = 0.25", "spacing = 0.0002"),
    ('shape = "ball"\ncenter = 0.5\nradius = 0.25\n', "shape = 'box'\nlower = 0.1\nupper = 0.95\nvelocity = ['sin(5*x)']\nparticles_per_cell = 3\n"),
    "[[boundary]]\nface = 'x-min'\ntype = 'fixed'\n[output]\ngrid = true\n",
)


class Threads(InTemporaryDirectory):
    def assert_same_for_any_threads(self, *args):
        for threads in (1, 2, 3, 8):
            self.run_good(*args, "--threads", threads, "--output", f"threads {threads}")
        one = contents(self.dir / "threads 1")
        for threads in (2, 3, 8):
            many = contents(self.dir / f"threads {threads}")
            self.assertEqual(many.keys(), one.keys())
            self.assertEqual([name for name in one if many[name] != one[name]], [], f"files differ between 1 and {threads} threads")

    def test_two_disks(self):
        for preset in PRESETS:
            with self.subTest(preset):
                self.assert_same_for_any_threads(TWO_DISKS, *FINE_DISKS, "--set", f"method.preset={preset}")

    def test_forced_ball_in_3d(self):
        self.assert_same_for_any_threads(self.write("case.toml", FORCED_CUBE))

    def test_periodic(self):
        for preset in PRESETS:
            with self.subTest(preset):
                self.assert_same_for_any_threads(self.write("case.toml", PERIODIC), "--set", f"method.preset={preset}")

    def test_a_bar_of_many_particles(self):
        for preset in ("mpm", "cpdi1", "cpls", "impm"):
            with self.subTest(preset):
                self.assert_same_for_any_threads(self.write("case.toml", BAR), "--set", f"method.preset={preset}", "--set", "time.dt=1e-5", "--set", "time.end=1e-4", "--set", "output.interval=5e-5")

    def test_splines_between_walls(self):
        whole = edit(PERIODIC, ("lower = [0.0, 0.25]\nupper = [1.0, 0.75]", "lower = 0.0\nupper = 1.0"), ("'10', '0.1", "'0.1*sin(pi*y)', '0.1*sin(pi*y)"), "[[boundary]]\nface = ['y-min', 'y-max']\ntype = 'symmetry'\n")
        for preset in ("spline3", "spline4"):
            with self.subTest(preset):
                self.assert_same_for_any_threads(self.write("case.toml", whole), "--set", f"method.preset={preset}")

    def test_splines_of_a_free_strip(self):
        self.assert_same_for_any_threads(self.write("case.toml", PERIODIC), "--set", "method.preset=spline3", "--set", "grid.spacing=0.125")

    def test_splines_of_a_free_disk(self):
        """Its functions are more than a piece of a sum, and some lines of the grid have none."""
        fine = ["grid.spacing=0.0125", "body.0.radius=0.35", "body.0.velocity=['0.3*x*y', '0.2*x']", "time.dt=0.0001", "time.end=0.0002"]
        self.assert_same_for_any_threads(self.write("case.toml", CASE), "--set", "method.preset=spline3", *(word for one in fine for word in ("--set", one)))

    def test_splines_of_a_free_ring(self):
        """A quarter of it between symmetry planes; its energy stays."""
        ring = edit(
            PERIODIC,
            ("shape = 'box'\nlower = [0.0, 0.25]\nupper = [1.0, 0.75]", "shape = 'ring'\ncenter = 0.0\ninner_radius = 0.3\nradius = 0.6\nangle = [0, 90]\ncells = 'polar'"),
            ("'10', '0.1*sin(2*pi*x)'", "'x', 'y'"),
            ("face = 'x-min'\ntype = 'periodic'", "face = ['x-min', 'y-min']\ntype = 'symmetry'"),
        )
        self.assert_same_for_any_threads(self.write("case.toml", ring), "--set", "method.preset=spline3", "--set", "grid.spacing=0.1")
        energy = history(self.dir / "threads 1")["total_energy"]
        self.assertGreater(len(energy), 3)
        self.assertAlmostEqual(energy[-1] / energy[0], 1, delta=1e-3)

    def test_consistent_mass(self):
        for preset in ("bsmpm", "ddmpm", "tls-bsmpm"):
            with self.subTest(preset):
                method = ["--set", f"method.preset={preset}"]
                self.assert_same_for_any_threads(TWO_DISKS, *FINE_DISKS, *method)
                self.assert_same_for_any_threads(self.write("case.toml", PERIODIC), *method, "--set", "time.dt=0.0002", "--set", "time.end=0.002")
