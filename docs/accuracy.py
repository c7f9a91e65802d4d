"""Write docs/explanation/accuracy.md and its pictures: what accuracy costs on the demo pit, and on Authume.

python docs/accuracy.py            (or make accuracy; takes about a minute a scene)
python docs/accuracy.py --as-is    the text alone, around what was measured last
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
from rpf3d_core.scene.models import ConstantSpec, ReboundSpec
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
"""By the name of its picture."""

HEAD = """# What accuracy costs
This page is for engineers who choose a method, a mesh or a number of rocks. It shows what each choice does to the
answer and what it costs.

## How do I measure it on my own scene?
```
rpf3d cost SCENE --out DIR                  # a table on the screen; cost.json, cost.png, cost.rrd in DIR
rpf3d run SCENE --out DIR --accuracy 0.05   # as many rocks as keep the error under 0.05
```

`run --accuracy` reads the price list in DIR if it is of the very same scene and version, and measures it first if not.
It keeps to the scene's terrain. `make accuracy` (`docs/accuracy.py`) measures and writes this page;
`python docs/accuracy.py --as-is` renews its text only.

## Which errors are measured?
- **numerical**: how contacts are found. The same rocks fly event by event, which is exact, and in fixed time steps, as
  in the thesis (`method: {stepping: ...}` in a scene). At each step VTK finds the closest facet. A rock that is nearer
  than the threshold and moves into the facet has an impact. Everything else is the same code.
  *squared* compares the squared distance with the threshold, as the thesis' code does: 0.05 then means 0.22 m.
  *raster* steps over heights sampled in cells and has an impact at the first step below the ground; no scene can ask
  for it.
- **geometric**: the resolution of the terrain. The same rocks, from the same heights above the ground, fly over 1/2 to
  1/64 of the triangles (quadric decimation). They are compared with the terrain as it is. What the survey itself misses
  is unknown; what the first halving changes is the nearest value that can be measured.
- **statistical**: the number of rocks. The distance of n rocks from all N that were flown (the n among them), over the
  square root of 1 - n/N, is their expected distance from the map of all possible rocks. Beyond the largest n the error
  goes with one over the square root of the number of rocks. (Two small ensembles cannot be compared directly: most of
  their cells have one rock or none.)

All three are **map errors**: the sum over all cells of |p - q| over the sum of p + q, with p and q the two maps of
reach probability. 0 means equal maps, 1 maps without a common cell. It is the share of all visits to cells that one map
has elsewhere. It depends on `hazard.cell`: smaller cells ask for more rocks.

The **total** is the sum of the three, because a bias and an interval do not cancel. A target is met against the terrain
as it is: its geometric error is 0 there. The cheapest setting is chosen among events and steps, over all measured
terrains; a coarser terrain is the user's to make.

## What do the columns mean?
| column | meaning |
| --- | --- |
| chance | map error between two ensembles of as many, but other, rocks |
| shares | largest difference of a share that reaches, or stops in, an area of interest or zone |
| impact, stop, bounce | medians: shift of the first impact and of the stop, change of the first bounce's height |
| tunnelled | share of rocks that fell through the ground |
| half-width | of the widest 95 % Wilson interval of a share; of the 95 % interval of p95 energy, over that p95 |
| s / 1,000 rocks | seconds of one core; ~ where a step was timed at a coarser setting |
| compiled | the same, with the closest facet found by this program's own index |

- **Chance.** Numerical and geometric lines compare the same rocks, so errors far below chance are still seen. Where a
  setting leads most rocks elsewhere, they are as good as other rocks: the error then contains chance and is an upper
  end. Settings too slow for 2,000 rocks fly a half, a quarter, ... of them (`rocks` in `cost.json`). Of 500 rocks, one
  that ends elsewhere moves the map by some thousandths.
- **Seconds of steps.** Every step is looked at, as in the thesis, and maps are not filled. *s / 1,000 rocks* is VTK
  called from Python, as the thesis is built, and compares programs; *compiled* (hollow in the picture) compares
  methods. `method: {stepping: ...}` is quicker than either: it passes over steps that cannot be a contact. All other
  lines fill their maps.
- **Events** have errors of rounding. The facets that rocks met are followed again with 50 digits, impact by impact
  (`test/accuracy` shows the digits, and that no other facet is met in exact arithmetic). Every bounce off another facet
  may multiply a difference. So the line of events shows how far the *map* moves where all rocks start one contact
  tolerance further east: thousands of times what rounding does.
"""
READING = """## What follows from the tables?
- **Ten times better steps cost ten times more.** Where step and threshold shrink together, the error goes with the step
  and the price with its inverse (`test/accuracy` holds the order of one). Events have no such price list: their error
  is that of rounding.
- **A threshold is a bias that no step removes.** From some step on, smaller steps only cost. An impact is found a
  threshold too early, which is a multiple of it along the ground where the rock comes in flat.
- **A long step loses rocks**: a rock that moves further than twice the threshold in a step can fall through the ground.
- **Python explains a factor of four to ten** between steps from Python and events. The steps explain the rest.
- **A raster does not converge to the answer** as its step shrinks, but to that of another terrain. A smaller cell need
  not be nearer: it makes stairs of a face of 70 degrees.
"""

def main(arguments: list[str]) -> int:
    """Measure and write, or renew the text alone; the exit code."""
    sections = kept_sections() if "--as-is" in arguments else [_section(*one) for one in MEASURED.items()]
    PAGE.write_text("\n".join([HEAD, *sections, READING]), encoding="utf-8")
    return 0


def kept_sections() -> list[str]:
    """Return the sections of the page as it is."""
    page = PAGE.read_text(encoding="utf-8")
    begin, end = page.index(f"## {MEASURED['demo'].title}\n"), page.index(READING.splitlines()[0])
    return [page[begin : end - 1]]


def _section(name: str, measured: Measured) -> str:
    """Return what was measured on a scene, or why it was not measured."""
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
    """Return a bullet with lines of at most 118 characters."""
    return textwrap.fill(f"- {text}", 118, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)


def maps_alone(measured: list[tuple[Row, list[Row]]]) -> list[str]:
    """Return the map errors of the three tables alone, methods against steps, as Markdown."""
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
