#!/usr/bin/python3
"""Figures, movies and summaries of ordo's output: energies over time, particle domains coloured by a field, errors over h.

Reads history.csv, probe_*.csv, particles.pvd and the VTU files it names, and the JSON of `ordo verify`; needs numpy,
matplotlib 3.6 and, for particles, vtk; for movies in MP4 ffmpeg.
On the command line (see --help) or as a module: each function draws into axes that it is given.
"""

import argparse
import json
import os
import re
import subprocess
import sys
import textwrap
import xml.etree.ElementTree as ElementTree


def fail(what):
    """Ends the program as ordo does after bad input: one line, exit code 2."""
    print(f"ordo_figures.py: {what}", file=sys.stderr)
    raise SystemExit(2)


def fail_without(error):
    """Says how to install what an ImportError misses."""
    fail(f"{error}; apt-get install python3-numpy python3-matplotlib python3-vtk9, or pip install numpy matplotlib vtk")


try:
    import matplotlib

    matplotlib.use("Agg")

    import matplotlib.animation
    import matplotlib.pyplot as plt
    import matplotlib.ticker
    import numpy as np
    from matplotlib.collections import LineCollection, PolyCollection
except ImportError as e:
    fail_without(e)

BLUE, ORANGE, BLACK, GREY = "#2a6fb0", "#d9730d", "#222222", "#8c8c8c"
GREEN, PURPLE, RED, TEAL, BROWN, LIME = "#3c8d40", "#8a5fb5", "#c23b4e", "#1b9e9e", "#a3761b", "#9bbf30"
COLOURS = [BLACK, ORANGE, BLUE, GREEN, PURPLE, RED, TEAL, BROWN]
MARKERS = "osD^vP<X>"
UNITS = {"time": "s", "dt": "s", "displacement": "m", "position": "m", "center": "m", "velocity": "m/s", "stress": "Pa", "density": "kg/m³",
         "pressure": "Pa", "von_mises": "Pa", "energy_density": "J/m³"}
# In 1D per square metre of section, in 2D per metre of depth, in 3D.
UNITS_OF_TOTALS = {"mass": ("kg/m²", "kg/m", "kg"), "volume": ("m", "m²", "m³"), "momentum": ("kg/(m s)", "kg/s", "kg m/s"),
                   "angular_momentum": ("kg/s", "kg m/s", "kg m²/s"), "energy": ("J/m²", "J/m", "J")}
LABELS = {"velocity": "speed", "von_mises": "von Mises stress"}
# Where the energy is: column of history.csv, label, colour. Work is positive when taken from the bodies, so the sum of all columns changes
# only by the error of the method.
ENERGIES = [("kinetic_energy", "kinetic", BLUE), ("strain_energy", "strain", ORANGE), ("potential_energy", "gravity", GREEN),
            ("boundary_work", "taken by boundaries", PURPLE), ("traction_work", "taken by tractions", RED),
            ("body_force_work", "taken by body forces", TEAL), ("dissipated_energy", "dissipated", BROWN), ("damped_energy", "damped", GREY),
            ("artificial_viscosity_work", "artificial viscosity", LIME), ("stage_energy", "left between stages", BLACK)]
# The same of contacts and obstacles: the end of their columns, label, colour.
CONTACT_ENERGIES = [("_friction_work", "taken by friction", "#d05fa0"), ("_dissipation", "lost in impacts", "#6b4fd0"),
                    ("_work", "taken by obstacles", PURPLE)]
