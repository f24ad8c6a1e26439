"""Constitutive laws in numpy."""

import math
import re

from . import _core
from ._errors import InputError
from ._simulation import Particles


def material(name, state=None, *, wave_speed, what=""):
    """Makes a function a constitutive law of this name, for cases made afterwards.

    Parameters
    ----------
    name : str
        What a ``[[material]]`` gives as `model`. A later law of the same name takes its place in new cases.
    state : dict, optional
        Names of numbers that each particle carries and their initial values. They are kept, sorted, written and checkpointed as those of
        built-in laws.
    wave_speed : function of a dict
        Speed of P-waves, m/s, from the parameters; automatic time steps and their limit follow from it.
    what : str, optional
        A sentence for `ordo.materials()`; by default the first line of the docstring.

    The function is called once a step, as its last pass, for all particles of its material::

        @ordo.material("my-law", state={"plastic_strain": 0.0}, wave_speed=lambda par: np.sqrt(par["E"] / par["rho"]))
        def my_law(F, dF, dt, state, par):
            return cauchy

    F, dF : (n, 3, 3) arrays
        Deformation gradient after the step, and that of the step: F = dF F_old. In 2D plane strain, in 1D uniaxial strain.
    dt : float
        s
    state : dict of (n,) arrays
        To be changed in place.
    par : dict
        The numbers of `parameters` of the material, and ``"rho"``, the initial density.
    cauchy : (n, 3, 3) array
        Cauchy stress, Pa, symmetric.

    Bodies start without stress, at F = I. The energies of a run count the work of the stresses as stored, column `stress_work`, without
    what a state named `dissipated` (J per initial volume) says is lost to heat.
    """
    if not isinstance(name, str) or not re.fullmatch(r"[A-Za-z][\w-]*", name):
        raise InputError(f"ordo.material: name must be a word of letters, digits, - and _ (got {name!r})")
    state = {} if state is None else state
    if not isinstance(state, dict):
        raise InputError(f"law {name}: state must be a dict of initial values (got {type(state).__name__})")
    columns = []
    for key, initial in state.items():
        if not isinstance(key, str) or not re.fullmatch(r"[A-Za-z]\w*", key):
            raise InputError(f"law {name}: state {key!r} must be a name of letters, digits and _")
        if hasattr(Particles, key):
            raise InputError(f"law {name}: state {key!r} is the name of another field of particles; take another one")
        try:
            initial = float(initial)
        except (TypeError, ValueError):
            raise InputError(f"law {name}: state {key!r} must start with a number (got {initial!r})") from None
        if not math.isfinite(initial):
            raise InputError(f"law {name}: state {key!r} must start with a finite number (got {initial})")
        columns.append((key, initial))
    if not callable(wave_speed):
        raise InputError(f"law {name}: wave_speed must be a function of the parameters (got {type(wave_speed).__name__})")

    def add(function):
        if not callable(function):
            raise InputError(f"law {name}: must be a function (got {type(function).__name__})")
        text = what or ((function.__doc__ or "").strip().splitlines() or ["a law in Python"])[0]
        _core.add_law(name, text, columns, function, wave_speed)
        return function

    return add
