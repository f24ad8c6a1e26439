#!/usr/bin/env python3
"""The collision of two disks, stopped or killed at random moments and restarted until it is over, against the same run left alone.

Both runs go on side by side, one thread each, on a grid so fine that the whole one takes about the given time. Every file but
the checkpoints, which are written by the clock, must be the same, byte by byte. Exit code: 0 when it is, 1 when not, 2 for wrong usage.

    scripts/soak.py --minutes 60
    scripts/soak.py --minutes 1 --pause 0.3 --seed 7      about 200 stops and kills
"""

import argparse
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
CASE = ROOT / "cases" / "two-disks" / "case.toml"
SPACING, DT = 0.05, 0.005  # of the case
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
STOPPED = (0, 128 + signal.SIGTERM, 128 + signal.SIGINT, *(-s for s in SIGNALS))


def arguments(options, cells, directory):
    settings = [f"grid.spacing={SPACING / cells}", f"time.dt={DT / cells}", "output.interval=0.1", "output.grid=true"]
    settings.append(f"checkpoint.wall_minutes={options.pause / 60 / 5}")
    return [options.ordo, "run", CASE, "--quiet", "--threads", "1", "--output", directory, *(a for s in settings for a in ("--set", s))]


def refinement(options, directory):
    """The factor by which to refine the grid: the time of a run grows with its third power."""
    begin = time.monotonic()
    subprocess.run(arguments(options, 2, directory / "short"), check=True)
    return max(1, round(2 * (60 * options.minutes / (time.monotonic() - begin)) ** (1 / 3)))


def run_in_parts(command, out, options):
    """Returns how often it was stopped, by signal."""
    moments, counts = random.Random(options.seed), dict.fromkeys(SIGNALS, 0)
    while True:
        restart = ["--restart", "latest"] if list(out.glob("checkpoint_*.h5")) else ["--overwrite"]
        process = subprocess.Popen([*command, *restart], stderr=subprocess.PIPE, text=True)
        try:
            process.wait(moments.uniform(0, 2 * options.pause))
        except subprocess.TimeoutExpired:
            chosen = moments.choice(SIGNALS)
            process.send_signal(chosen)
            counts[chosen] += 1
        _, err = process.communicate(timeout=3600)
        if process.returncode not in STOPPED:
            raise RuntimeError(f"exit code {process.returncode}: {err}")
        if process.returncode == 0:
            return counts


def files(directory):
    return {p.name: p.read_bytes() for p in directory.iterdir() if not p.name.startswith("checkpoint_")}


def parse_options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ordo", type=pathlib.Path, default=ROOT / "build" / "release" / "ordo", help="the program")
    parser.add_argument("--minutes", type=float, default=60, help="about how long the run left alone takes")
    parser.add_argument("--pause", type=float, default=10, help="mean time from a start to a stop, s")
    parser.add_argument("--seed", type=int, default=1, help="of the random moments and signals")
    return parser.parse_args()


def main():
    options = parse_options()
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background has it switched off, and so would ordo
    with tempfile.TemporaryDirectory() as folder:
        directory = pathlib.Path(folder)
        cells = refinement(options, directory)
        begin = time.monotonic()
        alone = subprocess.Popen(arguments(options, cells, directory / "whole"))
        try:
            counts = run_in_parts(arguments(options, cells, directory / "parts"), directory / "parts", options)
            code = alone.wait()
        finally:
            alone.kill()
        if code != 0:
            raise RuntimeError(f"the run left alone ended with exit code {code}")
        whole, parts = (files(directory / d) for d in ("whole", "parts"))
        wrong = sorted(name for name in whole.keys() | parts.keys() if whole.get(name) != parts.get(name))
        stops = ", ".join(f"{s.name} {n}" for s, n in counts.items())
        print(f"{SPACING / cells:.4g} m, {(time.monotonic() - begin) / 60:.1f} min, stopped {sum(counts.values())} times ({stops}): ", end="")
        print(f"{len(wrong)} files differ: {', '.join(wrong[:5])}" if wrong else f"all {len(whole)} files are the same")
        return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