METADATA = {".png": {"Software": None}, ".pdf": {"CreationDate": None}, ".svg": {"Date": None}}  # of figures, by suffix
WRITERS = {".mp4": "ffmpeg", ".gif": "pillow"}  # of movies, by suffix
LONG, SHORT = 2.3, 0.9                          # sides of a panel, inches: the long one, the short one at least
LINES = ["-", "--", "-.", ":"]
SLOPES = {(1, 2): "orders 1 and 2", (2, 3, 4): "orders 2, 3 and 4"}  # reference lines and their names in legends
ERRORS = ["displacement", "velocity", "stress", "density", "velocity_grid", "value", "value_inside"]
# Dimensions of VTK's cell types; the corners of a triangle as those of a quad, of a tetrahedron as those of a hexahedron.
DIMS = {1: 0, 3: 1, 5: 2, 9: 2, 10: 3, 12: 3}
POINTS_OF_ONE_CELL = 2  # VTK_POLY_VERTEX
SIMPLEX_CORNERS = {5: [0, 1, 2, 2], 10: [0, 1, 2, 2, 3, 3, 3, 3]}
# The faces of a VTK hexahedron, counter-clockwise when seen from outside.
FACES = np.array([[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]])

plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "axes.titlesize": 9,
                     "axes.formatter.limits": (-3, 4), "axes.formatter.use_mathtext": True,
                     "legend.frameon": False, "legend.fontsize": 8, "savefig.dpi": 100})


# ---- reading ---------------------------------------------------------------------------------------------------------

def read_csv(file):
    """The columns of history.csv or of a probe by name: table["time"], table["kinetic_energy"], .."""
    return np.atleast_1d(np.genfromtxt(file, delimiter=",", names=True))


def read_history(directory):
    return read_csv(os.path.join(directory, "history.csv"))


def run_dim(directory):
    """1, 2 or 3, of the resolved case; None where that is missing."""
    try:
        with open(os.path.join(directory, "case.toml"), encoding="utf-8") as stream:
            found = re.search(r"^dim = ([123])$", stream.read(), re.MULTILINE)
    except FileNotFoundError:
        return None
    return int(found[1]) if found else None


def read_frames(directory):
    """[(time, VTU file)] of particles.pvd."""
    file = os.path.join(directory, "particles.pvd")
    try:
        frames = [(float(s.get("timestep")), os.path.join(directory, s.get("file"))) for s in ElementTree.parse(file).getroot().iter("DataSet")]
    except ElementTree.ParseError as e:
        fail(f"{file}: {e}")
    return frames or fail(f"{file}: names no frames")


class Frame:
    """The particles of one VTU file in the order of their id.

    x: (n, 3) positions; corners: (n, k, 3) corners of the domains, k = 1 for points; fields: arrays by name;
    dim: 1, 2 or 3, None where points do not tell.
    """

    def __init__(self, file):
        try:
            from vtkmodules.util.numpy_support import vtk_to_numpy
            from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader
        except ImportError as e:
            fail_without(e)
        reader = vtkXMLUnstructuredGridReader()
        reader.SetFileName(file)
        reader.Update()
        grid = reader.GetOutput()
        n = grid.GetNumberOfCells()
        if n == 0:
            fail(f"{file}: holds no particles")
        points = vtk_to_numpy(grid.GetPoints().GetData())
        types = vtk_to_numpy(grid.GetCellTypesArray())
        ids, starts = vtk_to_numpy(grid.GetCells().GetConnectivityArray()), vtk_to_numpy(grid.GetCells().GetOffsetsArray())
        if np.all(types == POINTS_OF_ONE_CELL):  # output.particles = "points"
            types, ids, starts = np.ones(len(ids), dtype=int), ids, np.arange(len(ids) + 1)
        self.dim = max(DIMS[t] for t in types) or None
        width = 2 ** (self.dim or 0)
        self.corners = np.empty((len(types), width, 3))
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
        fail(f"there is no field {name}; this frame has {there} (see [output] fields)")


def nearest_frames(directory, times):
    frames = read_frames(directory)
    return [Frame(min(frames, key=lambda f: abs(f[0] - t))[1]) for t in times]


def read_studies(file):
    """The studies of `ordo verify --json`: case, method, parameters, h of the failed meshes, errors as name: [(h, error)]."""
    try:
        with open(file, encoding="utf-8") as stream:
            return [read_study(s) for s in json.load(stream)]
    except (ValueError, KeyError, TypeError, AttributeError) as e:
        fail(f"{file}: not what ordo verify --json writes ({type(e).__name__}: {e})")


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


