"""Tables that runs have written."""

import warnings
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
    try:
        with open(file, encoding="utf-8") as text, warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of numpy, where there are no rows
            header = text.readline().rstrip("\n").split(",")
            numbers = np.loadtxt(text, delimiter=",", ndmin=2, comments=None)
        if not all(header) or numbers.size and numbers.shape[1] != len(header):
            raise ValueError
    except ValueError:
        raise InputError(f"{file}: is not a table of numbers") from None
    numbers = numbers.reshape(-1, len(header))
    return {name: numbers[:, k].copy() for k, name in enumerate(header)}
