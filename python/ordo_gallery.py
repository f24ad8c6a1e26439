#!/usr/bin/python3
"""Figures of the papers, redrawn with `ordo verify`, and figures of the runs of one call.

    ordo_gallery.py gallery --ordo build/release/ordo -o docs/gallery    runs what is missing, draws docs/gallery.md's figures
    ordo_gallery.py runs DIR/verify.json -o DIR                          what `ordo verify --figures DIR` draws of histories and errors

A figure is an entry of FIGURES: the runs that it needs and how it is drawn. Functions called *_of take numbers from the
files of `ordo verify --data`; what they return is drawn and, rounded, stands in gallery.json. Needs numpy and matplotlib.
"""

import argparse
import concurrent.futures
import csv
import functools
import hashlib
import json
import os
import re
import subprocess
import sys
import time
from dataclasses import dataclass, field

import ordo_figures  # first: it says what to install where matplotlib is missing
from ordo_figures import BLACK, BLUE, COLOURS, GREEN, GREY, MARKERS, ORANGE, PURPLE, RED, UNITS, save

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize

NAMES = {"mpm": "MPM", "cpdi1": "CPDI", "cpdi2": "CPDI2", "cpls": "CPLS", "impm": "IMPM", "icpdi1": "improved CPDI", "impm-adjoint": "adjoint IMPM",
         "ddmpm": "DDMPM", "bsmpm": "BSMPM", "ugimp": "GIMP", "cpdi2e": "enriched CPDI2", "fem": "finite elements"}
METHOD_COLOURS = {"mpm": BLACK, "cpdi1": BLUE, "cpdi2": GREEN, "cpls": ORANGE, "impm": GREEN, "icpdi1": PURPLE, "impm-adjoint": RED,
                  "ugimp": ORANGE, "cpdi2e": RED, "fem": BLACK}
TENSOR = {1: ["xx"], 2: ["xx", "xy", "yy"], 3: ["xx", "xy", "xz", "yy", "yz", "zz"]}


# ---- runs ------------------------------------------------------------------------------------------------------------

@dataclass(frozen=True)
class Run:
    """One call of `ordo verify`; with `timed` it runs alone and writes times instead of tables."""
    case: str
    methods: str
    cells: tuple = ()
    ppc: int = 0
    set: tuple = ()
    timed: bool = False

    def arguments(self, quick=False):
        cells = self.cells[:2] if quick else self.cells
        words = ["verify", self.case, "--method", self.methods, "--threads", "1"]
        words += ["--cells", ",".join(map(str, cells))] if cells else []
        words += ["--ppc", str(self.ppc)] if self.ppc else []
        return words + [word for s in self.set for word in ("--set", s)]


@dataclass(frozen=True)
class CaseRun:
    """One call of `ordo run` on cases/NAME."""
    name: str
    set: tuple = ()
    timed: bool = False

    def arguments(self, quick=False):
        case = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "cases", self.name, "case.toml")
        words = ["run", os.path.normpath(case), "--quiet", "--threads", "1"]
        return words + [word for s in (*self.set, *(["time.end=0.05"] if quick else [])) for word in ("--set", s)]


def call_of(run, quick=False):
    """The call as a user would type it."""
    return " ".join(["ordo", *(w if not os.path.isabs(w) else f"cases/{run.name}/case.toml" for w in run.arguments(quick))])


class Results:
    """The output of a run, from its directory."""

    def __init__(self, directory):
        self.directory = directory
        self.file = os.path.join(directory, "verify.json")
        self.studies = []
        if os.path.exists(self.file):
            with open(self.file, encoding="utf-8") as stream:
                self.studies = json.load(stream)

    def study(self, method):
        return next(s for s in self.studies if s["method"] == method)

    def row(self, method, cells):
        """The row of a mesh; that of the finest mesh if a quick run left it out."""
        rows = self.study(method)["rows"]
        return next((r for r in rows if r["cells"] == cells), rows[-1])

    def table(self, row, what):
        """The columns of a row's history or particles by name; None if it has none."""
        if what not in row.get("files", {}):
            return None
        return read_table(os.path.join(self.directory, row["files"][what]))


def read_table(file):
    with open(file, encoding="utf-8", newline="") as stream:
        lines = csv.reader(stream)
        names = next(lines)
        values = np.array([[float(x) for x in line] for line in lines]).reshape(-1, len(names))
    return dict(zip(names, values.T))


class Runner:
    """Does the runs that are missing in the work directory. A run is there if command and binary are the same."""

    def __init__(self, ordo, work, quick=False, jobs=2):
        self.ordo, self.work, self.quick, self.jobs = os.path.abspath(ordo), work, quick, jobs
        with open(self.ordo, "rb") as stream:
            self.binary = hashlib.sha256(stream.read()).hexdigest()

    def directory(self, run):
        words = " ".join(w for w in run.arguments(self.quick) if not os.path.isabs(w))
        name = getattr(run, "name", "") or run.case
        return os.path.join(self.work, f"{name}-{hashlib.sha256(f'{name} {words} {run.timed}'.encode()).hexdigest()[:10]}")

    def results(self, run):
        return Results(self.directory(run))

    def run_all(self, runs):
        """Seconds by run. Timed runs come after the others, one at a time."""
        missing = [r for r in dict.fromkeys(runs) if not self.is_done(r)]
        seconds = {}
        with concurrent.futures.ThreadPoolExecutor(self.jobs) as pool:
            together = sorted((r for r in missing if not r.timed), key=lambda r: -max(getattr(r, "cells", ()), default=0))  # long ones first
            for run, took in zip(together, pool.map(self.execute, together)):
                seconds[run] = took
        for run in missing:
            if run.timed:
                seconds[run] = self.execute(run)
        return seconds

    def is_done(self, run):
        try:
            with open(os.path.join(self.directory(run), "command.json"), encoding="utf-8") as stream:
                return json.load(stream) == self.command(run)
        except (OSError, ValueError):
            return False

    def command(self, run):
        return {"arguments": run.arguments(self.quick), "ordo": self.binary}

    def execute(self, run):
        directory = self.directory(run)
        os.makedirs(directory, exist_ok=True)
        target = ["--output", directory, "--overwrite"] if isinstance(run, CaseRun) else \
            ["--json", os.path.join(directory, "verify.json")] if run.timed else ["--data", directory]
        begin = time.monotonic()
        with open(os.path.join(directory, "log"), "w", encoding="utf-8") as log:
            code = subprocess.run([self.ordo, *run.arguments(self.quick), *target], stdout=log, stderr=subprocess.STDOUT, check=False).returncode
        if code not in (0, 1):  # 1: a bar was missed
            raise SystemExit(f"ordo_gallery.py: {' '.join(run.arguments(self.quick))} ends with {code}; see {directory}/log")
        with open(os.path.join(directory, "command.json"), "w", encoding="utf-8") as stream:
            json.dump(self.command(run), stream)
        took = time.monotonic() - begin
        print(f"{took:8.1f} s  {call_of(run, self.quick)}", flush=True)
        return took


# ---- numbers to draw -------------------------------------------------------------------------------------------------

def error_curve_of(study, norm, name):
    """h, errors and orders of a study, coarse to fine, and h of failed meshes; norm is error, error_l2 or quantities."""
    points = [(r["h"], r[norm].get(name)) for r in study["rows"] if not r["failed"]]
    points = [(h, e) for h, e in points if e is not None and e > 0]
    return {"h": [h for h, _ in points], "error": [e for _, e in points], "order": orders(points),
            "failed": [r["h"] for r in study["rows"] if r["failed"]]}


def orders(points):
    return [np.log(a[1] / b[1]) / np.log(a[0] / b[0]) for a, b in zip(points, points[1:])]


