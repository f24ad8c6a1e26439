"""Verification cases."""

import json
import re

from . import _core
from ._errors import InputError
from ._simulation import _threads


def verify(name, methods=(), cells=(), ppc=None, threads=None, **settings):
    """Runs a case with a known answer over meshes, as `ordo verify` does.

    Parameters
    ----------
    name : str
        Such as "ring"; see `ordo.cases()`.
    methods : list of str
        Presets; by default those of the case's own studies.
    cells : list of int
        Cells per unit length, from coarse to fine; by default those of the case.
    ppc : int, optional
        Particles per cell.
    threads : int, optional
        By default all cores.
    settings
        Parameters of the case, such as ``amplitude=0.1``, or axes of the method, such as ``**{"method.mass": "consistent"}``.

    Returns
    -------
    list of dicts, one per study, with what the JSON of the program has (docs/output.md).
    """
    if isinstance(methods, str) or not all(isinstance(one, str) for one in methods):
        raise InputError("verify: methods must be a list of names of presets")
    try:
        cells = [one.__index__() for one in cells]
        ppc = None if ppc is None else ppc.__index__()
    except (TypeError, AttributeError):
        raise InputError("verify: cells must be a list of whole numbers, and ppc a whole number") from None
    if any(one < 1 for one in cells):
        raise InputError("verify: cells must be positive")
    try:
        pairs = [(key, value if isinstance(value, str) else repr(float(value))) for key, value in settings.items()]
    except (TypeError, ValueError):
        raise InputError("verify: parameters must be numbers or words") from None
    try:
        return json.loads(_core.verify(str(name), list(methods), cells, ppc, pairs, _threads(threads)))
    except InputError as e:
        raise InputError(re.sub(r"^--(\w+)", r"\1", str(e))) from None
