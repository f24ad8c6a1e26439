#!/usr/bin/env python3
"""The ratios of speed and memory that are demanded of ordo, measured side by side and judged.

Speeds of a shared machine wander; ratios of programs that take turns do not. Each row runs its programs one after the other,
again and again, and compares their medians. Exit code: 0 when no row fails, 1 when one does, 2 for wrong usage.

    scripts/bench_ratios.py --only domains,memory
    scripts/bench_ratios.py --spikes DIR --avx2 build/avx2/ordo --large --json ratios.json

DIR holds programs of a few hundred lines that do nothing but the step of one method: node_record.cpp (mpm with ORDER 1,
splines with ORDER 2) and corner_charges.cpp (cpdi1). They are compiled here.
"""

import argparse
import itertools
import json
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
SPIKE_FLAGS = ["-O3", "-march=native", "-ffast-math", "-fopenmp"]
SPIKE_CELLS = 64
BLOCK = 884736  # 8 particles in each of 48^3 cells: what a spike of 64 cells a side has
SECONDS = 2.0  # about what a run takes
LUMPED_SPLINES = ("bsmpm", "mass=lumped", "scheme=usl")

# name of the spike, its source, its macros, the equivalent method
SPIKES = [
    ("node_record, ORDER 1", "node_record.cpp", ["-DORDER=1"], ("mpm",)),
    ("node_record, ORDER 2", "node_record.cpp", ["-DORDER=2"], LUMPED_SPLINES),
    ("corner_charges", "corner_charges.cpp", [], ("cpdi1",)),
]
# dimension, method, method to compare with, largest allowed ratio of times
TIMES = [
    (3, "ugimp", "mpm", 3),
    (3, "cpgimp", "mpm", 3),
    (3, "impm", "mpm", 8),
    (3, "cpls", "cpdi1", 5),
    (2, "cpls", "cpdi1", 2.5),
    (3, "cpls-limited", "cpls", 1.15),
    (2, "cpls-limited", "cpls", 1.1),
]
RATES_2D = [("mpm", 1.5), ("cpdi1", 2)]  # over those in 3D
RESIDENT = [("mpm", 300), ("bsmpm", 400), ("cpdi1", 520), ("cpdi2", 520)]  # bytes a particle, 3D


def label(method):
    return " ".join(method)


class Failed(Exception):
    """A program that did not finish."""


class Bench:
    """Runs `ordo bench`."""

    def __init__(self, ordo):
        self.ordo = ordo
        self.steps = {}

    def run(self, dim, method, particles, steps, threads=1):
        name, *overrides = method
        command = [self.ordo, "bench", "--dim", dim, "--method", name, "--particles", particles, "--steps", steps]
        command += ["--threads", threads, "--json", "-"]
        for override in overrides:
            command += ["--set", override]
        done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
        if done.returncode != 0:
            raise Failed(f"{label(str(c) for c in command)}: {done.stderr.strip()}")
        return json.loads(done.stdout)

    def steps_for(self, dim, method, particles):
        """The number of steps that take about SECONDS, estimated from a small block."""
        if (dim, method) not in self.steps:
            self.steps[dim, method] = self.run(dim, method, 20000, 1)["particle_steps_per_second"]
        return int(min(max(SECONDS * self.steps[dim, method] / particles, 1), 50))

    def speed(self, dim, method, particles, threads=1):
        """A function that measures particle-steps per second."""

        def measure():
            steps = self.steps_for(dim, method, particles)
            return self.run(dim, method, particles, steps, threads)["particle_steps_per_second"]

        return measure


def medians(measures, runs):
    """The medians of functions that are called in turn."""
    values = [[] for _ in measures]
    for _ in range(runs):
        for measure, of in zip(measures, values):
            of.append(measure())
    return [statistics.median(of) for of in values]


def ratio(one, other, runs):
    """The ratio of the medians of two functions."""
    first, second = medians([one, other], runs)
    return first / second


