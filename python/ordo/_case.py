"""Cases: the same input as that of `ordo run`."""

import os
import re
from pathlib import Path

import numpy as np

from . import _core
from ._errors import InputError


def _toml(value, key):
    """A value as TOML in one line."""
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    if isinstance(value, (str, Path)):
        escaped = "".join(c if c >= " " and c not in '"\\' and c != "\x7f" else f"\\u{ord(c):04x}" for c in str(value))
        return f'"{escaped}"'
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_toml_key(k, key)} = {_toml(v, f'{key}.{k}')}" for k, v in value.items()) + "}"
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml(one, key) for one in value) + "]"
    raise InputError(f"case: {key}: cannot be {type(value).__name__}; give a number, a string, true or false, a list or a dict")


def _toml_key(key, path):
    if not isinstance(key, str):
        raise InputError(f"case: {path}: keys must be strings (got {key!r})")
    return _toml(key, path)


def _settings(overrides):
    if overrides is None:
        return []
    if not isinstance(overrides, dict):
        raise InputError(f'case: overrides must be a dict such as {{"method.preset": "cpls"}} (got {type(overrides).__name__})')
    for key in overrides:
        if not isinstance(key, str):
            raise InputError(f"case: overrides: keys must be strings (got {key!r})")
    return [f"{key}={_toml(value, key)}" for key, value in overrides.items()]


def named(call):
    """call(), whose errors name neither options of the command line nor places in the text that a dict becomes."""
    try:
        return call()
    except InputError as e:
        text = re.sub(r"^--set(?= |:)", "overrides", str(e))
        raise InputError(re.sub(r"^case:\d+:\d+: ", "case: ", text)) from None


class Case:
    """A resolved case.

    Parameters
    ----------
    file : path
        A TOML file, as for `ordo run`.
    overrides : dict, optional
        Keys and values as for `--set`, such as ``{"method.preset": "cpls", "time.dt": 0.005}``.

    Raises
    ------
    InputError
        With file, line, key and remedy.

    `print(case)` shows the case as TOML with every default.
    """

    def __init__(self, file, overrides=None):
        if not isinstance(file, (str, os.PathLike)):
            raise InputError(f"case: file must be a path (got {type(file).__name__}); Case.from_dict takes a dict")
        self._core = named(lambda: _core.Case.read(os.fspath(file), _settings(overrides)))

    @classmethod
    def from_dict(cls, tables, overrides=None):
        """A case from a dict of tables, in the schema of the file: ``{"grid": {...}, "material": [{...}], ...}``. Names of files are
        relative to the working directory."""
        if not isinstance(tables, dict):
            raise InputError(f"case: must be a dict of tables (got {type(tables).__name__})")
        text = "".join(f"{_toml_key(key, 'case')} = {_toml(value, key)}\n" for key, value in tables.items())
        self = cls.__new__(cls)
        self._core = named(lambda: _core.Case.parse(text, "case", _settings(overrides)))
        return self

    @property
    def dim(self):
        """Number of axes, 1 to 3."""
        return self._core.dim

    @property
    def name(self):
        """Name of the file, or of its folder if it is case.toml."""
        return self._core.name

    @property
    def title(self):
        """Title of the case."""
        return self._core.title

    @property
    def end(self):
        """Time at which a run ends by default, s; with stages the sum of their durations counts instead."""
        return self._core.end

    def to_dict(self):
        """The resolved case as a dict, which `from_dict` takes."""
        import tomllib

        return tomllib.loads(str(self))

    def __str__(self):
        return self._core.text()

    def __repr__(self):
        return f"<ordo.Case {self.name!r}, {self.dim}D>"