def suffix_of(output, suffixes):
    """The suffix of a file to write, one of those given, in a folder that is there."""
    suffix = os.path.splitext(output)[1].lower()
    if suffix not in suffixes:
        fail(f"-o {output}: the name must end with {' or '.join(suffixes)}")
    if not os.path.isdir(os.path.dirname(output) or "."):
        fail(f"-o {output}: there is no directory {os.path.dirname(output)}")
    return suffix


def save(figure, output):
    """Saves without the versions and dates that matplotlib would write, so equal drawings give equal bytes."""
    figure.savefig(output, metadata=METADATA[suffix_of(output, METADATA)])
    plt.close(figure)


# ---- drawing ---------------------------------------------------------------------------------------------------------

def unit_of(name, dim=None):
    """The SI unit of a field, component or column of a run in 1D, 2D or 3D; empty if unknown."""
    base, _, end = name.rpartition("_")
    for n in (name, base):
        if n in UNITS:
            return UNITS[n]
        if n in UNITS_OF_TOTALS:
            return UNITS_OF_TOTALS[n][(dim or 3) - 1]
    return UNITS_OF_TOTALS["energy"][(dim or 3) - 1] if end in ("energy", "work") else ""


def field_label(name, dim=None):
    text = LABELS.get(name, name.replace("_", " "))
    if name == "velocity" and dim == 1:  # drawn with its sign
        text = name
    return ", ".join(filter(None, [text, unit_of(name, dim)]))


def energy_curves(history):
    """Energies and work over time as (label, colour, values), the last the sum of all columns of ENERGIES and of contacts.

    Kinetic and strain energy always, others where they are not zero; of gravity the change since the start.
    """
    there = [row for row in ENERGIES if row[0] in history.dtype.names]
    curves = [(label, colour, history[c] - (history[c][0] if c == "potential_energy" else 0)) for c, label, colour in there]
    names = [name[:-len("_friction_work")] for name in history.dtype.names if name.endswith("_friction_work")]
    for end, label, colour in CONTACT_ENERGIES:
        columns = [name + end for name in names if name + end in history.dtype.names]
        if columns:
            curves.append((label, colour, sum(history[column] for column in columns)))
    largest = max(np.abs(values).max() for _, _, values in curves)
    drawn = [c for k, c in enumerate(curves) if k < 2 or np.abs(c[2]).max() > 1e-9 * largest]
    return drawn + [("sum", BLACK, sum(values for _, _, values in curves))]


def draw_energies(axes, directory):
    """Where the energy is over time: kinetic, strain, gravity, work taken, and their sum."""
    history = read_history(directory)
    for label, colour, values in energy_curves(history):
        axes.plot(history["time"], values, color=colour, label=label, linewidth=1.2)
    finish_time_axes(axes, f"energy, {unit_of('energy', run_dim(directory))}")


