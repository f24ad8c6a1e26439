#!/usr/bin/python3
"""Figures and summaries of ordo's output: energies over time, particle domains coloured by a field, errors over h.

Reads history.csv, probe_*.csv, particles.pvd and the VTU files it names, and the JSON of `ordo verify`; needs numpy,
matplotlib and, for particles, vtk.
On the command line (see --help) or as a module: each function draws into axes that it is given.
"""

import argparse
import json
import os
import re
import sys
import textwrap
import xml.etree.ElementTree as ElementTree

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402
import matplotlib.ticker  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.collections import PolyCollection  # noqa: E402

BLUE, ORANGE, BLACK, GREY = "#2a6fb0", "#d9730d", "#222222", "#8c8c8c"
COLOURS = [BLACK, ORANGE, BLUE, "#3c8d40", "#8a5fb5", "#c23b4e", "#1b9e9e", "#a3761b"]
MARKERS = "osD^vP<X>"
UNITS = {"displacement": "m", "position": "m", "velocity": "m/s", "stress": "Pa", "density": "kg/m³", "mass": "kg",
         "volume": "m³", "pressure": "Pa", "von_mises": "Pa", "energy_density": "J/m³"}
LABELS = {"velocity": "speed", "von_mises": "von Mises stress"}
LINES = ["-", "--", "-.", ":"]
SLOPES = {(1, 2): "orders 1 and 2", (2, 3, 4): "orders 2, 3 and 4"}  # reference lines and their names in legends
ERRORS = ["displacement", "velocity", "stress", "density", "velocity_grid", "value", "value_inside"]
# Dimensions of VTK's cell types; the corners of a triangle as those of a quad, of a tetrahedron as those of a hexahedron.
DIMS = {1: 0, 3: 1, 5: 2, 9: 2, 10: 3, 12: 3}
SIMPLEX_CORNERS = {5: [0, 1, 2, 2], 10: [0, 1, 2, 2, 3, 3, 3, 3]}
# The faces of a VTK hexahedron, counter-clockwise when seen from outside.
FACES = np.array([[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]])

plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "axes.titlesize": 9,
                     "legend.frameon": False, "legend.fontsize": 8, "savefig.dpi": 100})


# ---- reading ---------------------------------------------------------------------------------------------------------

def read_csv(file):
    """The columns of history.csv or of a probe by name: table["time"], table["kinetic_energy"], .."""
    return np.atleast_1d(np.genfromtxt(file, delimiter=",", names=True))


def read_history(directory):
    return read_csv(os.path.join(directory, "history.csv"))


def read_frames(directory):
    """[(time, VTU file)] of particles.pvd."""
    sets = ElementTree.parse(os.path.join(directory, "particles.pvd")).getroot().iter("DataSet")
    return [(float(s.get("timestep")), os.path.join(directory, s.get("file"))) for s in sets]


class Frame:
    """The particles of one VTU file in the order of their id.

    x: (n, 3) positions; corners: (n, k, 3) corners of the domains, k = 1 for points; fields: arrays by name;
    dim: 1, 2 or 3, None where points do not tell.
    """

    def __init__(self, file):
        from vtkmodules.util.numpy_support import vtk_to_numpy
        from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

        reader = vtkXMLUnstructuredGridReader()
        reader.SetFileName(file)
        reader.Update()
        grid = reader.GetOutput()
        n = grid.GetNumberOfCells()
        if n == 0:
            raise SystemExit(f"{file}: holds no particles")
        points = vtk_to_numpy(grid.GetPoints().GetData())
        types = vtk_to_numpy(grid.GetCellTypesArray())
        ids, starts = vtk_to_numpy(grid.GetCells().GetConnectivityArray()), vtk_to_numpy(grid.GetCells().GetOffsetsArray())
        self.dim = max(DIMS[t] for t in types) or None
        width = 2 ** (self.dim or 0)
        self.corners = np.empty((n, width, 3))
        for t in np.unique(types):  # triangles and tetrahedra as quads and hexahedra with corners that coincide
            cells = starts[:-1][types == t]
            for k, corner in enumerate(SIMPLEX_CORNERS.get(t, range(width))):
                self.corners[types == t, k] = points[ids[cells + corner]]
        self.has_domains = width > 1
        data = grid.GetCellData() if self.has_domains else grid.GetPointData()
        self.fields = {data.GetArrayName(k): vtk_to_numpy(data.GetArray(k)) for k in range(data.GetNumberOfArrays())}
        self.x = self.fields["position"] if self.has_domains else points
        self.time = vtk_to_numpy(grid.GetFieldData().GetArray("TimeValue"))[0]

    def scalar(self, name):
        """A field as one number per particle: the norm of a vector; stress_xy or velocity_x name a component."""
        if name in self.fields:
            values = self.fields[name]
            if values.ndim == 1:
                return values
            if values.shape[1] == 3:
                return np.linalg.norm(values, axis=1)
        base, _, component = name.rpartition("_")
        if base in self.fields and self.fields[base].ndim == 2:
            width = self.fields[base].shape[1]
            names = list("xyz") if width == 3 else [a + b for a in "xyz" for b in "xyz"]
            if component in names:
                return self.fields[base][:, names.index(component)]
        there = ", ".join(k if v.ndim == 1 or v.shape[1] == 3 else f"{k}_xx .." for k, v in self.fields.items())
        raise SystemExit(f"there is no field {name}; this frame has {there} (see [output] fields)")


