"""Your own rebound model.

The class `Sand` in `scenes/sand.py` gives back less of a faster impact, and `scenes/sand.yaml` names it as its rebound.
The script flies the same rocks with the model `constant` and with `Sand`, and compares how far they go.
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
