"""Writes driver.msh and driven.msh: spur gears of module 0.08 m with stub teeth, involute flanks of 20 degrees, and 0.01 m of backlash."""

import math

MODULE, PRESSURE, BACKLASH = 0.08, math.radians(20), 0.01
ACROSS, LAND, HEIGHT = 6, 3, 8  # cells: across a tooth, between two teeth, along a tooth


def involute(angle):
    return math.tan(angle) - angle


def gear(teeth, bore, layers, center, turn):
    pitch = MODULE * teeth / 2
    base, root, tip = pitch * math.cos(PRESSURE), pitch - MODULE, pitch + 0.8 * MODULE

    def half_angle(radius):  # of a tooth; flanks below the base circle are radial
        on = math.acos(base / radius) if radius > base else 0.0
        return math.pi / (2 * teeth) - BACKLASH / (4 * pitch) + involute(PRESSURE) - involute(on)

    nodes, cells, numbers = [], [], {}

    def node(angle, radius):
        x = [center[0] + radius * math.cos(turn + angle), center[1] + radius * math.sin(turn + angle)]
        key = tuple(round(v * 1e7) for v in x)
        if key not in numbers:
            nodes.append(x)
            numbers[key] = len(nodes)
        return numbers[key]

    def add(at, columns, rows):
        """Cells of a patch; at(i, j): angle and radius, i along the rim, j outwards."""
        for i in range(columns):
            for j in range(rows):
                cells.append([node(*at(*k)) for k in ((i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j))])

    for k in range(teeth):
        middle, half = 2 * math.pi * k / teeth, half_angle(root)
        gap = 2 * math.pi / teeth - 2 * half  # between the roots of two teeth

        def in_core(angles, j):
            return angles, bore + (root - bore) * j / layers

        add(lambda i, j: in_core(middle + half * (2 * i / ACROSS - 1), j), ACROSS, layers)
        add(lambda i, j: in_core(middle + half + gap * i / LAND, j), LAND, layers)

        def in_tooth(i, j):
            radius = root + (tip - root) * j / HEIGHT
            return middle + half_angle(radius) * (2 * i / ACROSS - 1), radius

        add(in_tooth, ACROSS, HEIGHT)
    return nodes, cells


def write(file, nodes, cells):
    with open(file, "w", encoding="ascii") as f:
        f.write(f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{len(nodes)}\n")
        f.writelines(f"{k + 1} {x:.7f} {y:.7f} 0\n" for k, (x, y) in enumerate(nodes))
        f.write(f"$EndNodes\n$Elements\n{len(cells)}\n")
        f.writelines(f"{k + 1} 3 2 1 1 {' '.join(str(c) for c in cell)}\n" for k, cell in enumerate(cells))
        f.write("$EndElements\n")


write("driver.msh", *gear(12, 0.2, 8, (0.6, 0.84), -0.0102))  # nearly touches
write("driven.msh", *gear(18, 0.3, 14, (1.8, 0.84), math.pi + math.pi / 18))