def nearest_frames(directory, times):
    frames = read_frames(directory)
    return [Frame(min(frames, key=lambda f: abs(f[0] - t))[1]) for t in times]


def read_studies(file):
    """The studies of `ordo verify --json`: case, method, parameters, h of the failed meshes, errors as name: [(h, error)]."""
    try:
        with open(file, encoding="utf-8") as stream:
            return [read_study(s) for s in json.load(stream)]
    except (ValueError, KeyError, TypeError, AttributeError) as e:
        raise SystemExit(f"ordo_figures.py: {file}: not what ordo verify --json writes ({type(e).__name__}: {e})") from e


def read_study(study):
    errors = {name: [] for name in ERRORS}
    for row in study["rows"]:
        for name, found in errors.items():
            e = row["error_l2" if name == "velocity_grid" else "error"].get(name)
            if e is not None and 0 < e < np.inf:
                found.append((float(row["h"]), e))
    failed = [float(row["h"]) for row in study["rows"] if row["failed"]]
    curves = [{name: np.array(v, float) for name, v in row["curves"].items()} for row in study["rows"] if row.get("curves")]
    return {"case": str(study["case"]), "method": str(study["method"]), "parameters": dict(study["parameters"]), "failed": failed,
            "errors": {name: sorted(found) for name, found in errors.items() if found}, "curves": curves[-1] if curves else None}


def save(figure, output):
    """Saves without the versions and dates that matplotlib would write, so equal drawings give equal bytes."""
    figure.savefig(output, metadata={"Software": None})
    plt.close(figure)


# ---- drawing ---------------------------------------------------------------------------------------------------------

def field_label(name):
    unit = UNITS.get(name) or UNITS.get(name.rpartition("_")[0], "")
    return f"{LABELS.get(name, name.replace('_', ' '))}{', ' + unit if unit else ''}"


def draw_energies(axes, directory):
    """Kinetic, strain and total energy over time, as in Tran et al. (2019) Figs. 52, 53, 56, 57."""
    h = read_history(directory)
    axes.plot(h["time"], h["total_energy"], color=BLACK, label="total")
    axes.plot(h["time"], h["kinetic_energy"], color=BLUE, label="kinetic")
    axes.plot(h["time"], h["strain_energy"], color=ORANGE, label="strain")
    finish_energy_axes(axes, h)


def draw_total_energies(axes, directories, labels):
    """Total energies of several runs, as in Tran et al. (2019) Figs. 54 and 58."""
    for directory, label, colour in zip(directories, labels, COLOURS):
        h = read_history(directory)
        axes.plot(h["time"], h["total_energy"], color=colour, label=label)
    finish_energy_axes(axes, h, "total energy, J", from_zero=False)


def finish_energy_axes(axes, history, label="energy, J", from_zero=True):
    axes.set_xlabel("time, s")
    axes.set_ylabel(label)
    axes.set_xlim(history["time"][0], history["time"][-1])
    low, high = axes.get_ylim()
    low = 0 if from_zero else low
    axes.set_ylim(low, high + 0.3 * (high - low))  # the legend stands above the curves
    axes.legend(loc="upper center", ncol=3, columnspacing=1.2, handlelength=1.5)


