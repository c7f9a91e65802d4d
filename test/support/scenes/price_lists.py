"""Make an invented price list of accuracy for tests: error and time of each choice of a scene, in round figures."""

import math
from typing import Any

from rpf3d_core.accuracy.price_list import EVENTS, Priced, PriceList

STEPS = {"method": "stepping", "dt": 1e-3, "threshold": 0.05, "squared": False}


def price_list(**changes: Any) -> PriceList:
    """Return a price list with errors and times (s) that are easy to add; changes : attributes to replace."""
    statistical = [Priced({"rocks": n}, 2.0 / math.sqrt(n), 0.01, {"seconds": 1e-5 * n}) for n in (100, 400, 1600)]
    numerical = [
        Priced(EVENTS, 0.0, 0.01, {}), Priced(STEPS, 0.02, 5.0, {}), Priced({**STEPS, "dt": 1e-1}, 0.4, 0.001, {}),
    ]  # fmt: skip
    geometric = [
        Priced({"part": 1, "triangles": 800}, 0.0, 0.010, {}), Priced({"part": 2, "triangles": 400}, 0.01, 0.004, {}),
        Priced({"part": 4, "triangles": 200}, 0.2, 0.001, {}),
    ]  # fmt: skip
    base: dict[str, Any] = {
        "scene": "a.yaml", "digest": "d", "rocks": 100, "auto": False, "method": EVENTS, "cell": 1.0, "triangles": 800,
        "numerical": numerical, "geometric": geometric, "statistical": statistical, "parametric": [],
        "off_exact": [],
    }  # fmt: skip
    return PriceList(**{**base, **changes})
