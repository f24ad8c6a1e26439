"""ordo: the material point method, of accurate order at large deformation.

    import ordo

    case = ordo.Case("cases/two-disks/case.toml", {"method.preset": "cpls"})
    sim = ordo.Simulation(case)
    sim.run(until=1.0)
    sim.particles.x, sim.history["kinetic_energy"]

Everything is in SI units. Arrays have one row per particle; D is the number of axes of the case.
"""

from pathlib import Path as _Path

from . import _core
from ._case import Case
from ._errors import InputError, InstabilityWarning, NumericalError, OutputError, StaleView
from ._frames import Frame, Frames, frames
from ._laws import material
from ._simulation import Grid, Particles, Simulation
from ._tables import history
from ._verify import verify
from ._views import Nodes, View

__version__ = _core.__version__
__all__ = ["Case", "Frame", "Frames", "Grid", "InputError", "InstabilityWarning", "Nodes", "NumericalError", "OutputError", "Particles", "Simulation",
           "StaleView", "View", "cases", "frames", "history", "material", "materials", "methods", "schema", "verify"]


def methods():
    """The presets of `method.preset`: a list of dicts with name, what and choices (axis or number by key)."""
    return _core.methods()


def materials():
    """The laws of `material.model`, own ones too: a list of dicts with name, what, parameters and history."""
    return _core.materials()


def cases(folder="cases"):
    """The cases that there are: a list of dicts. Those of `kind` "verify" have name, what, dim, cells and parameters, for `verify`; those
    of `kind` "run" have name, title and file, from the subfolders of `folder`."""
    found = [{"kind": "verify", **one} for one in _core.verification_cases()]
    for file in sorted(_Path(folder).glob("*/case.toml")):
        case = Case(file)
        found.append({"kind": "run", "name": case.name, "title": case.title, "file": str(file)})
    return found


def schema():
    """The tables of a case: a dict by name (top level: "") with what, repeated and keys; each key has what, type, unit, default, required
    and perhaps min, max and choices."""
    return _core.schema()
