"""Rigid obstacles and walls at an angle, as triangles with a place and a turn in each frame."""

from pathlib import Path

import numpy as np

from .._tables import history

SECTORS = 8   # light and dark by turns, so that a turn of a round obstacle is seen
ROUND = 64    # sides of a circle
FIGURES = 6   # digits of a coordinate


def shapes_of(case, directory, times):
    """For each obstacle: triangles (m, 3, 3), m, at the start; shades (m,); the shift, m, and the turn, a quaternion, in each frame."""
    dim = case["grid"]["dim"]
    if dim == 1:
        return []
    table = history(directory) if (directory / "history.csv").is_file() else {}
    walls = [wall for wall in case.get("boundary", []) if "normal" in wall and "value" not in wall]
    found = []
    for row in [*case.get("obstacle", []), *walls]:
        triangles = triangles_of(row, dim, case["grid"], directory)
        if triangles is None:
            continue
        shifts, turns = motion_of(row.get("name", ""), table, times)
        centre = centre_of(row, triangles, table)
        found.append({"triangles": rounded(triangles - centre), "shades": shades_of(triangles - centre, row), "places": rounded(centre + shifts),
                      "turns": rounded(turns)})
    return found


def rounded(values):
    return [float(f"{v:.{FIGURES}g}") for v in np.ravel(values)]


def along(values):
    """Three numbers."""
    return np.array([*values, 0.0, 0.0, 0.0][:3], float)


def triangles_of(row, dim, grid, directory):
    shape = row.get("shape", "half-space")
    if shape == "half-space":
        return half_space(row, dim, grid)
    if shape == "box":
        return box(along(row["lower"]), along(row["upper"]), dim)
    if shape == "stl":
        return stl(directory / row["file"], row.get("scale", 1.0))
    centre = along(row["center"])
    if dim == 2:
        return disk(row["radius"]) + centre
    if shape == "ball":
        return ball(row["radius"]) + centre
    return cylinder(row["radius"], row["height"])[..., {"x": [2, 0, 1], "y": [1, 2, 0], "z": [0, 1, 2]}[row.get("axis", "z")]] + centre


def quads(points):
    """The two triangles of each quad (.., 4, 3)."""
    points = np.asarray(points, float).reshape(-1, 4, 3)
    return points[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3)


def box(low, high, dim):
    corner = np.array([[(high if k >> d & 1 else low)[d] for d in range(3)] for k in range(8)])
    faces = [[0, 1, 3, 2]] if dim == 2 else [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
    return quads(corner[faces])


def half_space(row, dim, grid):
    """The part of its face that may be seen from the grid, with some thickness."""
    size = along(grid["size"])
    normal = along(row["normal"]) / np.linalg.norm(row["normal"])
    reach, deep = 0.75 * np.linalg.norm(size), 0.02 * np.linalg.norm(size)
    middle = along(grid.get("origin", [0.0])) + size / 2
    middle = middle - normal * ((middle - along(row["point"])) @ normal)
    first = np.cross(normal, [0, 0, 1] if dim == 2 else np.eye(3)[np.argmin(np.abs(normal))])
    first /= np.linalg.norm(first)
    axes = np.stack([first, normal, np.cross(first, normal)])
    flat = box(np.array([-reach, -deep, -reach if dim == 3 else 0.0]), np.array([reach, 0.0, reach if dim == 3 else 0.0]), dim)
    return middle + flat @ axes


def circle(radius):
    angle = np.linspace(0, 2 * np.pi, ROUND + 1)
    return radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)


def disk(radius):
    rim = circle(radius)
    return np.stack([np.zeros_like(rim[1:]), rim[:-1], rim[1:]], axis=1)


def swept(rings):
    """Between each two rings of points, (rings, points, 3)."""
    return quads(np.stack([rings[:-1, :-1], rings[:-1, 1:], rings[1:, 1:], rings[1:, :-1]], axis=2))


def ball(radius):
    up = np.linspace(-np.pi / 2, np.pi / 2, ROUND // 2 + 1)
    return swept(np.stack([circle(radius) * np.cos(u) + [0, 0, radius * np.sin(u)] for u in up]))


def cylinder(radius, height):
    ends = np.array([0, 0, height / 2])
    return np.concatenate([disk(radius) - ends, disk(radius) + ends, swept(np.stack([circle(radius) - ends, circle(radius) + ends]))])


def stl(file, scale):
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOGeometry import vtkSTLReader

    if not Path(file).is_file():
        return None
    reader = vtkSTLReader()
    reader.SetFileName(str(file))
    reader.Update()
    mesh = reader.GetOutput()
    return scale * vtk_to_numpy(mesh.GetPoints().GetData())[vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()).reshape(-1, 3)].astype(float)


def centre_of(row, triangles, table):
    """About which it turns: the first place in history.csv, else the middle."""
    name = row.get("name", "")
    if f"{name}_rotation_x" in table and len(table["time"]):
        return np.array([table[f"{name}_{a}"][0] for a in "xyz"])
    return (triangles.min(axis=(0, 1)) + triangles.max(axis=(0, 1))) / 2


def shades_of(triangles, row):
    """0 or 1 by sectors about the axis of round obstacles."""
    if row.get("shape") not in ("ball", "cylinder"):
        return [0] * len(triangles)
    u, v = {"x": (1, 2), "y": (2, 0)}.get(row.get("axis", "z"), (0, 1))
    middle = triangles.mean(axis=1)
    return (np.floor(np.arctan2(middle[:, v], middle[:, u]) * SECTORS / (2 * np.pi)).astype(int) % 2).tolist()


def motion_of(name, table, times):
    """Shift (frames, 3), m, from the columns of history.csv, and turn (frames, 4), its angular velocity summed over the rows."""
    if f"{name}_rotation_x" not in table or len(table["time"]) == 0:
        return np.zeros((len(times), 3)), np.tile([0.0, 0.0, 0.0, 1.0], (len(times), 1))
    time = table["time"]
    place = np.stack([table[f"{name}_{a}"] for a in "xyz"], axis=1)
    shifts = np.stack([np.interp(times, time, place[:, d] - place[0, d]) for d in range(3)], axis=1)
    spin = np.stack([table[f"{name}_rotation_{a}"] for a in "xyz"], axis=1)
    turn, turns = np.array([0.0, 0.0, 0.0, 1.0]), [np.array([0.0, 0.0, 0.0, 1.0])]
    for dt, rate in zip(np.diff(time), spin[1:]):  # that of the middle of the step
        angle = np.linalg.norm(rate) * dt
        if angle > 0:
            turn = product(np.append(np.sin(angle / 2) * rate / np.linalg.norm(rate), np.cos(angle / 2)), turn)
        turns.append(turn)
    turns = np.array(turns)
    return shifts, turns[np.clip(np.searchsorted(time, times - 1e-12 * max(1.0, abs(time[-1]))), 0, len(time) - 1)]


def product(p, q):
    """Of quaternions x, y, z, w: the turn q, then p."""
    v, w = p[:3], p[3]
    return np.append(w * q[:3] + q[3] * v + np.cross(v, q[:3]), w * q[3] - v @ q[:3])