def draw_curves(axes, directory, columns):
    """Columns of a CSV file over time: columns is FILE:NAME,NAME."""
    file, _, names = columns.partition(":")
    table = read_csv(os.path.join(directory, file))
    for name, colour in zip(names.split(","), [BLUE, ORANGE, BLACK]):
        axes.plot(table["time"], table[name], color=colour, label=name.replace("_", " "))
    axes.set_xlabel("time, s")
    axes.set_xlim(table["time"][0], table["time"][-1])
    if "," in names:
        axes.legend()
    else:
        axes.set_ylabel(field_label(names))


class View:
    """Parallel projection of 3D points; angles in degrees, z up."""

    def __init__(self, azimuth=-60.0, elevation=20.0):
        a, e = np.radians(azimuth), np.radians(elevation)
        self.towards = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])  # from the scene to the eye
        self.right = np.array([-np.sin(a), np.cos(a), 0.0])
        self.up = np.cross(self.towards, self.right)

    def plane(self, points):
        return np.stack([points @ self.right, points @ self.up], axis=-1)


def projected_polygons(frame, values, view):
    """Visible faces of hexahedra from back to front, their values, and their shade for the light from the eye."""
    faces = frame.corners[:, FACES]                                 # particle, face, corner, axis
    normal = np.cross(faces[:, :, 2] - faces[:, :, 0], faces[:, :, 3] - faces[:, :, 1])
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-300)
    facing = normal @ view.towards
    particle, face = np.nonzero(facing > 0)
    depth = faces[particle, face].mean(axis=1) @ view.towards
    order = np.argsort(depth)
    particle, face = particle[order], face[order]
    return view.plane(faces[particle, face]), values[particle], 0.55 + 0.45 * facing[particle, face]


def draw_particles(axes, frame, values, norm, view=None, dim=None, cmap="viridis"):
    """The particle domains of a frame (dots for points); 3D by a projection."""
    dim = frame.dim or dim or 2
    colours = plt.get_cmap(cmap)
    if dim == 3:
        view = view or View()
        if frame.has_domains:
            polygons, v, shade = projected_polygons(frame, values, view)
            rgba = colours(norm(v))
            rgba[:, :3] *= shade[:, None]
            axes.add_collection(PolyCollection(polygons, facecolors=rgba, edgecolors=rgba, linewidths=0.2))
        else:
            order = np.argsort(frame.x @ view.towards)
            p = view.plane(frame.x[order])
            axes.scatter(p[:, 0], p[:, 1], s=6, c=colours(norm(values[order])), linewidths=0)
    elif frame.has_domains:
        axes.add_collection(PolyCollection(frame.corners[:, :, :2], facecolors=colours(norm(values)), edgecolors="white", linewidths=0.15))
    else:
        axes.scatter(frame.x[:, 0], frame.x[:, 1], s=8, c=colours(norm(values)), linewidths=0)
    axes.set_aspect("equal")


def extent(frames, dim, view, walls=()):
    """A box around all frames and walls, with a margin."""
    points = np.concatenate([f.corners.reshape(-1, 3) for f in frames])
    points = view.plane(points) if dim == 3 else points[:, :2]
    low, high = points.min(axis=0), points.max(axis=0)
    for wall in walls:
        low[0], high[0] = min(low[0], wall), max(high[0], wall)
    pad = 0.06 * (high - low).max()
    return low - pad, high + pad


def guess_dim(frames, dim):
    if dim or frames[0].dim:
        return dim or frames[0].dim
    spread = [np.ptp(np.concatenate([f.x[:, a] for f in frames])) for a in range(3)]
    return 3 if spread[2] > 0 else 2 if spread[1] > 0 else 1


