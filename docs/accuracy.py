"""Write docs/explanation/accuracy.md and its pictures: error and time of each setting on the demo pit and at Authume.

python docs/accuracy.py            (or make accuracy; takes about a minute a scene)
python docs/accuracy.py --as-is    only the text; the last measurements stay
"""

import sys
import tempfile
import textwrap
import time
from pathlib import Path
from typing import NamedTuple

from rpf3d_core.accuracy.files import PICTURE, write_price_list
from rpf3d_core.accuracy.measure import price_list
from rpf3d_core.accuracy.tables import Row, findings, markdown, tables
from rpf3d_core.errors import InputError
from rpf3d_core.scene.models.keys import ConstantSpec, ReboundSpec
from rpf3d_core.scene.reading import read_scene

DOCS = Path(__file__).parent
PAGE = DOCS / "explanation" / "accuracy.md"
SCENES = DOCS.parent / "config" / "scenes"
TARGET = 0.05


class Measured(NamedTuple):
    """A section: which scene is measured, the rebound that replaces the scene's own, and whether map errors suffice."""

    stem: str
    title: str
    rebound: ReboundSpec | None = None
    maps_alone: bool = False


MEASURED = {
    "demo": Measured("demo", "The demo pit"),
    "demo_constant": Measured(
        "demo", "The demo pit with the rebound `constant`", ReboundSpec(constant=ConstantSpec()), maps_alone=True
    ),
    "authume_p1": Measured("authume_p1", "Authume, with the rebound `constant`"),
}
"""Sections of the page, by the name of their picture."""

HEAD = """# What accuracy costs
After this page you can choose a method, a mesh and a number of rocks by the error that each causes and the time that it
costs.

## How do I measure it on my own scene?
```
rpf3d cost SCENE --out DIR                  # a table on the screen; cost.json, cost.png, cost.rrd in DIR
rpf3d run SCENE --out DIR --accuracy 0.05   # enough rocks to keep the error under 0.05
```

`rpf3d cost` writes a *price list*: error and time of each setting. `run --accuracy` reads the price list in DIR if it
belongs to the same scene and version; otherwise it measures it first. It does not change the terrain. `make accuracy`
(`docs/accuracy.py`) measures and writes this page; `python docs/accuracy.py --as-is` writes only the text again.

## Which errors are measured?
- **numerical**: the error of the search for contacts. The same rocks fly with two methods: event by event, which is
  exact, and in fixed time steps, as in the [thesis](design.md#what-is-rpf3d-for) (`method: {stepping: ...}` in a
  scene). At each step VTK finds the closest facet. A rock that is nearer than the *threshold* and moves into the
  facet has an impact. All other code is the same. Two variants: *squared* compares the squared distance with the
  threshold, as the thesis' code does: 0.05 then means 0.22 m. *raster* replaces the mesh by heights in cells, with an
  impact at the first step below the ground; scenes do not offer it.
- **geometric**: the error of a coarser terrain. The same rocks, from the same heights above the ground, fly over 1/2
  to 1/64 of the triangles (quadric decimation). Their map is compared with the map on the full terrain. The error of
  the survey itself is unknown; the best estimate is the change from the first halving.
- **statistical**: the error of a small number of rocks. The map of n rocks is compared with the map of all N rocks
  flown, which include the n. The difference, divided by the square root of 1 - n/N, is the expected difference from
  the map of all possible rocks. For numbers above the largest n, the error is proportional to one over the square
  root of the number of rocks. (Two small ensembles cannot be compared directly: most of their cells have one rock or
  none.)
- **parametric**: the error of values of the ground that no one knows. Where a scene gives ranges (`prior`, `library`)
  or a calibration's sample, up to 32 parameter sets fly two lots of rocks each. The error is the root of the mean
  square distance between the maps of two sets, without the distance that chance causes between two lots of one set.
  A scene that gives all values as known has no such line: the error is there, but its size is not known.

All four are **map errors**: the sum over all cells of |p - q|, divided by the sum of p + q. Here p and q are the
reach probabilities of a cell in the two maps. 0 means equal maps, 1 means maps without a common cell. The map error
depends on `hazard.cell`: smaller cells need more rocks.

The **total** is the sum of the first three, because a systematic and a random error do not cancel. The full terrain
has the geometric error 0. For each scene, a line below names the cheapest setting among events and steps, over all
measured terrains. To use a coarser terrain, you must make it. The parametric error is not in the total, because no
setting reduces it: if it is above the target, `rpf3d cost` and `run --accuracy` say that rocks cannot buy the target.
The largest of the four shows what to improve next: more rocks, a finer survey, or a calibration.

## What do the columns mean?
| column | meaning |
| --- | --- |
| chance | map error between two ensembles of the same number of different rocks |
| shares | largest difference of the share of rocks that reaches, or stops in, an area of interest or zone |
| impact, stop, bounce | medians: shift of the first impact and of the end point, change of the first bounce's height |
| tunnelled | share of rocks that fell through the ground |
| half-width | half of the widest 95 % Wilson interval of a share; half of the 95 % interval of p95 energy over p95 |
| s / 1,000 rocks | seconds of one core; ~ if the time of a step was measured at a coarser setting |
| compiled | the same, with the closest facet found by rpf3d's own compiled search |

- **Chance.** Numerical and geometric lines compare the same rocks, so errors far below chance are visible. But if a
  setting moves most rocks elsewhere, the error also contains chance and is an upper limit. Settings too slow for
  2,000 rocks fly a half, a quarter, ... of them (`rocks` in `cost.json`). If one of 500 rocks ends elsewhere, the map
  error is some thousandths.
- **Seconds of steps.** Every step is tested, as in the thesis, and no maps are made. *s / 1,000 rocks* uses VTK
  called from Python, as the thesis' program does, so it compares programs. *compiled* (hollow in the picture)
  compares methods. `method: {stepping: ...}` is faster than both, because it skips steps that cannot be a contact.
  All other lines include maps.
- **Events** have rounding errors only. To measure them, the impacts are calculated again with 50 digits on the facets
  that the rocks hit (`test/accuracy` shows the digits, and that exact arithmetic hits no other facet). Every bounce
  off another facet may multiply a difference. So the map error in the line *events* is that of a shift of all
  rocks by one contact tolerance to the east, which is thousands of times more than rounding.
"""
READING = """## What follows from the tables?
- **A ten times smaller error costs ten times more time with steps.** If step and threshold shrink together, the error
  is proportional to the step, and the time to its inverse (`test/accuracy` checks this first order). With events no
  such choice is needed: their error is only rounding.
- **A threshold is a systematic error that no step removes.** Below a certain step, smaller steps cost more time
  without a smaller error. An impact is found one threshold too early. If the rock hits the ground at a flat angle,
  the shift along the ground is several times the threshold.
- **A long step loses rocks**: a rock that moves more than twice the threshold in one step can fall through the ground.
- **Python causes a factor of four to ten** of the time difference between steps from Python and events. The steps
  cause the rest.
- **A raster converges to the result of another terrain** as its step shrinks. A smaller cell may even be worse,
  because it turns a face of 70 degrees into stairs.
"""

