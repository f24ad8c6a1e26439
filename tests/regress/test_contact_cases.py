"""Shipped cases of contact and obstacles against what rigid bodies, Hertz and Lame say; their READMEs have finer grids."""

import math
import unittest

import contact_measures as measures
import numpy
from test_cases import run_case


class Contact(unittest.TestCase):
    """Between bodies."""

    def run_case(self, name, *args):
        _, directory, _ = run_case(self, name, "--threads", "1", *args)
        return measures.Run(directory)

    def test_disks_keep_their_energy(self):
        run   = self.run_case("two-disks-contact")
        found = measures.disks(run)
        self.assertLess(found["largest"], 1 + 1e-9)
        self.assertGreater(found["energy"], 0.9)
        for k in (0, 1):
            along = run.body(k)["momentum_x"] + run.body(k)["momentum_y"]
            self.assertLess(along[-1] / along[0], -0.9)
        self.assertLess(abs(found["first gap, m"]), 0.02 * 0.025)

    def test_a_block_rests_without_overlap(self):
        """But at its edges, where pressure is singular."""
        gap = self.run_case("block-on-incline", "--set", "stage.1.duration=0.02").contacts()[1]["gap"]
        self.assertLess(numpy.median(-gap), 3e-5 * 0.1)
        self.assertGreater(gap.min(), -3e-3 * 0.1)

    def test_a_block_slides_like_a_rigid_one(self):
        found = measures.slide(self.run_case("block-on-incline"))
        self.assertAlmostEqual(found["acceleration"], 1, delta=0.01)
        self.assertLess(found["account"], 0.005)

    def test_a_block_stays_where_friction_holds_it(self):
        """It swings, undamped but for what the method loses, and does not creep: means over half a second, 1e-6 of free fall apart."""
        run = self.run_case("block-on-incline", "--set", "contact.0.friction=0.7", "--set", "stage.1.duration=2.6")
        self.assertLess(measures.stay(run, 2.0)["drift, m"], 1e-6 * 10 * (2.5**2 - 2.0**2) / 2)

    def test_a_block_with_internal_damping_stays_near_the_limit(self):
        """Friction 0.6, 4 % above the slope's tangent: without the branch the block flutters and walks down by 0.1 m in a second."""
        block = self.run_case("block-on-incline", "--set", "contact.0.friction=0.6", "--set", "material.0.branch_shear=[100000.0]", "--set",
                              "material.0.branch_time=[0.01]").body(1)
        late = block["time"] > 1.5
        self.assertLess(numpy.ptp(block["center_x"][late]), 1e-5)
        self.assertLess(numpy.abs(block["momentum_x"] / block["mass"])[late].max(), 2e-4)

    def test_a_block_on_a_shaken_table(self):
        found = measures.shaken(self.run_case("shaken-table"))
        self.assertGreater(found["slip, m"], 0.015)
        self.assertLess(found["difference"], 0.03)

    def test_spinning_rings_brake_each_other(self):
        found = measures.spinning(self.run_case("spinning-rings", "--set", "time.end=0.55"))
        self.assertLess(found["inner"], 0.02)
        self.assertLess(found["outer"], 0.02)

    def test_hertz(self):
        run   = self.run_case("hertz-contact", "--set", "time.end=24")
        found = measures.hertz(run)
        self.assertAlmostEqual(found["p0"], 1, delta=0.05)
        self.assertAlmostEqual(found["a"], 1, delta=0.05)
        self.assertLess(found["profile"], 0.1)
        self.assertLess(numpy.abs(run.contacts()[1]["gap"]).max(), 0.006 * 0.05)

    def test_spheres(self):
        run   = self.run_case("two-spheres-contact")
        found = measures.spheres(run)
        self.assertLess(found["largest"], 1 + 1e-9)
        self.assertGreater(found["energy"], 0.7)
        self.assertLess(found["momentum"], 1e-13)
        self.assertEqual(run.history["contact_0_force_x"][-1], 0.0)
        self.assertLess(run.body(0)["momentum_x"][-1], -0.2 * 0.5 * 0.1 * run.history["mass"][0])
        self.assertGreater(found["friction"], 0.005)

    def test_a_block_slides_in_3d(self):
        found = measures.plate(self.run_case("block-on-plate", "--set", "grid.spacing=0.2"))
        self.assertAlmostEqual(found["acceleration"], 1, delta=0.02)
        self.assertAlmostEqual(found["direction, degrees"], 30, delta=0.5)

    def test_press_fit(self):
        found = measures.press(self.run_case("press-fit", "--set", "time.end=2"))
        self.assertAlmostEqual(found["pressure"], 1, delta=0.005)
        self.assertLess(found["scatter"], 0.01)
        self.assertLess(found["overlap, m"], 1e-3 * 0.0625)

    def test_gears(self):
        """From 0.6 s on, two teeth long: 12 teeth over 18 for the spin, and as much work into the shaft as the load and the swing take."""
        run   = self.run_case("gears", "--set", "time.end=1.65")
        seen  = run.history
        found = measures.gears(run, 0.6)
        self.assertAlmostEqual(found["spin"], 1, delta=0.01)
        late = seen["time"] > 0.6
        gained = {column: numpy.ptp(seen[column][late][[0, -1]]) for column in ("shaft_work", "body_force_work")}
        energy = seen["total_energy"][late][-1] - seen["total_energy"][late][0]
        self.assertAlmostEqual((gained["shaft_work"] - energy) / gained["body_force_work"], 1, delta=0.02)
        self.assertAlmostEqual(found["force"], 1, delta=0.06)
        self.assertAlmostEqual(found["direction, degrees"], 20, delta=2)


