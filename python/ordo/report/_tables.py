"""What a report shows beside particles: the case, tables over time, the rows of `ordo verify`."""

import json
import re
import tomllib

import numpy as np

from .._errors import InputError
from .._tables import history
from .._units import column_unit, field_unit

MOST_ROWS, MOST_NUMBERS = 4000, 400_000  # of a table over time, of all tables

# Where the energy is: columns of history.csv and labels. Work is positive when taken from the bodies, so the sum changes only by the error of the method.
ENERGIES = {"kinetic_energy": "kinetic", "strain_energy": "strain", "potential_energy": "gravity", "boundary_work": "taken by boundaries",
            "traction_work": "taken by tractions", "body_force_work": "taken by body forces", "dissipated_energy": "dissipated",
            "damped_energy": "damped", "artificial_viscosity_work": "artificial viscosity", "stage_energy": "left between stages"}
CONTACT_ENERGIES = {"_friction_work": "taken by friction", "_dissipation": "lost in impacts", "_work": "taken by obstacles"}


def case_of(directory):
    """Text and tables of the resolved case, and the program that wrote it."""
    file = directory / "case.toml"
    try:
        text = file.read_text(encoding="utf-8")
        case = tomllib.loads(text)
        dim = case["grid"]["dim"]
        if dim not in (1, 2, 3):
            raise ValueError(f"grid.dim is {dim}")
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, KeyError, TypeError, ValueError) as e:
        raise InputError(f"{file}: is not a case ({e})") from None
    program = re.search(r"Written by (ordo [^\n]*?)\.?\n", text)
    return text, case, program[1] if program else "ordo"


def tables_of(directory):
    """The tables over time that the run wrote, in the order of their numbers, by file name; and what cannot be read."""
    names = [name for name in names_of(directory) if re.fullmatch(r"history\.csv|(probe|body)_.*\.csv", name)]
    names.sort(key=lambda name: [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", name)])
    tables, notes = {}, []
    for name in names:
        try:
            tables[name] = history(directory / name)
        except InputError as e:
            notes.append(f"{e}.")
    return tables, notes


def names_of(directory):
    """The files of the run: those of files.txt, else what is there."""
    listed = directory / "files.txt"
    if listed.is_file():
        return [name for name in listed.read_text(encoding="utf-8", errors="replace").splitlines() if (directory / name).is_file()]
    return [file.name for file in directory.glob("*.csv")]


def shown(name, columns, dim, most):
    """A table for the page: units and columns of at most `most` rows, the last always."""
    rows = len(columns["time"])
    step = max(1, -(-rows // most))
    kept = np.unique(np.append(np.arange(0, rows, step), rows - 1)) if rows else np.arange(0)
    unit = field_unit if name.startswith("probe_") else column_unit
    return {"file": name, "every": step, "units": {column: unit(column, dim) for column in columns},
            "columns": {column: numbers(values[kept]) for column, values in columns.items()}}


def numbers(values):
    """For JSON: seven digits, null for what is not finite."""
    return [float(f"{v:.7g}") if np.isfinite(v) else None for v in values]


def energies_of(table):
    """Curves of an energy plot: label and values; kinetic and strain energy always, others where they are not zero, of gravity the change."""
    columns = {name: np.array([np.nan if v is None else v for v in values], float) for name, values in table["columns"].items()}
    curves = [(label, columns[c] - (columns[c][:1] if c == "potential_energy" else 0)) for c, label in ENERGIES.items() if c in columns]
    names = [name.removesuffix("_friction_work") for name in columns if name.endswith("_friction_work")]
    for end, label in CONTACT_ENERGIES.items():
        there = [columns[name + end] for name in names if name + end in columns]
        if there:
            curves.append((label, sum(there)))
    if not curves:
        return []
    largest = max(np.nanmax(np.abs(values), initial=0) for _, values in curves)
    drawn = [c for k, c in enumerate(curves) if k < 2 or np.nanmax(np.abs(c[1]), initial=0) > 1e-9 * largest]
    return [[label, numbers(values)] for label, values in [*drawn, ("sum", sum(values for _, values in curves))]]


def studies_of(directory):
    """The studies of verify.json."""
    file = directory / "verify.json"
    try:
        studies = json.loads(file.read_text(encoding="utf-8"))
        if not isinstance(studies, list):
            raise TypeError("no list of studies")
        for study in studies:
            study["case"], study["method"], study["parameters"], study["bars"], [row["h"] for row in study["rows"]]
    except (ValueError, KeyError, TypeError) as e:
        raise InputError(f"{file}: is not what `ordo verify --data` writes ({type(e).__name__}: {e})") from None
    return studies
