"""What runs of contact and obstacles are judged by: numbers over those of rigid bodies, Hertz and Lame. For tests and scripts/contact_rows.py."""

import math
from pathlib import Path

import numpy
from harness import ROOT, arrays, frames, history, read_vtk
from test_benchmarks import extent
from vtk.util.numpy_support import vtk_to_numpy

SINE, COSINE, GRAVITY = 0.5, 0.75**0.5, 10.0  # of a slope of 30 degrees


class Run:
    """A finished run."""

    def __init__(self, directory):
        self.directory = Path(directory)
        self.history   = self.columns("history.csv")

    def columns(self, file):
        return {name: numpy.array(values) for name, values in history(self.directory, file).items()}

    def body(self, k):
        return self.columns(f"body_{k}.csv")

    def contacts(self, time=math.inf):
        """The points of the last frame but one until `time`: their places and arrays. The last step of a run is shorter than the others."""
        files = [file for t, file in frames(self.directory, "contact")[:-1] if t < time + 1e-9]
        data  = read_vtk(files[-1])
        return vtk_to_numpy(data.GetPoints().GetData()), arrays(data.GetPointData())


def gain(time, values, begin):
    """The slope from `begin` on."""
    return numpy.polyfit(time[time > begin], values[time > begin], 1)[0]


def mean(seen, column, begin):
    late = seen["time"] > begin
    return numpy.average(seen[column][late], weights=seen["dt"][late])


def hertz(run, width=0.15, of_sphere=False):
    """p0 and a of a fit of p^2 = p0^2 (1 - r^2/a^2), of a sphere from the points with more than 0.3 of the largest pressure, over those of
    Hertz; the error of the profile by area; the deepest overlap in cells."""
    stiffness     = 1000 / (1 - 0.3**2)
    places, found = run.contacts()
    p, area  = found["pressure"], found["area"]
    r2, peak = ((places[:, :2] ** 2).sum(axis=1), 2 * stiffness * width / math.pi) if of_sphere else (places[:, 0] ** 2, stiffness * width / 2)
    fitted   = p > (0.3 * p.max() if of_sphere else 0.0)
    slope, square = numpy.polyfit(r2[fitted], p[fitted] ** 2, 1)
    exact = peak * numpy.sqrt(numpy.maximum(0, 1 - r2 / width**2))
    error = (numpy.average((p - exact) ** 2, weights=area) / numpy.average(exact**2, weights=area)) ** 0.5
    return {"p0": square**0.5 / peak, "a": (-square / slope) ** 0.5 / width, "profile": error, "overlap, m": -found["gap"].min()}


def disks(run):
    """Energies over that at the start; gap of the circles at the end of the first step with a force, m."""
    seen, one = run.history, run.body(0)
    energy = seen["total_energy"] / seen["total_energy"][0]
    along  = one["momentum_x"] + one["momentum_y"]
    row    = {"energy": energy[-1], "largest": energy.max(), "speed": -along[-1] / along[0]}
    if "contact_0_force_x" in seen:
        meets = numpy.flatnonzero(seen["contact_0_force_x"] != 0)[0]
        row |= {"dissipation": seen["contact_0_dissipation"][-1] / seen["total_energy"][0],
                "first gap, m": 0.4 * 2**0.5 - 0.4 - 0.2 * seen["time"][meets]}
    return row


def spheres(run):
    """Over the energy at the start."""
    seen = run.history
    of   = {name: seen[column] / seen["total_energy"][0] for name, column in (
        ("energy", "total_energy"), ("friction", "contact_0_friction_work"), ("dissipation", "contact_0_dissipation"))}
    momentum = max(numpy.abs(seen[f"momentum_{axis}"] - seen[f"momentum_{axis}"][0]).max() for axis in "xyz") / (0.1 * seen["mass"][0])
    return {name: values[-1] for name, values in of.items()} | {"sum": sum(values[-1] for values in of.values()), "largest": of["energy"].max(),
                                                                "momentum": momentum}


def account(seen, begin):
    """The change of energies and works since `begin` over the work of the load."""
    names = ("total_energy", "potential_energy", "body_force_work", "boundary_work", "contact_0_friction_work", "contact_0_dissipation")
    total = sum(seen[name] for name in names)[seen["time"] > begin]
    return numpy.abs(total - total[0]).max() / abs(seen["body_force_work"][-1])


def deepest(run, time):
    return -run.contacts(time)[1]["gap"].min()


def slide(run):
    """The acceleration over that of a rigid block."""
    b = run.body(1)
    slope = gain(b["time"], b["momentum_x"] / b["mass"], 0.9)
    return {"acceleration": slope / (GRAVITY * (SINE - 0.3 * COSINE)), "account": account(run.history, 0.41), "overlap at rest, m": deepest(run, 0.4)}