class Obstacles(unittest.TestCase):
    def run_case(self, name, *args, **file):
        return run_case(self, name, "--threads", "1", *args, **file)

    def test_cylinder_rolls(self):
        """8 cells a radius. The spin in slip is 6 % short, at 16 cells 4.4 %."""
        for friction, wide in ((0.5, 0.03), (0.1, 0.08)):
            _, directory, _ = self.run_case("rolling-cylinder", "--set", "grid.spacing=0.05", "--set", f"obstacle.0.friction={friction}")
            found = measures.rolling(measures.Run(directory), friction)
            with self.subTest(friction=friction):
                self.assertAlmostEqual(found["acceleration"], 1, delta=0.03)
                self.assertAlmostEqual(found["spin"], 1, delta=wide)

    def test_a_sphere_slips(self):
        """Down an oblique plane, with the acceleration of a block; 4 cells a radius are too few for its spin."""
        cosine, sine, radius, friction, centre = 0.75**0.5, 0.5, 0.4, 0.1, (0.6, 0.6, 0.76)
        c, s = math.cos(0.25), math.sin(0.25)
        turn = numpy.array(((c, 0, s), (0, 1, 0), (-s, 0, c)))  # x turns down
        normal, down = turn @ (0, 0, 1), turn @ (cosine, sine, 0)
        load = [f"'{10 * sine * d!r}*min(1, max(0, (t - 0.3)/0.2)) - {10 * cosine * n!r}'" for d, n in zip(down.tolist(), normal.tolist())]
        options = {"obstacle.0.friction": friction, "obstacle.0.normal": normal.tolist(), "obstacle.0.point": (centre - radius * normal).tolist(),
                   "body.0.center": list(centre), "body.0.body_force": f"[{', '.join(load)}]", "stage.0.duration": 0.3, "stage.1.duration": 0.6}
        _, directory, _ = self.run_case("rolling-cylinder", *(word for key, value in options.items() for word in ("--set", f"{key}={value}")),
                                        file="case-sphere.toml")
        found = measures.rolling_sphere(measures.Run(directory), friction, normal, down, 0.55)
        self.assertAlmostEqual(found["acceleration"], 1, delta=0.02)
        self.assertLess(found["aside"], 0.01)  # straight down
        self.assertTrue(0.6 < found["spin"] < 1, found["spin"])

    def test_taylor_bar_flies_back(self):
        seen, directory, _ = self.run_case("taylor-bar", "--set", "method.scheme=musl", file="case-obstacle.toml")
        found = measures.taylor(measures.Run(directory))
        self.assertGreater(found["half width"], 1.03)  # the rim lifts off
        self.assertAlmostEqual(found["length"], 1, delta=0.01)
        self.assertEqual(seen["wall_force_y"][-1], 0.0)
        self.assertAlmostEqual(found["momentum"], 0.055, delta=0.01)
        total = seen["total_energy"] + seen["dissipated_energy"] + seen["wall_dissipation"] + seen["artificial_viscosity_work"]
        self.assertLess(numpy.ptp(total), 0.005 * total[0])

    def test_ball_goes_through_a_slab(self):
        seen, _, done = self.run_case("ball-through-slab")
        self.assertIn("numerical fracture", done.stderr)
        mass, start = 200, 4000
        momentum = seen["momentum_y"] + mass * seen["ball_velocity_y"]
        self.assertLess(numpy.ptp(momentum), 1e-12 * start)
        self.assertLess(seen["ball_y"][-1], 1.0)
        self.assertTrue(-19 < seen["ball_velocity_y"][-1] < -14)
        lost = mass / 2 * (20**2 - seen["ball_velocity_y"] ** 2)
        self.assertLess(numpy.abs(lost + seen["ball_work"]).max(), 1e-9 * lost.max())
        taken = sum(seen[column] for column in ("total_energy", "dissipated_energy", "ball_friction_work", "ball_dissipation"))
        self.assertLess(numpy.abs(lost - taken).max(), 0.02 * lost.max())
        self.assertLess(numpy.abs(lost - taken - seen["stress_update_energy"]).max(), 1e-12 * lost.max())

    def test_wheel_on_sand(self):
        """The sand carries the wheel. With more slip it sinks further and takes more moment."""
        sinkage, moment = [], []
        for speed in (0.4, 0.2):
            seen, _, _ = self.run_case("wheel-on-sand", "--set", "grid.spacing=0.04", "--set", "time.end=2.5", "--set",
                                       f"obstacle.0.velocity=[\"{speed}*(t < 0.5 ? 0 : t < 1 ? sin(pi/2*(t - 0.5)/0.5)^2 : 1)\", 0.0]")
            self.assertAlmostEqual(measures.mean(seen, "wheel_force_y", 1) / (1500 * 9.81), 1, delta=0.01)
            sinkage.append(0.6 - measures.mean(seen, "wheel_y", 1))
            moment.append(measures.mean(seen, "wheel_moment_z", 1))
        self.assertGreater(sinkage[1], 1.3 * sinkage[0])
        self.assertGreater(moment[1], 1.2 * moment[0])
        self.assertLess(moment[1], 0.5 * 1500 * 9.81 * 0.2)  # friction times load times radius


if __name__ == "__main__":
    unittest.main()