def draw_total_energies(axes, directories, labels):
    """The sums of energies and work of several runs, as in Tran et al. (2019) Figs. 54 and 58."""
    for k, (directory, label) in enumerate(zip(directories, labels)):
        history = read_history(directory)
        axes.plot(history["time"], energy_curves(history)[-1][2], color=COLOURS[k % len(COLOURS)], label=label,
                  linestyle=LINES[k // len(COLOURS) % len(LINES)], linewidth=1.2)
    units = dict.fromkeys(unit_of("energy", run_dim(d)) for d in directories)
    finish_time_axes(axes, f"sum of energies and work, {' or '.join(units)}")


def draw_curves(axes, directory, columns):
    """Columns of a CSV file over time: columns is FILE:NAME,NAME."""
    file, _, names = columns.partition(":")
    names, dim = names.split(","), run_dim(directory)
    colours = [BLUE, ORANGE, BLACK, *COLOURS[3:]]
    table = read_csv(os.path.join(directory, file))
    for k, name in enumerate(names):
        if name not in table.dtype.names:
            fail(f"{file} has no column {name or '(FILE:COLUMN)'}; it has {', '.join(table.dtype.names)}")
        axes.plot(table["time"], table[name], color=colours[k % len(colours)], label=field_label(name, dim))
    finish_time_axes(axes, field_label(names[0], dim) if len(names) == 1 else "")


def finish_time_axes(axes, label):
    """A label, and a legend above several curves."""
    axes.set_xlabel("time, s")
    axes.set_ylabel(label)
    axes.margins(x=0)
    labels = axes.get_legend_handles_labels()[1]
    if len(labels) > 1:
        columns = max(1, 70 // (10 + max(map(len, labels))))
        axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.04), ncol=columns, columnspacing=1.2, handlelength=1.5)


class View:
    """Parallel projection of 3D points; angles in degrees, z up."""

    def __init__(self, azimuth=-60.0, elevation=20.0):
        a, e = np.radians(azimuth), np.radians(elevation)
        self.towards = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])  # from the scene to the eye
        self.right = np.array([-np.sin(a), np.cos(a), 0.0])
        self.up = np.cross(self.towards, self.right)

    def plane(self, points):
        return np.stack([points @ self.right, points @ self.up], axis=-1)

    def edges(self, low, high):
        """The edges of a box that no front of it hides, as {axis: [(two ends, whether on the outline)]}."""
        found = {}
        for axis in range(3):
            others = [d for d in range(3) if d != axis]
            for sides in ((0, 0), (0, 1), (1, 0), (1, 1)):
                ends = np.array([low, high])
                ends[:, others] = [(low, high)[side][d] for side, d in zip(sides, others)]
                fronts = sum((2 * side - 1) * self.towards[d] > 1e-9 for side, d in zip(sides, others))
                if fronts < 2:
                    found.setdefault(axis, []).append((ends, fronts == 1))
        return found


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


class Scene:
    """What the frames of a figure share: dimension, view, field, limits of space and of the field."""

    def __init__(self, frames, field="velocity", view=None, dim=None, limits=None, walls=()):
        """Reads all frames once; dim where points do not tell."""
        self.field, self.view, self.walls, self.dim = field, view or View(), walls, None
        spaces, values = [], []
        for frame in frames:
            if not self.dim:
                self.dim = frame.dim or dim or max(np.flatnonzero(np.ptp(frame.x, axis=0) > 0), default=0) + 1
            points, value = frame.corners.reshape(-1, 3), self.values(frame)
            points, value = points[np.isfinite(points).all(axis=1)], value[np.isfinite(value)]  # a failed run may end with others
            spaces += [points.min(axis=0), points.max(axis=0)] if len(points) else []
            values += [value.min(), value.max()] if len(value) else []
        self.low, self.high = np.min(spaces, axis=0), np.max(spaces, axis=0)
        low, high = limits or (min(values, default=0), max(values, default=1))
        self.norm = matplotlib.colors.Normalize(low, high if high > low else low + 1)

    def values(self, frame):
        """The field, in 1D with the sign of vectors."""
        along_x = self.dim == 1 and frame.fields.get(self.field, np.empty(0)).ndim == 2
        return frame.fields[self.field][:, 0] if along_x else frame.scalar(self.field)

    def label(self):
        return field_label(self.field, self.dim)

    def plane(self):
        """Lower and upper corner of a panel, not too narrow for its ticks and title."""
        low, high = self.low[:2].copy(), self.high[:2].copy()
        low[0], high[0] = min([low[0], *self.walls]), max([high[0], *self.walls])
        if self.dim == 3:
            corners = [self.view.plane(ends) for edges in self.view.edges(self.low, self.high).values() for ends, _ in edges]
            low, high = np.min(corners, axis=(0, 1)), np.max(corners, axis=(0, 1))
        middle, half = (low + high) / 2, (high - low) * (1 / 2 + 0.06)
        half = np.maximum(half, half.max() * SHORT / LONG or 1)
        return middle - half, middle + half

    def panel(self):
        """Width and height of a panel, inches."""
        if self.dim == 1:
            return np.array([3.6, 2.4])
        low, high = self.plane()
        return LONG * (high - low) / (high - low).max()


