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
LEAST = 0.08  # bytes that a number takes at least, about
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
    if isinstance(fields, str) or fields is not None and not all(isinstance(one, str) for one in fields):
        raise InputError("fields must be a list of names")
    if not isinstance(every, int) or every < 1:
        raise InputError("every must be a whole number, at least 1")
    if not isinstance(limit, (int, float)) or not 0 < limit < math.inf:
        raise InputError("limit must be a number of MB above 0")
    try:
        directory, output = Path(directory), Path(directory) / "report.html" if output is None else Path(output)
    except TypeError:
        raise InputError("directory and output must be paths") from None
    if not directory.is_dir():
        raise InputError(f"{directory}: there is no such folder")
    is_run, is_study = (directory / "case.toml").is_file(), (directory / "verify.json").is_file()
    if not is_run and not is_study:
        raise InputError(f"{directory}: holds neither case.toml of `ordo run` nor verify.json of `ordo verify --data`")
    refuse_other_file(output)
    data, blobs = {"name": directory.resolve().name, "notes": []}, {}
    if is_study:
        data["studies"] = _tables.studies_of(directory)
    if is_run:
        add_run(data, blobs, directory, fields, every, points, limit * 1e6)
    save(page(data, blobs), output)
    return output


def refuse_other_file(output):
    """Nothing that was there is lost, but for an earlier report."""
    try:
        with open(output, "rb") as there:
            is_report = MARK.encode() in there.read(1000)
    except FileNotFoundError:
        return
    except OSError as e:
        raise OutputError(f"{output}: cannot be written ({e.strerror})") from None
    if not is_report:
        raise OutputError(f"{output}: is there and is no report; give another name with -o")


def add_run(data, blobs, directory, fields, every, points, limit):
    text, case, program = _tables.case_of(directory)
    dim = case["grid"]["dim"]
    tables, notes = _tables.tables_of(directory)
    most = max(100, min(_tables.MOST_ROWS, _tables.MOST_NUMBERS // max(1, sum(map(len, tables.values())))))
    data["tables"] = {Path(name).stem: _tables.shown(name, columns, dim, most) for name, columns in tables.items() if "time" in columns}
    if "history" in data["tables"]:
        data["tables"]["history"]["energies"] = _tables.energies_of(data["tables"]["history"])
    coarsest = max((table["every"] for table in data["tables"].values()), default=1)
    if coarsest > 1:
        notes.append(f"Curves show one row in {coarsest} of long tables.")
    data.update(case=case, toml=text, program=program)
    data["notes"] += notes
    if not (directory / "particles.pvd").is_file():
        return
    frames = one_in(Frames.of(directory), every)
    found = _particles.look(frames, dim, fields, points)
    obstacles, notes = _obstacles.shapes_of(case, directory, tables.get("history.csv", {}), frames.times)
    data["notes"] += notes
    rest = len(page({**data, "obstacles": obstacles, "ids": found.ids.tolist()}, {}).encode()) + 20_000
    about, packed, notes = packed_below(limit - rest, frames, found)
    if len(about["times"]) < len(frames):
        obstacles, _ = _obstacles.shapes_of(case, directory, tables.get("history.csv", {}), np.array(about["times"]))
    data["particles"] = {**about, "box": box_of(case), "obstacles": obstacles}
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


def packed_below(room, frames, found):
    """The frames in less than so many bytes, and notes on what that took."""
    share, level = 1, 0
    while True:
        chosen = one_in(frames, share)
        count = len(found.ids) * len(chosen) * found.numbers()
        while count > _particles.PRECISIONS[level][2]:
            level += 1
        size = LEAST * count
        if size < room or len(chosen) <= 2:
            about, blobs = _particles.encode(chosen, found, _particles.PRECISIONS[level])
            size = 4 / 3 * sum(map(len, blobs.values()))
            if size < room:
                break
        if level < len(_particles.PRECISIONS) - 1:
            level += 1
        elif len(chosen) > 2:
            share = min(max(share + 1, int(share * size / max(room, 1))), len(frames))
        else:
            raise InputError(f"two frames take {size / 1e6:.2g} MB, the limit leaves {max(room, 0) / 1e6:.2g}: give fewer fields (--fields), points "
                             "(--points) or a larger --limit")
    notes = [f"{len(chosen)} of {len(frames)} frames are shown."] if len(chosen) < len(frames) else []
    return about, blobs, notes + _particles.notes_on(about, found, _particles.PRECISIONS[level])


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
    target = output.resolve()
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        with open(part, "x", encoding="utf-8") as stream:
            try:
                stream.write(text)
                stream.close()
                os.replace(part, target)
            except BaseException:
                part.unlink()
                raise
    except OSError as e:
        raise OutputError(f"{output}: cannot be written ({e.strerror})") from None
