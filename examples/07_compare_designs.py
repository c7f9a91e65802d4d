"""Two designs of a slope.

A windrow (a ridge of loose rock) protects a road below a face. In design A the windrow is six metres from the toe of
the face; in design B it is at the toe. The script flies the same rocks over both designs. `rpf3d compare` then shows
which differences are larger than chance alone explains.
"""

import json
import subprocess
import sys
from pathlib import Path

import rpf3d_core as rpf3d

SCENES, OUT = Path(__file__).parent / "scenes", Path("out/compare_designs")
COMPARE = [sys.executable, "-m", "rpf3d_core.cli", "compare"]  # the command `rpf3d compare`

run_a = rpf3d.simulate(SCENES / "berm_far.yaml")
run_b = rpf3d.simulate(SCENES / "berm_near.yaml")
a = rpf3d.write_run(run_a, OUT / "A", recording=False)
b = rpf3d.write_run(run_b, OUT / "B", recording=False)

printed = subprocess.run([*COMPARE, a, b, "--json"], check=True, capture_output=True, text=True).stdout
for row in json.loads(printed)["differences"]:
    if row["place"] == "road":  # the area of interest
        low, high = row["interval_95"]
        words = "significant" if row["significant"] else "may be chance"
        print(f"road {row['measure']}: A {row['a']['share']:.1%}, B {row['b']['share']:.1%}", end="; ")
        print(f"B - A is {low:+.1%} to {high:+.1%}, {words}")
