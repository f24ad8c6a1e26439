#!/usr/bin/python3
"""Makes the meshes of this folder, which tests/unit/meshes.cpp reads. Needs Debian's python3-gmsh (4.8 made those here).

Usage: tests/data/make_meshes.py [DIR], the folder of this file by default. Lengths are in m.
"""

import sys
from math import cos, pi, sin
from pathlib import Path

import gmsh


def points(coordinates):
    return [gmsh.model.geo.addPoint(*(list(x) + [0] * (3 - len(x)))) for x in coordinates]


def loop(corners):
    """The curves of a polygon, numbered as its sides."""
    return [gmsh.model.geo.addLine(a, b) for a, b in zip(corners, corners[1:] + corners[:1])]


def surface(curves):
    return gmsh.model.geo.addPlaneSurface([gmsh.model.geo.addCurveLoop(curves)])


def transfinite(curves, cells):
    for curve in curves:
        gmsh.model.geo.mesh.setTransfiniteCurve(curve, cells + 1)


def group(dim, entities, name):
    gmsh.model.setPhysicalName(dim, gmsh.model.addPhysicalGroup(dim, entities), name)


def bar():
    """Segments on [0, 2], two groups of unlike size."""
    a, b, c = points([(0,), (0.5,), (2,)])
    left, right = gmsh.model.geo.addLine(a, b), gmsh.model.geo.addLine(c, b)  # the right one runs to the left
    transfinite([left], 4)
    transfinite([right], 3)
    gmsh.model.geo.synchronize()
    group(1, [left], "left")
    group(1, [right], "right")
    return 1


def quarter_ring():
    """Quadrilaterals, 3 x 12, between the radii 0.4 and 0.6, angles 0 to pi/2."""
    centre, a, b, c, d = points([(0, 0), (0.4, 0), (0.6, 0), (0, 0.6), (0, 0.4)])
    radial = gmsh.model.geo.addLine(a, b), gmsh.model.geo.addLine(c, d)
    outer, inner = gmsh.model.geo.addCircleArc(b, centre, c), gmsh.model.geo.addCircleArc(d, centre, a)
    ring = surface([radial[0], outer, radial[1], inner])
    transfinite(radial, 3)
    transfinite([outer, inner], 12)
    gmsh.model.geo.mesh.setTransfiniteSurface(ring)
    gmsh.model.geo.mesh.setRecombine(2, ring)
    gmsh.model.geo.synchronize()
    group(2, [ring], "ring")
    group(1, [outer], "outer")
    return 2


def halves(recombine_left):
    """The unit square of two halves that share the line x = 0.5, in the plane z = 0.25."""
    a, b, c, d, e, f = points([(x, y, 0.25) for x, y in ((0, 0), (0.5, 0), (1, 0), (1, 1), (0.5, 1), (0, 1))])
    shared = gmsh.model.geo.addLine(b, e)
    left_curves = [gmsh.model.geo.addLine(a, b), shared, gmsh.model.geo.addLine(e, f), gmsh.model.geo.addLine(f, a)]
    right_curves = [gmsh.model.geo.addLine(b, c), gmsh.model.geo.addLine(c, d), gmsh.model.geo.addLine(d, e), -shared]
    left, right = surface(left_curves), surface(right_curves)
    transfinite(left_curves + right_curves[:3], 4)
    if recombine_left:
        gmsh.model.geo.mesh.setTransfiniteSurface(left)
        gmsh.model.geo.mesh.setRecombine(2, left)
    gmsh.model.geo.synchronize()
    group(2, [left], "left")
    group(2, [right], "right")
    group(1, [right_curves[1]], "edge")
    return 2


def cube(cells, kind):
    """The unit cube, turned by 0.3 about z, as tetrahedra or as hexahedra."""
    turned = [(x * cos(0.3) - y * sin(0.3), x * sin(0.3) + y * cos(0.3)) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    square = surface(loop(points(turned)))
    if kind == "hexes":
        gmsh.model.geo.synchronize()
        transfinite([curve for _, curve in gmsh.model.getEntities(1)], cells)
        gmsh.model.geo.mesh.setTransfiniteSurface(square)
        gmsh.model.geo.mesh.setRecombine(2, square)
        made = gmsh.model.geo.extrude([(2, square)], 0, 0, 1, numElements=[cells], recombine=True)
    else:
        made = gmsh.model.geo.extrude([(2, square)], 0, 0, 1)
    gmsh.model.geo.synchronize()
    if kind == "tets":
        gmsh.option.setNumber("Mesh.MeshSizeMin", 1 / cells)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 1 / cells)
    group(3, [tag for dim, tag in made if dim == 3], "cube")
    group(2, [square], "bottom")
    return 3


MESHES = [  # file, version of the format, binary, maker
    ("bar.msh", 2.2, 0, bar),
    ("quarter_ring.msh", 2.2, 0, quarter_ring),
    ("square.msh", 4.1, 0, lambda: halves(recombine_left=False)),
    ("mixed.msh", 4.1, 1, lambda: halves(recombine_left=True)),
    ("cube_tets.msh", 4.1, 0, lambda: cube(2, "tets")),
    ("cube_hexes.msh", 2.2, 1, lambda: cube(3, "hexes")),
]


def main():
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parent
    for name, version, binary, make in MESHES:
        gmsh.initialize(readConfigFiles=False)
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.model.mesh.generate(make())
        gmsh.write(str(folder / name))
        gmsh.finalize()


if __name__ == "__main__":
    main()