class Table:
    """Rows that are printed as soon as they are known."""

    def __init__(self):
        self.rows = []
        print(f"{'what':<68} {'limit':>8} {'value':>8}")

    def judge(self, group, what, relation, limit, measure):
        """Calls measure() for the value; None if the system does not tell it."""
        row = {"group": group, "what": what, "relation": relation, "limit": limit, "value": None, "pass": False}
        try:
            value = measure()
        except Failed as failure:
            row["failed"] = str(failure)
            self.add(row, f"FAIL: {failure}")
            return
        if value is None:
            self.skip(group, what, "the system does not say")
            return
        passes = value >= limit if relation == ">=" else value <= limit
        self.add(row | {"value": value, "pass": passes}, f"{relation} {limit:>5g} {value:8.4g}  {'pass' if passes else 'FAIL'}")

    def skip(self, group, what, why):
        self.add({"group": group, "what": what, "pass": None, "skipped": why}, f"skipped: {why}")

    def add(self, row, text):
        self.rows.append(row)
        print(f"{row['what']:<68} {text}", flush=True)


def spike_speed(program, steps):
    """A function that runs a spike and reads its particle-steps per second."""

    def measure():
        done = subprocess.run([program, str(SPIKE_CELLS), str(steps)], capture_output=True, text=True,
                              env=os.environ | {"OMP_NUM_THREADS": "1"})
        found = re.search(r"([\d.]+) M particle-steps/s", done.stdout)
        if done.returncode != 0 or not found:
            raise Failed(f"{program.name}: {done.stderr.strip()}")
        return 1e6 * float(found[1])

    return measure


def over_spike(bench, options, source, macros, method):
    """The speed of a method relative to that of a spike."""
    with tempfile.TemporaryDirectory() as directory:
        program = pathlib.Path(directory) / source.stem
        done = subprocess.run([options.cxx, *SPIKE_FLAGS, *macros, source, "-o", program], capture_output=True, text=True)
        if done.returncode != 0:
            raise Failed(done.stderr.strip())
        steps = bench.steps_for(3, method, BLOCK)
        return ratio(bench.speed(3, method, BLOCK), spike_speed(program, steps), options.runs)


def judge_spikes(table, bench, options):
    for name, source, macros, method in SPIKES:
        what = f"speed of {label(method)} over {name}, 3D"
        if options.spikes:
            table.judge("spikes", what, ">=", 0.85, lambda: over_spike(bench, options, options.spikes / source, macros, method))
        else:
            table.skip("spikes", what, "no --spikes")


def judge_domains(table, bench, options):
    for dim, method, other, limit in TIMES:
        speeds = [bench.speed(dim, (m,), BLOCK) for m in (other, method)]
        table.judge("domains", f"time of {method} over {other}, {dim}D", "<=", limit, lambda: ratio(*speeds, options.runs))


def judge_dimensions(table, bench, options):
    for method, limit in RATES_2D:
        speeds = [bench.speed(dim, (method,), BLOCK) for dim in (2, 3)]
        table.judge("dimensions", f"speed of {method}, 2D over 3D", ">=", limit, lambda: ratio(*speeds, options.runs))


def judge_threads(table, bench, options):
    for method in options.threads_of:
        speeds = [bench.speed(3, (method,), BLOCK, threads) for threads in (2, 1)]
        table.judge("threads", f"speed of {method}, two threads over one, 3D", ">=", 1.9, lambda: ratio(*speeds, options.runs))


def judge_sizes(table, bench, options):
    sizes = [100_000, 1_000_000] + ([10_000_000, 30_000_000] if options.large else [])

    def spread():
        speeds = medians([bench.speed(3, ("mpm",), n) for n in sizes], options.runs)
        return max(speeds) / min(speeds)

    table.judge("sizes", f"time a particle-step of mpm, {sizes[0]:.0e} to {sizes[-1]:.0e}, 3D", "<=", 1.15, spread)
    if not options.large:
        table.skip("sizes", "the same to 3e+07", "no --large")


