"""A simulation: its steps, its particles, its callbacks."""

import os
import warnings
import weakref

from . import _core
from ._case import Case, named
from ._errors import InputError, InstabilityWarning
from ._views import Clock, guarded

_FIELDS = ("x", "X", "v", "F", "stress", "V", "mass", "body", "material", "id")


class Particles:
    """Live views of the particles of a simulation, without copies.

    x, X, v : (n, D) arrays
        Position at t, initial position, m; velocity at t - dt/2, m/s.
    F, stress : (n, D, D) arrays
        Deformation gradient; Cauchy stress, Pa. `sim.field("stress")` has the components across the plane too.
    V, mass : (n,) arrays
        Volume, m^D; mass, kg.
    body, material, id : (n,) arrays of int
        Numbers of body and material, in the order of the case; number of the particle, in the order of seeding.

    The numbers that laws carry are attributes of their names, as in `state`. x (except where the corners of cells carry the motion), v,
    stress and state may be changed in place, the others are read-only. What was changed counts from the next step on; particles that
    were moved must stay in the grid. Particles are sorted by place: a view is good until the simulation goes on, then each use raises
    `StaleView`.
    """

    __slots__ = ("_core", "_clock")

    def __init__(self, core, clock):
        object.__setattr__(self, "_core", core)
        object.__setattr__(self, "_clock", clock)

    def _view(self, name):
        return guarded(self._core.particles(name), self._clock, self._clock.now)

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return self._view(name)

    def __setattr__(self, name, value):
        view = getattr(self, name)
        view[...] = value

    def __len__(self):
        return self._core.count

    def __dir__(self):
        return [*_FIELDS, "state", *self._core.state_names()]

    @property
    def state(self):
        """The numbers that laws carry: a dict of (n,) arrays."""
        return {name: self._view(name) for name in self._core.state_names()}

    def __repr__(self):
        return f"<ordo.Particles, {len(self)}: {', '.join(dir(self))}>"


def _field(name):
    def put(self, value):
        self._view(name)[...] = value

    return property(lambda self: self._view(name), put)


for _name in _FIELDS:
    setattr(Particles, _name, _field(_name))


class Grid:
    """Copies of the nodes of the grid that have mass.

    place, velocity : (m, D) arrays
        m, m/s
    mass : (m,) array
        kg
    field : (m,) array of int
        The velocity field: bodies in contact have fields of their own.
    """

    __slots__ = ("place", "velocity", "mass", "field")

    def __init__(self, place, velocity, mass, field):
        self.place, self.velocity, self.mass, self.field = place, velocity, mass, field