def draw_snapshots(axes, directory, times, field="velocity", view=None, dim=None, limits=None, walls=()):
    """Frames nearest to the times, one to each axes, with one colour scale. 1D: the field over x, all in axes[0].

    Returns what a colour bar needs, None in 1D.
    """
    frames = nearest_frames(directory, times)
    dim = guess_dim(frames, dim)
    if dim == 1:
        shades = plt.get_cmap("viridis")(np.linspace(0.0, 0.85, len(frames)))
        for frame, colour in zip(frames, shades):
            values = frame.fields[field][:, 0] if field in frame.fields and frame.fields[field].ndim == 2 else frame.scalar(field)
            axes[0].plot(frame.x[:, 0], values, ".-", markersize=3, linewidth=0.8, color=colour, label=f"t = {frame.time:.3g} s")
        axes[0].set_xlabel("x, m")
        axes[0].set_ylabel(f"{field.replace('_', ' ')}, {UNITS.get(field, '')}")
        axes[0].legend(loc="lower right", bbox_to_anchor=(1.02, 0.99), ncol=2)
        return None
    view = view or View()
    values = [f.scalar(field) for f in frames]
    low, high = limits or (min(v.min() for v in values), max(v.max() for v in values))
    norm = matplotlib.colors.Normalize(low, high if high > low else low + 1)
    lower, upper = extent(frames, dim, view, walls)
    for a, frame, v in zip(axes, frames, values):
        draw_particles(a, frame, v, norm, view, dim)
        for wall in walls:
            a.axvline(wall, color="#666666", linewidth=1.5, zorder=0)
        a.set_xlim(lower[0], upper[0])
        a.set_ylim(lower[1], upper[1])
        a.set_title(f"t = {frame.time:.3g} s")
        if dim == 3:
            a.set_axis_off()
        else:
            a.locator_params(nbins=5)
            a.set_xlabel("x, m")
    if dim == 2:
        axes[0].set_ylabel("y, m")
        for a in axes[1:]:
            a.set_yticklabels([])
    return matplotlib.cm.ScalarMappable(norm, "viridis")


def error_label(name):
    if name == "velocity_grid":  # not divided by the volume, unlike the RMS over particles
        return "grid velocity, $L_2$, m/s m$^{d/2}$"
    return ", ".join([name.replace("_", " "), "RMS", *([UNITS[name]] if name in UNITS else [])])


def draw_errors(axes, studies, name, methods):
    """One error over h, one curve per study in the style of its method; failed meshes are crosses at the top edge."""
    hs = sorted({h for s in studies for h in s["failed"] + [p[0] for c in s["errors"].values() for p in c]})
    level = dict.fromkeys(hs, 1.0)  # stacks the crosses of several methods at one h
    curves = []
    for place, study in enumerate(studies):
        k = methods.index(study["method"])
        size = max(3.0, 6.0 - 0.8 * place)  # so that coinciding curves show all their markers
        colour = COLOURS[k % len(COLOURS)]
        if name in study["errors"]:
            curves.append(np.array(study["errors"][name]).T)
            axes.loglog(*curves[-1], color=colour, marker=MARKERS[k % len(MARKERS)], markersize=size, linewidth=1.1, label=study["method"])
        for h in study["failed"]:
            axes.plot(h, level[h], "x", color=colour, transform=axes.get_xaxis_transform(), clip_on=False,
                      label=f"{study['method']} failed")
            level[h] += 0.06
    draw_slopes(axes, curves)
    axes.set_xlim(hs[0] / 1.25, hs[-1] * 1.25)
    ticks = []
    for h in hs[::-1]:  # only labels with enough room: a character takes a 20th of the axis
        if not ticks or np.log(ticks[-1] / h) > (0.025 * (len(f"{h:.2g}") + len(f"{ticks[-1]:.2g}")) + 0.05) * np.log(hs[-1] / hs[0]):
            ticks.append(h)
    axes.set_xticks(ticks, [f"{h:.2g}" for h in ticks])
    axes.minorticks_off()
    axes.set_xlabel("h, m")
    axes.set_ylabel(error_label(name))


