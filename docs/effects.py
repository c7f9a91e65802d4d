"""Write docs/reference/effects.md: the models and effects that a scene may name, and their cost.

python docs/effects.py            (or make effects; first measures all of them on a wall of a pit, in some minutes)
python docs/effects.py --as-is    (uses the last measurements)
"""

import argparse
import json
import re
import sys
import textwrap
import time
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
from list_items import key as key_item
from pydantic import BaseModel

from rpf3d_core.ensemble.flights import Deposits
from rpf3d_core.ensemble.stream import Shown, Stream
from rpf3d_core.scene.listings.catalogue import COSTS, KINDS, CatalogueEntry, entries
from rpf3d_core.scene.models.spec import ModelSpec
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.choices import chosen_scene
from rpf3d_core.setup.prepared import Prepared, prepare, releases_in_ranges
from rpf3d_core.values import Outcome

DOCS = Path(__file__).parent
ROOT = DOCS.parent
WALL = DOCS / "effects_wall.yaml"
"""The scene of all measurements; its coefficients are fixed, so that only the measured model or effect differs."""
MEASURED = ROOT / "rpf3d_core" / COSTS
ROCKS = 4000
PASSES = 7
TITLES = {
    "rebound": "Rebound models", "ground": "Ground models", "contact": "Contact models", "effects": "Effects",
}  # fmt: skip
OPENINGS = {
    "rebound": (
        "R_n and R_t are the normal and tangential restitution (-), v_n is the speed into the ground (m/s), m the\n"
        "mass of the rock (kg). A *lumped mass* is a rock without size and spin.\n",
    ),
    "effects": (
        "A file of polygons or lines may have any of these [file formats](formats.md#areas-lines-and-points).\n",
    ),
}
"""Kind of models -> text at the beginning of the section on this kind."""
BASE = {"rebound": "coulomb_limited", "ground": "sliding"}
"""The models with which all others are compared: the defaults of a scene."""

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
"""Parameters, as YAML, with which models and effects without a sensible default are measured."""
NOT_MEASURED = ("contact.rigid",)
"""Models that are not measured: the cost of rocks with a shape depends on the shape, and they need other materials."""
SPHERES = "rock: {density: 2700, diameter: 1.0, shape: sphere}"
BESIDE = {"contact.coulomb_sphere": SPHERES, "ground.sphere": SPHERES}
"""Model -> further line that its scene needs."""
ROLLING_FRICTION = read_scene(WALL).materials["default"].rolling_friction
"""mu_r (-) of the material in the scene of the measurements."""
ROLLING = ("contact.coulomb_sphere", "ground.rolling", "ground.rolling_stone", "ground.sphere")
"""Models whose result depends on ROLLING_FRICTION; for these the page states the value."""
SHOWN = 50
"""Largest number of characters of an example that the page shows."""

HEAD = """# Models and effects
This page lists every model and effect that a scene may name, with its parameters, sources and cost.

`rpf3d effects` prints this list, `rpf3d effects --json` the same for programs. `docs/effects.py` writes this page.

The shape of the rocks determines the models that a scene may name:

| rocks | `rebound:` | `ground:` | `contact:` |
|---|---|---|---|
| points | one model | one model except `sphere` | refused |
| spheres | refused | `sphere` or `none` | `coulomb_sphere` |
| rocks with a shape | refused | refused | `rigid` |

A scene may have any number of effects; [effects by shape](effects-by-shape.md) shows on which rocks each effect acts.
**An effect that the scene does not name is not imported, compiled or simulated, and uses no random numbers.** You
can add [your own models and effects](../howto/own-models.md).

```yaml
rebound: coulomb_limited         # a name, or a name with parameters: {v_half: {speed: 10}}
ground: sliding
effects: {roughness: {angle_sd_deg: 8}}
```

## How well is a figure confirmed?
| mark | meaning |
|---|---|
| C | read in the primary text |
| CC | found in an independent public implementation |
| S | quoted by another text |
| D | derived, or checked from first principles |
| UNCONFIRMED | general knowledge: check it before you base a decision on it |

If the source of a parameter is only a mark, the source is that of the model or effect.

## What does each model or effect cost?
*Time* is the CPU time to simulate the rocks, divided by the CPU time with the defaults (`coulomb_limited`, `sliding`);
the median of {passes} alternating measurements, without compiling. *Runout* is the relative change of the mean
horizontal distance from release to end. A fragment counts as a rock that was released where the whole rock broke; the
whole rock does not count.

`make effects` measures time and runout with {rocks:,} rocks on a wall of one synthetic pit (150,000 triangles,
`docs/effects_wall.yaml`). For other pits, the figures show only the order of magnitude. Parameters without a default
have invented values in these measurements: do not take the values as advice.

"""
TEXTS = {
    "effects.scarring": """\
In `zones`, each zone or pattern may set every other parameter of this list. If a zone does not set a parameter, the
value outside `zones` applies.
""",
    "effects.forest": """\
- A file of trees is a CSV. Its header names x, y and `dbh_cm` (stem diameter). It may also name `height` (m),
  `kind` (`conifer`, `broadleaved`, `silver_fir`) and z of the foot, which must be within 2 m of the ground. A tree
  without a kind is a conifer. Without a header, the columns are x, y, dbh_cm, height and kind.
- A randomly placed tree is equally likely at every place. Each tree depends only on the seed and its number.
- A flying rock that loses all its energy at a tree drops to the foot of the tree. A sliding or rolling rock stops at
  the tree.
""",
    "effects.barriers": """\
```yaml
effects:
  barriers:
    panels:
      - {name: fence_1, along: [[0, 60], [120, 90]], height: 4, capacity_kj: 1000}
      - {name: counted, along: portal.geojson, height: 3, capacity_kj: 0}
```

- A barrier stands vertically on the ground straight below its line. A rock hits the barrier if it crosses the plane of
  the barrier at most `height` times `residual_height` above this ground. A higher rock flies over without any change of
  its path.
- A rock with at most `capacity_kj` of energy is caught (outcome `caught`). A rock with more energy breaks through in
  the same direction, and loses `taken_by_break` times the capacity. The energy is translational; for rocks with a
  shape, it is the sum of translational and rotational energy.
- Rocks that slide, roll or settle also hit barriers.
- Rocks are independent of each other, so every rock hits an undamaged barrier. For a net that was hit before, give
  `residual_height`.
- `capacity_kj: 0` counts the rocks that cross a line, and changes no bit of any path.
- The engineer must decide whether a net is high and strong enough: the [results](outputs.md#barriers) have p95 energies
  and heights, without a factor of safety.
- ETAG 027 (now EAD 340059) tests nets at these maximum energy levels (kJ), classes 0 to 7: 100, 250, 500, 1000, 1500,
  2000, 3000, 4500. They are unconfirmed: look them up for the product.
""",
}
"""Additional text of the page on some models and effects."""