def draw_particles(axes, frame, scene):
    """The particle domains of a frame (dots for points); 3D by a projection."""
    colours = plt.get_cmap("viridis")
    values = scene.values(frame)
    if scene.dim == 3:
        if frame.has_domains:
            polygons, v, shade = projected_polygons(frame, values, scene.view)
            rgba = colours(scene.norm(v))
            rgba[:, :3] *= shade[:, None]
            axes.add_collection(PolyCollection(polygons, facecolors=rgba, edgecolors=rgba, linewidths=0.2))
        else:
            order = np.argsort(frame.x @ scene.view.towards)
            p = scene.view.plane(frame.x[order])
            axes.scatter(p[:, 0], p[:, 1], s=6, c=colours(scene.norm(values[order])), linewidths=0)
    elif frame.has_domains:
        axes.add_collection(PolyCollection(frame.corners[:, :, :2], facecolors=colours(scene.norm(values)), edgecolors="white", linewidths=0.15))
    else:
        axes.scatter(frame.x[:, 0], frame.x[:, 1], s=8, c=colours(scene.norm(values)), linewidths=0)


def round_numbers(inches):
    """A locator of ticks at round numbers, as many as have room."""
    return matplotlib.ticker.MaxNLocator(max(1, min(5, int(inches / 0.38))), steps=[1, 2, 2.5, 5, 10])


def draw_box(axes, scene):
    """The box around all frames behind the particles, with the scale of each axis on an edge of the outline."""
    lower, upper = scene.plane()
    inch = (upper - lower).max() / LONG
    centre = scene.view.plane((scene.low + scene.high) / 2)
    for axis, edges in scene.view.edges(scene.low, scene.high).items():
        lines = [(scene.view.plane(ends), outer) for ends, outer in edges]
        axes.add_collection(LineCollection([line for line, _ in lines], colors="#bbbbbb", linewidths=0.6, zorder=0))
        along = lines[0][0][1] - lines[0][0][0]
        length = np.linalg.norm(along)
        if length < 0.2 * inch:  # seen from its end
            continue
        first = 0 if axis == 2 else 1  # z on the left, x and y below
        start, end = min((line for line, outer in lines if outer), key=lambda line: (round(line[:, first].sum() / inch, 6), line[:, 1 - first].sum()))
        out = np.array([along[1], -along[0]]) / length
        out *= np.sign(out @ ((start + end) / 2 - centre))
        place = {"fontsize": 7, "textcoords": "offset points", "annotation_clip": False,
                 "ha": "left" if out[0] > 0.1 else "right" if out[0] < -0.1 else "center",
                 "va": "bottom" if out[1] > 0.5 else "top" if out[1] < -0.5 else "center"}
        texts = []
        for t in round_numbers(length / inch).tick_values(scene.low[axis], scene.high[axis]):
            if scene.low[axis] <= t <= scene.high[axis]:
                p = start + (t - scene.low[axis]) / (scene.high[axis] - scene.low[axis]) * (end - start)
                axes.plot(*np.transpose([p, p + 0.03 * inch * out]), color="#666666", linewidth=0.6, clip_on=False)
                texts.append(axes.annotate(f"{t + 0.0:g}", p, 4 * out, **place).get_text())
        far = 8 + (4 * max(map(len, texts), default=0) if abs(out[0]) > 0.5 else 8)  # points, beyond the numbers
        axes.annotate(f"{'xyz'[axis]}, m", (start + end) / 2, far * out, **place)