def stay(run, begin=1.3):
    """How the centre moves after the load has grown: between the half seconds after `begin` and before the end, in all, and its last speed."""
    b = run.body(1)
    t, x, v = b["time"], b["center_x"], b["momentum_x"] / b["mass"]
    row = {"way, m": x[-1] - x[t > 0.41][0], "speed, m/s": numpy.abs(v[t > t[-1] - 0.2]).max(), "overlap at rest, m": deepest(run, 0.4)}
    if t[-1] > begin + 0.5:
        means = [x[(t > end - 0.5) & (t <= end)].mean() for end in (begin + 0.5, t[-1])]
        row |= {"drift, m": abs(means[1] - means[0]), "drift over g t^2/2": abs(means[1] - means[0]) / (GRAVITY * (t[-1] - begin) ** 2 / 2)}
    return row


def plate(run):
    b = run.body(1)
    x, y = (gain(b["time"], b[f"momentum_{axis}"] / b["mass"], 0.75) for axis in "xy")
    return {"acceleration": math.hypot(x, y) / (GRAVITY * (SINE - 0.3 * COSINE)), "direction, degrees": math.degrees(math.atan2(y, x)),
            "account": account(run.history, 0.41), "overlap at rest, m": deepest(run, 0.4)}


def shaken(run):
    """The largest difference to the rigid block's place over the range of its slip."""
    block, start, step = run.body(1), 0.4, 1e-5
    t     = start + step * numpy.arange(200001)
    table = 0.36 * numpy.sin(4 * numpy.pi * (t - start)) * numpy.where(t < 0.9, numpy.sin(numpy.pi * (t - start)) ** 2, 1)
    speed = numpy.zeros(len(t))
    for k in range(1, len(t)):
        speed[k] = speed[k - 1] + min(max(table[k] - speed[k - 1], -3 * step), 3 * step)
    rigid  = numpy.interp(block["time"], t, step * numpy.cumsum(speed))
    after  = block["time"] >= start
    error  = (block["center_x"] - block["center_x"][after][0] - rigid)[after]
    slip   = numpy.ptp(step * numpy.cumsum(speed - table))
    return {"difference": numpy.abs(error).max() / slip, "slip, m": slip}


def spinning(run):
    """Errors of the angular speeds over the first one until 0.55 s; the mean moment over the expected one."""
    seen, radii = run.history, (0.4, 0.6137, 0.85)
    inertia = [1000 * math.pi / 2 * (b**4 - a**4) for a, b in zip(radii, radii[1:])]
    t       = seen["time"]
    press   = 100 * numpy.where(t < 0.2, numpy.sin(numpy.pi / 2 * t / 0.2) ** 2, 1)
    impulse = numpy.concatenate([[0], numpy.cumsum((press[1:] + press[:-1]) / 2 * numpy.diff(t))])
    lever   = 0.1 * 0.2612 * 2 * math.pi * radii[1] ** 2
    bodies  = [run.body(k)["angular_momentum_z"] for k in (0, 1)]
    brakes  = t < 0.55 + 1e-9
    errors  = [numpy.abs(b / size - (first + sign * lever * impulse / size))[brakes].max() / 0.02
               for b, sign, first, size in zip(bodies, (-1, 1), (0.02, 0.0), inertia)]
    late    = (t > 0.25) & (t < 0.5)
    moment  = -numpy.average(seen["contact_0_moment_z"][late], weights=seen["dt"][late]) / (100 * lever)
    return {"inner": errors[0], "outer": errors[1], "moment": moment,
            "angular momentum": (bodies[0][-1] + bodies[1][-1]) / (bodies[0][0] + bodies[1][0])}


def press(run):
    """Mean and standard deviation of the pressure over that of Lame."""
    a, b, c, gap = 0.4, 0.6137, 0.85, 1e-3
    exact = 1e6 / (1 - 0.3**2) * gap / b / ((b**2 + a**2) / (b**2 - a**2) + (c**2 + b**2) / (c**2 - b**2))
    _, found = run.contacts()
    p, area  = found["pressure"], found["area"]
    middle   = numpy.average(p, weights=area)
    return {"pressure": middle / exact, "scatter": numpy.average((p - middle) ** 2, weights=area) ** 0.5 / exact, "overlap, m": -found["gap"].min(),
            "dissipation, J": run.history["contact_0_dissipation"][-1], "strain energy, J": run.history["strain_energy"][-1]}


