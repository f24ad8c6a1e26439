"""Shipped cases of contact and obstacles against what rigid bodies, Hertz and Lame say; their READMEs have finer grids."""

import math
import unittest

import numpy
from harness import ROOT, arrays, frames, history, read_vtk
from test_benchmarks import extent
from test_cases import run_case
from vtk.util.numpy_support import vtk_to_numpy


def columns_of(directory, file):
    return {name: numpy.array(values) for name, values in history(directory, file).items()}


def mean(seen, column, begin):
    """Over time, from `begin` on."""
    late = seen["time"] > begin
    return numpy.average(seen[column][late], weights=seen["dt"][late])


def gain(time, values, begin):
    """The slope from `begin` on."""
    return numpy.polyfit(time[time > begin], values[time > begin], 1)[0]


class Contact(unittest.TestCase):
    """Between bodies."""

    def run_case(self, name, *args):
        columns, directory, _ = run_case(self, name, "--threads", "1", *args)
        return columns, [columns_of(directory, f"body_{k}.csv") for k in (0, 1)], directory

    def test_disks_keep_their_energy(self):
        seen, (one, other), _ = self.run_case("two-disks-contact")
        energy = seen["total_energy"] / seen["total_energy"][0]
        self.assertLess(energy.max(), 1 + 1e-9)
        self.assertGreater(energy[-1], 0.9)
        apart = [(b["momentum_x"] + b["momentum_y"])[-1] / (b["momentum_x"] + b["momentum_y"])[0] for b in (one, other)]
        for part in apart:
            self.assertLess(part, -0.9)

    def slide(self, *args):
        """The acceleration once the load is constant, and the change of energies and works since the start of the load over its work."""
        seen, (_, block), _ = self.run_case("block-on-incline", *args)
        late  = block["time"] > 0.9
        slope = numpy.polyfit(block["time"][late], (block["momentum_x"] / block["mass"])[late], 1)[0]
        total = sum(seen[name] for name in ("total_energy", "potential_energy", "body_force_work", "boundary_work", "contact_0_friction_work", "contact_0_dissipation"))
        total = total[seen["time"] > 0.41]
        return slope, numpy.abs(total - total[0]).max() / abs(seen["body_force_work"][-1]), block

    def test_a_block_rests_without_overlap(self):
        """But at its edges, where pressure is singular."""
        _, _, directory = self.run_case("block-on-incline", "--set", "stage.1.duration=0.02")
        gap = arrays(read_vtk(frames(directory, "contact")[-2][1]).GetPointData())["gap"]
        self.assertLess(numpy.median(-gap), 3e-5 * 0.1)
        self.assertGreater(gap.min(), -3e-3 * 0.1)

    def test_a_block_slides_like_a_rigid_one(self):
        slope, lost, _ = self.slide()
        self.assertAlmostEqual(slope / (10 * (0.5 - 0.3 * 0.75**0.5)), 1, delta=0.01)
        self.assertLess(lost, 0.005)

    def test_a_block_stays_where_friction_holds_it(self):
        """It swings, undamped but for what the method loses, and does not creep: means over half a second, 1e-6 of free fall apart."""
        _, _, block = self.slide("--set", "contact.0.friction=0.7", "--set", "stage.1.duration=2.6")
        t, x  = block["time"], block["center_x"]
        means = [x[(t > begin) & (t <= begin + 0.5)].mean() for begin in (2.0, 2.5)]
        self.assertLess(abs(means[1] - means[0]), 1e-6 * 10 * (2.5**2 - 2.0**2) / 2)

    def test_a_block_with_internal_damping_stays_near_the_limit(self):
        """Friction 0.6, 4 % above the slope's tangent: without the branch the block flutters and walks down by 0.1 m in a second."""
        _, _, block = self.slide("--set", "contact.0.friction=0.6", "--set", "material.0.branch_shear=[100000.0]", "--set",
                                 "material.0.branch_time=[0.01]")
        late = block["time"] > 1.5
        self.assertLess(numpy.ptp(block["center_x"][late]), 1e-5)
        self.assertLess(numpy.abs(block["momentum_x"] / block["mass"])[late].max(), 2e-4)

    def test_a_block_on_a_shaken_table(self):
        seen, (_, block), _ = self.run_case("shaken-table")
        start, step = 0.4, 1e-5
        t = start + step * numpy.arange(200001)
        table = 0.36 * numpy.sin(4 * numpy.pi * (t - start)) * numpy.where(t < 0.9, numpy.sin(numpy.pi * (t - start)) ** 2, 1)
        speed = numpy.zeros(len(t))
        for k in range(1, len(t)):
            speed[k] = speed[k - 1] + min(max(table[k] - speed[k - 1], -3 * step), 3 * step)
        way    = numpy.interp(block["time"], t, step * numpy.cumsum(speed))
        shaken = block["time"] >= start
        error  = (block["center_x"] - block["center_x"][shaken][0] - way)[shaken]
        self.assertGreater(numpy.ptp(step * numpy.cumsum(speed - table)), 0.015)  # it slides
        self.assertLess(numpy.abs(error).max(), 0.03 * numpy.ptp(step * numpy.cumsum(speed - table)))

    def test_spinning_rings_brake_each_other(self):
        seen, bodies, _ = self.run_case("spinning-rings", "--set", "time.end=0.55")
        radii   = (0.4, 0.6137, 0.85)
        inertia = [1000 * math.pi / 2 * (b**4 - a**4) for a, b in zip(radii, radii[1:])]
        t       = seen["time"]
        press   = 100 * numpy.where(t < 0.2, numpy.sin(numpy.pi / 2 * t / 0.2) ** 2, 1)
        impulse = numpy.concatenate([[0], numpy.cumsum((press[1:] + press[:-1]) / 2 * numpy.diff(t))])
        turn    = 0.1 * 0.2612 * 2 * math.pi * radii[1] ** 2 * impulse
        for body, sign, start, size in zip(bodies, (-1, 1), (0.02, 0.0), inertia):
            error = body["angular_momentum_z"] / size - (start + sign * turn / size)
            self.assertLess(numpy.abs(error).max(), 0.02 * 0.02)

    def test_hertz(self):
        _, _, directory = self.run_case("hertz-contact", "--set", "time.end=24")
        data  = read_vtk(frames(directory, "contact")[-2][1])  # the last step is shorter than the others
        found = arrays(data.GetPointData())
        x2    = vtk_to_numpy(data.GetPoints().GetData())[:, 0] ** 2
        slope, square = numpy.polyfit(x2, found["pressure"] ** 2, 1)  # p^2 = p0^2 (1 - x^2/a^2)
        peak  = 1000 / (1 - 0.3**2) * 0.15 / 2
        exact = peak * numpy.sqrt(numpy.maximum(0, 1 - x2 / 0.15**2))
        self.assertAlmostEqual(square**0.5 / peak, 1, delta=0.05)
        self.assertAlmostEqual((-square / slope) ** 0.5 / 0.15, 1, delta=0.05)
        error = numpy.average((found["pressure"] - exact) ** 2, weights=found["area"]) / numpy.average(exact**2, weights=found["area"])
        self.assertLess(error**0.5, 0.1)
        self.assertLess(numpy.abs(found["gap"]).max(), 0.006 * 0.05)

    def test_spheres(self):
        seen, bodies, _ = self.run_case("two-spheres-contact")
        energy, scale = seen["total_energy"] / seen["total_energy"][0], 0.1 * seen["mass"][0]
        self.assertLess(energy.max(), 1 + 1e-9)
        self.assertGreater(energy[-1], 0.7)
        for axis in "xyz":
            self.assertLess(numpy.abs(seen[f"momentum_{axis}"] - seen[f"momentum_{axis}"][0]).max(), 1e-13 * scale)
        self.assertEqual(seen["contact_0_force_x"][-1], 0.0)
        self.assertLess(bodies[0]["momentum_x"][-1], -0.2 * 0.5 * scale)
        self.assertGreater(seen["contact_0_friction_work"][-1], 0.005 * seen["total_energy"][0])

    def test_a_block_slides_in_3d(self):
        _, (_, block), _ = self.run_case("block-on-plate", "--set", "grid.spacing=0.2")
        late = block["time"] > 0.75
        x, y = (numpy.polyfit(block["time"][late], (block[f"momentum_{axis}"] / block["mass"])[late], 1)[0] for axis in "xy")
        self.assertAlmostEqual(math.hypot(x, y) / (10 * (0.5 - 0.3 * 0.75**0.5)), 1, delta=0.02)
        self.assertAlmostEqual(math.degrees(math.atan2(y, x)), 30, delta=0.5)

    def test_press_fit(self):
        a, b, c = 0.4, 0.6137, 0.85
        lame = 1e6 / (1 - 0.3**2) * 1e-3 / b / ((b**2 + a**2) / (b**2 - a**2) + (c**2 + b**2) / (c**2 - b**2))
        _, _, directory = self.run_case("press-fit", "--set", "time.end=2")
        found = arrays(read_vtk(frames(directory, "contact")[-2][1]).GetPointData())
        pressure = numpy.average(found["pressure"], weights=found["area"])
        self.assertAlmostEqual(pressure / lame, 1, delta=0.005)
        self.assertLess(numpy.average((found["pressure"] - pressure) ** 2, weights=found["area"]) ** 0.5, 0.01 * lame)
        self.assertGreater(found["gap"].min(), -1e-3 * 0.0625)

    def test_gears(self):
        """From 0.6 s on, two teeth long: 12 teeth over 18 for the spin, and as much work into the shaft as the load and the swing take."""
        seen, (_, driven), _ = self.run_case("gears", "--set", "time.end=1.65")
        self.assertAlmostEqual(mean(seen, "driven_shaft_rotation_z", 0.6) * 18 / 12, 1, delta=0.01)
        late = seen["time"] > 0.6
        gained = {column: numpy.ptp(seen[column][late][[0, -1]]) for column in ("shaft_work", "body_force_work")}
        energy = seen["total_energy"][late][-1] - seen["total_energy"][late][0]
        self.assertAlmostEqual((gained["shaft_work"] - energy) / gained["body_force_work"], 1, delta=0.02)
        x, y = (mean(seen, f"contact_0_force_{axis}", 0.6) for axis in "xy")
        self.assertAlmostEqual(math.hypot(x, y) / (1000 / (0.72 * math.cos(math.radians(20)))), 1, delta=0.06)
        self.assertAlmostEqual(math.degrees(math.atan2(-x, y)), 20, delta=2)


