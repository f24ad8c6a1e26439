#!/usr/bin/env python3
"""Runs presets through the cases of cases/everyday, and prints tables in Markdown (docs/which-method.md).

    scripts/everyday.py PROGRAM [--methods cpdi1,cpls+strain_velocity=0.3] [--cases bounce,impact] [--results DIR] [--jobs 2]

A method is a preset, with settings of [method] after it. Each case is compared with a fine reference: the same case on a grid of a quarter
of the spacing (drop: half), with the method of REFERENCE. References are kept in the results. Needs numpy and VTK.
"""

import argparse
import concurrent.futures
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tomllib

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "python"))
from ordo_figures import Frame, read_frames, read_history  # noqa: E402

REFERENCE = {"shear": "bscpdi2", "long": "cpls", "pressure": "cpls", "pull": "cpls", "rotation": "cpls", "swing": "cpls"}  # else the usual method:
USUAL = "cpdi1"
CASES = sorted(f.stem for f in (ROOT / "cases/everyday").glob("*.toml"))
FINER = {"drop": 2}  # else 4
EXCHANGED = ("potential_energy", "dissipated_energy", "boundary_work", "traction_work", "body_force_work", "artificial_viscosity_work", "damped_energy")
SCHEME = ("stress_update_energy", "projection_energy", "filter_energy", "half_step_energy")


# ---- runs ------------------------------------------------------------------------------------------------------------

class Run:
    """One case with one method: what it left, how it ended, and its CPU time, s."""

    def __init__(self, program, case, method, directory, settings=(), most=None):
        self.case, self.method, self.directory = case, method, directory
        preset, *of_method = method.split("+")
        call = ["prlimit", f"--cpu={most}"] if most else []
        call += [program, "run", ROOT / "cases/everyday" / f"{case}.toml", "--output", directory, "--overwrite", "--quiet", "--threads", "1"]
        for setting in (f"method.preset={preset}", *(f"method.{s}" for s in of_method), *settings):
            call += ["--set", setting]
        with subprocess.Popen(call, stderr=subprocess.PIPE, text=True, env=os.environ | {"OMP_NUM_THREADS": "1"}) as process:
            self.message = process.stderr.read()
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
        self.code, self.seconds, self.most = process.returncode, usage.ru_utime + usage.ru_stime, most

    @property
    def outcome(self):
        """Empty, or why there are no figures."""
        if self.code == 0:
            return ""
        if self.code == 2:
            return "refused"
        if self.most and self.code in (-signal.SIGXCPU, -signal.SIGKILL):
            return f"over {self.most} s"
        end = re.search(r"the run failed: .*?t = ([0-9.e+-]+) s(.*)", self.message)
        if self.code != 1 or not end:
            sys.exit(f"everyday.py: {self.case} with {self.method} ended with {self.code}: {self.message}")
        return f"{'gains' if 'the method has added' in end[2] else 'fails'} {float(end[1]):.2g}"


def input_of(case):
    return tomllib.loads((ROOT / "cases/everyday" / f"{case}.toml").read_text())


def spacing_of(case):
    return input_of(case)["grid"]["spacing"]


def reference(program, case, results):
    spacing = spacing_of(case) / FINER.get(case, 4)
    return Run(program, case, REFERENCE.get(case, USUAL), results / "reference" / case, [f"grid.spacing={spacing}"])


# ---- fields ----------------------------------------------------------------------------------------------------------

class Bins:
    """Means over boxes of the initial configuration: mass, displacement at the time asked for, and stress by volume."""

    def __init__(self, frame, time, size):
        f = frame.fields
        # Frames lie up to a step behind the time asked for.
        u = f["displacement"] - f["velocity"] * (frame.time - time)
        places = np.floor((frame.x - f["displacement"]) / size + 1e-6).astype(int)
        keys, which = np.unique(np.column_stack([f["body"], places]), axis=0, return_inverse=True)
        which = which.ravel()
        total = lambda values, weight: np.array([np.bincount(which, weight * v) for v in np.atleast_2d(values.T)]).T
        self.mass = np.bincount(which, f["mass"])
        self.volume = np.bincount(which, f["volume"])
        self.u = total(u, f["mass"]) / self.mass[:, None]
        self.stress = total(f["stress"].reshape(len(u), -1), f["volume"]) / self.volume[:, None]
        self.row = {tuple(key): k for k, key in enumerate(keys)}


