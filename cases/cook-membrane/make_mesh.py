#!/usr/bin/python3
"""Writes membrane.msh, Cook's trapezoid in m, as quadrilaterals along its sides.

Usage: cases/cook-membrane/make_mesh.py [CELLS], per side, 36 by default.
"""

import sys
from pathlib import Path


def main():
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 36
    file = Path(__file__).parent / "membrane.msh"
    nodes = []
    for j in range(n + 1):
        for i in range(n + 1):
            x, up = 0.048 * i / n, j / n
            low, high = 0.044 * i / n, 0.044 + 0.016 * i / n
            nodes.append((x, low + up * (high - low)))
    quads = [(k, k + 1, k + n + 2, k + n + 1) for j in range(n) for k in range(j * (n + 1) + 1, j * (n + 1) + n + 1)]
    with open(file, "w", encoding="ascii") as out:
        print("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes", file=out)
        print(len(nodes), file=out)
        for k, (x, y) in enumerate(nodes, 1):
            print(f"{k} {x:.12g} {y:.12g} 0", file=out)
        print(f"$EndNodes\n$Elements\n{len(quads)}", file=out)
        for k, corners in enumerate(quads, 1):  # type 3, quadrilateral, with two tags
            print(k, 3, 2, 1, 1, *corners, file=out)
        print("$EndElements", file=out)


main()