class Obstacles(unittest.TestCase):
    def run_case(self, name, *args, **file):
        return run_case(self, name, "--threads", "1", *args, **file)

    def test_cylinder_rolls(self):
        """Without slip at 2/3 of g sin, with slip at that of a block; 8 cells a radius. The spin in slip is 6 % short, at 16 cells 4.4 %."""
        sine, cosine, radius = 0.5, 0.75**0.5, 0.4
        for friction, exact, spin, wide in ((0.5, 10 * sine * 2 / 3, 10 * sine * 2 / 3 / radius, 0.03),
                                            (0.1, 10 * (sine - 0.1 * cosine), 0.2 * 10 * cosine / radius, 0.08)):
            _, directory, _ = self.run_case("rolling-cylinder", "--set", "grid.spacing=0.05", "--set", f"obstacle.0.friction={friction}")
            b = columns_of(directory, "body_0.csv")
            turning = b["angular_momentum_z"] - b["center_x"] * b["momentum_y"] + b["center_y"] * b["momentum_x"]
            mass = b["mass"][0]
            with self.subTest(friction=friction):
                self.assertAlmostEqual(gain(b["time"], b["momentum_x"], 0.95) / mass / exact, 1, delta=0.03)
                self.assertAlmostEqual(-gain(b["time"], turning, 0.95) / (mass * radius**2 / 2) / spin, 1, delta=wide)

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
        b = columns_of(directory, "body_0.csv")
        place, momentum = (numpy.stack([b[f"{name}_{axis}"] for axis in "xyz"]) for name in ("center", "momentum"))
        turning = numpy.stack([b[f"angular_momentum_{axis}"] for axis in "xyz"]) - numpy.cross(place, momentum, axis=0)
        along, across, mass = down @ momentum, numpy.cross(normal, down), b["mass"][0]
        self.assertAlmostEqual(gain(b["time"], along, 0.55) / mass / (10 * (sine - friction * cosine)), 1, delta=0.02)
        self.assertLess(numpy.abs(across @ momentum).max(), 0.01 * along.max())  # straight down
        spin = gain(b["time"], across @ turning, 0.55) / (2 / 5 * mass * radius**2) / (5 / 2 * friction * 10 * cosine / radius)
        self.assertTrue(0.6 < spin < 1, spin)

    def test_taylor_bar_flies_back(self):
        seen, directory, _ = self.run_case("taylor-bar", "--set", "method.scheme=musl", file="case-obstacle.toml")
        held = numpy.genfromtxt(ROOT / "cases/taylor-bar/reference.csv", delimiter=",", skip_header=1, names=True)
        time, file = frames(directory)[-1]
        width, length, _ = extent(read_vtk(file))
        self.assertGreater(width / numpy.interp(time, held["t"], held["half_width"]), 1.03)  # the rim lifts off
        self.assertAlmostEqual(length / numpy.interp(time, held["t"], held["length"]), 1, delta=0.01)
        self.assertEqual(seen["wall_force_y"][-1], 0.0)
        self.assertAlmostEqual(seen["momentum_y"][-1] / -seen["momentum_y"][0], 0.055, delta=0.01)
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
            self.assertAlmostEqual(mean(seen, "wheel_force_y", 1) / (1500 * 9.81), 1, delta=0.01)
            sinkage.append(0.6 - mean(seen, "wheel_y", 1))
            moment.append(mean(seen, "wheel_moment_z", 1))
        self.assertGreater(sinkage[1], 1.3 * sinkage[0])
        self.assertGreater(moment[1], 1.2 * moment[0])
        self.assertLess(moment[1], 0.5 * 1500 * 9.81 * 0.2)  # friction times load times radius


if __name__ == "__main__":
    unittest.main()