def errors(run, fine, case):
    """In percent: displacement over the size of the bodies, the largest over the frames, and stress over its own size, over all frames."""
    motion = off = whole = 0.0
    end = input_of(case)["time"]["end"]
    size, dim = spacing_of(case) / 2, 3 if case == "drop" else 2
    fine_frames, frames = read_frames(fine.directory), read_frames(run.directory)
    for k in range(1, 5):
        a, b = (Bins(Frame(of[k][1]), k * end / 4, size) for of in (frames, fine_frames))
        pairs = np.array([(i, b.row[key]) for key, i in a.row.items() if key in b.row])
        i, j = pairs.T
        mean = lambda values, weight: np.sum(weight * np.sum(values**2, axis=1)) / np.sum(weight)
        motion = max(motion, np.sqrt(mean(a.u[i] - b.u[j], b.mass[j])) / np.sum(b.volume) ** (1 / dim))
        off += mean(a.stress[i] - b.stress[j], b.volume[j])
        whole += mean(b.stress[j], b.volume[j])
    return 100 * motion, 100 * np.sqrt(off / whole)


# ---- energies --------------------------------------------------------------------------------------------------------

def energies(run):
    """In percent of all energy that was there or was exchanged: what the scheme took, what is between particles at the end, the largest
    gain on the way; and how well the account closes and momentum is kept, as fractions."""
    h = read_history(run.directory)
    exchanged = [h[c] for c in EXCHANGED if c in h.dtype.names]
    scale = h["total_energy"][0] + sum(np.max(np.abs(e - e[0])) for e in exchanged)
    total = h["total_energy"] + sum(exchanged)
    took = sum(h[c] for c in SCHEME)
    parts = [h["total_energy"], *exchanged, *(h[c] for c in SCHEME)]
    closure = np.max(np.abs(total + took - total[0])) / max(np.max(np.abs(p)) for p in parts)
    projection = np.max(np.abs(h["projection_energy"])) / scale
    parts = {c: 100 * h[c][-1] / scale for c in SCHEME}
    return {"parts": parts, "projection": projection, "took": 100 * (total[0] - total[-1]) / scale, "noise": 100 * h["unresolved_kinetic_energy"][-1] / scale,
            "gain": 100 * np.max(total - total[0]) / scale, "closure": closure, "momentum": momentum_error(run, h)}


def momentum_error(run, h):
    """Of the momentum that gravity, boundaries and tractions gave, over the largest impulse or momentum."""
    case = tomllib.loads((pathlib.Path(run.directory) / "case.toml").read_text())
    gravity = case.get("gravity", [0.0, 0.0, 0.0])
    kick = 0.5 * (h["dt"] + np.concatenate([[0.0], h["dt"][:-1]]))
    worst, scale = 0.0, 0.0
    for axis, g in zip("xyz", gravity):
        given = kick * g * h["mass"][0]
        for name in h.dtype.names:
            if name.endswith(f"_force_{axis}"):
                given = given + kick * h[name]
        given = np.cumsum(given)
        p = h[f"momentum_{axis}"]
        worst = max(worst, np.max(np.abs(p - p[0] - given)))
        scale = max(scale, np.max(np.abs(p)), np.max(np.abs(given)))
    return worst / max(scale, np.sqrt(2 * h["mass"][0] * np.max(h["kinetic_energy"])))


# ---- tables ----------------------------------------------------------------------------------------------------------

def table(title, methods, cases, text):
    print(f"\n**{title}**\n\n| method | {' | '.join(cases)} |\n|---|{'---|' * len(cases)}")
    for method in methods:
        name = "`" + label_of(method).replace(", ", "`, `") + "`"
        print(f"| {name} | {' | '.join(text(method, case) for case in cases)} |")


def label_of(method):
    preset, *settings = method.split("+")
    return ", ".join([preset, *settings]).replace('"', "")


