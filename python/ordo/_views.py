"""Views of particles that say when they are out of date, and the nodes that callbacks see."""

import numpy as np

from ._errors import StaleView


class Clock:
    """Counts the generations of a state: views are good in one of them."""

    __slots__ = ("now",)

    def __init__(self):
        self.now = 0


def _owns_memory(array):
    """Whether the memory of an array was made by numpy: then it is a copy, which stays good."""
    while isinstance(array, np.ndarray):
        if np.ndarray.__dict__["flags"].__get__(array).owndata:
            return True
        array = np.ndarray.__dict__["base"].__get__(array)
    return array is None


def _plain(value):
    """The value with views replaced by plain arrays on the same memory, after checking them."""
    if isinstance(value, View):
        value._require_good()
        return np.ndarray.view(value, np.ndarray)
    if isinstance(value, (tuple, list)):
        return type(value)(_plain(one) for one in value) if type(value) in (tuple, list) else value
    if type(value) is dict:
        return {key: _plain(one) for key, one in value.items()}
    return value


class View(np.ndarray):
    """A field of the particles, on the memory of the simulation. Good until the next step; then every use raises `StaleView`.

    Results of operations are plain arrays, and copies stay good. `numpy.asarray(view)` gives a plain array that is not guarded: after the
    next step it keeps the numbers of before.
    """

    def __array_finalize__(self, of):
        fields = getattr(of, "__dict__", {}) if isinstance(of, View) else {}
        self.__dict__["_clock"] = fields.get("_clock")
        self.__dict__["_at"] = fields.get("_at")

    def _require_good(self):
        fields = object.__getattribute__(self, "__dict__")
        clock = fields.get("_clock")
        if clock is not None and clock.now != fields["_at"] and not _owns_memory(self):
            raise StaleView("this view of particles was good until the simulation went on; take it from sim.particles again")

    def __getattribute__(self, name):
        if name not in ("_require_good", "__dict__", "__class__", "__array_finalize__"):
            object.__getattribute__(self, "_require_good")()
        return super().__getattribute__(name)

    def __array_ufunc__(self, ufunc, method, *inputs, out=None, **kwargs):
        if out is not None:
            kwargs["out"] = tuple(_plain(one) for one in out)
        result = getattr(ufunc, method)(*_plain(inputs), **_plain(kwargs))
        if out is None:
            return result
        return out[0] if len(out) == 1 else out

    def __array_function__(self, function, types, args, kwargs):
        return function(*_plain(args), **_plain(kwargs))

    def __getitem__(self, key):
        result = _plain(self)[_plain(key)]
        if isinstance(result, np.ndarray) and not _owns_memory(result):
            return guarded(result, self.__dict__["_clock"], self.__dict__["_at"])
        return result

    def __setitem__(self, key, value):
        _plain(self)[_plain(key)] = _plain(value)

    def copy(self, order="C"):
        """A plain array of its own, which stays good."""
        return _plain(self).copy(order)

    def astype(self, *args, **kwargs):
        """A plain array of its own, which stays good."""
        kwargs["copy"] = True
        return _plain(self).astype(*args, **kwargs)


def _checked(name):
    method = getattr(np.ndarray, name)

    def call(self, *args):
        return method(_plain(self), *_plain(args))

    call.__name__, call.__doc__ = name, method.__doc__
    return call


for _name in ("__iter__", "__len__", "__contains__", "__repr__", "__str__", "__format__", "__bool__", "__float__", "__int__", "__index__",
              "__complex__", "__eq__", "__ne__", "__lt__", "__le__", "__gt__", "__ge__", "__copy__", "__deepcopy__", "__reduce_ex__"):
    setattr(View, _name, _checked(_name))


def guarded(array, clock, at):
    """The array as a view that is good as long as `clock.now` is `at`."""
    view = np.ndarray.view(array, View)
    view.__dict__["_clock"], view.__dict__["_at"] = clock, at
    return view


class Nodes:
    """The nodes of the grid that have mass, between the forces and the kick of a step: v = (momentum + dt force) / mass.

    Attributes
    ----------
    t, dt : float
        Time of the forces and length of the kick, s.
    place : (m, D) array
        Positions, m.
    mass : (m,) array
        kg; row sums, where a method has the consistent mass matrix.
    momentum, force : (m, D) arrays
        kg m/s; N, with gravity. To be changed in place.
    field : (m,) array of int
        The velocity field: bodies in contact have fields of their own.
    """

    __slots__ = ("t", "dt", "place", "mass", "momentum", "force", "field")

    def __init__(self, t, dt, place, mass, momentum, force, field):
        self.t, self.dt, self.place, self.mass = t, dt, place, mass
        self.momentum, self.force, self.field = momentum, force, field
