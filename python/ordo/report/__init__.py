"""Reports: the results of a run, or of `ordo verify --data`, as one page to look at, without network.

    from ordo.report import write
    write("results/two-disks")                 # results/two-disks/report.html

From the shell: ``python3 -m ordo.report results/two-disks``. Reading frames needs VTK (python3-vtk9).
"""

import base64
import html
import json
import math
import os
import re
from importlib import resources
from pathlib import Path

import numpy as np

from .._errors import InputError, OutputError
from .._frames import Frames
from . import _obstacles, _particles, _tables

__all__ = ["write"]

MARK = '<meta name="generator" content="ordo.report">'
SCRIPTS = ("data.js", "colours.js", "viewer.js", "plots.js", "page.js")


def write(directory, output=None, fields=None, every=1, points=False, limit=60):
    """Writes the report of a folder of results.

    Parameters
    ----------
    directory : str or Path
        Where `ordo run`, or `ordo verify --data`, has written.
    output : str or Path, optional
        The page; by default report.html in the directory. A page of before is replaced, any other file is not.
    fields : list of str, optional
        Names of the fields to show, such as ["velocity", "stress"]; by default all that were written.
    every : int
        Shows each so many frames, and the last.
    points : bool
        Shows particles as points, also where the files have their domains.
    limit : float
        The largest page, MB. Above it, numbers are coarser first, then frames are left out; the page says so.

    Returns
    -------
    The path of the page.

    Raises
    ------
    InputError
        If the folder holds no results, or they cannot be used.
    OutputError
        If the page cannot be written, or another file is there.
    """
    directory = Path(directory)
    output = Path(output) if output is not None else directory / "report.html"
    if every < 1 or limit <= 0:
        raise InputError("every must be at least 1 and limit above 0")
    if not directory.is_dir():
        raise InputError(f"{directory}: there is no such folder")
    is_run, is_study = (directory / "case.toml").is_file(), (directory / "verify.json").is_file()
    if not is_run and not is_study:
        raise InputError(f"{directory}: holds neither case.toml of `ordo run` nor verify.json of `ordo verify --data`")
    refuse_other_file(output)
    blobs, data = {}, {"name": directory.resolve().name, "notes": []}
    if is_run:
        add_run(data, blobs, directory, fields, every, points, limit * 1e6)
    if is_study:
        data["studies"] = _tables.studies_of(directory)
    save(page(data, blobs), output)
    return output


def refuse_other_file(output):
    """Nothing that was there is lost, but for an earlier report."""
    if not output.exists():
        return
    with open(output, "rb") as there:
        if MARK.encode() not in there.read(1000):
            raise OutputError(f"{output}: is there and is no report; give another name with -o")


def add_run(data, blobs, directory, fields, every, points, limit):
    text, case, program = _tables.case_of(directory)
    dim = case.get("grid", {}).get("dim")
    tables = {}
    for file in sorted(directory.glob("*.csv")):
        if file.name == "history.csv" or file.name.startswith(("probe_", "body_")):
            tables[file.stem] = _tables.table_of(file, dim)
    if "history" in tables and tables["history"]["columns"].get("time"):
        tables["history"]["energies"] = _tables.energies_of(tables["history"])
    coarsest = max((table["every"] for table in tables.values()), default=1)
    if coarsest > 1:
        data["notes"].append(f"Curves show one row in {coarsest} of long tables.")
    data.update(case=case, toml=text, program=program, tables=tables)
    if (directory / "particles.pvd").is_file():
        about, packed, notes = particles_of(Frames.of(directory), dim, fields, every, points, limit)
        data["particles"] = {**about, "box": box_of(case), "obstacles": _obstacles.shapes_of(case, directory, np.array(about["times"]))}
        data["notes"] += notes
        blobs.update(packed)


def box_of(case):
    """Lower and upper corner of the grid."""
    grid = case.get("grid", {})
    size = grid.get("size", [])
    low = [*grid.get("origin", [0.0] * len(size)), 0.0, 0.0, 0.0][:3]
    return [low, [a + b for a, b in zip(low, [*size, 0.0, 0.0, 0.0])]]


def one_in(frames, share):
    """Each so many frames, and the last."""
    kept = [*range(0, len(frames) - 1, share), len(frames) - 1]
    return Frames(frames.times[kept], [frames.files[k] for k in kept])


def particles_of(frames, dim, fields, every, points, limit):
    """The frames, packed below the limit."""
    found = _particles.look(frames, dim, fields, points)
    share, level = every, 0
    while True:
        chosen = one_in(frames, share)
        count = len(found.ids) * len(chosen) * found.numbers()
        while count > _particles.PRECISIONS[level][2]:
            level += 1
        about, blobs = _particles.encode(chosen, found, _particles.PRECISIONS[level])
        size = 4 / 3 * sum(map(len, blobs.values()))
        if size < limit:
            break
        if level < len(_particles.PRECISIONS) - 1:
            level += 1
        elif len(chosen) > 2:
            share = min(max(share + 1, int(share * size / limit)), len(frames))
        else:
            raise InputError(f"two frames take {size / 1e6:.0f} MB, the limit is {limit / 1e6:.0f}: give fewer fields (--fields), points "
                             "(--points) or a larger --limit")
    notes = []
    if len(chosen) < len(frames):
        notes.append(f"{len(chosen)} of {len(frames)} frames are shown.")
    if level:
        per_size, levels, _ = _particles.PRECISIONS[level]
        notes.append(f"Places are good to 1/{per_size} of a particle's size, fields to 1/{levels + 1} of their range.")
    return about, blobs, notes


def page(data, blobs):
    """The whole text of the page."""
    files = resources.files(__package__)

    def read(name):
        return files.joinpath(name).read_text(encoding="utf-8")

    def script(kind, text, name=None):
        label = f' id="{html.escape(name)}"' if name else ""
        return f'<script type="{kind}"{label}>' + text + "</script>"

    # "<" in the texts of users must end no script.
    body = [script("application/json", json.dumps(finite(data), separators=(",", ":"), default=str, allow_nan=False).replace("<", "\\u003c"), "data")]
    body += [script("text/plain", base64.b64encode(blob).decode(), name) for name, blob in blobs.items()]
    body += [script("text/plain", read("library/LICENSES.txt"), "licences"), script("text/javascript", read("library/library.min.js"))]
    body += [script("text/javascript", read(name)) for name in SCRIPTS]
    title = html.escape(data.get("case", {}).get("title") or data["name"])
    parts = {"mark": MARK, "title": title, "style": read("library/library.min.css") + read("page.css"), "scripts": "\n".join(body)}
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], read("page.html"))


def finite(values):
    """The same with None in place of numbers that JSON does not have."""
    if isinstance(values, dict):
        return {key: finite(value) for key, value in values.items()}
    if isinstance(values, list):
        return [finite(value) for value in values]
    return None if isinstance(values, float) and not math.isfinite(values) else values


def save(text, output):
    """Written whole or not at all."""
    part = output.with_name(output.name + ".part")
    try:
        part.write_text(text, encoding="utf-8")
        os.replace(part, output)
    except OSError as e:
        part.unlink(missing_ok=True)
        raise OutputError(f"{output}: cannot be written ({e.strerror})") from None