def gears(run, begin=1.0):
    """Means from `begin` on over those of rigid gears."""
    seen = run.history
    x, y = (mean(seen, f"contact_0_force_{axis}", begin) for axis in "xy")
    late = seen["time"] > begin
    return {"spin": mean(seen, "driven_shaft_rotation_z", begin) * 18 / 12, "moment": abs(mean(seen, "shaft_moment_z", begin)) / (1000 * 12 / 18),
            "force": math.hypot(x, y) / (1000 / (0.72 * math.cos(math.radians(20)))), "direction, degrees": math.degrees(math.atan2(-x, y)),
            "gain, J": numpy.diff(seen["total_energy"][late][[0, -1]])[0], "dissipation, J": numpy.diff(seen["contact_0_dissipation"][late][[0, -1]])[0]}


def rigid(friction, inertia, limit):
    """Acceleration and angular acceleration of a rigid body of radius 0.4 m down the slope; its inertia is over m R^2."""
    if friction > limit:
        return GRAVITY * SINE / (1 + inertia), GRAVITY * SINE / (1 + inertia) / 0.4
    return GRAVITY * (SINE - friction * COSINE), friction * GRAVITY * COSINE / (inertia * 0.4)


def rolling(run, friction=0.5):
    """Acceleration and angular acceleration over those of a rigid cylinder."""
    slope, spin = rigid(friction, 1 / 2, 0.2)
    b = run.body(0)
    turning = b["angular_momentum_z"] - b["center_x"] * b["momentum_y"] + b["center_y"] * b["momentum_x"]
    mass    = b["mass"][0]
    return {"acceleration": gain(b["time"], b["momentum_x"], 0.95) / mass / slope, "spin": -gain(b["time"], turning, 0.95) / (mass * 0.4**2 / 2) / spin}


def rolling_sphere(run, friction=0.5, normal=(0.0, 0.0, 1.0), down=(COSINE, SINE, 0.0), begin=0.95):
    """The same of a sphere on a plane with this normal and line of slope; its spin is about the axis across the way. How far its way is off the
    slope, and the largest momentum across it over that along it."""
    slope, spin = rigid(friction, 2 / 5, 0.16)
    b = run.body(0)
    place, momentum = (numpy.stack([b[f"{name}_{axis}"] for axis in "xyz"]) for name in ("center", "momentum"))
    turning = numpy.stack([b[f"angular_momentum_{axis}"] for axis in "xyz"]) - numpy.cross(place, momentum, axis=0)
    across, mass = numpy.cross(normal, down), b["mass"][0]
    along, aside = numpy.array(down) @ momentum, across @ momentum
    speeds = [gain(b["time"], one, begin) / mass for one in (along, aside)]
    return {"acceleration": math.hypot(*speeds) / slope, "spin": gain(b["time"], across @ turning, begin) / (2 / 5 * mass * 0.4**2) / spin,
            "off the slope, degrees": math.degrees(math.atan2(speeds[1], speeds[0])), "aside": numpy.abs(aside).max() / along.max()}


def taylor(run):
    """Half width and length over those of the held bar; losses over the energy at the start."""
    seen = run.history
    held = numpy.genfromtxt(ROOT / "cases/taylor-bar/reference.csv", delimiter=",", skip_header=1, names=True)
    time, file = frames(run.directory)[-1]
    width, length, _ = extent(read_vtk(file))
    total = seen["total_energy"] + seen["dissipated_energy"] + seen.get("artificial_viscosity_work", 0)
    return {"half width": width / numpy.interp(time, held["t"], held["half_width"]), "length": length / numpy.interp(time, held["t"], held["length"]),
            "lost": 1 - total[-1] / total[0], "contact": seen["wall_dissipation"][-1] / total[0],
            "back, us": 1e6 * seen["time"][numpy.flatnonzero(seen["wall_force_y"])[-1]], "momentum": -seen["momentum_y"][-1] / seen["momentum_y"][0]}


def ball(run):
    """The ball's energy loss, where it went, and what is in no account, kJ."""
    seen  = run.history
    lost  = 0.1 * (20**2 - seen["ball_velocity_y"][-1] ** 2)
    taken = {name: seen[column][-1] / 1e3 for name, column in (
        ("plastic", "dissipated_energy"), ("friction", "ball_friction_work"), ("impact", "ball_dissipation"), ("slab", "total_energy"))}
    return {"velocity, m/s": abs(seen["ball_velocity_y"][-1]), "lost": lost} | taken | {"in no account": lost - sum(taken.values())}


def wheel(run):
    """Means from 1.5 s on."""
    return {name: mean(run.history, column, 1.5) for name, column in (
        ("height, m", "wheel_y"), ("pull, N", "wheel_force_x"), ("load, N", "wheel_force_y"), ("moment, N m", "wheel_moment_z"))}