def judge_avx2(table, bench, options):
    for dim, method in itertools.product((2, 3), (("mpm",), LUMPED_SPLINES, ("bsmpm",), ("cpdi1",), ("cpls",), ("cpls-limited",))):
        what = f"speed of {label(method)}, AVX2 over this build, {dim}D"
        if not options.avx2:
            table.skip("avx2", what, "no --avx2")
            continue
        speeds = [b.speed(dim, method, BLOCK) for b in (Bench(options.avx2), bench)]
        table.judge("avx2", what, ">=", 0.5, lambda: ratio(*speeds, options.runs))


WRITING_CASE = """
[grid]
dim = 3
spacing = 0.015625
size = [1.0, 1.0, 1.0]
[method]
preset = "mpm"
[time]
end = {end}
dt = {dt}
[output]
interval = {interval}
[[material]]
name = "solid"
model = "neo-hookean"
young = 1e7
poisson = 0.3
density = 1000.0
[[body]]
material = "solid"
shape = "box"
lower = [0.25, 0.25, 0.25]
upper = [0.75, 0.75, 0.75]
velocity = [1.0, 0.0, 0.0]
"""


def run_time(bench, case, *args, clock=time.perf_counter):
    """Of `ordo run`, s; `case` is a file or its text."""
    with tempfile.TemporaryDirectory() as directory:
        if isinstance(case, str):
            text, case = case, pathlib.Path(directory) / "case.toml"
            case.write_text(text)
        begin = clock()
        done = subprocess.run([bench.ordo, "run", case, "--quiet", "--output", pathlib.Path(directory) / "out", *args], capture_output=True, text=True)
        if done.returncode != 0:
            raise Failed(done.stderr.strip())
        return clock() - begin


def time_of_children():
    """Processor time of the programs that have ended, s."""
    used = os.times()
    return used.children_user + used.children_system


def judge_writing(table, bench, options):
    """The time of a run that writes particles every 100 steps over that of one that writes only the first and the last."""
    dt, steps = 1e-5, 500

    def run(interval):
        return lambda: run_time(bench, WRITING_CASE.format(end=dt * steps, dt=dt, interval=interval))

    table.judge("writing", "time of mpm with particles every 100 steps over first and last, 3D", "<=", 1.05,
                lambda: ratio(run(100 * dt), run(steps * dt), options.runs))


BODIES = """
[grid]
spacing = 0.01
size = {size}
[method]
preset = "cpdi1"
[time]
end = {end}
dt = 1e-5
[output]
interval = 1.0
[[material]]
name = "solid"
young = 1e7
poisson = 0.3
density = 1000.0
[[body]]
name = "one"
material = "solid"
shape = "box"
lower = {lower[0]}
upper = {upper[0]}
velocity = {velocity}
[[body]]
name = "other"
material = "solid"
shape = "box"
lower = {lower[1]}
upper = {upper[1]}
"""
APART = {"size": [2.4, 0.8], "lower": [[0.1, 0.1], [1.5, 0.1]], "upper": [[0.8, 0.66], [2.2, 0.66]], "velocity": [0, 0]}
SLABS = {"size": [1.2, 1.2, 0.2], "lower": [[0.05, 0.05, 0.05], [0.0513, 0.0517, 0.09]],  # each of 8 layers of particles
         "upper": [[1.15, 1.15, 0.09], [1.1513, 1.1517, 0.13]], "velocity": [0, 0, 0.05]}
CONTACT = "[[contact]]\nbodies = ['one', 'other']\ntype = 'frictional'\nfriction = 0.3\n"