def draw_frame(axes, frame, scene):
    """One frame in 2D or 3D with its axes."""
    draw_particles(axes, frame, scene)
    lower, upper = scene.plane()
    axes.set_xlim(lower[0], upper[0])
    axes.set_ylim(lower[1], upper[1])
    axes.set_aspect("equal")
    if scene.dim == 3:
        draw_box(axes, scene)
        axes.set_axis_off()
        return
    for wall in scene.walls:
        axes.axvline(wall, color="#666666", linewidth=1.5, zorder=0)
    width, height = scene.panel()
    axes.xaxis.set_major_locator(round_numbers(width))
    axes.yaxis.set_major_locator(round_numbers(height))
    axes.set_xlabel("x, m")
    axes.set_ylabel("y, m")


def draw_profile(axes, frame, scene, **style):
    """The field of a frame in 1D over x."""
    order = np.argsort(frame.x[:, 0])
    axes.plot(frame.x[order, 0], scene.values(frame)[order], ".-", markersize=3, linewidth=0.8, **style)
    axes.set_xlabel("x, m")
    axes.set_ylabel(scene.label())


def draw_frames(axes, frames, scene):
    """Frames of a scene, one to each axes; 1D: all in axes[0]. Returns what a colour bar needs, None in 1D."""
    if scene.dim == 1:
        for frame, colour in zip(frames, plt.get_cmap("viridis")(np.linspace(0.0, 0.85, len(frames)))):
            draw_profile(axes[0], frame, scene, color=colour, label=f"t = {frame.time:.3g} s")
        axes[0].legend(loc="lower right", bbox_to_anchor=(1.02, 1.04), ncol=2)
        return None
    for a, frame in zip(axes, frames):
        draw_frame(a, frame, scene)
        a.set_title(f"t = {frame.time:.3g} s")
    for a in axes[1:]:
        a.set_ylabel("")
        a.tick_params(labelleft=False)
    return matplotlib.cm.ScalarMappable(scene.norm, "viridis")


def draw_snapshots(axes, directory, times, field="velocity", view=None, dim=None, limits=None, walls=()):
    """Frames nearest to the times, one to each axes, with one colour scale. 1D: the field over x, all in axes[0].

    Returns what a colour bar needs, None in 1D.
    """
    frames = nearest_frames(directory, times)
    return draw_frames(axes, frames, Scene(frames, field, view, dim or run_dim(directory), limits, walls))


def add_colour_bar(figure, mapped, axes, label, width):
    """Below panels of a width in inches; beside narrow ones."""
    if width < 2:
        bar = figure.colorbar(mapped, ax=axes, aspect=25, pad=0.1)
        bar.set_label(label)
    else:
        bar = figure.colorbar(mapped, ax=axes, orientation="horizontal", shrink=min(1, 2.4 / width), aspect=30, pad=0.04)
        bar.set_label(label, labelpad=1)
    bar.locator = matplotlib.ticker.MaxNLocator(4)
    bar.update_ticks()


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
        if not ticks or np.log(ticks[-1] / h) > (0.025 * (len(f"{h:.3g}") + len(f"{ticks[-1]:.3g}")) + 0.05) * np.log(hs[-1] / hs[0]):
            ticks.append(h)
    axes.set_xticks(ticks, [f"{h:.3g}" for h in ticks])
    axes.xaxis.set_minor_locator(matplotlib.ticker.NullLocator())
    label_log_axis(axes.yaxis, *axes.get_ylim())
    axes.set_xlabel("h, m")
    axes.set_ylabel(error_label(name))


def label_log_axis(axis, low, high):
    """Ticks at powers of ten; on about a decade also between them."""
    is_short = np.log10(high / low) < 1.5
    axis.set_major_locator(matplotlib.ticker.LogLocator(10, subs=(1, 2, 5) if is_short else (1,), numticks=9))
    axis.set_minor_formatter(matplotlib.ticker.NullFormatter())
    if is_short and 1e-3 < low < 1e3:
        axis.set_major_formatter("{x:g}")
    elif is_short:
        axis.set_major_formatter(matplotlib.ticker.LogFormatterSciNotation(labelOnlyBase=False, minor_thresholds=(np.inf, np.inf)))