def published_stress_curve_of(results, study):
    """The stress error as in the published code of Tran et al.: root of the mean norm, each component once."""
    points = []
    for row in study["rows"]:
        p = results.table(row, "particles")
        if not row["failed"] and p is not None:
            e = np.sqrt(sum((p[f"stress_{ab}"] - p[f"stress_{ab}_exact"]) ** 2 for ab in TENSOR[2]))
            points.append((row["h"], float(np.sqrt(e.mean()))))
    return {"h": [h for h, _ in points], "error": [e for _, e in points], "order": orders(points), "failed": []}


def dim_of(particles):
    return sum(f"position_{a}" in particles for a in "xyz")


def particle_errors_of(particles, name):
    """The size of each particle's error of displacement, velocity or stress."""
    dim = dim_of(particles)
    base = {"displacement": "position"}.get(name, name)
    parts = [f"{base}_{a}" for a in (TENSOR[dim] if name == "stress" else "xyz"[:dim])]
    twice = [2 if name == "stress" and p[-1] != p[-2] else 1 for p in parts]
    return np.sqrt(sum(w * (particles[p] - particles[p + "_exact"]) ** 2 for p, w in zip(parts, twice)))


def stress_along_y(particles):
    order = np.argsort(particles["reference_y"])
    return particles["reference_y"][order], particles["stress_yy"][order]


def radial_stress_around(particles, low, high):
    """Angles in degrees and radial stress of the particles that start between two radii."""
    x, y = particles["reference_x"], particles["reference_y"]
    r = np.hypot(x, y)
    stress = (x ** 2 * particles["stress_xx"] + 2 * x * y * particles["stress_xy"] + y ** 2 * particles["stress_yy"]) / r ** 2
    chosen = np.flatnonzero((low < r) & (r < high))
    order = chosen[np.argsort(np.arctan2(y, x)[chosen])]
    return np.degrees(np.arctan2(y, x))[order], stress[order]


def domains_of(particles):
    """Corners of the domains in cyclic order, (n, 4, 2); none for points."""
    if "corner3_x" in particles:
        walk = (0, 1, 3, 2)
    elif "corner2_x" in particles:
        walk = (0, 1, 2, 2)
    else:
        return None
    return np.stack([np.stack([particles[f"corner{c}_x"], particles[f"corner{c}_y"]], axis=-1) for c in walk], axis=1)


def history_of(results, method, cells, columns):
    """Those columns of a history that exist, by name."""
    table = results.table(results.row(method, cells), "history")
    return {} if table is None else {c: table[c] for c in columns if c in table}


def times_of(study):
    """CPU time in all steps and in one, with that of body forces, and displacement errors."""
    rows = [r for r in study["rows"] if not r["failed"]]
    return {"h": [r["h"] for r in rows], "seconds": [r["seconds_cpu"] for r in rows],
            "per_step": [r["seconds_cpu"] / r["steps"] for r in rows],
            "error": [r["error"]["displacement"] for r in rows]}


# ---- drawing ---------------------------------------------------------------------------------------------------------

@dataclass
class Style:
    label: str
    colour: str = BLACK
    marker: str = "o"
    line: str = "-"
    filled: bool = True

    def of_line(self):
        return {"label": self.label, "color": self.colour, "marker": self.marker, "linestyle": self.line, "linewidth": 1.1,
                "markersize": 4.5 if self.filled else 7.5,  # open markers show around others
                "markerfacecolor": self.colour if self.filled else "white"}


def style_of(method, ppc=None):
    """A colour a method; marker and line tell particles per cell apart."""
    marker, line = {None: ("o", "-"), 1: ("o", ":"), 4: ("s", "--"), 9: ("^", "-"), 8: ("s", "--"), 27: ("^", "-")}[ppc]
    return Style(NAMES.get(method, method) + (f", {ppc} ppc" if ppc else ""), METHOD_COLOURS.get(method, GREY), marker, line)


def draw_error_curves(axes, curves, xlabel="cell size, m", ylabel=None, exponents=False, slopes=True):
    """[(Style, curve)] on logarithmic axes, lines of known order, failed meshes as crosses at the top."""
    drawn = []
    top = {}
    for style, curve in curves:
        if len(curve["h"]) > 0:
            axes.loglog(curve["h"], curve["error"], **style.of_line())
        for h in curve["failed"]:
            top[h] = top.get(h, 0.94) + 0.06
            axes.plot(h, top[h], "x", color=style.colour, transform=axes.get_xaxis_transform(), clip_on=False, markersize=5,
                      label=f"{style.label} fails")
        if len(curve["h"]) > 1:
            drawn.append(np.array([curve["h"], curve["error"]])[:, ::-1])
    if drawn and slopes:
        ordo_figures.draw_slopes(axes, drawn)
    hs = [h for _, c in curves for h in [*c["h"], *c["failed"]]]
    axes.set_xlim(min(hs) / 1.3, max(hs) * 1.3)
    axes.set_xlabel(xlabel)
    if ylabel:
        axes.set_ylabel(ylabel)
    finish_log_axes(axes, exponents)


def finish_log_axes(axes, exponents=False):
    for axis, (low, high) in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
        ordo_figures.label_log_axis(axis, low, high)
        if exponents:
            axis.set_major_formatter(lambda value, _: f"{np.log10(value):.2g}")


def add_legend(figure, axes, slot, columns, extra=()):
    """One legend for all axes, in a slot without axes."""
    entries = {}
    for a in np.ravel(axes):
        for handle, label in zip(*a.get_legend_handles_labels()):
            entries.setdefault(label, handle)
    entries = ordo_figures.slopes_last(entries)
    slot.set_axis_off()
    slot.legend(entries.values(), entries.keys(), loc="center", ncol=columns, handlelength=2.4, columnspacing=1.3)


def panels(rows, columns, width, height, legend=0.32):
    """Axes in rows, and a slot for a legend below them."""
    figure = plt.figure(figsize=(width * columns, height * rows + legend), layout="constrained")
    grid = figure.add_gridspec(rows + (legend > 0), columns, height_ratios=[height] * rows + ([legend] if legend > 0 else []))
    axes = np.array([[figure.add_subplot(grid[r, c]) for c in range(columns)] for r in range(rows)])
    slot = figure.add_subplot(grid[rows, :]) if legend > 0 else None
    return figure, axes, slot


def unit_label(name, norm="error"):
    what = {"velocity_grid": "grid velocity"}.get(name, name)
    return f"{'RMS of ' if norm == 'error' else '$L_2$, '}{what}" + (f", {UNITS[name]}" if norm == "error" and name in UNITS else "")


# ---- kinds of figures ------------------------------------------------------------------------------------------------

@dataclass
class Figure:
    """name: of the PNG; number: of the paper's figures; runs: the runs it needs; draw(results, quick, output): drawn numbers."""
    name: str
    paper: str
    number: str
    title: str
    runs: list
    draw: object
    options: dict = field(default_factory=dict)
    has_times: bool = False


def convergence_figure(results, figure, output):
    """options["panels"]: rows of (title, norm, name, [(run, method, Style)]); one curve per study. Styles of kind `published`
    use the norm of the published code."""
    rows = figure.options["panels"]
    fig, axes, slot = panels(len(rows), len(rows[0]), figure.options.get("width", 3.4), 2.6, figure.options.get("legend", 0.55))
    numbers = {}
    for a, (title, norm, name, members) in zip(axes.flat, (p for row in rows for p in row)):
        curves = []
        for run, method, style in members:
            study = results[run].study(method)
            curve = published_stress_curve_of(results[run], study) if norm == "published" else error_curve_of(study, norm, name)
            curves.append((style, curve))
            numbers.setdefault(title, {})[style.label] = curve
        draw_error_curves(a, curves, "$\\log_{10}$ h, m" if figure.options.get("exponents") else "cell size, m",
                          figure.options.get("ylabel") or ("as published, Pa$^{1/2}$" if norm == "published" else unit_label(name, norm)),
                          figure.options.get("exponents", False), figure.options.get("slopes", True))
        a.set_title(title)
    add_legend(fig, axes, slot, figure.options.get("columns", 4))
    save(fig, output)
    return numbers


