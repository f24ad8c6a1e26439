#!/usr/bin/env python3
"""Measures the tables of contact: of the READMEs of its cases, docs/contact.md and docs/obstacles.md.

Prints a row for each run. Exit code: 1 if one misses a bar.
Usage: scripts/contact_rows.py [--results DIRECTORY] [NAME...]; needs ordo (ORDO, by default the release build), numpy and vtk.
"""

import argparse
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy

ROOT = Path(__file__).resolve().parent.parent
os.environ.setdefault("ORDO", str(ROOT / "build" / "release" / "ordo"))
os.environ.setdefault("ORDO_ROOT", str(ROOT))
sys.path.insert(0, str(ROOT / "tests" / "regress"))
import harness  # noqa: E402

SINE, COSINE, GRAVITY = 0.5, 0.75**0.5, 10.0  # of a slope of 30 degrees


class Run:
    """A finished run."""

    def __init__(self, directory):
        self.directory = directory
        self.history   = self.columns("history.csv")

    def columns(self, file):
        return {name: numpy.array(values) for name, values in harness.history(self.directory, file).items()}

    def body(self, k):
        return self.columns(f"body_{k}.csv")

    def contacts(self, time=math.inf):
        """The points of the last frame but one until `time`: their places and arrays. The last step of a run is shorter than the others."""
        from vtk.util.numpy_support import vtk_to_numpy

        frames = harness.frames(self.directory, "contact")[:-1]
        data   = harness.read_vtk([file for t, file in frames if t < time + 1e-9][-1])
        return vtk_to_numpy(data.GetPoints().GetData()), harness.arrays(data.GetPointData())


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
    return {"difference": numpy.abs(error).max() / numpy.ptp(step * numpy.cumsum(speed - table))}


def spinning(run):
    """Errors of the angular speeds over the first one until 0.5 s; the mean moment over the expected one."""
    seen, radii = run.history, (0.4, 0.6137, 0.85)
    inertia = [1000 * math.pi / 2 * (b**4 - a**4) for a, b in zip(radii, radii[1:])]
    t       = seen["time"]
    press   = 100 * numpy.where(t < 0.2, numpy.sin(numpy.pi / 2 * t / 0.2) ** 2, 1)
    impulse = numpy.concatenate([[0], numpy.cumsum((press[1:] + press[:-1]) / 2 * numpy.diff(t))])
    lever   = 0.1 * 0.2612 * 2 * math.pi * radii[1] ** 2
    bodies  = [run.body(k)["angular_momentum_z"] for k in (0, 1)]
    brakes  = t < 0.5
    errors  = [numpy.abs(b / size - (first + sign * lever * impulse / size))[brakes].max() / 0.02
               for b, sign, first, size in zip(bodies, (-1, 1), (0.02, 0.0), inertia)]
    late    = (t > 0.25) & brakes
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