def draw_slopes(axes, curves):
    """Lines of known order through one point, below all curves, over the coarser half of the meshes."""
    low, high = min(c[0, 0] for c in curves), max(c[0, -1] for c in curves)
    if low == high:
        return
    h = np.geomspace((low * high) ** 0.5, high, 20)
    below = np.min([np.interp(np.log(h), *np.log(c)) for c in curves], axis=0)
    steepest = max(np.log(c[1, -1] / c[1, 0]) / np.log(c[0, -1] / c[0, 0]) for c in curves if c[0, -1] > c[0, 0])
    orders, label = list(SLOPES.items())[int(steepest > 2.6)]
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
    labels = labels or [os.path.basename(os.path.normpath(d)) for d in directories]
    if len(labels) != len(directories):
        fail(f"--labels: {len(labels)} names for {len(directories)} runs")
    figure, axes = plt.subplots(figsize=(5, 3.6), layout="constrained")
    if len(directories) == 1:
        draw_energies(axes, directories[0])
    else:
        draw_total_energies(axes, directories, labels)
    save(figure, output)


def snapshots(directory, output, times, field="velocity", view=None, dim=None, limits=None, curve=None, walls=()):
    """Snapshots in a row; with `curve` ("energies" or FILE:COLUMN) a last panel over time."""
    frames = nearest_frames(directory, times)
    scene = Scene(frames, field, view, dim or run_dim(directory), limits, walls)
    panels = 1 if scene.dim == 1 else len(times)
    width, height = scene.panel()
    ratios = [width] * panels + ([3.0] if curve else [])
    height = max(height, 1.8) if curve else height
    figure, axes = plt.subplots(1, len(ratios), figsize=(sum(ratios) + 1, height + 1), layout="constrained", squeeze=False,
                                gridspec_kw={"width_ratios": ratios})
    axes = list(axes[0])
    mapped = draw_frames(axes[:panels], frames, scene)
    if mapped:
        add_colour_bar(figure, mapped, axes[:panels], scene.label(), width * panels)
    if curve == "energies":
        draw_energies(axes[-1], directory)
    elif curve:
        draw_curves(axes[-1], directory, curve)
    give_size(figure, axes[:panels], np.array([width, height]), sum(ratios) / width)
    save(figure, output)


def give_size(figure, panels, size, columns=1):
    """Changes a figure so that each panel has a size in inches, whatever room labels take; columns: of this width, side by side.

    The layout is found without equal lengths along the axes, for it takes panels that these make smaller for their labels' room.
    """
    aspects = [a.get_aspect() for a in panels]
    for a in panels:
        a.set_aspect("auto")
    figure.set_size_inches(figure.get_size_inches() + 2)  # a layout without room for all labels is not applied
    for _ in range(4):
        figure.draw_without_rendering()
        lacking = size - panels[0].get_position().size * figure.get_size_inches()
        figure.set_size_inches(figure.get_size_inches() + lacking * [columns, 1])
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # from now on nothing moves
    for a, aspect in zip(panels, aspects):
        a.set_aspect(aspect)


def movie_writer(output, fps):
    """The writer of matplotlib for the suffix of a file."""
    suffix = suffix_of(output, WRITERS)
    if not matplotlib.animation.writers.is_available(WRITERS[suffix]):
        fail(f"-o {output}: {suffix} needs {WRITERS[suffix]}, which is not there; apt-get install ffmpeg, or write a .gif")
    return matplotlib.animation.writers[WRITERS[suffix]](fps=fps)


def movie(directory, output, field="velocity", view=None, dim=None, limits=None, walls=(), fps=10, every=1):
    """All frames, or each of `every`, as a movie; axes and colours have the same limits in each."""
    writer = movie_writer(output, fps)
    times, files = zip(*read_frames(directory)[::every])
    scene = Scene(map(Frame, files), field, view, dim or run_dim(directory), limits, walls)
    steps = np.diff(times)
    digits = max(0, 1 - int(np.floor(np.log10(min(steps[steps > 0], default=1)))))  # so that times of frames differ
    size = 1.8 * scene.panel()
    figure, axes = plt.subplots(figsize=size + 1, layout="constrained")
    if scene.dim > 1:
        add_colour_bar(figure, matplotlib.cm.ScalarMappable(scene.norm, "viridis"), axes, scene.label(), size[0])
    draw_still(axes, Frame(files[0]), scene, digits)
    give_size(figure, [axes], size)
    try:
        with writer.saving(figure, output, 120):
            for file in files:
                axes.clear()
                draw_still(axes, Frame(file), scene, digits)
                writer.grab_frame()
    except subprocess.CalledProcessError as e:
        fail(f"-o {output}: ffmpeg ends with exit code {e.returncode}; write a .gif")
    plt.close(figure)