def all_errors_figure(results, figure, output):
    """Gong's: all L2 errors of a method in one panel, over log10 h. options["panels"]: (title, [(run, method, line, label)])."""
    quantities = {"stress": ("s", RED), "density": ("D", GREEN), "velocity": ("o", BLUE), "velocity_grid": ("v", PURPLE), "displacement": ("^", BLACK)}
    members = figure.options["panels"]
    fig, axes, slot = panels(1, len(members), 3.9, 3.4, 0.3)
    numbers = {}
    for a, (title, studies) in zip(axes.flat, members):
        curves = []
        for run, method, line, label in studies:
            study = results[run].study(method)
            for name, (marker, colour) in quantities.items():
                curve = error_curve_of(study, "error_l2", name)
                numbers.setdefault(title, {})[f"{name}{label}"] = curve
                curves.append((Style(name.replace("velocity_grid", "grid velocity") + label, colour, marker, line, line == "-"),
                               {**curve, "failed": []}))
            curves.append((Style(f"{method}{label}"), {"h": [], "error": [], "failed": curve["failed"]}))  # one cross for all
        draw_error_curves(a, curves, "$\\log_{10}$ h, h in m", "$\\log_{10}$ of the $L_2$ error", True)
        a.set_title(title)
    add_legend(fig, axes, slot, 7)
    save(fig, output)
    return numbers


