#!/usr/bin/env python3
"""Times runs on ranks against runs in one process: a block of material in 3D that flies through the grid.

    scripts/ranks_speed.py build/release/ordo [--particles 100000] [--steps 20] [--turns 5] [--methods mpm,cpdi1]

Runs take turns, so that a busy machine slows all alike. Prints the median seconds of the steps and of the two frames, without set-up and start of MPI,
and ratios of speeds. With one rank ordo starts no MPI. It must have been built with -DORDO_RANKS=ON. Exit code 1 if a run fails.
"""

import argparse
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
shape = "box"
lower = 4.0
upper = {upper}
velocity = ["0.5 + 0.02*sin(y)", "0.3", "0.2"]
[output]
interval = {end}
history_interval = 1000000
fields = []
"""
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
    parser.add_argument("ordo", type=pathlib.Path)
    parser.add_argument("--particles", type=int, default=100_000)
    parser.add_argument("--steps", type=int, default=20)
    parser.add_argument("--turns", type=int, default=5)
    parser.add_argument("--methods", default="mpm,cpdi1")
    given = parser.parse_args()
    cells = max(round((given.particles / 8) ** (1 / 3)), 2)
    dt = 0.1
    with tempfile.TemporaryDirectory() as folder:
        for method in given.methods.split(","):
            case = pathlib.Path(folder) / f"{method}.toml"
            end = dt * given.steps
            case.write_text(CASE.format(method=method, size=cells + 8 + int(end), upper=cells + 4.0, dt=dt, end=end))
            times = {way: [] for way in WAYS}
            for _ in range(given.turns):
                for way, (processes, threads) in WAYS.items():
                    times[way].append(seconds(given.ordo.resolve(), case, processes, threads, folder))
            medians = {way: statistics.median(t) for way, t in times.items()}
            print(f"{method}, {8 * cells**3} particles, {given.steps} steps: " + ", ".join(f"{way} {t:.2f} s" for way, t in medians.items()))
            print(f"  speed of 1 rank over one process: {medians['one process'] / medians['1 rank']:.3f}")
            print(f"  speed of 2 ranks over 2 threads: {medians['2 threads'] / medians['2 ranks']:.3f}")


if __name__ == "__main__":
    main()