def draw_slopes(axes, curves):
    """Lines of known order through one point, below all curves, over the coarser half of the meshes."""
    low, high = min(c[0, 0] for c in curves), max(c[0, -1] for c in curves)
    if low == high:
        return
    h = np.geomspace((low * high) ** 0.5, high, 20)
    below = np.min([np.interp(np.log(h), *np.log(c)) for c in curves], axis=0)
    steepest = max(np.log(c[1, -1] / c[1, 0]) / np.log(c[0, -1] / c[0, 0]) for c in curves if c[0, -1] > c[0, 0])
    orders, label = list(SLOPES.items())[steepest > 2.6]
    start = np.exp(np.min(below - orders[-1] * np.log(h / h[0]))) / 2
    for order in orders:
        e = start * (h / h[0]) ** order
        axes.plot(h[[0, -1]], e[[0, -1]], color=GREY, linewidth=0.9, label=label)
        axes.annotate(str(order), (h[-1], e[-1]), (3, 0), textcoords="offset points", color=GREY, fontsize=8, va="center")


def slopes_last(entries):
    """Entries of a legend, with the lines of known order after all others."""
    return dict(sorted(entries.items(), key=lambda entry: entry[0] in SLOPES.values()))


# ---- whole figures ---------------------------------------------------------------------------------------------------

def energies(directories, output, labels=None):
    figure, axes = plt.subplots(figsize=(5, 3.4), layout="constrained")
    if len(directories) == 1:
        draw_energies(axes, directories[0])
    else:
        draw_total_energies(axes, directories, labels or [os.path.basename(os.path.normpath(d)) for d in directories])
    save(figure, output)


def snapshots(directory, output, times, field="velocity", view=None, dim=None, limits=None, curve=None, walls=()):
    """Snapshots in a row; with `curve` ("energies" or FILE:COLUMN) a last panel over time."""
    first = Frame(read_frames(directory)[0][1])
    one_dim = guess_dim([first], dim) == 1
    panels = 1 if one_dim else len(times)
    width = 3.6 if one_dim else 2.2
    ratios = [width] * panels + ([3.2] if curve else [])
    figure, axes = plt.subplots(1, len(ratios), figsize=(sum(ratios), 3.1), layout="constrained", squeeze=False,
                                gridspec_kw={"width_ratios": ratios})
    axes = axes[0]
    mapped = draw_snapshots(axes[:panels], directory, times, field, view, dim, limits, walls)
    if mapped:
        bar = figure.colorbar(mapped, ax=list(axes[:panels]), orientation="horizontal", shrink=0.5, aspect=35, pad=0.04)
        bar.set_label(field_label(field), labelpad=1)
        bar.locator = matplotlib.ticker.MaxNLocator(5)
        bar.update_ticks()
    if curve == "energies":
        draw_energies(axes[-1], directory)
    elif curve:
        draw_curves(axes[-1], directory, curve)
    save(figure, output)


def summary(directories, output=sys.stdout):
    """One Markdown row per run: energies relative to the initial total energy."""
    output.write("| run | time reached, s | steps | total energy at the end | largest total energy | largest strain energy |\n|---|---|---|---|---|---|\n")
    for directory in directories:
        h = read_history(directory)
        start = h["total_energy"][0]
        rows = [h["total_energy"][-1], h["total_energy"].max(), h["strain_energy"].max()]
        text = [f"{v / start:.4f}" if start > 0 else f"{v:.4g} J" for v in rows]
        name = os.path.basename(os.path.normpath(directory))
        output.write(f"| {name} | {h['time'][-1]:.4g} | {len(h) - 1} | {' | '.join(text)} |\n")


def convergence(file, directory):
    """Errors over h of the studies of `ordo verify`: one PNG per case and set of parameters, one curve per method."""
    studies = read_studies(file)
    methods = list(dict.fromkeys(s["method"] for s in studies))
    os.makedirs(directory, exist_ok=True)
    spectra(directory, [s for s in studies if s["curves"]])
    studies = [s for s in studies if not s["curves"]]
    for case in dict.fromkeys(s["case"] for s in studies):
        sets = []  # of studies with the same parameters
        for study in (s for s in studies if s["case"] == case):
            same = [s for s in sets if s[0]["parameters"] == study["parameters"]]
            same[0].append(study) if same else sets.append([study])
        given = [s[0]["parameters"] for s in sets]
        names = dict.fromkeys(name for p in given for name in p)
        differing = [name for name in names if any(p.get(name) != given[0].get(name) for p in given)]
        for group, parameters in zip(sets, given):
            told = [[f"{n} {number(p[n])}" for n in p if (n in differing) == d] for p, d in ((parameters, True), (parameters, False))]
            if not any(s["errors"] for s in group):
                print(f"ordo_figures.py: {', '.join([case] + told[0])}: there are no errors to draw", file=sys.stderr)
                continue
            if all(len(points) < 2 for s in group for points in s["errors"].values()) and not any(s["failed"] for s in group):
                print(f"ordo_figures.py: {', '.join([case] + told[0])}: one mesh makes no curve", file=sys.stderr)
                continue
            output = os.path.join(directory, re.sub(r"[^\w.+-]+", "-", "-".join([case] + told[0])) + ".png")
            draw_convergence(group, output, methods, ", ".join([case] + told[0]), ", ".join(told[1]))
            print(output)


