"""Write docs/reference/effects.md and the table of the README: what a scene may name, and what that costs.

python docs/effects.py            (or make effects: measures every one on a wall first; takes some minutes)
python docs/effects.py --as-is    (from what was measured last)
"""

import json
import re
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rpf3d_core.ensemble.flights import Deposits
from rpf3d_core.ensemble.stream import Shown, Stream
from rpf3d_core.scene.catalogue import COSTS, Offered, offers
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.choices import chosen_scene
from rpf3d_core.setup.prepared import Prepared, prepare, releases_in_ranges
from rpf3d_core.values import Outcome

DOCS = Path(__file__).parent
ROOT = DOCS.parent
WALL = DOCS / "effects_wall.yaml"
"""The scene that all are measured on: plain coefficients, so that only what is named differs."""
MEASURED = ROOT / "rpf3d_core" / COSTS
ROCKS = 4000
PASSES = 7
TITLES = {"rebound": "Rebound models", "ground": "Ground models", "effects": "Effects"}
BASE = {"rebound": "coulomb_limited", "ground": "sliding"}
"""What all are measured against: the defaults of a scene."""

MADE_UP = [[0.0025 if row == column else 0.0 for column in range(9)] for row in range(9)]
EXAMPLES: dict[str, str] = {
    "rebound.angle_table": "{law: wyllie}",
    "rebound.stochastic_matrix": (
        "{mean: [[0.7, 0, 0.1], [0, 0.4, 0], [0.4, 0, 0.3]], covariance: " + str(MADE_UP) + "}"
    ),
    "effects.roughness": "{angle_sd_deg: 8}",
    "effects.drag_layer": "{coefficient: 250}",
    "effects.forest": "{stems_per_ha: 400}",
    "effects.barriers": ("{panels: [{name: crest, along: [[-590, -160], [-590, 160]], height: 3, capacity_kj: 1000}]}"),
}
"""What stands in the scene to measure those that have no sensible default, as YAML."""
BESIDE = {"rebound.coulomb_sphere": "ground: sphere", "ground.sphere": "rebound: coulomb_sphere"}
"""What some of them need in the same scene."""
ROLLING_FRICTION = read_scene(WALL).materials["default"].rolling_friction
"""mu_r (-) of the wall."""
ROLLING = ("rebound.coulomb_sphere", "ground.rolling", "ground.rolling_stone", "ground.sphere")
"""Those that it decides, so the page states it."""
SHOWN = 120
"""Characters of them that the page shows."""

HEAD = """# Models and effects
`rpf3d effects` prints this list, `rpf3d effects --json` the same for programs; `docs/effects.py` writes this page from
it. A scene names one rebound model, one ground model and any number of effects; **what it does not name is not
simulated, not compiled, not imported and draws no random number.**

```yaml
rebound: coulomb_limited         # a name, or a mapping of it to parameters: {v_half: {speed: 10}}
ground: sliding
effects: {roughness: {angle_sd_deg: 8}}
```

How far a figure is confirmed: **C** read in the primary text, **CC** in an independent public implementation, **S**
quoted by another text, **D** derived or checked from first principles. **UNCONFIRMED** is general knowledge: check it
before you rest a decision on it. Models and effects of your own: [own-models.md](../howto/own-models.md).

*Time* is that of a rock on a wall of a synthetic pit (150,000 triangles, `docs/effects_wall.yaml`) over its time with
the defaults of a scene (`coulomb_limited`, `sliding`), without compiling, medians of passes that take turns. *Runout*
is the change of the mean horizontal runout there. Both are figures of one pit: they show the order, not what yours
does.
"""


def document(listed: list[Offered]) -> str:
    """The whole page."""
    return "\n".join([HEAD, *(part for kind, title in TITLES.items() for part in _section(kind, title, listed))])


def _section(kind: str, title: str, listed: list[Offered]) -> list[str]:
    ours = [offer for offer in listed if offer.kind == kind]
    return [f"## {title} (`{kind}:`)", *(_described(offer) for offer in ours)]


def _described(offer: Offered) -> str:
    """One of them: what it does, where it is from, what it costs, its parameters."""
    lines = [f"### `{offer.name}`", offer.summary, "", f"Source: {offer.source} ({offer.confirmed}). {_cost(offer)}"]
    key = f"{offer.kind}.{offer.name}"
    example = EXAMPLES.get(key)
    beside = [f"`{BESIDE[key]}`"] if key in BESIDE else []
    beside += [f"`rolling_friction: {ROLLING_FRICTION:g}` of all materials"] if key in ROLLING else []
    if beside:
        lines += ["", f"Measured with {' and '.join(beside)}."]
    if example:
        shown = example if len(example) <= SHOWN else example[:SHOWN] + " ..."
        lines += ["", f"Measured with `{offer.kind}: {{{offer.name}: {shown}}}`; made-up figures are no advice."]
    if offer.parameters:
        lines += ["", "| parameter | value | default | source | confirmed |", "|---|---|---|---|---|"]
        lines += [
            f"| `{p.name}` | {p.meaning} | {_default(p.default, p.required)} | {p.source} | {p.confirmed} |"
            for p in offer.parameters
        ]
    return "\n".join([*lines, ""])