def main(arguments: list[str]) -> int:
    """Measure and write the page, or with `--as-is` write only its text; return the exit code."""
    sections = kept_sections() if "--as-is" in arguments else [_section(*one) for one in MEASURED.items()]
    PAGE.write_text("\n".join([HEAD, *sections, READING]), encoding="utf-8")
    return 0


def kept_sections() -> list[str]:
    """Return the measured sections of the existing page, so that `--as-is` can keep them."""
    page = PAGE.read_text(encoding="utf-8")
    begin, end = page.index(f"## {MEASURED['demo'].title}\n"), page.index(READING.splitlines()[0])
    return [page[begin : end - 1]]


def _section(name: str, measured: Measured) -> str:
    """Measure a scene; return its section of the page, or the reason if it cannot be measured."""
    began = time.process_time()
    try:
        scene = read_scene(SCENES / f"{measured.stem}.yaml")
        if measured.rebound is not None:
            scene = scene.model_copy(update={"rebound": measured.rebound})
        prices = price_list(scene, lambda line: print(f"{name}: {line}", file=sys.stderr))
    except InputError as fault:
        return f"## {measured.title}\nNot measured: {str(fault).splitlines()[-1]}\n"
    seconds = time.process_time() - began
    with tempfile.TemporaryDirectory() as folder:
        write_price_list(folder, prices, TARGET, recording=False)
        picture = DOCS / "pictures" / f"cost_{name}.png"
        picture.write_bytes((Path(folder) / PICTURE).read_bytes())
    facts = (
        f"`config/scenes/{measured.stem}.yaml`, rebound `{scene.rebound.name}`: {prices.triangles:,} triangles, maps "
        f"in cells of {prices.cell:g} m. Measured in {seconds:.0f} s of one core, compiling included."
    )
    found = "\n".join(bullet(line) for line in findings(prices, TARGET))
    shown = maps_alone(tables(prices)) if measured.maps_alone else [markdown(*one) for one in tables(prices)]
    head = f"## {measured.title}\n{facts}\n\n![what accuracy costs](../pictures/{picture.name})"
    return "\n\n".join([head, found, *shown]) + "\n"


def bullet(text: str) -> str:
    """Return a text as a Markdown bullet with lines of at most 118 characters."""
    return textwrap.fill(f"- {text}", 118, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)


def maps_alone(measured: list[tuple[Row, list[Row]]]) -> list[str]:
    """Return short Markdown tables with the map errors only, for a section that does not need all columns."""
    (_, numerical), (_, geometric), (_, statistical) = measured
    errors = {(method, dt): error for method, dt, error, *_ in numerical if dt}
    steps = sorted({dt for _, dt in errors}, key=float, reverse=True)
    methods = dict.fromkeys(method for method, _ in errors)
    rows = [(method, *(errors.get((method, dt), "") for dt in steps)) for method in methods]
    return [
        "Map errors alone (`rpf3d cost` prints all columns):",
        markdown(("numerical: method", *(f"dt {dt} s" for dt in steps)), rows),
        markdown(("triangles", *(row[0] for row in geometric)), [("map error", *(row[2] for row in geometric))]),
        markdown(("rocks", *(row[0] for row in statistical)), [("map error", *(row[1] for row in statistical))]),
    ]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