def spectra(directory, studies):
    """Growth and speed of waves over wave number: one PNG per method, one curve per number of particles per cell and shift."""
    seen = {}
    for s in studies:
        label = f"{s['parameters']['ppc']} a cell" + (f", shift {number(s['parameters']['shift'])}" if s["parameters"]["shift"] else "")
        axes = {k: v for k, v in s["parameters"].items() if k not in ("ppc", "shift", "shifts", "steps")}
        seen.setdefault((s["case"], s["method"], tuple(axes.items())), {}).setdefault(label, s["curves"])
    for (case, method, parameters), curves in seen.items():
        told = ", ".join(f"{name} {number(value)}" for name, value in parameters)
        same = [k for k in seen if k[:2] == (case, method)]
        output = os.path.join(directory, f"{case}-{method}{f'-{same.index((case, method, parameters))}' if len(same) > 1 else ''}.png")
        draw_spectra(curves, output, f"{case}, {method}, {told}")
        print(output)


def draw_spectra(curves, output, title):
    """The largest growth of all waves, and damping and relative speed of the wave of the continuum."""
    panels = [("growth", "largest |eigenvalue|"), ("wave_size", "|eigenvalue| of the wave"), ("wave_speed", "its speed / c")]
    figure, axes = plt.subplots(1, 3, figsize=(9.5, 3.0), layout="constrained")
    for a, (name, label) in zip(axes, panels):
        for k, (which, curve) in enumerate(curves.items()):
            a.plot(curve["theta"] / np.pi, curve[name], color=COLOURS[k % len(COLOURS)], linewidth=1.2, linestyle=LINES[k % len(LINES)], label=which)
        a.axhline(1, color=GREY, linewidth=0.6, zorder=0)
        low, high = a.get_ylim()
        if high - low < 1e-3:  # round-off, not growth
            a.set_ylim(0.95, 1.05)
        a.set_xlim(0, 1)
        a.set_xlabel("wave number, $k h/\\pi$")
        a.set_ylabel(label)
    axes[-1].legend(loc="lower left")
    figure.suptitle(textwrap.fill(title, 110), fontsize=9)
    save(figure, output)


