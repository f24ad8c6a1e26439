"""Packs the frames of a run for a page: small whole numbers, predicted in time and compressed.

Places are whole multiples of a fraction of a particle's size, domains the offsets of their corners (of parallelepipeds: their half sides),
fields linear in their range, without values that are far out of it. Each number is stored as its difference from what the frames before it foretell; most of the differences
are small, so that deflate does well. 0 stands for what is not finite.
"""

import zlib
from dataclasses import dataclass, field

import numpy as np

from .._errors import InputError
from .._units import field_unit

TOP = 65534                     # codes 1 to TOP + 1
OUTLIER = 1000                  # times the range of 98 % of the values
LARGEST = 1e30                  # a value beyond it is none
# Levels in a particle's size and in the range of a field, and up to how many numbers in all: measured 0.6, 0.4 and 0.15 bytes a number in a smooth run.
PRECISIONS = [(512, TOP, 10_000_000), (128, 4094, 100_000_000), (32, 254, np.inf)]
AXES = "xyz"
# Signs of the half sides at the corners of a parallelepiped, in VTK's order.
SIGNS = {1: [[-1], [1]], 2: [[-1, -1], [1, -1], [1, 1], [-1, 1]],
         3: [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]]}


@dataclass
class Scalar:
    """A number of each particle: a column of an array of the files."""
    name: str
    array: str
    column: int
    low: float = np.inf
    high: float = -np.inf
    inner: tuple = (np.inf, -np.inf)  # of 98 % of the values of each frame
    is_clipped: bool = False

    def of(self, frame):
        values = frame.fields[self.array]
        values = values if values.ndim == 1 else values[:, self.column]
        return np.where(np.abs(values) < LARGEST, values, np.nan)

    def see(self, frame):
        values = self.of(frame)
        values = values[np.isfinite(values)]
        if len(values):
            self.low, self.high = min(self.low, float(values.min())), max(self.high, float(values.max()))
            inner = np.quantile(values, [0.01, 0.99])
            self.inner = min(self.inner[0], float(inner[0])), max(self.inner[1], float(inner[1]))

    def settle(self):
        """The range to show: without outliers, and of zero if there is no value."""
        if not np.isfinite(self.low):
            self.low = self.high = 0.0
        width = self.inner[1] - self.inner[0]
        if width > 0 and self.high - self.low > OUTLIER * width:
            self.is_clipped = True
            self.low, self.high = max(self.low, self.inner[0] - 10 * width), min(self.high, self.inner[1] + 10 * width)

    def step(self, levels):
        return (self.high - self.low) / levels or 1.0


@dataclass
class Survey:
    """What one look at all frames tells."""
    ids: np.ndarray
    dim: int
    kind: str                   # points, axes or corners
    size: float                 # of a typical particle, m
    small: float                # of a small one
    scalars: list
    reach: float = 0.0          # the largest offset of a corner, or half side, m
    low: np.ndarray = field(default_factory=lambda: np.full(3, np.inf))
    high: np.ndarray = field(default_factory=lambda: np.full(3, -np.inf))

    def numbers(self):
        """How many a particle has in a frame."""
        return len(self.scalars) + self.dim + {"points": 0, "axes": self.dim ** 2, "corners": self.dim * 2 ** self.dim}[self.kind]


def scalars_of(frame, dim, chosen):
    """The columns to show: components of vectors and tensors of the plane or space, each once where a tensor is symmetric."""
    found, there = [], [name for name in frame.fields if name not in ("id", "position")]
    for name in chosen or there:
        if name not in there:
            raise InputError(f"the frames have no field {name}; they have {', '.join(there)} (see [output] fields)")
        values = frame.fields[name]
        width = 1 if values.ndim == 1 else values.shape[1]
        if width == 1:
            found.append(Scalar(name, name, 0))
        elif width == 3:
            found += [Scalar(f"{name}_{AXES[k]}", name, k) for k in range(dim)]
        else:
            symmetric = name == "stress"
            pairs = [(i, j) for i in range(3) for j in range(3) if i == j or (max(i, j) < dim and not (symmetric and i > j))]
            found += [Scalar(f"{name}_{AXES[i]}{AXES[j]}", name, 3 * i + j) for i, j in pairs]
    return found


def sizes_of(frame, dim):
    """The sides of a small and of a typical particle, m: from volumes or domains, else from the distance to the next one."""
    values = frame.fields
    if "volume" in values or {"mass", "density"} <= values.keys():
        volume = values["volume"] if "volume" in values else values["mass"] / values["density"]
        sizes = np.abs(volume) ** (1 / dim)
    elif frame.has_domains:
        sizes = np.ptp(frame.corners, axis=1)[:, :dim].prod(axis=1) ** (1 / dim)
    else:
        sizes = []
        for k in np.linspace(0, len(frame.x) - 1, min(len(frame.x), 50)).astype(int):
            apart = np.linalg.norm(frame.x - frame.x[k], axis=-1)
            sizes.append(np.min(apart[apart > 0], initial=np.inf))
    sizes = np.asarray(sizes)
    sizes = sizes[np.isfinite(sizes) & (sizes > 0)]
    return tuple(map(float, np.quantile(sizes, [0.05, 0.5]))) if len(sizes) else (1.0, 1.0)


def is_parallelepiped(corners, dim):
    """Whether all domains are: then centre and half sides tell all corners."""
    sides = half_sides(corners, dim)
    rebuilt = np.einsum("cs,nsd->ncd", np.array(SIGNS[dim]), sides)
    offsets = corners - corners.mean(axis=1, keepdims=True)
    return bool(np.all(np.abs(offsets - rebuilt).max(axis=(1, 2)) <= 1e-3 * np.abs(sides).max(axis=(1, 2))))


