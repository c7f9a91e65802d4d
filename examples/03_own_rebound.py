"""Your own rebound model.

The class `Sand` in `examples/scenes/sand.py` is a rebound model: the faster a rock moves into the ground, the smaller
its normal restitution. The scene `examples/scenes/sand.yaml` uses this model. The script flies the same rocks with the
model `constant` and with `Sand`, and compares the distances at which the rocks stop.
"""

from pathlib import Path

import numpy as np

import rpf3d_core as rpf3d

SCENES = Path(__file__).parent / "scenes"


def runouts(scene: Path) -> np.ndarray:
    """Return the horizontal distance (m) from the release to the end of each rock."""
    deposits = rpf3d.simulate(scene, rocks=200).flights.deposits
    return np.hypot(*(deposits.x - deposits.release)[:, :2].T)


results = {"constant": runouts(SCENES / "wall.yaml"), "Sand": runouts(SCENES / "sand.yaml")}
for model, runout in results.items():
    half, most = np.percentile(runout, [50, 95])
    print(f"{model:8s} half of the rocks stop within {half:4.1f} m, 95 of 100 within {most:5.1f} m")