def document(listed: list[CatalogueEntry]) -> str:
    """Return the whole page as Markdown; listed : the catalogue of models and effects."""
    head = HEAD.replace("{passes}", str(PASSES)).replace("{rocks:,}", f"{ROCKS:,}")
    sections = [part for kind, title in TITLES.items() for part in _section(kind, title, listed)]
    return "\n".join([head + _costs(listed), *sections])


def _costs(listed: list[CatalogueEntry]) -> str:
    """Return the Markdown table with time and runout of each model and effect."""
    rows = [
        f"| `{entry.kind}:` [`{entry.name}`](#{entry.name}) | {entry.confirmed} | "
        + (" | ".join(_cost(entry)) if entry.cost else "not measured |")
        + " |"
        for entry in listed
    ]
    head = ["| named in the scene | confirmed | time (ratio) | runout (change) |", "|---|---|---|---|"]
    return "\n".join([*head, *rows, ""])


def _section(kind: str, title: str, listed: list[CatalogueEntry]) -> list[str]:
    ours = [entry for entry in listed if entry.kind == kind]
    return [f"## {title} (`{kind}:`)", *OPENINGS.get(kind, ()), *(_described(entry) for entry in ours)]


def _described(entry: CatalogueEntry) -> str:
    """Return the section of a model or effect: summary, source, parameters."""
    key, spec = f"{entry.kind}.{entry.name}", _spec(entry)
    lines = [f"### `{entry.name}`", _wrapped(entry.summary), ""]
    lines += [f"Every material must have `{each}`.\n" for each in spec.MATERIAL_KEYS]
    lines += [_wrapped(f"Source: {entry.source} ({entry.confirmed}).")]
    lines += [f"Measured with {' and '.join(_measured_with(key))}."] if _measured_with(key) else []
    lines += ["", TEXTS[key].rstrip()] if key in TEXTS else []
    if entry.parameters:
        lines += ["", "Parameters:", ""]
        lines += [
            key_item(p.name, _default(p.default, p.required), _short(p.meaning),
                     _source(p.source, p.confirmed, entry.source)) for p in entry.parameters
        ]  # fmt: skip
    return "\n".join([*lines, "", *(line for name, part in _parts(spec) for line in _part(name, part))])


def _spec(entry: CatalogueEntry) -> type[ModelSpec]:
    """Return the `ModelSpec` class that has the parameters of a model or effect."""
    annotation = KINDS[entry.kind].model_fields[entry.name].annotation  # type: ignore[attr-defined]
    return next(kind for kind in get_args(annotation) if issubclass(kind, ModelSpec))


def _wrapped(text: str) -> str:
    return textwrap.fill(text, 120, break_long_words=False, break_on_hyphens=False)


def _measured_with(key: str) -> list[str]:
    """Return the keys of the scene with which a model or effect is measured, for the sentence "Measured with".

    key : such as `rebound.v_half`
    """
    kind, name = key.split(".")
    example = EXAMPLES.get(key, "")
    shown = f"`{kind}: {{{name}: {example}}}`" if len(example) <= SHOWN else "the example in `docs/effects.py`"
    named = [shown] if example else []
    named += [f"`{BESIDE[key]}`"] if key in BESIDE else []
    return named + ([f"`rolling_friction: {ROLLING_FRICTION:g}` in all materials"] if key in ROLLING else [])