def draw(file, methods, cases, seen):
    """What the method took in each case, by where it went: bars of the methods side by side, up for taken and down for added."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    names = {"stress_update_energy": "in the stress update", "projection_energy": "in the projection", "filter_energy": "by filters and PIC",
             "half_step_energy": "between half steps, by stops at walls"}
    figure, axes = plt.subplots(figsize=(11, 4.5), layout="constrained")
    width, hatches = 0.8 / len(methods), ["", "//", "..", "xx"]
    for m, method in enumerate(methods):
        place = np.arange(len(cases)) + (m - (len(methods) - 1) / 2) * width
        above, below = np.zeros(len(cases)), np.zeros(len(cases))
        for k, (part, name) in enumerate(names.items()):
            value = np.array([seen[method, case].get("parts", {}).get(part, 0.0) if not seen[method, case]["outcome"] else 0.0 for case in cases])
            axes.bar(place, value, 0.94 * width, bottom=np.where(value > 0, above, below), color=f"C{k}", hatch=hatches[m % 4], edgecolor="white",
                     linewidth=0.5, label=name if m == 0 else None)
            above, below = above + np.maximum(value, 0), below + np.minimum(value, 0)
    axes.axhline(0, color="black", linewidth=0.8)
    axes.set_xticks(range(len(cases)), cases)
    axes.set_ylabel("energy taken, % of all that was there or came")
    axes.set_title("From left to right: " + "; ".join(label_of(method) for method in methods), fontsize=10)
    axes.legend()
    figure.savefig(file, dpi=110)


def short(value):
    return f"{value:.0f}" if abs(value) >= 9.95 else f"{value:.1f}" if abs(value) >= 0.995 else f"{value:.2f}"


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("program")
    options.add_argument("--methods", default="", help="default: all presets")
    options.add_argument("--cases", default=",".join(CASES))
    options.add_argument("--results", type=pathlib.Path, default=pathlib.Path("results/everyday"))
    options.add_argument("--most", type=int, default=60, help="CPU time of a run at most, s; not of references")
    options.add_argument("--jobs", type=int, default=2)
    options.add_argument("--figure", help="a picture of what the methods took, and where; for a few methods")
    options.add_argument("--messages", action="store_true", help="print those of runs that ended early")
    o = options.parse_args()
    program, cases = os.path.abspath(o.program), o.cases.split(",")
    methods = o.methods.split(",") if o.methods else presets_of(program)
    if unknown := set(cases) - set(CASES):
        sys.exit(f"everyday.py: there is no case {', '.join(sorted(unknown))}; there are {', '.join(CASES)}")

    def measure(case, method):
        directory = o.results / case / re.sub(r"[^A-Za-z0-9=.+_-]", "", method)
        run = Run(program, case, method, directory, most=o.most)
        figures = {"outcome": run.outcome, "message": run.message, "seconds": run.seconds}
        if run.code in (0, 1):
            figures |= energies(run)
        if not run.outcome:
            figures["motion"], figures["stress"] = errors(run, fine[case], case)
        shutil.rmtree(directory, ignore_errors=True)
        return (method, case), figures

    with concurrent.futures.ThreadPoolExecutor(o.jobs) as pool:
        fine = dict(zip(cases, pool.map(lambda case: reference(program, case, o.results), cases)))
        for case, run in fine.items():
            if run.outcome:
                sys.exit(f"everyday.py: the reference of {case} {run.outcome}: {run.message}")
        seen = dict(pool.map(lambda pair: measure(*pair), [(case, method) for case in cases for method in methods]))

    def cell(key):
        return lambda method, case: seen[method, case]["outcome"] or short(seen[method, case][key])

    def fraction(key):
        return lambda method, case: f"{seen[method, case][key]:.0e}" if key in seen[method, case] else seen[method, case]["outcome"]

    usual = lambda case: seen.get((USUAL, case), {"seconds": np.nan})["seconds"]
    table("Motion: error of the displacement, percent of the size of the bodies", methods, cases, cell("motion"))
    table("Stress: error, percent of its own size", methods, cases, cell("stress"))
    table("Energy that the method took, percent of all that was there or came", methods, cases, cell("took"))
    table("Kinetic energy between particles at the end, percent of the same", methods, cases, cell("noise"))
    table("Largest gain on the way, percent of the same", methods, cases, cell("gain"))
    table("Account: what does not close, of the largest part", methods, cases, fraction("closure"))
    table("Momentum that nothing gave, of the largest", methods, cases, fraction("momentum"))
    table(f"CPU time over that of {USUAL}", methods, cases,
          lambda method, case: seen[method, case]["outcome"] or short(seen[method, case]["seconds"] / usual(case)))
    if o.figure:
        draw(o.figure, methods, cases, seen)
    if o.messages:
        print("\nMessages of runs that ended early:\n")
        for (method, case), figures in seen.items():
            if figures["outcome"] and figures["message"] and figures["outcome"] != "refused":
                print(f"- {case}, {method}: {figures['message'].strip().splitlines()[-1]}")
    if open_accounts := [key for key, figures in seen.items() if not figures.get("closure", 0.0) < 1e-10]:
        sys.exit(f"everyday.py: the account does not close in {open_accounts}")


def presets_of(program):
    listed = subprocess.run([program, "list", "methods"], capture_output=True, text=True, check=True).stdout
    return re.findall(r"^  ([a-z0-9-]+) ", listed.split("\n\n")[0], re.MULTILINE)


if __name__ == "__main__":
    main()
