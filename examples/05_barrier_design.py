"""The design of a barrier.

The script first places a barrier where a fence is planned. With capacity 0, the barrier stops no rock: it only counts
the rocks and records their energies and heights. From these figures the script chooses a fence. It then flies the rocks
again, and prints the share of the rocks at the fence that the fence catches.
"""

import json
from pathlib import Path

import yaml

import rpf3d_core as rpf3d

SCENES, OUT = Path(__file__).parent / "scenes", Path("out/barrier_design")
CLASSES_KJ = (100, 250, 500, 1000, 1500, 2000, 3000, 4500)  # unconfirmed: look them up for the product
ALONG = [[-142, -50], [-145, 0], [-142, 50]]  # m, in plan: between the toe of the slope and the road


def fly(name: str, height: float, capacity_kj: float) -> dict:
    """Fly the scene of the road with a fence; return counts, energies (J) and heights (m) of rocks at the fence.

    name : name of the scene file and of the result folder; height : height of the fence (m)
    capacity_kj : largest energy that the fence can stop (kJ)
    """
    scene = yaml.safe_load((SCENES / "road.yaml").read_text())
    fence = {"name": "fence", "along": ALONG, "height": height, "capacity_kj": capacity_kj}
    scene["effects"] = {"barriers": {"panels": [fence]}}
    scene["areas_of_interest"][0]["polygons"] = str((SCENES / "road.geojson").resolve())
    OUT.mkdir(parents=True, exist_ok=True)
    (OUT / f"{name}.yaml").write_text(yaml.safe_dump(scene))
    run = rpf3d.simulate(OUT / f"{name}.yaml")
    rpf3d.write_run(run, OUT / name, recording=False)
    summary = json.loads((OUT / name / "summary.json").read_text())
    on_road = summary["areas_of_interest"]["road"]["reached"]["share"]
    print(f"{name}: {on_road:.1%} of the rocks reach the road")
    return summary["barriers"]["fence"]


counted = fly("no_fence", height=10, capacity_kj=0)
energy_kj = counted["first_energy_j"]["p95_interval_95"][1] / 1000  # the upper end of the interval: the safe side
height = counted["first_height_over_ground_m"]["p95_interval_95"][1]
print(f"p95 at the fence, upper ends: {energy_kj:.0f} kJ and {height:.1f} m over the ground")

capacity = next(kj for kj in CLASSES_KJ if kj >= energy_kj)
high = round(height + 0.5, 1)  # m: half the diameter of a rock above its centre
print(f"chosen: a fence of {capacity} kJ, {high:.1f} m high")
caught = fly("with_fence", high, capacity)["first_caught"]
low, up = caught["interval_95"]
print(f"the fence catches {caught['share']:.1%} of the rocks that come to it ({low:.1%} to {up:.1%})")
