"""What the regression tests share: running ordo, a minimal valid case and its edits, reading what was written.

ORDO is the path of the binary, ORDO_ROOT that of the repository.
"""

import csv
import os
import pathlib
import re
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree

import vtk
from vtk.util.numpy_support import vtk_to_numpy

ORDO = os.environ["ORDO"]
ROOT = pathlib.Path(os.environ["ORDO_ROOT"])
TWO_DISKS = ROOT / "cases" / "two-disks" / "case.toml"
PRESETS = ("mpm", "ugimp", "cpgimp", "cpdi1")

# Single numbers stand for every axis, so that `dim` alone makes it a case in 1D or 3D.
CASE = """\
[grid]
dim = 2
size = 1.0
spacing = 0.25

[time]
end = 0.01
dt = 0.001

[[material]]
name = "rubber"
density = 1000.0
young = 1000.0
poisson = 0.3

[[body]]
material = "rubber"
shape = "ball"
center = 0.5
radius = 0.25
"""

HANG = 600  # s after which a program counts as hanging: no machine is so busy


def edit(text, *changes):
    """The text with changes: a pair replaces, a string is added at the end."""
    for change in changes:
        if isinstance(change, str):
            text += change
            continue
        old, new = change
        if text.count(old) != 1:
            raise ValueError(f"{old!r} stands {text.count(old)} times in the text")
        text = text.replace(old, new)
    return text


def start(*args, cwd, preload=None, launcher=(), **how):
    """Starts ordo, by a launcher; with the functions of a shared library in the place of those of the system."""
    more = {"LD_PRELOAD": str(preload), "ASAN_OPTIONS": os.environ.get("ASAN_OPTIONS", "") + ":verify_asan_link_order=0"} if preload else {}
    return subprocess.Popen([*launcher, ORDO, *map(str, args)], cwd=cwd, text=True, errors="backslashreplace", env={**os.environ, **more},
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, **how)


def ordo(*args, cwd, **how):
    """Runs ordo to its end: returncode, stdout, stderr. `how` is that of start."""
    process = start(*args, cwd=cwd, **how)
    try:
        out, err = process.communicate(timeout=HANG)
    finally:
        process.kill()
    return subprocess.CompletedProcess(process.args, process.returncode, out, err)


def presets():
    """The names of all presets."""
    text = subprocess.run([ORDO, "list", "methods"], capture_output=True, text=True, check=True).stdout
    return re.findall(r"^  (\S+) ", text.split("\n\n")[0], re.MULTILINE)


def is_built_with(library):
    return re.search(rf"^{library} +yes", ordo("--version", cwd=".").stdout, re.MULTILINE) is not None


def has_hdf5():
    """Whether ordo writes checkpoints."""
    return is_built_with("HDF5")


def has_gmsh():
    """Whether ordo reads meshes."""
    return is_built_with("Gmsh")


def history(directory, name="history.csv"):
    """The columns of history.csv, or of another table, by name."""
    with open(pathlib.Path(directory) / name, newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: [float(row[name]) for row in rows] for name in rows[0]}


def frames(directory, kind="particles"):
    """Times and paths of the frames that particles.pvd or grid.pvd lists."""
    directory = pathlib.Path(directory)
    sets = xml.etree.ElementTree.parse(directory / f"{kind}.pvd").iter("DataSet")
    return [(float(s.get("timestep")), directory / s.get("file")) for s in sets]


def read_vtk(path):
    """The data set of a VTU or VTI file, as VTK's own reader sees it."""
    if not path.read_bytes().endswith(b"</VTKFile>\n"):
        raise ValueError(f"{path} is not whole")
    reader = vtk.vtkXMLUnstructuredGridReader() if path.suffix == ".vtu" else vtk.vtkXMLImageDataReader()
    errors = []
    reader.AddObserver("ErrorEvent", lambda *_: errors.append(path))
    reader.SetFileName(str(path))
    reader.Update()
    if errors or reader.GetErrorCode() or reader.GetOutput().GetNumberOfCells() == 0:
        raise ValueError(f"{path} cannot be read")
    return reader.GetOutput()


def arrays(attributes):
    """The arrays of a PointData, CellData or FieldData by name."""
    return {attributes.GetArrayName(k): vtk_to_numpy(attributes.GetArray(k)) for k in range(attributes.GetNumberOfArrays())}


def particle_data(data):
    """The fields of a particle frame: on cells where particles have domains, else on vertices."""
    return arrays(data.GetCellData() if data.GetCellData().GetNumberOfArrays() else data.GetPointData())


def contents(directory):
    """Every file below a directory with its bytes."""
    directory = pathlib.Path(directory)
    return {str(p.relative_to(directory)): p.read_bytes() for p in sorted(directory.rglob("*")) if p.is_file()}


class InTemporaryDirectory(unittest.TestCase):
    def setUp(self):
        holder = tempfile.TemporaryDirectory()
        self.addCleanup(holder.cleanup)
        self.dir = pathlib.Path(holder.name)

    def write(self, name, text):
        path = self.dir / name
        path.write_text(text)
        return path

    def assert_same_files(self, one, other):
        """Of two directories, by bytes."""
        a, b = contents(self.dir / one), contents(self.dir / other)
        self.assertEqual(a.keys(), b.keys())
        self.assertEqual([name for name in a if a[name] != b[name]], [], f"files of {one} and {other} differ")

    def run_good(self, *args):
        """Runs `ordo run` on one thread, over earlier results if it is no restart, and requires success."""
        more = [*(() if "--threads" in args else ("--threads", "1")), *(() if "--restart" in args else ("--overwrite",))]
        done = ordo("run", *args, "--quiet", *more, cwd=self.dir)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done
