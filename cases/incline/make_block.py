#!/usr/bin/env python3
"""Prints block.csv: a block of 0.4 m x 0.2 m on a plane that falls by 30 degrees from (0, 2), in 16 x 8 particles."""

import math

ANGLE = math.radians(30)
ALONG, NORMAL = (math.cos(ANGLE), -math.sin(ANGLE)), (math.sin(ANGLE), math.cos(ANGLE))
START, SIDE = 0.4, 0.025  # m down the plane, of a particle

print("x,y,volume,r1x,r1y,r2x,r2y")
for i in range(16):
    for j in range(8):
        down, up = START + (i + 0.5) * SIDE, (j + 0.5) * SIDE
        x = [origin + down * a + up * n for origin, a, n in zip((0.0, 2.0), ALONG, NORMAL)]
        edges = [c * SIDE / 2 for c in (*ALONG, *NORMAL)]
        print(",".join(f"{v:.10g}" for v in (*x, SIDE**2, *edges)))
