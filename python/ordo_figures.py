#!/usr/bin/python3
"""Figures and summaries of ordo's output: energies over time, particle domains coloured by a field.

Reads history.csv, probe_*.csv, particles.pvd and the VTU files it names; needs numpy, matplotlib and vtk.
On the command line (see --help) or as a module: each function draws into axes that it is given.
"""

import argparse
import os
import sys
import xml.etree.ElementTree as ElementTree

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402
import matplotlib.ticker  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.collections import PolyCollection  # noqa: E402

BLUE, ORANGE, BLACK = "#2a6fb0", "#d9730d", "#222222"
UNITS = {"displacement": "m", "position": "m", "velocity": "m/s", "stress": "Pa", "density": "kg/m³", "mass": "kg",
         "volume": "m³", "pressure": "Pa", "von_mises": "Pa", "energy_density": "J/m³"}
LABELS = {"velocity": "speed", "von_mises": "von Mises stress"}
# The faces of a VTK hexahedron, seen from outside counter-clockwise.
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
        self.corners = points[vtk_to_numpy(grid.GetCells().GetConnectivityArray())].reshape(n, -1, 3)
        self.has_domains = self.corners.shape[1] > 1
        data = grid.GetCellData() if self.has_domains else grid.GetPointData()
        self.fields = {data.GetArrayName(k): vtk_to_numpy(data.GetArray(k)) for k in range(data.GetNumberOfArrays())}
        self.x = self.fields["position"] if self.has_domains else points
        self.dim = {2: 1, 4: 2, 8: 3}.get(self.corners.shape[1])
        self.time = vtk_to_numpy(grid.GetFieldData().GetArray("TimeValue"))[0]

    def scalar(self, name):
        """A field as one number a particle: the size of a vector; stress_xy or velocity_x name a component."""
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
    for directory, label, colour in zip(directories, labels, [BLACK, ORANGE, BLUE, "#3c8d40", "#8a5fb5"]):
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


# ---- whole figures ---------------------------------------------------------------------------------------------------

def energies(directories, output, labels=None):
    figure, axes = plt.subplots(figsize=(5, 3.4), layout="constrained")
    if len(directories) == 1:
        draw_energies(axes, directories[0])
    else:
        draw_total_energies(axes, directories, labels or [os.path.basename(os.path.normpath(d)) for d in directories])
    figure.savefig(output)
    plt.close(figure)


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
    figure.savefig(output)
    plt.close(figure)


def summary(directories, output=sys.stdout):
    """A Markdown row a run: energies relative to the first total energy."""
    output.write("| run | time reached, s | steps | total energy at the end | largest total energy | largest strain energy |\n|---|---|---|---|---|---|\n")
    for directory in directories:
        h = read_history(directory)
        start = h["total_energy"][0]
        rows = [h["total_energy"][-1], h["total_energy"].max(), h["strain_energy"].max()]
        text = [f"{v / start:.4f}" if start > 0 else f"{v:.4g} J" for v in rows]
        name = os.path.basename(os.path.normpath(directory))
        output.write(f"| {name} | {h['time'][-1]:.4g} | {len(h) - 1} | {' | '.join(text)} |\n")


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

    o = parser.parse_args()
    try:
        run(o)
    except OSError as e:
        sys.exit(f"ordo_figures.py: {e}; give the directory of a run")


def run(o):
    if o.command == "energies":
        energies(o.directory, o.output, o.labels.split(",") if o.labels else None)
    elif o.command == "snapshots":
        snapshots(o.directory, o.output, o.times, o.field, View(*o.view), o.dim, o.limits, o.curve, o.walls)
    else:
        summary(o.directory)


if __name__ == "__main__":
    main()
