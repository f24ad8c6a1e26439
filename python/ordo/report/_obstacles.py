"""Rigid obstacles and walls at an angle, as triangles with a place and a turn in each frame."""

from pathlib import Path

import numpy as np

from .._errors import InputError

SECTORS = 8   # light and dark by turns, so that a turn of a round obstacle is seen
ROUND = 64    # sides of a circle
MOST = 20_000 # triangles of a surface


def shapes_of(case, directory, table, times):
    """For each obstacle: triangles (m, 3, 3), m, about its centre; shades (m,); the place of the centre, m, and the turn, a quaternion, in each
    frame. And notes on what is not drawn. table: the columns of history.csv."""
    dim, found, notes = case["grid"]["dim"], [], []
    if dim == 1:
        return found, notes
    walls = [wall for wall in case.get("boundary", []) if "normal" in wall and "value" not in wall]
    for row in [*case.get("obstacle", []), *walls]:
        name = row.get("name", "")
        try:
            triangles = triangles_of(row, dim, case["grid"], directory)
        except InputError as e:
            notes.append(f"The obstacle {name} is not drawn: {e}.")
            continue
        start = centre_of(row, triangles)
        places, turns = motion_of(name, table, times, start)
        if table.get("time", [0.0])[0] > 0 and np.any(turns[:, 3] != 1):
            notes.append(f"How far {name} had turned before the first row of history.csv is not known.")
        size = np.linalg.norm(case["grid"]["size"])
        found.append({"triangles": rounded(triangles - start, size), "shades": shades_of(triangles - start, row),
                      "places": rounded(places, size), "turns": rounded(turns, 1.0)})
    return found, notes


def rounded(values, size):
    """Numbers to a millionth of a size."""
    digits = max(0, 6 - int(np.floor(np.log10(size))))
    return np.round(np.ravel(values), digits).tolist()


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
    """Its face as far as it is in the grid; in 2D with some thickness."""
    size, low = along(grid["size"]), along(grid.get("origin", [0.0]))
    normal, point = along(row["normal"]) / np.linalg.norm(row["normal"]), along(row["point"])
    ends = [np.where([k >> d & 1 for d in range(3)], low + size, low) for k in range(2 ** dim)]
    edges = [(ends[k], ends[k | 1 << d]) for k in range(2 ** dim) for d in range(dim) if not k >> d & 1]
    heights = [((p - point) @ normal, (q - point) @ normal) for p, q in edges]
    cuts = np.array([p + (q - p) * a / (a - b) for (p, q), (a, b) in zip(edges, heights) if a * b < 0 or (a == 0) != (b == 0)])
    if len(cuts) < dim:
        raise InputError("its face is not in the grid")
    if dim == 2:
        along_face = np.array([-normal[1], normal[0], 0.0])
        way = (cuts - point) @ along_face
        first, last = point + way.min() * along_face, point + way.max() * along_face
        deep = 0.02 * np.linalg.norm(size) * normal
        return quads([[first, last, last - deep, first - deep]])
    middle = cuts.mean(axis=0)
    u = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    angle = np.arctan2((cuts - middle) @ np.cross(normal, u), (cuts - middle) @ u)
    rim = cuts[np.argsort(angle)]
    return np.stack([np.broadcast_to(middle, rim.shape), rim, np.roll(rim, -1, axis=0)], axis=1)


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
        raise InputError(f"there is no file {file}")
    reader = vtkSTLReader()
    reader.SetFileName(str(file))
    reader.Update()
    mesh = reader.GetOutput()
    if not 0 < mesh.GetNumberOfPolys() <= MOST:
        raise InputError(f"{file} has {mesh.GetNumberOfPolys()} triangles, not 1 to {MOST}")
    return scale * vtk_to_numpy(mesh.GetPoints().GetData())[vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()).reshape(-1, 3)].astype(float)


def centre_of(row, triangles):
    """About which it turns: as given, the point of a half-space, the middle of a box or surface."""
    if "center" in row or "point" in row:
        return along(row.get("center", row.get("point")))
    return (triangles.min(axis=(0, 1)) + triangles.max(axis=(0, 1))) / 2


def shades_of(triangles, row):
    """0 or 1 by sectors about the axis of round obstacles."""
    if row.get("shape") not in ("ball", "cylinder"):
        return [0] * len(triangles)
    u, v = {"x": (1, 2), "y": (2, 0)}.get(row.get("axis", "z"), (0, 1))
    middle = triangles.mean(axis=1)
    return (np.floor(np.arctan2(middle[:, v], middle[:, u]) * SECTORS / (2 * np.pi)).astype(int) % 2).tolist()


def motion_of(name, table, times, start):
    """Places of the centre (frames, 3), m, from the columns of history.csv, and turns (frames, 4), the angular velocity summed over the rows."""
    if f"{name}_rotation_x" not in table or len(table["time"]) == 0:
        return np.tile(start, (len(times), 1)), np.tile([0.0, 0.0, 0.0, 1.0], (len(times), 1))
    time = table["time"]
    places = np.stack([np.interp(times, time, table[f"{name}_{a}"]) for a in "xyz"], axis=1)
    spin = np.stack([table[f"{name}_rotation_{a}"] for a in "xyz"], axis=1)
    turn, turns = np.array([0.0, 0.0, 0.0, 1.0]), [np.array([0.0, 0.0, 0.0, 1.0])]
    for dt, rate in zip(np.diff(time), spin[1:]):  # that of the middle of the step
        angle = np.linalg.norm(rate) * dt
        if angle > 0:
            turn = product(np.append(np.sin(angle / 2) * rate / np.linalg.norm(rate), np.cos(angle / 2)), turn)
        turns.append(turn)
    return places, np.array(turns)[np.clip(np.searchsorted(time, times - 1e-12 * max(1.0, abs(time[-1]))), 0, len(time) - 1)]


def product(p, q):
    """Of quaternions x, y, z, w: the turn q, then p."""
    v, w = p[:3], p[3]
    return np.append(w * q[:3] + q[3] * v + np.cross(v, q[:3]), w * q[3] - v @ q[:3])