class Simulation:
    """A simulation of a case.

    Parameters
    ----------
    case : Case or path
        What to simulate.
    threads : int, optional
        Number of threads; by default all cores. Results do not depend on it.

    Raises
    ------
    InputError
        For a case that cannot be set up.

    Two simulations may run in two threads: `step` and `run` leave the interpreter to others. A simulation belongs to the process that made
    it.
    """

    def __init__(self, case, threads=None):
        self._start(lambda: _core.Simulation(_case_of(case), _threads(threads)))

    @classmethod
    def restore(cls, file, case=None, threads=None):
        """The simulation of a state that `save` or the program wrote. Without `case` that of the file, whose other files (meshes, ..) must
        be where they were. Body forces and callbacks are not part of it."""
        self = cls.__new__(cls)
        self._start(lambda: _core.Simulation.restore(os.fspath(file), None if case is None else _case_of(case), _threads(threads)))
        return self

    def _start(self, make):
        self._held, self._clock, self._callbacks = named(make), Clock(), {}
        self._warn()

    @property
    def _core(self):
        if self._held is None:
            raise RuntimeError("the simulation is closed")
        return self._held

    def _warn(self):
        for text in self._core.take_warnings():
            warnings.warn(text, InstabilityWarning, stacklevel=3)

    @property
    def t(self):
        """Time, s."""
        return self._core.t

    @property
    def dt(self):
        """Length of the last step, s; 0 before the first."""
        return self._core.dt

    @property
    def n(self):
        """Number of steps taken."""
        return self._core.n

    @property
    def dim(self):
        """Number of axes."""
        return self._core.dim

    @property
    def is_complete(self):
        """Whether the end of the case is reached."""
        return self._core.is_complete

    @property
    def notes(self):
        """What a user of the case may not expect: a list of sentences."""
        return self._core.notes

    @property
    def particles(self):
        """Live views of the particles, see `Particles`."""
        return Particles(self._core, self._clock)

    @property
    def grid(self):
        """Copies of the nodes after the last step, see `Grid`. If particles were changed since, they are projected again, and views go
        stale."""
        if self._core.find_nodes():
            self._clock.now += 1
        return Grid(**self._core.grid())

    @property
    def history(self):
        """The columns of history.csv so far: a dict of arrays, one row each `output.history_interval` steps."""
        return self._core.history()

    def field(self, name):
        """A copy of a field of the particles that `output.fields` can name: (n,), (n, 3) or (n, 3, 3), in SI units."""
        return self._core.field(name)

    def step(self, dt=None):
        """One step of dt, s, or of the case's own time step. It may go past the end of the case.

        Raises `NumericalError` if it fails; then the state is not good any more.
        """
        self._go(lambda core: core.step(None if dt is None else _real("dt", dt)))

    def run(self, until=None, output=None, progress=False, overwrite=False):
        """Steps to a time.

        Parameters
        ----------
        until : float, optional
            s; the last step is shortened to end there. By default the end of the case.
        output : path, optional
            Folder for the files of `ordo run`, from now to the end of this call. Without it nothing is written.
        progress : bool
            Whether to show a line of progress on stderr.
        overwrite : bool
            Whether results in the folder may be deleted.

        Raises `NumericalError` if a step fails. Ctrl-C ends the run after a whole step; the state is good.
        """
        path = None if output is None else os.fspath(output)
        self._go(lambda core: core.run(None if until is None else _real("until", until), path, bool(progress), bool(overwrite)))

    def _go(self, call):
        core = self._core
        core.require_idle()  # else views of another call would go stale
        self._clock.now += 1
        try:
            call(core)
        finally:
            self._clock.now += 1
            self._warn()

    def save(self, file):
        """Writes the state to a file, which replaces one of this name. `restore` and `ordo run --restart` go on from it bit for bit."""
        self._core.save(os.fspath(file))

    def write(self, file):
        """Writes the particles of now as VTU, for ParaView; the folder is made, and .vtu is added to the name."""
        self._core.write(os.fspath(file))

    def close(self):
        """Frees the memory. Arrays that were taken from views stay alive."""
        self._clock.now += 1
        self._held = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def body_force(self, f):
        """Adds an acceleration: ``f(x, X, t)`` gets positions and initial positions, (n, D), m, and the time, s, and returns (n, D), m/s^2.
        It is in addition to gravity and the body forces of the case. A decorator; a new one replaces it, None ends it."""
        self._set("body_force", f)
        return f

    def on_step(self, f):
        """``f(sim)`` is called after each step. Returning False ends the run. A decorator; a new one replaces it, None ends it."""
        self._set("on_step", f)
        return f

    def on_nodes(self, f):
        """``f(nodes)`` is called in each step between the forces and the kick of the nodes, see `Nodes`; what it changes in
        `nodes.momentum` and `nodes.force` counts. A decorator; a new one replaces it, None ends it."""
        self._set("on_nodes", f)
        return f

    def _set(self, name, f):
        if f is not None and not callable(f):
            raise InputError(f"{name}: must be a function or None (got {type(f).__name__})")
        getattr(self._core, f"set_{name}")(None if f is None else _Callback(self, name))
        self._callbacks[name] = f

    def _after_step(self, f):
        self._clock.now += 1
        try:
            return f(self)
        finally:
            self._clock.now += 1

    def __repr__(self):
        if self._held is None:
            return "<ordo.Simulation, closed>"
        return f"<ordo.Simulation, {self.dim}D, {self._core.count} particles, t = {self.t:.6g} s>"


class _Callback:
    """A function of a simulation, without holding either: functions often refer to their simulation, and such a circle through the
    extension would never be freed."""

    __slots__ = ("_sim", "_name")

    def __init__(self, sim, name):
        self._sim, self._name = weakref.ref(sim), name

    def __call__(self, *args):
        sim = self._sim()
        f = sim._callbacks[self._name]
        return f(*args) if args else sim._after_step(f)


def _case_of(case):
    if isinstance(case, Case):
        return case._core
    if isinstance(case, (str, os.PathLike)):
        return Case(case)._core
    raise InputError(f"a simulation needs an ordo.Case or the path of one (got {type(case).__name__})")


def _threads(threads):
    if threads is None:
        return None
    if isinstance(threads, bool) or not hasattr(threads, "__index__"):
        raise InputError(f"threads: must be a whole number (got {threads!r})")
    return threads.__index__()


def _real(name, value):
    try:
        return float(value)
    except (TypeError, ValueError):
        raise InputError(f"{name}: must be a number, s (got {value!r})") from None
