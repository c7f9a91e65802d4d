"""A run in ten lines.

A hundred rocks leave the crest of a synthetic open pit. The script prints where and when each rock stops.
"""

from pathlib import Path

import rpf3d_core as rpf3d

scene = Path(__file__).parent / "scenes" / "wall.yaml"
run = rpf3d.simulate(scene, rocks=100)
deposits = run.flights.deposits
places = run.terrain.frame.points_to_input(deposits.x)
for rock, (x, y, z) in enumerate(places):
    print(f"rock {rock:2d} stops at x {x:6.1f}, y {y:5.1f}, z {z:6.1f} m after {deposits.t[rock]:4.1f} s")