def draw_convergence(studies, output, methods, title, subtitle):
    """One panel per error; the legend is in the empty panel, or on the right."""
    names = [name for name in ERRORS if any(name in s["errors"] for s in studies)]
    columns = 3 if len(names) > 4 else min(len(names), 2)
    rows = -(-len(names) // columns)
    beside = 1.3 if len(names) == rows * columns else 0  # room for a legend on the right
    figure, axes = plt.subplots(rows, columns, figsize=(3.1 * columns + beside, 2.5 * rows + 0.6), layout="constrained", squeeze=False)
    entries = {}
    for a, name in zip(axes.flat, names):
        draw_errors(a, studies, name, methods)
        entries.update(zip(*a.get_legend_handles_labels()[::-1]))
    entries = slopes_last(entries)
    for a in axes.flat[len(names):]:
        a.set_axis_off()
    if len(names) < axes.size:
        axes.flat[-1].legend(entries.values(), entries.keys(), loc="center")
    else:
        axes[0, -1].legend(entries.values(), entries.keys(), loc="upper left", bbox_to_anchor=(1.05, 1))
    figure.suptitle("\n".join(textwrap.fill(text, 44 * columns) for text in (title, subtitle) if text), fontsize=9)
    save(figure, output)


def number(value):
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def numbers(text):
    return [float(t) for t in text.split(",")]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)

    c = commands.add_parser("energies", help="kinetic, strain and total energy; of several runs the total energies")
    c.add_argument("directory", nargs="+")
    c.add_argument("-o", "--output", required=True)
    c.add_argument("--labels", help="names of the runs, separated by commas")

    c = commands.add_parser("snapshots", help="particle domains coloured by a field")
    c.add_argument("directory")
    c.add_argument("-o", "--output", required=True)
    c.add_argument("--times", type=numbers, required=True, help="t1,t2,.. (the nearest frames)")
    c.add_argument("--field", default="velocity", help="vectors by their size; components as velocity_x, stress_xy")
    c.add_argument("--limits", type=numbers, help="low,high of the colours")
    c.add_argument("--view", type=numbers, default=[-60, 20], help="azimuth,elevation in degrees (3D)")
    c.add_argument("--dim", type=int, choices=[1, 2, 3], help="where points do not tell")
    c.add_argument("--curve", help="a last panel: energies, or FILE:COLUMN[,COLUMN] such as probe_tip.csv:displacement_y")
    c.add_argument("--walls", type=numbers, default=[], help="x of vertical lines (2D)")

    c = commands.add_parser("summary", help="a Markdown table of energies, relative to the first")
    c.add_argument("directory", nargs="+")

    c = commands.add_parser("convergence", help="errors over h of `ordo verify`, one PNG a case and set of parameters")
    c.add_argument("file", help="what ordo verify --json wrote")
    c.add_argument("-o", "--output", required=True, help="a directory")

    c = commands.add_parser("path", help="stresses, history and energies over the path of `ordo drive`")
    c.add_argument("file", nargs="+", help="what ordo drive --json wrote")
    c.add_argument("-o", "--output", required=True)
    c.add_argument("--over", default="F11", help="time, or a component of F")

    o = parser.parse_args()
    try:
        run(o)
    except OSError as e:
        sys.exit(f"ordo_figures.py: {e}" + ("" if o.command == "convergence" else "; give the directory of a run"))


def run(o):
    if o.command == "energies":
        energies(o.directory, o.output, o.labels.split(",") if o.labels else None)
    elif o.command == "snapshots":
        snapshots(o.directory, o.output, o.times, o.field, View(*o.view), o.dim, o.limits, o.curve, o.walls)
    elif o.command == "convergence":
        convergence(o.file, o.output)
    elif o.command == "path":
        path(o.file, o.output, o.over)
    else:
        summary(o.directory)


def path(files, output, over):
    """Paths of `ordo drive --json`: Cauchy stresses, the scalars of the history, energies."""
    figure, axes = plt.subplots(1, 3, figsize=(12, 3.4), layout="constrained")
    for file, line in zip(files, LINES * len(files)):
        with open(file) as f:
            result = json.load(f)
        rows = result["rows"]
        place = 3 * (int(over[1]) - 1) + int(over[2]) - 1 if over != "time" else None
        x = [row["time"] if place is None else row["F"][place] for row in rows]
        label = result["law"] + (f", {os.path.splitext(os.path.basename(file))[0]}" if len(files) > 1 else "")
        stress = np.array([row["cauchy"] for row in rows])
        for c, colour in zip((0, 4, 8, 1, 5, 6), COLOURS):
            if np.any(stress[:, c] != 0):
                axes[0].plot(x, stress[:, c], line, color=colour, label=f"{'xyz'[c // 3]}{'xyz'[c % 3]}, {label}")
        for name, colour in zip([n for n in rows[0]["history"] if not n.startswith("elastic_b") and n != "dissipated"], COLOURS):
            axes[1].plot(x, [row["history"][name] for row in rows], line, color=colour, label=f"{name}, {label}")
        for name, colour in (("stored", BLUE), ("dissipated", ORANGE)):
            axes[2].plot(x, [row[name] for row in rows], line, color=colour, label=f"{name}, {label}")
    for a, title in zip(axes, ("Cauchy stress, Pa", "history", "energy per initial volume, J/m³")):
        a.set_title(title)
        a.set_xlabel("time, s" if over == "time" else over)
        if a.lines:
            a.legend()
    figure.savefig(output)
    plt.close(figure)


if __name__ == "__main__":
    main()
