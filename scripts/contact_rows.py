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

ROOT = Path(__file__).resolve().parent.parent
os.environ.setdefault("ORDO", str(ROOT / "build" / "release" / "ordo"))
os.environ.setdefault("ORDO_ROOT", str(ROOT))
sys.path.insert(0, str(ROOT / "tests" / "regress"))
from contact_measures import (Run, ball, disks, gears, hertz, plate, press, rolling, rolling_sphere, shaken, slide, spheres, spinning,  # noqa: E402
                              stay, taylor, wheel)


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
    for name in given.names:
        if name not in TABLES:
            options.error(f"{name}: there is {'; '.join(TABLES)}")
    failed = 0
    for name in given.names or TABLES:
        file, measure, rows = TABLES[name]
        print(name, flush=True)
        for k, (row, bars) in enumerate(rows):
            directory = given.results / name.replace(", ", "-").replace(" ", "-") / str(k)
            command   = [os.environ["ORDO"], "run", ROOT / "cases" / name.split(",")[0] / file, "--output", directory, "--overwrite", "--quiet", "--threads", "1"]
            done      = subprocess.run([*command, *row], capture_output=True, text=True, check=False)
            text, passes = judged(measure(Run(directory)), bars) if done.returncode == 0 else (done.stderr.strip(), False)
            print(f"  {' '.join(word for word in row if word != '--set') or 'as it is'}: {text}", flush=True)
            failed += not passes
    print(f"{failed} rows fail")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
