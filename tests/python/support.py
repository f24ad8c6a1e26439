"""What the tests of the Python module share. ORDO is the path of the program, ORDO_ROOT that of the repository."""

import copy
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ORDO = os.environ["ORDO"]
ROOT = pathlib.Path(os.environ["ORDO_ROOT"])
TWO_DISKS = ROOT / "cases" / "two-disks" / "case.toml"

BLOCK = {
    "grid": {"size": [1.0, 1.0], "spacing": [0.125, 0.125]},
    "method": {"preset": "cpdi1"},
    "time": {"end": 0.02, "dt": 0.0005},
    "material": [{"name": "rubber", "model": "neo-hookean", "density": 1000.0, "young": 1e5, "poisson": 0.3}],
    "body": [{"material": "rubber", "shape": "box", "lower": [0.25, 0.25], "upper": [0.75, 0.75], "velocity": ["0.5*sin(6*x)", "0.3*cos(5*y)"]}],
}


def block(**changes):
    """The case of a block that vibrates, as a dict, with changes: `grid__spacing=0.1` sets a key, `material=[..]` a table."""
    case = copy.deepcopy(BLOCK)
    for key, value in changes.items():
        table, _, name = key.partition("__")
        if not name:
            case[table] = value
        elif isinstance(case.get(table), list):
            case[table][0][name] = value
        else:
            case.setdefault(table, {})[name] = value
    return case


def python(code, cwd, timeout=300):
    """Runs code in a new interpreter that imports ordo as this one does."""
    return subprocess.run([sys.executable, "-c", code], cwd=cwd, capture_output=True, text=True, timeout=timeout, check=False)


def program(*args, cwd):
    """Runs the program, which must succeed."""
    done = subprocess.run([ORDO, *map(str, args)], cwd=cwd, capture_output=True, text=True, timeout=600, check=False)
    if done.returncode != 0:
        raise AssertionError(f"ordo {args}: {done.returncode}\n{done.stderr}")
    return done


def has(library):
    """Whether ordo was built with it: HDF5 (checkpoints), Gmsh (meshes)."""
    return re.search(rf"^{library} +yes", program("--version", cwd=".").stdout, re.MULTILINE) is not None


needs_hdf5 = unittest.skipUnless(has("HDF5"), "ordo was built without HDF5")


class InTemporaryDirectory(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.dir = pathlib.Path(folder.name)