def half_sides(corners, dim):
    """(n, dim, 3): from the centre of a domain to the middle of its faces, for parallelepipeds."""
    return np.einsum("cs,ncd->nsd", np.array(SIGNS[dim]), corners) / len(SIGNS[dim])


def look(frames, dim, chosen, as_points):
    """Reads all frames once."""
    found = None
    for frame in frames:
        if found is None:
            dim = frame.dim or dim or int(max(np.flatnonzero(np.ptp(frame.x, axis=0) > 0), default=0)) + 1
            kind = "axes" if frame.has_domains and not as_points else "points"
            small, size = sizes_of(frame, dim)
            found = Survey(frame.fields["id"], dim, kind, size, small, scalars_of(frame, dim, chosen))
        found.ids = np.union1d(found.ids, frame.fields["id"])
        if found.kind == "axes" and not is_parallelepiped(frame.corners, found.dim):
            found.kind = "corners"
        if found.kind != "points":
            reach = np.abs(frame.corners - frame.x[:, None])
            found.reach = max(found.reach, float(reach.max(initial=0, where=np.isfinite(reach))))
        good = frame.x[np.isfinite(frame.x).all(axis=1)]
        if len(good):
            found.low, found.high = np.minimum(found.low, good.min(axis=0)), np.maximum(found.high, good.max(axis=0))
        for scalar in found.scalars:
            scalar.see(frame)
    for scalar in found.scalars:
        scalar.settle()
    if not np.isfinite(found.low).all():
        raise InputError("no particle of these frames has a finite position")
    return found


def codes(values, low, step, top):
    """Whole numbers 1 to top + 1 for low, low + step, ..; 0 for what is not finite; what is outside goes to the nearest end."""
    with np.errstate(invalid="ignore"):
        found = np.clip(np.rint((values - low) / step), 0, top) + 1
    return np.where(np.isfinite(values), found, 0).astype(np.uint16)


def packed(rows):
    """(frames, n) codes compressed: differences along particles in the first frame, then in time, of first or second order."""
    rows = np.asarray(rows, dtype=np.uint16)
    best = None
    for order in (1, 2):
        left = rows.astype(np.int32)
        left[1:] -= rows[:-1]
        if order == 2 and len(rows) > 2:
            left[2:] -= rows[1:-1].astype(np.int32) - rows[:-2]
        left[0, 1:] -= rows[0, :-1]
        left = left.astype(np.int16)                               # modulo 2^16
        zigzag = ((left << 1) ^ (left >> 15)).astype(np.uint16)    # small numbers of both signs to small ones
        cost = np.log2(zigzag.astype(np.float32) + 1).sum()
        if best is None or cost < best[0]:
            best = cost, order, zigzag
    _, order, zigzag = best
    bytes_apart = zigzag.astype("<u2").view(np.uint8).reshape(-1, 2).T.tobytes()
    return order, zlib.compress(bytes_apart, 9)


def encode(frames, found, precision):
    """The arrays of some frames, as a dict for the page and a dict of compressed bytes by name."""
    per_size, levels, _ = precision
    step = np.maximum(found.small / per_size, (found.high - found.low) / TOP)
    side = max(found.small / per_size, found.reach / (TOP // 2))
    arrays, dim = {}, found.dim

    def add(name, k, values, low, by, top):
        n = arrays.setdefault(name, np.zeros((len(frames), len(found.ids)), np.uint16))
        n[k, place] = codes(values, low, by, top)

    for k, frame in enumerate(frames):
        place = np.searchsorted(found.ids, frame.fields["id"])
        for d in range(dim):
            add(f"place {AXES[d]}", k, frame.x[:, d], found.low[d], step[d], TOP)
        if found.kind != "points":
            offsets = half_sides(frame.corners, dim) if found.kind == "axes" else frame.corners - frame.x[:, None]
            for c in range(offsets.shape[1]):
                for d in range(dim):
                    add(f"offset {c} {AXES[d]}", k, offsets[:, c, d], -side * (TOP // 2), side, TOP)
        for n, scalar in enumerate(found.scalars):
            add(f"field {n}", k, scalar.of(frame), scalar.low, scalar.step(levels), levels)
    blobs, orders = {}, {}
    for name in list(arrays):
        orders[name], blobs[name] = packed(arrays.pop(name))
    about = {
        "count": len(found.ids), "dim": dim, "kind": found.kind, "size": found.size, "low": found.low.tolist(), "high": found.high.tolist(),
        "step": step.tolist(), "side": side, "grow": 1 + 2 * side / found.size, "middle": TOP // 2 + 1, "corners": SIGNS[dim],
        "times": frames.times.tolist(), "orders": orders,
        "ids": None if np.array_equal(found.ids, np.arange(len(found.ids))) else found.ids.tolist(),
        "fields": [{"name": s.name, "array": s.array, "unit": field_unit(s.array, dim), "low": s.low, "step": s.step(levels)} for s in found.scalars]}
    return about, blobs


def notes_on(about, found, precision):
    """What the numbers of a page are good to, where that is less than the best."""
    coarsest = max(*about["step"][:found.dim], about["side"] if found.kind != "points" else 0)
    notes, per_size = [], found.small / coarsest
    if per_size < 0.99 * PRECISIONS[0][0]:
        size = f"1/{per_size:.0f} of" if per_size >= 1.5 else f"{1 / per_size:.2g} times"
        notes.append(f"Places are rounded to {size} a small particle's size.")
    if precision is not PRECISIONS[0]:
        notes.append(f"Fields are rounded to 1/{precision[1]} of their range.")
    for one in found.scalars:
        if one.is_clipped:
            notes.append(f"{one.name}: values out of {one.low:.4g} to {one.high:.4g} are shown as the nearest end.")
    return notes
