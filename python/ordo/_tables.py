"""Tables that runs have written."""

import csv
from pathlib import Path

import numpy as np

from ._errors import InputError


def history(path):
    """The columns of history.csv in a folder of results, or of any table that a run wrote: a dict of arrays."""
    file = Path(path)
    if file.is_dir():
        file = file / "history.csv"
    if not file.is_file():
        raise InputError(f"{file}: there is no such file; give the folder of a run, such as results/two-disks")
    with open(file, newline="", encoding="utf-8") as text:
        header, *rows = list(csv.reader(text)) or [[]]
    try:
        if not header:
            raise ValueError
        numbers = np.array([[float(one) for one in row] for row in rows]).reshape(len(rows), len(header))
    except ValueError:
        raise InputError(f"{file}: is not a table of numbers") from None
    return {name: numbers[:, k].copy() for k, name in enumerate(header)}