def history_figure(results, figure, output):
    """options["panels"]: (title, ylabel, [(run, method, cells, column, Style)]), a column or "column - column"; limits by ylabel."""
    members = figure.options["panels"]
    columns = figure.options.get("columns", len(members))
    fig, axes, slot = panels(-(-len(members) // columns), columns, figure.options.get("width", 3.2), 2.5, 0.3)
    numbers = {}
    for a, (title, ylabel, curves) in zip(axes.flat, members):
        for run, method, cells, column, style in curves:
            column, *less = column.split(" - ")
            table = history_of(results[run], method, cells, ["time", column, *less]) if method else ordo_figures.read_history(results[run].directory)
            t, y = table["time"], table[column] - sum(table[c] for c in less)
            a.plot(t, y, color=style.colour, linestyle=style.line, label=style.label, linewidth=1.2, marker=style.marker or "",
                   markersize=3, markevery=max(1, len(t) // 20), markerfacecolor=style.colour if style.filled else "white")
            numbers.setdefault(title, {})[style.label] = {"first": y[0], "last": y[-1], "least": y.min(), "largest": y.max()}
        a.set_title(title)
        a.set_xlabel("time, s")
        a.set_ylabel(ylabel)
        a.set_xlim(t[0], t[-1])
        if ylabel in figure.options.get("limits", {}):
            a.set_ylim(figure.options["limits"][ylabel])
        low, high = a.get_ylim()
        if high - low < 1e-9 * max(abs(low), abs(high)):  # constant to round-off
            a.set_ylim(low - 0.05 * abs(low), high + 0.05 * abs(high))
        a.ticklabel_format(axis="y", style="sci", scilimits=(-3, 4))
    add_legend(fig, axes, slot, figure.options.get("legend_columns", 5))
    save(fig, output)
    return numbers


def map_figure(results, figure, output):
    """Errors of particles. options: names; panels (run, method, cells, title); quarter; first: the number of the first figure."""
    names, members = figure.options["names"], figure.options["panels"]
    tables = [particles_in(results[run].table(results[run].row(method, cells), "particles"), figure.options.get("quarter"))
              for run, method, cells, _ in members]
    fig, axes = plt.subplots(len(names), len(members), figsize=(3.1 * len(members) + 0.6, 2.6 * len(names)), layout="constrained", squeeze=False)
    numbers = {}
    told = iter([f"Fig. {k}: " for k in range(figure.options["first"], figure.options["first"] + axes.size)])
    for name, row in zip(names, axes):
        errors = [particle_errors_of(p, name) for p in tables]
        norm = Normalize(0, max(e.max() for e in errors))
        for a, p, e, (_, method, cells, title) in zip(row, tables, errors, members):
            draw_domains(a, p, e, norm)
            a.set_title(next(told) + f"{title}: {name}")
            numbers.setdefault(name, {})[title] = {"largest": e.max(), "rms": np.sqrt((e ** 2).mean())}
        bar = fig.colorbar(plt.cm.ScalarMappable(norm, "viridis"), ax=list(row), aspect=18, pad=0.02)
        bar.set_label(f"error of {name}, {UNITS[name]}")
        bar.ax.ticklabel_format(style="sci", scilimits=(-2, 4))
    finish_plane(axes)
    save(fig, output)
    return numbers


def particles_in(particles, quarter):
    if not quarter:
        return particles
    keep = (particles["reference_x"] > 0) & (particles["reference_y"] > 0)
    return {name: values[keep] for name, values in particles.items()}


def draw_domains(axes, particles, values, norm, cmap="viridis", edge=None):
    polygons = domains_of(particles)
    colours = plt.get_cmap(cmap)(norm(values))
    if polygons is None:
        axes.scatter(particles["position_x"], particles["position_y"], s=min(7, 7000 / len(values)), c=colours, linewidths=0)
    else:
        axes.add_collection(PolyCollection(polygons, facecolors=colours, edgecolors=edge or colours, linewidths=0.3))
        axes.autoscale_view()
    axes.set_aspect("equal")


def finish_plane(axes):
    """Same limits everywhere, labels at the edges only."""
    low = np.min([[a.get_xlim()[0], a.get_ylim()[0]] for a in axes.flat], axis=0)
    high = np.max([[a.get_xlim()[1], a.get_ylim()[1]] for a in axes.flat], axis=0)
    for a in axes.flat:
        a.set_xlim(low[0], high[0])
        a.set_ylim(low[1], high[1])
        a.locator_params(nbins=5)
        a.label_outer()
    for a in axes[-1]:
        a.set_xlabel("x, m")
    for a in axes[:, 0]:
        a.set_ylabel("y, m")


def configuration_figure(results, figure, output):
    """Particle domains over the grid. options: panels (run, method, cells, title), value: speed or None, grid: spacing by cells."""
    members = figure.options["panels"]
    columns = figure.options.get("columns", len(members))
    rows = -(-len(members) // columns)
    fig, axes = plt.subplots(rows, columns, figsize=(2.9 * columns + (0.7 if figure.options.get("value") else 0), 3.2 * rows), layout="constrained",
                             squeeze=False)
    tables = [results[run].table(results[run].row(method, cells), "particles") for run, method, cells, _ in members]
    speeds = [np.hypot(p["velocity_x"], p["velocity_y"]) for p in tables]
    norm = Normalize(0, max(s.max() for s in speeds))
    numbers = {}
    for a, p, v, (run, method, cells, title) in zip(axes.flat, tables, speeds, members):
        if figure.options.get("value"):
            draw_domains(a, p, v, norm)
            numbers[title] = {"largest speed": v.max()}
        else:
            draw_domains(a, p, np.zeros(len(v)), Normalize(0, 1), "Blues", BLUE)
            if domains_of(p) is None:
                a.collections[-1].set_facecolor(BLUE)
            offset = np.hypot(p["position_x"] - p["position_x_exact"], p["position_y"] - p["position_y_exact"])
            numbers[title] = {"largest displacement error": offset.max()}
        a.set_title(title)
    if figure.options.get("limits"):
        for a in axes.flat:
            a.set_xlim(figure.options["limits"])
            a.set_ylim(figure.options["limits"])
    finish_plane(axes)
    for a, (_, _, cells, _) in zip(axes.flat, members):
        draw_grid(a, 1 / cells)
    if figure.options.get("value"):
        fig.colorbar(plt.cm.ScalarMappable(norm, "viridis"), ax=list(axes.flat), aspect=25, pad=0.02).set_label("speed, m/s")
    save(fig, output)
    return numbers


def draw_grid(axes, h):
    (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
    lines = [[(k * h, y0), (k * h, y1)] for k in range(int(np.ceil(x0 / h)), int(x1 / h) + 1)]
    lines += [[(x0, k * h), (x1, k * h)] for k in range(int(np.ceil(y0 / h)), int(y1 / h) + 1)]
    axes.add_collection(LineCollection(lines, colors="#cccccc", linewidths=0.4, zorder=0), autolim=False)


def stress_figure(results, figure, output):
    """Stress of particles over x, and its error. options["panels"]: (title, [(run, method, Style)])."""
    members = figure.options["panels"]
    fig, axes, slot = panels(2, len(members), 3.3, 2.4, 0.3)
    numbers = {}
    for above, below, (title, curves) in zip(*axes, members):
        told = []
        for run, method, style in curves:
            row = results[run].study(method)["rows"][0]
            p = results[run].table(row, "particles")
            order = np.argsort(p["position_x"])
            x, stress, exact = (p[name][order] for name in ("position_x", "stress_xx", "stress_xx_exact"))
            if style is curves[0][2]:
                above.plot(x, exact, "o", color="#bbbbbb", markersize=4, label="finite elements")
            above.plot(x, stress, color=style.colour, linestyle=style.line, linewidth=1.1, label=style.label)
            below.plot(x, stress - exact, color=style.colour, linestyle=style.line, linewidth=1.1)
            error = row["error_relative"]["stress"]
            told.append(f"{error:.2%}")
            numbers.setdefault(title, {})[style.label] = {"relative error": error, "largest difference": np.abs(stress - exact).max()}
        above.set_title(f"Fig. 4: {title}, errors {', '.join(told)}", fontsize=8)
        above.set_ylabel("stress, Pa")
        above.set_ylim(*figure.options["limits"])
        below.set_ylabel("less reference, Pa")
        below.set_yscale("symlog", linthresh=20)
        below.set_xlabel("x, m")
    add_legend(fig, axes, slot, 4)
    save(fig, output)
    return numbers


def profile_figure(results, figure, output):
    """Particles along a line. options["panels"]: (title, xlabel, take, [(run, method, Style)]); take(particles) has x and stress."""
    members = figure.options["panels"]
    fig, axes, slot = panels(1, len(members), 3.9, 2.9, 0.3)
    numbers = {}
    for a, (title, xlabel, take, curves) in zip(axes.flat, members):
        for run, method, style in curves:
            x, stress = take(results[run].table(results[run].study(method)["rows"][0], "particles"))
            a.plot(x, stress, **style.of_line())
            numbers.setdefault(title, {})[style.label] = {"mean": stress.mean(), "deviation": stress.std(), "least": stress.min(),
                                                          "largest": stress.max()}
        a.set_title(title)
        a.set_xlabel(xlabel)
        a.set_ylabel("stress, Pa")
        a.ticklabel_format(axis="y", style="sci", scilimits=(-3, 4))
    add_legend(fig, axes, slot, 4)
    save(fig, output)
    return numbers


def cost_figure(results, figure, output):
    """CPU times, which differ from run to run. options["panels"]: (title, x, y, [(run, method, Style)])."""
    members = figure.options["panels"]
    labels = {"h": "cell size, m", "seconds": "CPU time of the run, s", "per_step": "CPU time per step, s", "error": "RMS of displacement, m"}
    fig, axes, slot = panels(2, len(members) // 2, 3.6, 2.7, 0.5)
    numbers = {}
    for a, (title, x, y, curves) in zip(axes.flat, members):
        for run, method, style in curves:
            times = times_of(results[run].study(method))
            a.loglog(times[x], times[y], **style.of_line())
            numbers.setdefault(title, {})[style.label] = {x: times[x], y: times[y]}
        a.set_title(title)
        a.set_xlabel(labels[x])
        a.set_ylabel(labels[y])
        finish_log_axes(a)
    add_legend(fig, axes, slot, 4)
    save(fig, output)
    return numbers


# ---- the figures of the papers ---------------------------------------------------------------------------------------

BAR_CELLS = (8, 16, 32, 64, 128, 256, 512)
RING_CELLS = (10, 20, 40, 80, 160)
FINE_CELLS = (16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192)
VORTEX = ("cfl=0.04",)


def by_ppc(case, amplitude, dim=1):
    """MPM with 9, CPDI and CPLS with 1, 4 and 9 particles per cell, counted as if in 2D, like Tran's legends."""
    settings = (f"amplitude={amplitude}",)
    runs = {n: Run(case, "mpm,cpdi1,cpls" if n == 3 else "cpdi1,cpls", BAR_CELLS, n, settings) for n in (1, 2, 3)}
    members = [(runs[3], "mpm", style_of("mpm", 9))]
    return list(runs.values()), members + [(runs[n], m, style_of(m, n * n)) for m in ("cpdi1", "cpls") for n in (1, 2, 3)]


def error_rows(columns, names=("displacement", "velocity", "stress")):
    """Panels: one row per quantity, one column per (title with {}, members)."""
    return [[(title.format(name), "error", name, members) for title, members in columns] for name in names]


def tran_bar():
    (small, of_small), (large, of_large) = by_ppc("vibration-1d", 1e-4), by_ppc("vibration-1d", 0.1)
    numbers = {"displacement": (9, 10), "velocity": (11, 12), "stress": (13, 14)}
    rows = [[(f"Fig. {numbers[n][0]}: {n}, A = 0.0001 m", "error", n, of_small), (f"Fig. {numbers[n][1]}: {n}, A = 0.1 m", "error", n, of_large)]
            for n in numbers]
    return Figure("tran-09-14", "Tran", "9-14", "Vibrating bar: errors over cell size", small + large, convergence_figure, {"panels": rows})


def tran_two_waves():
    runs, members = by_ppc("vibration-two-waves", 0.1)
    rows = [[(f"{n}, A = 0.1 m", "error", n, members) for n in ("displacement", "velocity", "stress")]]
    return Figure("tran-09-14-two-waves", "Tran", "10, 12, 14 with eq. 48 as printed", "The same with two half waves", runs, convergence_figure,
                  {"panels": rows})


def cost():
    in_plane = {n: Run("vibration-2d", "cpls,cpdi1" if n == 1 else "cpdi1", (8, 16, 32, 64), n * n, timed=True) for n in (1, 2, 3)}
    in_space = {n: Run("vibration-3d", "cpls,cpdi1" if n == 1 else "cpdi1", (4, 8, 16), n ** 3, timed=True) for n in (1, 2, 3)}
    flat = [(in_plane[n], "cpdi1", style_of("cpdi1", n * n)) for n in in_plane] + [(in_plane[1], "cpls", style_of("cpls", 1))]
    solid = [(in_space[n], "cpdi1", style_of("cpdi1", n ** 3)) for n in in_space] + [(in_space[1], "cpls", style_of("cpls", 1))]
    rows = [("Fig. 15: 2D", "h", "per_step", flat), ("2D", "seconds", "error", flat), ("3D", "h", "per_step", solid), ("3D", "seconds", "error", solid)]
    return Figure("tran-15", "Tran", "15", "CPU time", list(in_plane.values()) + list(in_space.values()), cost_figure,
                  {"panels": rows}, has_times=True)


def momenta(name, number, title, run, cells, first, size=True):
    """sum m |v| of particles and nodes (Tran's eqs. 52 and 53), and the change of momentum by the projection."""
    rows = [(f"Fig. {first + k}: {NAMES[m]}", "$\\Sigma$ m |v|, kg m/s",
             [(run, m, cells, "momentum_size", Style("particles", BLACK, "")), (run, m, cells, "grid_momentum_size", Style("nodes", GREEN, "o", " ", False))])
            for k, m in enumerate(("cpdi1", "cpls"))]
    return Figure(name, "Tran", number, title, [run], momentum_figure, {"panels": rows, "cells": cells, "run": run})


def momentum_figure(results, figure, output):
    """history_figure, with a last panel for the changes by the projection."""
    o = figure.options
    fig, axes, slot = panels(1, 3, 3.3, 2.6, 0.3)
    numbers = {}
    for a, (title, ylabel, curves) in zip(axes.flat, o["panels"]):
        for run, method, cells, column, style in curves:
            h = history_of(results[run], method, cells, ["time", column])
            a.plot(h["time"], h[column], color=style.colour, linestyle=style.line, marker=style.marker, markersize=3.5, markerfacecolor="white",
                   markevery=max(1, len(h["time"]) // 25), label=style.label, linewidth=1.2)
            numbers.setdefault(title, {})[style.label] = {"largest": h[column].max(), "last": h[column][-1]}
        a.set_title(title)
        a.set_ylabel(ylabel)
    for method, style in (("cpdi1", Style("CPDI", BLUE)), ("cpls", Style("CPLS", ORANGE))):
        t, defect = momentum_defect_of(results[o["run"]], method, o["cells"])
        axes[0, 2].semilogy(t, np.maximum(defect, 1e-18), color=style.colour, linewidth=1.1, label=f"{style.label}, change")
        numbers.setdefault("change", {})[style.label] = {"largest": defect.max()}
    axes[0, 2].set_title("change of $\\Sigma$ m v by the projection")
    axes[0, 2].set_ylabel("over the largest $\\Sigma$ m |v|")
    axes[0, 2].set_ylim(1e-19, 1)
    for a in axes.flat:
        a.set_xlabel("time, s")
        a.set_xlim(left=0)
    add_legend(fig, axes, slot, 4)
    save(fig, output)
    return numbers


def momentum_defect_of(results, method, cells):
    """Times, and the norm of the nodes' momentum minus that of the particles (signed sums) over the largest sum m |v|."""
    table = results.table(results.row(method, cells), "history")
    change = np.sqrt(sum((table[f"grid_momentum_{a}"] - table[f"momentum_{a}"]) ** 2 for a in "xyz" if f"momentum_{a}" in table))
    return table["time"], change / table["momentum_size"].max()


def energies(case, number, first, run, cells, title, exact=True):
    """Kinetic, strain and total energies, one panel each."""
    rows = []
    for k, what in enumerate(("kinetic", "strain", "total")):
        curves = [(run, m, cells, f"{what}_energy", Style(NAMES[m], METHOD_COLOURS[m], "o" if m == "cpls" else "", " " if m == "cpls" else "-", False))
                  for m in ("cpdi1", "cpls")]
        if exact:
            curves.insert(0, (run, "cpdi1", cells, f"{what}_energy_exact", Style("exact", BLACK, "", "--")))
        rows.append((f"Fig. {first + k}: {what} energy" if first else f"{what} energy", "energy, J", curves))
    return Figure(case, "Tran", number, title, [run], history_figure, {"panels": rows})


def three_energies(name, number, first, run, cells, title):
    """The three energies of CPDI and of CPLS, and both totals."""
    rows = []
    for k, m in enumerate(("cpdi1", "cpls")):
        rows.append((f"Fig. {first + k}: {NAMES[m]}", "energy, J",
                     [(run, m, cells, f"{what}_energy", Style(what, colour, "", "-")) for what, colour in
                      (("total", BLACK), ("kinetic", BLUE), ("strain", GREEN))]))
    rows.append((f"Fig. {first + 2}: total energy", "energy, J",
                 [(run, m, cells, "total_energy", Style(f"total, {NAMES[m]}", colour, "", "-")) for m, colour in (("cpdi1", PURPLE), ("cpls", ORANGE))]))
    return Figure(name, "Tran", number, title, [run], history_figure, {"panels": rows})


def tran_ring():
    runs = {a: Run("ring", "cpdi1,cpls", RING_CELLS, 4, (f"amplitude={a}",)) for a in ("0.0001", "0.1")}
    members = {a: [(r, m, style_of(m)) for m in ("cpdi1", "cpls")] for a, r in runs.items()}
    published = {a: [(r, m, Style(f"{NAMES[m]}, norm of the published code", METHOD_COLOURS[m], "x", ":")) for m in ("cpdi1", "cpls")]
                 for a, r in runs.items()}
    rows = [[(f"Fig. {f + k}: {n}, A = {a} m", "error", n, members[a]) for k, a in enumerate(runs)]
            for n, f in (("displacement", 23), ("velocity", 25), ("stress", 27))]
    rows.append([(f"Fig. {27 + k} in the norm of the code", "published", "stress", published[a]) for k, a in enumerate(runs)])
    return Figure("tran-23-28", "Tran", "23-28", "Ring expansion: errors over cell size", list(runs.values()), convergence_figure,
                  {"panels": rows, "columns": 3})


def tran_ring_printed():
    free = Run("ring", "cpdi1,cpls", RING_CELLS[:4], 4, ("nu=0.3",))
    loaded = Run("ring", "cpdi2", RING_CELLS[:4], 4, ("nu=0.3", "rims=loaded"))
    members = [(free, "cpdi1", Style("CPDI", BLUE)), (free, "cpls", Style("CPLS", ORANGE)), (loaded, "cpdi2", Style("CPDI2, rims loaded", GREEN, "s"))]
    rows = [[(f"{n}, A = 0.1 m, nu = 0.3", "error", n, members) for n in ("displacement", "velocity", "stress")]]
    return Figure("tran-23-28-printed", "Tran", "24, 26, 28 with Table 3's Lamé constants", "Ring with nu = 0.3", [free, loaded],
                  convergence_figure, {"panels": rows})


def tran_ring_3d():
    run = Run("ring", "cpdi1,cpls", (10, 20, 40), 8, ("dim=3",))
    members = [(run, m, style_of(m)) for m in ("cpdi1", "cpls")]
    rows = [[(f"{n}, 3D, A = 0.1 m", "error", n, members) for n in ("displacement", "velocity", "stress")]]
    return Figure("tran-23-28-3d", "Tran", "24, 26, 28 in 3D", "Expanding tube", [run], convergence_figure, {"panels": rows})


def tran_vortex():
    run, points = Run("vortex", "cpdi1,cpls", (8, 16, 32, 64), 4, VORTEX), Run("vortex", "mpm", (8, 32), 4, VORTEX)
    members = [(run, m, style_of(m)) for m in ("cpdi1", "cpls")]
    both = [(run, m, 8, NAMES[m]) for m in ("cpdi1", "cpls")]
    shapes = [(points, "mpm", 8, "Fig. 34: MPM, where it fails"), (run, "cpdi1", 8, "Fig. 35: CPDI, t = 1 s"), (run, "cpls", 8, "Fig. 36: CPLS, t = 1 s"),
              (points, "mpm", 32, "MPM, h = 0.125/4 m, where it fails"), (run, "cpdi1", 32, "CPDI, h = 0.125/4 m"), (run, "cpls", 32, "CPLS, h = 0.125/4 m")]
    rows = [[(f"Fig. {f}: {n}", "error", n, members) for n, f in (("displacement", 43), ("velocity", 44), ("stress", 45))]]
    return [
        Figure("tran-34-36", "Tran", "34-36", "Vortex: particles at the end", [run, points], configuration_figure,
               {"panels": shapes, "limits": (-1.45, 1.45), "columns": 3}),
        Figure("tran-37-42", "Tran", "37-42", "Vortex: errors of the particles of a quarter", [run], map_figure,
               {"names": ("displacement", "velocity", "stress"), "panels": both, "quarter": True, "first": 37}),
        Figure("tran-43-45", "Tran", "43-45", "Vortex: errors over cell size", [run], convergence_figure, {"panels": rows}),
        momenta("tran-46-47", "46-47", "Vortex: momentum", run, 8, 46)]


def tran_vortex_3d():
    run = Run("vortex", "cpdi1,cpls", (8, 16), 8, ("dim=3", *VORTEX))
    members = [(run, m, style_of(m)) for m in ("cpdi1", "cpls")]
    rows = [[(f"{n}, 3D", "error", n, members) for n in ("displacement", "velocity", "stress")]]
    return Figure("tran-43-45-3d", "Tran", "43-45 in 3D", "Vortex in a tube", [run], convergence_figure, {"panels": rows})


def tran_disks():
    times = {"0.005": "Fig. 49: t = 0.005 s", "1.5": "Fig. 50: t = 1.5 s", "3": "Fig. 51: t = 3 s"}
    stills = {t: Run("two-disks", "cpls", (20,), 9, (f"end={t}",)) for t in times}
    run, wall = Run("two-disks", "cpdi1,cpls", (20,), 9), Run("wall-rebound", "cpdi1,cpls", (20,), 4)
    shots = [(stills[t], "cpls", 20, title) for t, title in times.items()]
    return [
        Figure("tran-49-51", "Tran", "49-51", "Two disks, CPLS", list(stills.values()), configuration_figure,
               {"panels": shots, "value": True, "limits": (0, 1)}),
        three_energies("tran-52-54", "52-54", 52, run, 20, "Two disks: energies"),
        three_energies("tran-56-58", "56-58", 56, wall, 20, "Disk between walls: energies")]


def tran_balls():
    runs = {m: CaseRun("two-balls", (f"method.preset={m}", "output.interval=3.5")) for m in ("cpdi1", "cpls")}
    rows = [(f"{NAMES[m]}, 3D", "energy, J", [(r, "", 0, f"{what}_energy", Style(what, colour, "", "-")) for what, colour in
                                              (("total", BLACK), ("kinetic", BLUE), ("strain", GREEN))]) for m, r in runs.items()]
    colours = {"cpdi1": PURPLE, "cpls": ORANGE}
    rows.append(("total energy, 3D", "energy, J", [(r, "", 0, "total_energy", Style(f"total, {NAMES[m]}", colours[m], "", "-")) for m, r in runs.items()]))
    return Figure("tran-52-54-3d", "Tran", "52-54 in 3D", "Two balls: energies", list(runs.values()), history_figure, {"panels": rows})


def gong():
    mpm = {a: Run("vibration-1d", "mpm", (8, 16, 32, 64, 128, 256), 2, (f"amplitude={a}",)) for a in ("0.0001", "0.1")}
    mpm_2d = {a: Run("vibration-2d", "mpm", (8, 16, 32, 64), 4, (f"amplitude={a}",)) for a in ("0.0001", "0.05")}
    impm = {a: Run("vibration-1d", "impm", (8, 16, 32, 64, 128, 256), 2, (f"amplitude={a}",)) for a in ("0.0001", "0.1")}
    impm_2d = {a: Run("vibration-2d", "impm", (8, 16, 32, 64), 4, (f"amplitude={a}",)) for a in ("0.0001", "0.1")}
    fine = {m: Run("vibration-1d", m, FINE_CELLS, 2) for m in ("cpdi1", "impm", "icpdi1", "impm-adjoint")}
    coarse = Run("vibration-1d", "cpdi1", (8, 16, 32, 64, 128), 2)

    def pair(name, number, title, method, runs, dim):
        first, second = number.split("-")
        texts = zip((first, second), runs.items())
        return Figure(name, "Gong", number, title, list(runs.values()), all_errors_figure,
                      {"panels": [(f"Fig. {n}: {NAMES[method]}, {dim}D, G = {a}", [(r, method, "-", "")]) for n, (a, r) in texts]})

    def against(name, number, other):
        return Figure(name, "Gong", number, f"CPDI and {NAMES[other]} on fine meshes", [fine["cpdi1"], fine[other]], convergence_figure,
                      {"panels": [[(f"Fig. {number}: {n}", "error_l2", n, [(fine["cpdi1"], "cpdi1", Style("CPDI", RED, "s")),
                                                                           (fine[other], other, Style(NAMES[other], BLACK, "o"))])
                                   for n in ("displacement", "velocity", "stress")]], "exponents": True, "ylabel": "$\\log_{10}$ of the $L_2$ error",
                       "legend": 0.3})

    cells = (4, 8, 16)
    runs = {a: Run("vibration-3d", "mpm,impm,cpdi1,icpdi1,cpls", cells, 8, (f"amplitude={a}",)) for a in ("0.0001", "0.1")}
    members = {a: [(r, m, style_of(m)) for m in ("mpm", "impm", "cpdi1", "icpdi1", "cpls")] for a, r in runs.items()}
    in_3d = [[(f"{n}, 3D, G = {a}", "error_l2", n, members[a]) for a in runs] for n in ("displacement", "velocity", "stress")]
    return [
        pair("gong-4.7-4.8", "4.7-4.8", "MPM in 1D", "mpm", mpm, 1),
        pair("gong-4.9-4.10", "4.9-4.10", "MPM in 2D", "mpm", mpm_2d, 2),
        pair("gong-5.5-5.6", "5.5-5.6", "IMPM in 1D", "impm", impm, 1),
        pair("gong-5.7-5.8", "5.7-5.8", "IMPM in 2D", "impm", impm_2d, 2),
        Figure("gong-6.1-6.2", "Gong", "6.1-6.2", "CPDI on coarse and on fine meshes", [coarse, fine["cpdi1"]], all_errors_figure,
               {"panels": [("Fig. 6.1: CPDI, 1D, G = 0.1", [(coarse, "cpdi1", "-", "")]), ("Fig. 6.2: finer meshes", [(fine["cpdi1"], "cpdi1", "-", "")])]}),
        against("gong-6.3", "6.3", "impm"),
        against("gong-6.4", "6.4", "icpdi1"),
        against("gong-6.3-adjoint", "6.3 with ordo's adjoint IMPM", "impm-adjoint"),
        Figure("gong-3d", "Gong", "4.9, 4.10, 5.7, 5.8 in 3D", "Vibrating cube", list(runs.values()), convergence_figure, {"panels": in_3d})]


def wobbes():
    grids = {"mpm": "MPM", "ddmpm": "DDMPM", "bsmpm": "BSMPM"}
    small = Run("bar-small-strain", "mpm,ddmpm,bsmpm,tls-mpm,tls-ddmpm,tls-bsmpm", (5, 10, 20, 40), 12)
    plain = Run("bar-small-strain", "mpm,bsmpm", (5, 10, 20, 40), 12, ("method.mass=lumped",))
    matrix = Run("bar-small-strain", "mpm", (5, 10, 20, 40), 12, ("method.mass=consistent",))
    large = Run("bar-large-strain", "mpm,ddmpm,bsmpm,tls-mpm,tls-ddmpm,tls-bsmpm", (20,), 8)
    alone = Run("bar-large-strain", "tls-bsmpm", (20,), 8, ("method.tls=stress",))

    def members(m):
        r = [(small, m, Style("without TLS", BLUE, "o", "-", False))]
        if m == "mpm":
            r.append((matrix, m, Style("without TLS, consistent mass", GREEN, "D", "--", False)))
        if m == "bsmpm":
            r.append((plain, m, Style("without TLS, lumped mass", GREY, "^", ":", False)))
        return [*r, (small, f"tls-{m}", Style("with TLS", RED, "s"))]

    rows = [[(f"{label}: {n}", "error", n, members(m)) for m, label in grids.items()] for n in ("displacement", "velocity", "stress")]
    curves = {m: [(large, m, Style("without TLS", BLUE, "", ":")), (large, f"tls-{m}", Style("with TLS", RED, "", "-"))] for m in grids}
    curves["bsmpm"].append((alone, "tls-bsmpm", Style("TLS of the stress alone", BLACK, "", "--")))
    return [
        Figure("wobbes-3", "Wobbes", "3", "Bar, small strain: errors over cell size", [small, plain, matrix], convergence_figure, {"panels": rows}),
        Figure("wobbes-4", "Wobbes", "4", "Bar, large strain: stress at 0.1 s", [large, alone], stress_figure,
               {"panels": [(label, curves[m]) for m, label in grids.items()], "limits": (-9000, 9000)})]


REFERENCE = Style("reference in 1D", GREY, "", "--")


def line_of(method):
    return Style(NAMES[method], METHOD_COLOURS[method], "")


def against_reference(run, cells, column, styles):
    return [*((run, m, cells, column, style) for m, style in styles.items()), (run, "fem", cells, f"{column}_reference", REFERENCE)]


def displacements(number, run, cells, styles):
    """The displacement of particle A, and its difference from the reference."""
    return [(f"Fig. {number}: displacement of A", "displacement, m", against_reference(run, cells, "displacement_A", styles)),
            ("less the reference", "difference, m", [(run, m, cells, "displacement_A - displacement_A_reference", style) for m, style in styles.items()])]


def sadeghirad_bar():
    run = Run("bimaterial-bar", "ugimp,cpdi1,cpdi2,cpdi2e,fem", (1,))
    stills = {title: Run("bimaterial-bar", "cpdi2,cpdi2e,fem", (1,), set=("end=0.14", f"stiff={part}"))
              for part, title in (("top", "Fig. 5: stiff part on top, t = 0.14 s"), ("bottom", "stiff part at the bottom, t = 0.14 s"))}
    styles = {m: line_of(m) for m in ("ugimp", "cpdi1", "fem", "cpdi2e", "cpdi2")}
    styles["cpdi1"] = Style(NAMES["cpdi1"], BLUE, "o", " ", False)  # around the line of CPDI2
    colours = {"B": PURPLE, "C": BLUE}

    def stresses(title, method, below, end=""):
        grey = [(run, below, 1, f"stress_{p}{end}", Style(f"{p}, {end[1:] or NAMES[below]}", GREY, "", line)) for p, line in (("B", "-"), ("C", "--"))]
        return title, "stress, Pa", grey + [(run, method, 1, f"stress_{p}", Style(p, colour, "")) for p, colour in colours.items()]

    rows = [*displacements(3, run, 1, styles), stresses("Fig. 4: GIMP", "ugimp", "fem"), stresses("Fig. 4: CPDI and CPDI2", "cpdi1", "fem"),
            stresses("Fig. 4: enriched CPDI2", "cpdi2e", "fem"), stresses("finite elements", "fem", "fem", "_reference")]
    rows[3][2].extend((run, "cpdi2", 1, f"stress_{p}", Style(f"{p}, CPDI2", colour, "o", " ", False)) for p, colour in colours.items())
    points = {m: Style(NAMES[m], METHOD_COLOURS[m], marker, line) for m, marker, line in (("fem", "o", "-"), ("cpdi2e", "^", "-"), ("cpdi2", "s", "--"))}
    profiles = [(title, "y at the start, m", stress_along_y, [(r, m, style) for m, style in points.items()]) for title, r in stills.items()]
    return [
        Figure("sadeghirad-3-4", "Sadeghirad", "3-4", "Bar of two materials", [run], history_figure,
               {"panels": rows, "columns": 3, "legend_columns": 7, "limits": {"stress, Pa": (-2e4, 1.45e5)}}),
        Figure("sadeghirad-5", "Sadeghirad", "5", "Bar of two materials: stress at 0.14 s", list(stills.values()), profile_figure, {"panels": profiles})]


def sadeghirad_ring():
    run, still = (Run("bimaterial-ring", "cpdi2,cpdi2e,fem", (20,), set=s) for s in ((), ("end=0.0107",)))  # the ring is widest then
    styles = {m: line_of(m) for m in ("fem", "cpdi2e", "cpdi2")}
    rows = displacements(7, run, 20, styles)
    around = []
    for p, side, low, high in (("B", "inside", 3.075, 3.1), ("C", "outside", 3.1, 3.125)):
        rows.append((f"Fig. 8: {p}, {side} the interface", "radial stress, Pa", against_reference(run, 20, f"stress_{p}", styles)))
        around.append((f"{p}, t = 0.0107 s", "angle, degrees", functools.partial(radial_stress_around, low=low, high=high),
                       [(still, m, styles[m]) for m in ("cpdi2", "cpdi2e", "fem")]))
    return [
        Figure("sadeghirad-7-8", "Sadeghirad", "7-8", "Ring of two materials", [run], history_figure, {"panels": rows, "columns": 2, "width": 3.7}),
        Figure("sadeghirad-8-angle", "Sadeghirad", "8 over the angle", "Ring of two materials: radial stress around", [still], profile_figure,
               {"panels": around})]


def sphere():
    """Ours, not a figure of a paper."""
    plain = Run("bimaterial-sphere", "cpdi2,cpdi2e", (6, 8, 10))
    runs = {e: Run("bimaterial-sphere", "cpdi2e", (6, 8, 10), set=(f"method.enrichment={e}",)) for e in ("interface", "layers")}
    members = [(plain, "cpdi2", Style("CPDI2", GREEN)), (runs["interface"], "cpdi2e", Style("enriched: interface", ORANGE, "s")),
               (plain, "cpdi2e", Style("adjacent", RED, "^")), (runs["layers"], "cpdi2e", Style("two layers", BLUE, "D"))]
    rows = [[("next to the interface", "quantities", "interface stress error", members), ("everywhere", "quantities", "stress error", members)]]
    return Figure("ordo-sphere", "ordo", "", "Sphere in a cube", [plain, *runs.values()], convergence_figure,
                  {"panels": rows, "ylabel": "relative error of stress", "slopes": False, "legend": 0.3})


def vortex_study():
    """Ours, not a figure of a paper: docs/vortex.md."""
    plain = Run("vortex", "cpdi1,cpls,cpdi2", (16, 32, 64, 128), 4, ("cfl=0.1",))
    splines = Run("vortex", "cpdi1", (16, 32, 64, 128), 4, ("cfl=0.1", "method.basis=bspline2"))
    best = Run("vortex", "bscpdi2", (16, 32, 64, 128, 256), 4, ("cfl=0.15",))
    quadratic = Run("vortex", "cpls", (16, 32, 64, 128), 4, ("cfl=0.15", "method.basis=bspline2", "method.domain=cell", "method.degree=2"))
    members = [(plain, m, style_of(m)) for m in ("cpdi1", "cpls", "cpdi2")]
    members += [(splines, "cpdi1", Style("CPDI on splines", BLUE, "s", "--")), (best, "bscpdi2", Style("CPDI2 on splines", BLACK)),
                (quadratic, "cpls", Style("CPLS of degree 2 on CPDI2 and splines", RED, "s", "--"))]
    rows = [[(n, "error", n, members) for n in ("displacement", "velocity", "stress")]]
    return Figure("vortex-study", "ordo", "", "Vortex on fine meshes", [plain, splines, best, quadratic], convergence_figure, {"panels": rows})


def high_order():
    """Ours, not a figure of a paper: docs/high_order.md."""
    low = Run("vibration-1d", "cpdi1,impm-adjoint", (16, 32, 64, 128, 256), 2)
    high = Run("vibration-1d", "spline3,spline4", (16, 32, 64, 128, 256), 2, ("cfl=0.3",))
    members = [(low, "cpdi1", style_of("cpdi1")), (low, "impm-adjoint", style_of("impm-adjoint")),
               (high, "spline3", Style("spline3", GREEN, "s")), (high, "spline4", Style("spline4", BLACK, "D"))]
    rows = [[(n, "error", n, members) for n in ("displacement", "velocity", "stress")]]
    return Figure("high-order", "ordo", "", "Vibrating bar, third and fourth order", [low, high], convergence_figure, {"panels": rows, "legend": 0.4})


def gallery_figures():
    bar = by_ppc("vibration-1d", 0.1)[0][1]  # 4 ppc
    cube = Run("vibration-3d", "cpdi1,cpls", (8,), 8)
    return [tran_bar(), tran_two_waves(), cost(), momenta("tran-16-17", "16-17", "Vibrating bar: momentum", bar, 8, 16),
            energies("tran-18-20", "18-20", 18, bar, 8, "Vibrating bar: energies"),
            energies("tran-18-20-3d", "18-20 in 3D", 0, cube, 8, "Vibrating cube: energies"),
            tran_ring(), tran_ring_printed(), tran_ring_3d(),
            momenta("tran-29-30", "29-30", "Ring: momentum", Run("ring", "cpdi1,cpls", RING_CELLS, 4, ("amplitude=0.1",)), 10, 29),
            *tran_vortex(), tran_vortex_3d(), *tran_disks(), tran_balls(), *gong(), *wobbes(), *sadeghirad_bar(), *sadeghirad_ring(), vortex_study(), high_order(),
            sphere()]


# ---- commands --------------------------------------------------------------------------------------------------------

def rounded(value):
    """Numbers with six digits, arrays as lists: the same text on machines whose last digits differ."""
    if isinstance(value, dict):
        return {k: rounded(v) for k, v in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [rounded(v) for v in value]
    return float(f"{value:.6g}") if isinstance(value, (float, np.floating)) else value


def draw_gallery(o):
    figures = gallery_figures()
    if o.list:
        for f in figures:
            print(f"{f.name:24} {f.paper} Fig. {f.number}: {f.title}")
        return
    only = o.only.split(",") if o.only else [f.name for f in figures]
    unknown = set(only) - {f.name for f in figures}
    if unknown:
        raise SystemExit(f"ordo_gallery.py: there is no figure {', '.join(sorted(unknown))}; see --list")
    figures = [f for f in figures if f.name in only]
    os.makedirs(o.output, exist_ok=True)
    runner = Runner(o.ordo, o.work, o.quick, o.jobs)
    runner.run_all([r for f in figures for r in f.runs])
    numbers = []
    for f in figures:
        drawn = f.draw({r: runner.results(r) for r in f.runs}, f, os.path.join(o.output, f.name + ".png"))
        print(os.path.join(o.output, f.name + ".png"), flush=True)
        runs = [call_of(r, o.quick) for r in f.runs]
        numbers.append({"name": f.name, "paper": f.paper, "figures": f.number, "title": f.title, "runs": runs,
                        "drawn": None if f.has_times else rounded(drawn)})
    file = os.path.join(o.output, "gallery.json")
    kept = {}
    if os.path.exists(file):  # with --only those that were drawn before stay
        with open(file, encoding="utf-8") as stream:
            kept = {f["name"]: f for f in json.load(stream)}
    kept.update((f["name"], f) for f in numbers)
    numbers = [kept[f.name] for f in gallery_figures() if f.name in kept]
    with open(file, "w", encoding="utf-8") as stream:
        json.dump(numbers, stream, indent=1, sort_keys=True, ensure_ascii=False)
        stream.write("\n")


def draw_runs(o):
    """Histories and error maps of one call, one figure of each per case and set of parameters."""
    results = Results(os.path.dirname(os.path.abspath(o.file)))
    groups = []
    for study in results.studies:
        same = [g for g in groups if (g[0]["case"], g[0]["parameters"]) == (study["case"], study["parameters"])]
        same[0].append(study) if same else groups.append([study])
    os.makedirs(o.output, exist_ok=True)
    for k, group in enumerate(groups, 1):
        name = group[0]["case"] + (f"-{k}" if sum(g[0]["case"] == group[0]["case"] for g in groups) > 1 else "")
        for kind, draw in (("history", draw_histories), ("map", draw_maps)):
            output = os.path.join(o.output, f"{name}-{kind}.png")
            if draw(results, group, output):
                print(output)


def draw_histories(results, group, output):
    """Energies, and the change of momentum by the projection, on the coarsest mesh of each method."""
    tables = []
    for study in group:
        rows = [r for r in study["rows"] if not r["failed"] and "history" in r.get("files", {})]
        if rows:
            tables.append((study["method"], rows[0], results.table(rows[0], "history")))
    if not tables:
        return False
    fig, axes, slot = panels(2, 2, 3.6, 2.4, 0.2 + 0.15 * (1 + len(tables) // 5))
    methods = list(dict.fromkeys(s["method"] for s in results.studies))
    for k, (method, row, h) in enumerate(tables):
        colour = COLOURS[methods.index(method) % len(COLOURS)]  # as in the figures of errors
        label = f"{method}, {row['cells']} cells"
        for a, what in zip(axes.flat, ("kinetic_energy", "strain_energy", "total_energy")):
            if k == 0 and f"{what}_exact" in h:
                a.plot(h["time"], h[f"{what}_exact"], color=GREY, linewidth=3, alpha=0.5, label="exact")
            a.plot(h["time"], h[what], color=colour, linewidth=1.1, label=label)
            a.set_ylabel(ordo_figures.field_label(what, sum(f"momentum_{x}" in h for x in "xyz")))
        change = np.sqrt(sum((h[f"grid_momentum_{x}"] - h[f"momentum_{x}"]) ** 2 for x in "xyz" if f"momentum_{x}" in h))
        axes[1, 1].semilogy(h["time"], np.maximum(change / max(h["momentum_size"].max(), 1e-300), 1e-18), color=colour, linewidth=1.1, label=label)
    axes[1, 1].set_ylabel("change of momentum\nby the projection, relative")
    for a in axes.flat:
        a.set_xlabel("time, s")
    add_legend(fig, axes, slot, 4)
    fig.suptitle(group[0]["case"], fontsize=9)
    save(fig, output)
    return True


def draw_maps(results, group, output):
    """Errors of particles in 2D on the finest mesh of each method, for at most four methods."""
    members = []
    for study in group:
        rows = [r for r in study["rows"] if not r["failed"] and "particles" in r.get("files", {})]
        if rows:
            p = results.table(rows[-1], "particles")
            if dim_of(p) == 2 and "position_x_exact" in p and len(p["position_x"]) <= 20000:
                members.append((study["method"], rows[-1]["cells"], p))
    members = members[:4]
    if not members:
        return False
    fig, axes = plt.subplots(3, len(members), figsize=(2.9 * len(members) + 0.8, 7.4), layout="constrained", squeeze=False)
    for name, row in zip(("displacement", "velocity", "stress"), axes):
        errors = [particle_errors_of(p, name) for _, _, p in members]
        norm = Normalize(0, max(max(e.max() for e in errors), 1e-300))
        for a, (method, cells, p), e in zip(row, members, errors):
            draw_domains(a, p, e, norm)
            a.set_title(f"{method}, {cells} cells: {name}")
        fig.colorbar(plt.cm.ScalarMappable(norm, "viridis"), ax=list(row), aspect=18, pad=0.02).set_label(f"error, {UNITS[name]}")
    finish_plane(axes)
    save(fig, output)
    return True


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    c = commands.add_parser("gallery", help="run what is missing and draw the papers' figures")
    c.add_argument("--ordo", default="build/release/ordo")
    c.add_argument("-o", "--output", default="docs/gallery")
    c.add_argument("--work", default="build/gallery", help="directory of the runs")
    c.add_argument("--only", help="names of figures, separated by commas")
    c.add_argument("--quick", action="store_true", help="two coarsest meshes of each run")
    c.add_argument("--jobs", type=int, default=2, help="runs at once, of one thread each")
    c.add_argument("--list", action="store_true", help="print the figures")
    c = commands.add_parser("runs", help="histories and error maps of what ordo verify --data wrote")
    c.add_argument("file", help="verify.json")
    c.add_argument("-o", "--output", required=True, help="a directory")
    o = parser.parse_args()
    draw_gallery(o) if o.command == "gallery" else draw_runs(o)


if __name__ == "__main__":
    main()
