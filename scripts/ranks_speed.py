#!/usr/bin/env python3
"""Times runs on ranks against runs in one process: a block or a ball in 3D that flies through the grid.

    scripts/ranks_speed.py build/release/ordo [OTHER_ORDO ...] [--shape box] [--particles 100000] [--steps 20] [--turns 5] [--methods mpm,cpdi1] [--shear 0.02]

Runs, also those of other programs, take turns, so that a busy machine slows all alike. Prints the median seconds of the steps and of the two frames, without set-up and start of MPI,
and ratios of speeds. With one rank ordo starts no MPI. It must have been built with -DORDO_RANKS=ON. Exit code 1 if a run fails.
"""

import argparse
import math
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile

CASE = """\
[grid]
dim = 3
size = [{size}, {size}, {size}]
spacing = 1.0
[method]
preset = "{method}"
[time]
end = {end}
dt = {dt}
[[material]]
name = "soft"
density = 1.0
young = 1.0
poisson = 0.3
[[body]]
material = "soft"
{shape}
velocity = ["0.5 + {shear}*sin(y)", "0.3", "0.2"]
[output]
interval = {end}
history_interval = 1000000
fields = []
"""
RATIO = (3 / (4 * math.pi)) ** (1 / 3)
SHAPES = {  # as large as a box of `cells` cells a side
    "box": lambda cells: f'shape = "box"\nlower = 4.0\nupper = {cells + 4.0}',
    "ball": lambda cells: f'shape = "ball"\ncenter = {RATIO * cells + 4.0}\nradius = {RATIO * cells}',
}
WAYS = {  # processes (0: without mpiexec) and threads of each
    "one process": (0, 1),
    "1 rank": (1, 1),
    "2 threads": (0, 2),
    "2 ranks": (2, 1),
}
FREE = {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "OMPI_MCA_hwloc_base_binding_policy": "none",
}


def case_of(method, shape, particles, steps, shear):
    """The text of a case, and about how many particles it has."""
    cells = max(round((particles / 8) ** (1 / 3)), 2)
    dt = 0.1
    end = dt * steps
    size = math.ceil(1.25 * cells) + 8 + int(end)
    return CASE.format(method=method, size=size, shape=SHAPES[shape](cells), dt=dt, end=end, shear=shear), 8 * cells**3


def seconds(ordo, case, processes, threads, folder):
    """Of the steps of a run, as its last progress line has them."""
    launcher = ["mpiexec", "-n", str(processes)] if processes else []
    line = [*launcher, ordo, "run", case, "--threads", str(threads), "--output", "out", "--overwrite"]
    done = subprocess.run(line, cwd=folder, text=True, capture_output=True, env={**os.environ, **FREE})
    found = re.search(r"steps to t = \S+ s in (\S+) s", done.stderr)
    if done.returncode != 0 or not found:
        sys.exit(f"{' '.join(map(str, line))}:\n{done.stderr}")
    return float(found[1])


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("ordo", type=pathlib.Path, nargs="+")
    parser.add_argument("--shape", choices=SHAPES, default="box")
    parser.add_argument("--particles", type=int, default=100_000)
    parser.add_argument("--steps", type=int, default=20)
    parser.add_argument("--turns", type=int, default=5)
    parser.add_argument("--methods", default="mpm,cpdi1")
    parser.add_argument("--shear", type=float, default=0.02, help="of the velocities; with 0 the body flies as it is")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for method in given.methods.split(","):
            case = pathlib.Path(folder) / f"{method}.toml"
            text, particles = case_of(method, given.shape, given.particles, given.steps, given.shear)
            case.write_text(text)
            times = {(ordo, way): [] for ordo in given.ordo for way in WAYS}
            for _ in range(given.turns):
                for ordo, way in times:
                    times[ordo, way].append(seconds(ordo.resolve(), case, *WAYS[way], folder))
            for ordo in given.ordo:
                medians = {way: statistics.median(times[ordo, way]) for way in WAYS}
                print(f"{ordo}: {method}, {given.shape} of {particles} particles, {given.steps} steps: ", end="")
                print(", ".join(f"{way} {t:.2f} s" for way, t in medians.items()))
                print(f"  speed of 1 rank over one process: {medians['one process'] / medians['1 rank']:.3f}")
                print(f"  speed of 2 ranks over 2 threads: {medians['2 threads'] / medians['2 ranks']:.3f}")


if __name__ == "__main__":
    main()
