#!/usr/bin/env python3
"""Peak memory of each rank against that of one process, for a block of material in 3D: two steps, two frames, two checkpoints, and a restart.

    scripts/ranks_memory.py build/release/ordo [--particles 10240000] [--ranks 8] [--method mpm]

Also compares all files. ordo must have been built with -DORDO_RANKS=ON. Exit code 1 if a run fails or files differ.
"""

import argparse
import filecmp
import os
import pathlib
import re
import resource
import subprocess
import sys
import tempfile

from ranks_speed import FREE, case_of


def run_and_tell(line):
    """Runs a command and prints its peak, MB, as the last line."""
    done = subprocess.run(line)
    print(f"peak {resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024:.0f}", flush=True)
    return done.returncode


def peaks(ranks, ordo, folder, *words):
    """Of the ranks of a run, MB, ascending; `ranks` 0: one process without mpiexec."""
    launcher = ["mpiexec", "-n", str(ranks)] if ranks else []
    line = [*launcher, sys.executable, __file__, "--child", ordo, "run", "case.toml", "--quiet", "--threads", "1"]
    line += ["--set", "checkpoint.steps=1", *words]
    done = subprocess.run(line, cwd=folder, text=True, capture_output=True, env={**os.environ, **FREE})
    if done.returncode != 0:
        sys.exit(done.stdout + done.stderr)
    return sorted(int(peak) for peak in re.findall(r"peak (\d+)", done.stdout))  # mpiexec may join lines


def main():
    if sys.argv[1:2] == ["--child"]:
        sys.exit(run_and_tell(sys.argv[2:]))
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("ordo", type=pathlib.Path)
    parser.add_argument("--particles", type=int, default=10_240_000)
    parser.add_argument("--ranks", type=int, default=8)
    parser.add_argument("--method", default="mpm")
    given = parser.parse_args()
    ordo = given.ordo.resolve()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        text, particles = case_of(given.method, "box", given.particles, steps=2)
        (folder / "case.toml").write_text(text)
        print(f"{given.method}, {particles} particles, peaks in MB")
        print("one process:", *peaks(0, ordo, folder, "--output", "one"))
        print(f"{given.ranks} ranks:", *peaks(given.ranks, ordo, folder, "--output", "many"))
        restart = ["--output", "many", "--restart", "many/checkpoint_000000001.h5"]
        print("a restart on them:", *peaks(given.ranks, ordo, folder, *restart), flush=True)
        files = sorted(file.name for file in (folder / "one").iterdir())
        differing = [file for file in files if not filecmp.cmp(folder / "one" / file, folder / "many" / file, shallow=False)]
        print(f"{len(files)} files, {len(differing)} differ", *differing)
        sys.exit(1 if differing else 0)


if __name__ == "__main__":
    main()
