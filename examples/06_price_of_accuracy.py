"""The price of accuracy.

rpf3d computes the exact place of each impact, event by event. Other programs move rocks in fixed time steps. The script
flies the same rocks with both methods. For each length of the time step, the script prints the median error in the
place of the first impact, and the mean number of steps of a rock.
"""

from pathlib import Path

import numpy as np
import yaml

import rpf3d_core as rpf3d

SCENES, OUT, ROCKS = Path(__file__).parent / "scenes", Path("out/price_of_accuracy"), 20


def fly(method: object) -> rpf3d.Run:
    """Fly 20 rocks in the scene of the road, and return the run.

    method : value of the scene's key `method`: "events", or {"stepping": {...}} for fixed time steps
    """
    scene = yaml.safe_load((SCENES / "road.yaml").read_text())
    scene |= {"method": method, "areas_of_interest": [], "engine": "reference"}
    OUT.mkdir(parents=True, exist_ok=True)
    (OUT / "scene.yaml").write_text(yaml.safe_dump(scene))
    return rpf3d.simulate(OUT / "scene.yaml", rocks=ROCKS)


def first_impacts(run: rpf3d.Run) -> np.ndarray:
    """Return the place of the first impact of each rock, (rocks, 3) m."""
    impacts = run.flights.impacts
    return impacts.x[np.searchsorted(impacts.row, np.arange(ROCKS))]  # sorted by rock, then by time


exact = fly("events")
events = exact.flights.deposits.impacts.mean()
print(f"event by event: exact,             {events:9,.0f} impacts a rock")
steps, errors = [], []
for dt in (0.01, 0.003, 0.001, 0.0003, 0.0001):
    run = fly({"stepping": {"dt": dt, "threshold": 20 * dt}})  # a contact is a distance to the ground below 20 dt (m)
    off = np.linalg.norm(first_impacts(run) - first_impacts(exact), axis=1)
    errors.append(float(np.median(off)))
    steps.append(float(run.flights.deposits.t.mean() / dt))
    print(f"steps of {dt:6.4f} s: off by {errors[-1]:6.4f} m, {steps[-1]:9,.0f} steps a rock")