def judge_contact(table, bench, options):
    """Processor time with a [[contact]] over that without, one thread; and the share of 97000 points between 774000 particles in a step."""
    def run(case, *args):
        return lambda: run_time(bench, case, "--threads", "1", *args, clock=time_of_children)

    def steps(bodies, count, more=""):
        """Without the set-up."""
        few, all_of_them = (run(BODIES.format(end=n * 1e-5, **bodies) + more) for n in (5, 5 + count))
        return lambda: all_of_them() - few()

    disks = ROOT / "cases/two-disks-contact/case.toml"
    table.judge("contact", "time of two blocks far apart with a contact over without, 2D", "<=", 1.03,
                lambda: ratio(steps(APART, 500, CONTACT), steps(APART, 500), options.runs))
    table.judge("contact", "time of two disks with a contact over that of disks that stick, 2D", "<=", 1.3,
                lambda: ratio(run(disks), run(disks, "--set", "contact=[]"), options.runs))
    table.judge("contact", "share of contact in a step, slabs of 8 layers, 3D", "<=", 0.3,
                lambda: 1 - ratio(steps(SLABS, 20), steps(SLABS, 20, CONTACT), options.runs))


def judge_memory(table, bench, _):
    for method, limit in RESIDENT:
        table.judge("memory", f"resident bytes a particle of {method}, 3D", "<=", limit,
                    lambda: bench.run(3, (method,), BLOCK, 1)["resident_bytes_per_particle"])


GROUPS = {
    "memory": judge_memory,
    "spikes": judge_spikes,
    "domains": judge_domains,
    "dimensions": judge_dimensions,
    "avx2": judge_avx2,
    "sizes": judge_sizes,
    "threads": judge_threads,
    "writing": judge_writing,
    "contact": judge_contact,
}


def presets(ordo):
    """The names of all presets."""
    done = subprocess.run([ordo, "bench", "--all", "--dim", "1", "--particles", "10", "--steps", "1", "--json", "-"],
                          capture_output=True, text=True, check=True)
    return [row["method"] for row in json.loads(done.stdout)]


def names_of(known):
    def parse(text):
        names = text.split(",")
        for name in names:
            if name not in known:
                raise argparse.ArgumentTypeError(f"{name}: there is {', '.join(known)}")
        return names

    return parse


def parse_options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ordo", type=pathlib.Path, default=ROOT / "build" / "release" / "ordo", help="the program")
    parser.add_argument("--spikes", type=pathlib.Path, help="directory of the programs to compare with; without it they are skipped")
    parser.add_argument("--avx2", type=pathlib.Path, help="the program built for AVX2; without it these rows are skipped")
    parser.add_argument("--large", action="store_true", help="sizes up to 3e7 particles (12 GB)")
    parser.add_argument("--only", type=names_of(GROUPS), default=list(GROUPS), help=f"of {', '.join(GROUPS)}, separated by commas")
    parser.add_argument("--threads-of", metavar="PRESETS", help="presets for the group threads, separated by commas; all without it")
    parser.add_argument("--runs", type=int, default=5, help="of each program, of which the median counts")
    parser.add_argument("--cxx", default="g++", help="compiler of the spikes")
    parser.add_argument("--json", type=pathlib.Path, help="file for the rows")
    options = parser.parse_args()
    if not os.access(options.ordo, os.X_OK):
        parser.error(f"--ordo {options.ordo}: there is no such program")
    if options.spikes and not options.spikes.is_dir():
        parser.error(f"--spikes {options.spikes}: there is no such directory")
    if options.avx2 and not os.access(options.avx2, os.X_OK):
        parser.error(f"--avx2 {options.avx2}: there is no such program")
    if options.runs < 1:
        parser.error("--runs must be at least 1")
    known = presets(options.ordo)
    try:
        options.threads_of = names_of(known)(options.threads_of) if options.threads_of else known
    except argparse.ArgumentTypeError as error:
        parser.error(f"--threads-of {error}")
    return options


def main():
    options = parse_options()
    table = Table()
    bench = Bench(options.ordo)
    for name, judge in GROUPS.items():
        if name in options.only:
            judge(table, bench, options)
            if options.json:
                options.json.write_text(json.dumps({"runs": options.runs, "load": os.getloadavg(), "rows": table.rows}, indent=1) + "\n")
    failed = [row for row in table.rows if row["pass"] is False]
    print(f"{len(failed)} of {len(table.rows)} rows fail")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