def gears(run):
    """Means from 1 s on over those of rigid gears."""
    seen = run.history
    x, y = (mean(seen, f"contact_0_force_{axis}", 1) for axis in "xy")
    late = seen["time"] > 1
    return {"spin": mean(seen, "driven_shaft_rotation_z", 1) * 18 / 12, "moment": abs(mean(seen, "shaft_moment_z", 1)) / (1000 * 12 / 18),
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


def rolling_sphere(run, friction=0.5):
    """The same of a sphere; its spin is about the axis across the way."""
    slope, spin = rigid(friction, 2 / 5, 0.16)
    b = run.body(0)
    mass, x = b["mass"][0], [b[f"center_{axis}"] for axis in "xyz"]
    p    = [b[f"momentum_{axis}"] for axis in "xyz"]
    turn = [b["angular_momentum_x"] - x[1] * p[2] + x[2] * p[1], b["angular_momentum_y"] - x[2] * p[0] + x[0] * p[2]]
    v    = [gain(b["time"], one, 0.95) / mass for one in p]
    w    = [gain(b["time"], one, 0.95) / (2 / 5 * mass * 0.4**2) for one in turn]
    return {"acceleration": math.hypot(v[0], v[1]) / slope, "spin": (w[1] * COSINE - w[0] * SINE) / spin,
            "direction, degrees": math.degrees(math.atan2(v[1], v[0]))}


def taylor(run):
    """Half width and length over those of the held bar; losses over the energy at the start."""
    seen = run.history
    from test_benchmarks import extent

    held = numpy.genfromtxt(ROOT / "cases/taylor-bar/reference.csv", delimiter=",", skip_header=1, names=True)
    time, file = harness.frames(run.directory)[-1]
    width, length, _ = extent(harness.read_vtk(file))
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


def settings(**of):
    """`--set` options; a double underscore stands for a dot."""
    return [word for key, value in of.items() for word in ("--set", f"{key.replace('__', '.')}={value}")]


def preset(name, **more):
    return settings(method__preset=name, **more)


def near(value, part):
    return value * (1 - part), value * (1 + part)


def at_most(value):
    return -math.inf, value


BRANCH = {"material__0__branch_shear": "[100000.0]", "material__0__branch_time": "[0.01]"}
FINE   = settings(contact__0__points="faces", grid__spacing=1 / 120, damping__rate=0.6, body__1__body_force='[0.0, "-6.869e-4*(t < 8 ? sin(pi/2*t/8)^2 : 1)"]')
RESTS  = {"drift over g t^2/2": at_most(1e-6)}
# Case, file, measure, and rows: options, and the bars of what is measured: low, high.
TABLES = {
    "hertz-contact": ("case.toml", hertz, [
        *((preset(name), {"p0": near(1, 0.05), "a": near(1, 0.05)}) for name in ("bscpdi2", "cpls", "cpdi2")),
        *((preset(name, contact__0__sweeps=1), {}) for name in ("bscpdi2", "cpls")),
        (settings(contact__0__sweeps=20), {"p0": near(1, 0.05), "a": near(1, 0.05)}),
        (settings(contact__0__points="faces"), {"p0": near(1, 0.05), "a": near(1, 0.05)})]),
    "hertz-contact, 6 cells": ("case.toml", lambda run: hertz(run, 0.05), [
        (preset("cpdi2") + FINE, {"p0": near(1, 0.02), "a": near(1, 0.02)})]),
    "hertz-contact, sphere": ("case-sphere.toml", lambda run: hertz(run, of_sphere=True), [([], {"p0": near(1, 0.05), "a": near(1, 0.05)})]),
    "two-disks-contact": ("case.toml", disks, [
        *((preset(name, grid__spacing=h), {"largest": at_most(1 + 1e-9), "speed": (0.9 if h < 0.05 else 0.8, 1.0), "first gap, m": (-0.02 * h, 0.02 * h)})
          for name in ("cpls", "icpdi1") for h in (0.05, 0.025, 0.0125)),
        (preset("cpdi2", method__scheme="musl"), {"largest": at_most(1.001), "speed": (0.9, 1.0)}), (preset("cpls", contact="[]"), {})]),
    "two-spheres-contact": ("case.toml", spheres, [
        *((preset(name), {"largest": at_most(1 + 1e-9), "momentum": at_most(1e-13)}) for name in ("cpls", "cpdi1", "cpdi2")),
        (preset("cpdi2", method__scheme="musl"), {"sum": near(1, 0.005), "momentum": at_most(1e-13)})]),
    "block-on-incline": ("case.toml", slide, [
        (preset(name), {"acceleration": near(1, 0.01), "account": at_most(0.005)}) for name in ("cpdi1", "cpdi2", "cpls", "icpdi1", "bscpdi2")]),
    "block-on-incline, stays": ("case.toml", stay, [
        (settings(contact__0__friction=0.7, stage__1__duration=5.4), RESTS), (settings(contact__0__friction=0.6), {}),
        *((preset(name, contact__0__friction=0.6, stage__1__duration=2.6, **BRANCH), RESTS | {"speed, m/s": at_most(1e-4)})
          for name in ("cpdi1", "cpdi2", "cpls", "icpdi1", "bscpdi2")),
        (settings(contact__0__friction=0.6, grid__spacing=0.05, stage__1__duration=2.6, **BRANCH), RESTS)]),
    "block-on-plate": ("case.toml", plate, [
        (row, {"acceleration": near(1, 0.01), "direction, degrees": near(30, 0.005), "account": at_most(0.005)})
        for row in (settings(grid__spacing=0.2), [], preset("cpls"))]),
    "block-on-plate, stays": ("case.toml", stay, [(settings(contact__0__friction=0.7, stage__1__duration=2.6), RESTS)]),
    "shaken-table": ("case.toml", shaken, [
        ([], {"difference": at_most(0.03)}), (preset("icpdi1"), {}), (settings(grid__spacing=0.05), {}),
        *((settings(material__0__young=young), {}) for young in (6.4e7, 4e6, 1e6))]),
    "spinning-rings": ("case.toml", spinning, [
        (row, {"inner": at_most(0.02), "outer": at_most(0.02)}) for row in ([], preset("cpdi2", time__end=0.5), preset("bscpdi2", time__end=0.5))]),
    "press-fit": ("case.toml", press, [(row, {"pressure": near(1, 0.01)}) for row in ([], settings(contact__0__points="faces"))]),
    "gears": ("case.toml", gears, [([], {"spin": near(1, 0.002), "moment": near(1, 0.03), "force": near(1, 0.03)})]),
    "rolling-cylinder": ("case.toml", rolling, [
        (settings(grid__spacing=0.05), {"acceleration": near(1, 0.03)}), ([], {"acceleration": near(1, 0.02), "spin": near(1, 0.05)})]),
    "rolling-cylinder, slips": ("case.toml", lambda run: rolling(run, 0.1), [
        (settings(grid__spacing=0.05, obstacle__0__friction=0.1), {"acceleration": near(1, 0.02)}),
        (settings(obstacle__0__friction=0.1), {"acceleration": near(1, 0.02), "spin": near(1, 0.05)})]),
    "rolling-cylinder, sphere": ("case-sphere.toml", rolling_sphere, [([], {}), (settings(grid__spacing=0.05), {"acceleration": near(1, 0.05)})]),
    "rolling-cylinder, sphere slips": ("case-sphere.toml", lambda run: rolling_sphere(run, 0.1), [
        (settings(obstacle__0__friction=0.1, **more), {"acceleration": near(1, 0.02)}) for more in ({}, {"grid__spacing": 0.05})]),
    "taylor-bar": ("case-obstacle.toml", taylor, [
        ([], {"length": near(1, 0.01)}), (settings(method__scheme="musl"), {"length": near(1, 0.01), "lost": at_most(0.01)}), (preset("cpdi1"), {}),
        (preset("cpdi1", grid__spacing=0.0002), {})]),
    "ball-through-slab": ("case.toml", ball, [([], {}), (settings(grid__spacing=0.04), {}), (preset("apic"), {})]),
    "wheel-on-sand": ("case.toml", wheel, [([], {"load, N": near(1500 * 9.81, 0.01)})]),
}


def judged(found, bars):
    """The row in words, and whether it meets its bars."""
    words, passes = [], True
    for name, value in found.items():
        low, high = bars.get(name, (-math.inf, math.inf))
        is_within = low <= value <= high
        words.append(f"{name} {value:.4g}" + ("" if is_within else f" (FAIL: {low:.4g} to {high:.4g})"))
        passes = passes and is_within
    return "; ".join(words), passes


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--results", type=Path, default=ROOT / "build/contact-rows", help="directory for the runs")
    options.add_argument("names", nargs="*", metavar="NAME", help="; ".join(TABLES))
    given  = options.parse_args()
    failed = 0
    for name in given.names or TABLES:
        file, measure, rows = TABLES[name]
        print(name, flush=True)
        for k, (row, bars) in enumerate(rows):
            directory = given.results / name.replace(", ", "-").replace(" ", "-") / str(k)
            command   = [harness.ORDO, "run", ROOT / "cases" / name.split(",")[0] / file, "--output", directory, "--overwrite", "--quiet", "--threads", "1"]
            done      = subprocess.run([*command, *row], capture_output=True, text=True, check=False)
            text, passes = judged(measure(Run(directory)), bars) if done.returncode == 0 else (done.stderr.strip(), False)
            print(f"  {' '.join(word for word in row if word != '--set') or 'as it is'}: {text}", flush=True)
            failed += not passes
    print(f"{failed} rows fail")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