def _default(value: Any, required: bool) -> str:
    if required:
        return "must be given"
    return "none" if value in (None, ()) else f"`{value}`"


def _cost(offer: Offered) -> str:
    if offer.cost is None:
        return "Not measured."
    return f"Time {offer.cost['time']:.2f}, runout {100 * offer.cost['runout']:+.0f} %."


def table(listed: list[Offered]) -> str:
    """The table of the README."""
    rows = [
        f"| `{offer.kind}: {offer.name}` | {_first_sentence(offer.summary)} | {offer.confirmed} | "
        + (f"{offer.cost['time']:.2f} | {100 * offer.cost['runout']:+.0f} % |" if offer.cost else " | |")
        for offer in listed
    ]
    head = ["| named in the scene | what it is | confirmed | time | runout |", "|---|---|---|---|---|"]
    return "\n".join([*head, *rows])


def _first_sentence(text: str) -> str:
    return re.split(r"(?<=[.])\s", text)[0].rstrip(".")


def with_table(readme: str, listed: list[Offered]) -> str:
    """The README with its table of effects as it is now."""
    begin, end = "<!-- effects -->", "<!-- end of effects -->"
    before, rest = readme.split(begin)
    _, after = rest.split(end)
    return f"{before}{begin}\n{table(listed)}\n{end}{after}"


class Flown:
    """The wall's rocks with one more thing named, ready to fly; CPU seconds of the passes so far."""

    def __init__(self, lines: str) -> None:
        scene = DOCS / "measured.yaml"
        named = {key: value for key, _, value in (line.partition(": ") for line in lines.splitlines())}
        base = BASE | named
        scene.write_text(WALL.read_text() + "".join(f"{key}: {value}\n" for key, value in base.items()))
        try:
            self.prepared: Prepared = prepare(chosen_scene(read_scene(scene), ROCKS, "compiled", None))
        finally:
            scene.unlink()
        ranges = [range(source.rocks) for source in self.prepared.sources]
        self.releases = releases_in_ranges(self.prepared, ranges)
        self.seconds: list[float] = []
        self.fly()
        self.seconds.clear()

    def fly(self) -> None:
        """Fly all rocks again."""
        self.ends: list[Deposits] = []
        nothing = Shown(np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64))
        stream = Stream(
            self.prepared.engine, self.prepared.flight, nothing, sink=lambda ends, _: self.ends.append(ends),
            threads=1, impacts=False,
        )  # fmt: skip
        began = time.process_time()
        stream.fly([self.releases])
        self.seconds.append(time.process_time() - began)

    def runout(self) -> float:
        """Mean horizontal distance (m) from the release to the end, of pieces from where they broke off."""
        whole = [ends.outcome != Outcome.FRAGMENTED for ends in self.ends]
        ways = [(ends.x - ends.release)[some, :2] for ends, some in zip(self.ends, whole, strict=True)]
        return float(np.mean(np.linalg.norm(np.concatenate(ways), axis=1)))


def measured(listed: list[Offered]) -> dict[str, dict[str, float]]:
    """Time and runout of each, against the same wall with the defaults of a scene."""
    base, costs = Flown(""), {}
    for offer in listed:
        key = f"{offer.kind}.{offer.name}"
        value = EXAMPLES.get(key, "{}")
        one = Flown("\n".join([f"{offer.kind}: {{{offer.name}: {value}}}", *filter(None, [BESIDE.get(key)])]))
        base.seconds.clear()
        for _ in range(PASSES):
            base.fly()
            one.fly()
        ratio = float(np.median(np.divide(one.seconds, base.seconds)))
        costs[key] = {"time": round(ratio, 3), "runout": round(one.runout() / base.runout() - 1.0, 4)}
        print(f"{key:30} {ratio:6.2f} {100 * costs[key]['runout']:+6.1f} %", flush=True)
    return costs


def main(arguments: list[str]) -> None:
    """Measure, and write page and table."""
    listed = offers()
    if "--as-is" not in arguments:
        costs = measured(listed)
        MEASURED.write_text(json.dumps(costs, indent=1) + "\n")
        listed = [replace(offer, cost=costs.get(f"{offer.kind}.{offer.name}")) for offer in listed]
    (DOCS / "reference" / "effects.md").write_text(document(listed))
    readme = ROOT / "README.md"
    readme.write_text(with_table(readme.read_text(), listed))


if __name__ == "__main__":
    main(sys.argv[1:])