def draw_still(axes, frame, scene, digits):
    """One picture of a movie."""
    if scene.dim == 1:
        draw_profile(axes, frame, scene, color=BLUE)
        low, high = scene.norm.vmin, scene.norm.vmax
        axes.set_xlim(scene.low[0], scene.high[0])
        axes.set_ylim(low - 0.05 * (high - low), high + 0.05 * (high - low))
    else:
        draw_frame(axes, frame, scene)
    axes.set_title(f"t = {frame.time:.{digits}f} s")


def summary(directories, output=sys.stdout):
    """One Markdown row per run: energies relative to the initial total energy."""
    output.write("| run | time reached, s | steps | total energy at the end | largest total energy | largest strain energy |\n|---|---|---|---|---|---|\n")
    for directory in directories:
        h = read_history(directory)
        start = h["total_energy"][0]
        rows = [h["total_energy"][-1], h["total_energy"].max(), h["strain_energy"].max()]
        text = [f"{v / start:.4f}" if start > 0 else f"{v:.4g} {unit_of('energy', run_dim(directory))}" for v in rows]
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


def pair(text):
    first, second = numbers(text)
    return first, second


def at_least_one(text):
    if int(text) < 1:
        raise ValueError
    return int(text)


def add_options_of_frames(command):
    command.add_argument("directory")
    command.add_argument("-o", "--output", required=True)
    command.add_argument("--field", default="velocity", help="vectors by their size; components as velocity_x, stress_xy")
    command.add_argument("--limits", type=pair, help="low,high of the colours")
    command.add_argument("--view", type=pair, default=(-60, 20), help="azimuth,elevation in degrees (3D)")
    command.add_argument("--dim", type=int, choices=[1, 2, 3], help="where neither particles nor case.toml tell")
    command.add_argument("--walls", type=numbers, default=[], help="x of vertical lines (2D)")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)

    c = commands.add_parser("energies", help="kinetic, strain and gravity's energy, work taken, and their sum; of several runs the sums")
    c.add_argument("directory", nargs="+")
    c.add_argument("-o", "--output", required=True)
    c.add_argument("--labels", help="names of the runs, separated by commas")

    c = commands.add_parser("snapshots", help="particle domains coloured by a field")
    add_options_of_frames(c)
    c.add_argument("--times", type=numbers, required=True, help="t1,t2,.. (the nearest frames)")
    c.add_argument("--curve", help="a last panel: energies, or FILE:COLUMN[,COLUMN] such as probe_tip.csv:displacement_y")

    c = commands.add_parser("movie", help="the same over time, as MP4 (needs ffmpeg) or GIF")
    add_options_of_frames(c)
    c.add_argument("--fps", type=at_least_one, default=10, help="frames a second")
    c.add_argument("--every", type=at_least_one, default=1, help="only each n-th frame")

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
        fail(f"{e}" + ("" if o.command == "convergence" else "; give the directory of a run"))


def run(o):
    if o.command == "energies":
        energies(o.directory, o.output, o.labels.split(",") if o.labels else None)
    elif o.command == "snapshots":
        snapshots(o.directory, o.output, o.times, o.field, View(*o.view), o.dim, o.limits, o.curve, o.walls)
    elif o.command == "movie":
        movie(o.directory, o.output, o.field, View(*o.view), o.dim, o.limits, o.walls, o.fps, o.every)
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
