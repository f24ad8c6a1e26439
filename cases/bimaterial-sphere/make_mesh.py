#!/usr/bin/python3
"""Makes sphere_in_cube.msh, hexahedra of a sphere and of the cube around it. Needs Debian's python3-gmsh.

Usage: make_mesh.py [--n 5] [--inner 3] [--outer 7] [FILE], by default sphere_in_cube.msh in the folder of this file.

One eighth of a sphere of radius 0.5 m in the middle of a cube of half-side 1 m: [0, 1]^3 with the centre at the origin and
symmetry planes x = 0, y = 0, z = 0. The groups "sphere" and "cube" share the nodes of their interface. Those lie on the
sphere, those of the boundary in its planes. Lengths are in m.

Seven blocks: a bulged core of n^3 cells, three of n^2 x inner cells from its outer faces to the sphere, three of
n^2 x outer cells from the sphere to the faces of the cube. From each node of the core's outer faces a line of nodes runs to
the sphere, and from there along the radius to the cube.
"""

import argparse
from itertools import product
from pathlib import Path

import gmsh
import numpy as np

RADIUS = 0.5
HEXAHEDRON = 5  # its number in Gmsh
SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]  # corners in Gmsh's order

# From scans for the best scaled Jacobian of the sphere (0.76) and small volume ratios of neighbours (at most 2.2).
CORE = 0.27  # length of the core along an axis
BULGE = 0.15, 0.07  # of the core's faces: 0, 0 is a cube; 0.29, 0.16 nearly a ball


def core(u):
    """Nodes of the core at the places u of the unit cube."""
    v, w = (np.roll(u, shift, axis=1) ** 2 for shift in (1, 2))
    return CORE * u * (1 - BULGE[0] * (v + w) + BULGE[1] * v * w)


def shells(u, inner, outer):
    """Layers of nodes from the core to the cube, those of the core left out, on the lines from the places u of its faces."""
    cube = np.where(u == 1, 1, np.tan(u * np.pi / 4))  # at equal angles
    distance = np.linalg.norm(cube, axis=1, keepdims=True)
    sphere = RADIUS * cube / distance
    layers = [(1 - f) * core(u) + f * sphere for f in np.arange(1, inner + 1) / inner]
    for f in np.arange(1, outer + 1) / outer:
        # Starts with slope (1 - R) / (distance - R): cells at the sphere have the same thickness everywhere as on the axes.
        part = f * (f + (1 - f) * (1 - RADIUS) / (distance - RADIUS))
        layers.append((1 - part) * sphere + part * cube)
    return np.concatenate(layers)


def make(n, inner, outer):
    """Nodes, and for each group the eight of each cell in Gmsh's order."""
    lattice = np.array(list(product(range(n + 1), repeat=3)))
    faces = lattice[lattice.max(axis=1) == n]
    nodes = np.concatenate([core(lattice / n), shells(faces / n, inner, outer)])
    in_core = {tuple(place): k for k, place in enumerate(lattice)}
    on_faces = {tuple(place): k for k, place in enumerate(faces)}

    def node(place, layer):
        return in_core[place] if layer == 0 else len(lattice) + (layer - 1) * len(faces) + on_faces[place]

    cells = [[node((i + a, j + b, k + c), 0) for c in (0, 1) for a, b in SQUARE] for i, j, k in product(range(n), repeat=3)]
    for layer, axis, i, j in product(range(inner + outer), range(3), range(n), range(n)):
        square = [tuple(np.roll((n, i + a, j + b), axis)) for a, b in SQUARE]
        cells.append([node(place, end) for end in (layer, layer + 1) for place in square])
    in_sphere = n**3 + 3 * n**2 * inner
    return nodes, {"sphere": np.array(cells[:in_sphere]), "cube": np.array(cells[in_sphere:])}


def write(file, nodes, groups):
    gmsh.initialize(readConfigFiles=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
    left, first = np.ones(len(nodes), bool), 1
    for volume, (name, cells) in enumerate(groups.items(), 1):
        gmsh.model.addDiscreteEntity(3, volume)
        own = [k for k in np.unique(cells) if left[k]]  # a node belongs to the first of its volumes
        left[own] = False
        gmsh.model.mesh.addNodes(3, volume, [k + 1 for k in own], nodes[own].ravel())
        gmsh.model.mesh.addElementsByType(volume, HEXAHEDRON, range(first, first + len(cells)), (cells + 1).ravel())
        gmsh.model.setPhysicalName(3, gmsh.model.addPhysicalGroup(3, [volume]), name)
        first += len(cells)
    gmsh.write(str(file))
    gmsh.finalize()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--n", type=int, default=5, help="cells along an edge of the core")
    parser.add_argument("--inner", type=int, default=3, help="cells from the core to the sphere")
    parser.add_argument("--outer", type=int, default=7, help="cells from the sphere to the faces of the cube")
    parser.add_argument("file", nargs="?", default=Path(__file__).resolve().parent / "sphere_in_cube.msh")
    a = parser.parse_args()
    nodes, groups = make(a.n, a.inner, a.outer)
    write(a.file, nodes, groups)
    print(f"{a.file}: {len(nodes)} nodes, " + ", ".join(f"{len(cells)} cells of the {name}" for name, cells in groups.items()))


if __name__ == "__main__":
    main()
