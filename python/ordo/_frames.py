"""Frames of particles that runs have written."""

import os
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ._errors import InputError

# Dimensions of VTK's cell types; the corners of a triangle as those of a quad, of a tetrahedron as those of a hexahedron.
DIMS = {1: 0, 3: 1, 5: 2, 9: 2, 10: 3, 12: 3}
POINTS_OF_ONE_CELL = 2  # VTK_POLY_VERTEX
SIMPLEX_CORNERS = {5: [0, 1, 2, 2], 10: [0, 1, 2, 2, 3, 3, 3, 3]}


class Frame:
    """The particles of one VTU file in the order of their id; reading needs VTK (python3-vtk9).

    time: s; x (n, 3): centres, m; corners (n, k, 3): of the drawn domains in VTK's order, k = 2, 4, 8 in 1D, 2D, 3D, and 1 for points;
    fields: arrays by name (docs/output.md); dim: of the domains, None for points.
    """

    def __init__(self, file):
        try:
            from vtkmodules.util.numpy_support import vtk_to_numpy
            from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader
        except ImportError as e:
            raise ImportError(f"{e}; reading frames needs VTK: apt-get install python3-vtk9, or pip install vtk") from None
        if not Path(file).is_file():
            raise InputError(f"{file}: there is no such file")
        with open(file, "rb") as stream:  # on a part of a file VTK crashes
            stream.seek(-min(64, Path(file).stat().st_size), os.SEEK_END)
            if not stream.read().rstrip().endswith(b"</VTKFile>"):
                raise InputError(f"{file}: is no VTU file, or only a part of one")
        reader = vtkXMLUnstructuredGridReader()
        reader.SetFileName(str(file))
        reader.Update()
        grid = reader.GetOutput()
        if grid.GetNumberOfCells() == 0:
            raise InputError(f"{file}: holds no particles")
        points = vtk_to_numpy(grid.GetPoints().GetData())
        types = vtk_to_numpy(grid.GetCellTypesArray())
        ids, starts = vtk_to_numpy(grid.GetCells().GetConnectivityArray()), vtk_to_numpy(grid.GetCells().GetOffsetsArray())
        if np.all(types == POINTS_OF_ONE_CELL):  # output.particles = "points"
            types, starts = np.ones(len(ids), dtype=int), np.arange(len(ids) + 1)
        kinds = np.unique(types)
        self.dim = max(DIMS[t] for t in kinds) or None
        width = 2 ** (self.dim or 0)
        self.corners = np.empty((len(types), width, 3))
        for t in kinds:
            cells = starts[:-1][types == t]
            for k, corner in enumerate(SIMPLEX_CORNERS.get(t, range(width))):
                self.corners[types == t, k] = points[ids[cells + corner]]
        data = grid.GetCellData() if self.has_domains else grid.GetPointData()
        self.fields = {data.GetArrayName(k): vtk_to_numpy(data.GetArray(k)) for k in range(data.GetNumberOfArrays())}
        self.x = self.fields["position"] if self.has_domains else points
        self.time = float(vtk_to_numpy(grid.GetFieldData().GetArray("TimeValue"))[0])

    @property
    def has_domains(self):
        return self.dim is not None


class Frames(Sequence):
    """The frames of a folder of results: `times` and `files`, and each `Frame` by number, read when it is asked for."""

    def __init__(self, times, files):
        self.times, self.files = np.asarray(times), files

    @classmethod
    def of(cls, directory):
        file = Path(directory) / "particles.pvd"
        if not file.is_file():
            raise InputError(f"{file}: there is no such file; give the folder of a run, such as results/two-disks")
        try:
            rows = [(float(row.get("timestep")), file.parent / row.get("file")) for row in ElementTree.parse(file).getroot().iter("DataSet")]
        except (ElementTree.ParseError, TypeError, ValueError) as e:
            raise InputError(f"{file}: is not a list of frames ({e})") from None
        if not rows:
            raise InputError(f"{file}: names no frames")
        return cls(*zip(*rows))

    def __len__(self):
        return len(self.files)

    def __getitem__(self, k):
        return Frames(self.times[k], self.files[k]) if isinstance(k, slice) else Frame(self.files[k])


def frames(directory):
    """The particles that a run has written: a sequence of `Frame` with `times`, s.

        last = ordo.frames("results/two-disks")[-1]
        last.x, last.fields["velocity"]

    Each frame is read when it is asked for; this needs VTK (python3-vtk9).
    """
    return Frames.of(directory)