def _parts(spec: type[ModelSpec]) -> list[tuple[str, type[BaseModel]]]:
    """Return name and class of each parameter, except `zones`, that is a mapping or a list of mappings.

    Each of these parameters needs a list of its own.
    """
    found = []
    for name, field in spec.model_fields.items():
        for kind in (field.annotation, *get_args(field.annotation)):
            if isinstance(kind, type) and issubclass(kind, BaseModel) and name != "zones":
                found.append((name, kind))
    return found


def _part(name: str, part: type[BaseModel]) -> list[str]:
    """Return the list of keys of a parameter that itself has keys, such as the panels of barriers."""
    items = []
    for key, field in part.model_fields.items():
        facts = field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
        source = _source(str(facts.get("source", "")), str(facts.get("confirmed", "")), "")
        default = None if field.is_required() else field.default
        items.append(key_item(key, _default(default, field.is_required()), _short(field.description or ""), source))
    about = _wrapped(" ".join([f"`{name}`:", *(part.__doc__ or "").split()]))
    return [about, "", f"Keys of `{name}`:", "", *items, ""]


def _short(meaning: str) -> str:
    """Return the meaning of a parameter without its first article or the words "a number of", for a list."""
    return re.sub(r"^(a number (of )?|an? |the )", "", meaning)


def _source(source: str, confirmed: str, above: str) -> str:
    """Return the source of a figure with its mark of confirmation; only the mark if the source is `above` or empty.

    above : source of the model
    """
    return confirmed if source in ("", above) else f"{source} ({confirmed})"


def _default(value: Any, required: bool) -> str:
    if required:
        return "must be given"
    if isinstance(value, BaseModel):
        return "below"
    plain = str(value).lower() if isinstance(value, bool) else list(value) if isinstance(value, tuple) else value
    return "none" if value in (None, (), {}) else f"`{plain}`"


def _cost(entry: CatalogueEntry) -> tuple[str, str]:
    """Return the relative time and the change of runout of a measured model or effect as table cells."""
    assert entry.cost is not None
    return f"{entry.cost['time']:.2f}", f"{100 * entry.cost['runout']:+.0f} %"


class Flown:
    """The rocks of the scene WALL with the models of BASE, replaced or extended by further lines of the scene.

    seconds : CPU time (s) of each pass; ends : deposits of the last pass
    """

    def __init__(self, lines: str) -> None:
        scene = DOCS / "measured.yaml"
        named = {key: value for key, _, value in (line.partition(": ") for line in lines.splitlines())}
        base = named if named.get("rock") else BASE | named
        wall = [line for line in WALL.read_text().splitlines() if line.partition(": ")[0] not in base]
        scene.write_text("\n".join([*wall, *(f"{key}: {value}" for key, value in base.items()), ""]))
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
        """Fly all rocks, and append the CPU time of the flight to `seconds`."""
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
        """Return the mean horizontal distance (m) from release to end; a fragment is released where the rock broke.

        Rocks that broke do not count.
        """
        whole = [ends.outcome != Outcome.FRAGMENTED for ends in self.ends]
        ways = [(ends.x - ends.release)[some, :2] for ends, some in zip(self.ends, whole, strict=True)]
        return float(np.mean(np.linalg.norm(np.concatenate(ways), axis=1)))


def measured(listed: list[CatalogueEntry]) -> dict[str, dict[str, float]]:
    """Measure each model and effect on the wall; return the figures by its kind and name, such as `effects.forest`.

    The figures are `time`, relative to the time with BASE, and `runout`, the relative change of the mean runout.
    """
    base, costs = Flown(""), {}
    for entry in listed:
        key = f"{entry.kind}.{entry.name}"
        value = EXAMPLES.get(key, "{}")
        if key in NOT_MEASURED:
            continue
        one = Flown("\n".join([f"{entry.kind}: {{{entry.name}: {value}}}", *filter(None, [BESIDE.get(key)])]))
        base.seconds.clear()
        for _ in range(PASSES):
            base.fly()
            one.fly()
        ratio = float(np.median(np.divide(one.seconds, base.seconds)))
        costs[key] = {"time": round(ratio, 3), "runout": round(one.runout() / base.runout() - 1.0, 4)}
        print(f"{key:30} {ratio:6.2f} {100 * costs[key]['runout']:+6.1f} %", flush=True)
    return costs


def main(arguments: list[str]) -> None:
    """Measure, unless `--as-is` is given, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--as-is", action="store_true")
    as_is, listed = parser.parse_args(arguments).as_is, entries()
    if not as_is:
        costs = measured(listed)
        MEASURED.write_text(json.dumps(costs, indent=1) + "\n")
        listed = [replace(entry, cost=costs.get(f"{entry.kind}.{entry.name}")) for entry in listed]
    (DOCS / "reference" / "effects.md").write_text(document(listed))


if __name__ == "__main__":
    main(sys.argv[1:])
