"""Write docs/explanation/accuracy.md and its pictures: what accuracy costs on the demo pit, and on Authume.

python docs/accuracy.py    (or make accuracy; takes about a minute a scene)
"""

import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

from rpf3d_core.accuracy.files import PICTURE, write_price_list
from rpf3d_core.accuracy.measure import price_list
from rpf3d_core.accuracy.tables import document
from rpf3d_core.errors import InputError
from rpf3d_core.scene.models import ConstantSpec, ReboundSpec
from rpf3d_core.scene.reading import read_scene

DOCS = Path(__file__).parent
SCENES = DOCS.parent / "config" / "scenes"
TARGET = 0.05


class Measured(NamedTuple):
    """A section: which scene is measured, and the rebound that replaces the scene's own."""

    stem: str
    title: str
    rebound: ReboundSpec | None = None


MEASURED = {
    "demo": Measured("demo", "The demo pit"),
    "demo_constant": Measured("demo", "The demo pit with the rebound `constant`", ReboundSpec(constant=ConstantSpec())),
    "authume_p1": Measured("authume_p1", "Authume, with the rebound `constant`"),
}
"""By the name of its picture."""

HEAD = """# What accuracy costs
`rpf3d cost SCENE --out DIR` measures, on your own scene, what each setting leaves open and what it costs: a table on
the screen, `cost.json`, `cost.png` and `cost.rrd` in the folder. `rpf3d run SCENE --out DIR --accuracy 0.05` flies as
many rocks as keep the error under 0.05; it reads the price list in the folder if it is of the very same scene and
version, and measures it first if not. `docs/accuracy.py` (`make accuracy`) measures and writes this page.

## Three errors in one currency
- **numerical**: how contacts are found. The same rocks are flown event by event, which is exact, and in fixed time
  steps, as in the thesis (`method: {stepping: ...}` in a scene): at each step VTK tells the closest facet, and a rock
  that is nearer than the threshold and moves into it has an impact. *squared* compares the squared distance with the
  threshold, as the thesis' code does: 0.05 then means 0.22 m. *raster* steps over heights sampled in cells, and has
  an impact at the first step below the ground. Rebound, materials, the end of bouncing and outcomes are the same
  code.
- **geometric**: the terrain's resolution. The same rocks, from the same heights above the ground, over a half to 1/64
  of the triangles (quadric decimation), compared with the terrain as it is. What the survey itself misses is in no
  number here; what the first halving changes is the nearest that can be measured.
- **statistical**: the number of rocks. n rocks are compared with all N that were flown, themselves among them, and
  that over the square root of 1 - n/N is how far they are off the map of all rocks there could be. (Two small
  ensembles are too near to each other to tell it: most of their cells have one rock or none.) It is the error to
  expect; from the last measured number on it is told as one over the square root of the number of rocks.

All three are told as **map error**: the sum over all cells of |p - q| over the sum of p + q, with p and q the two
maps of reach probability. It is 0 for equal maps and 1 for maps without a common cell, and says which share of all
visits to cells one map has elsewhere than the other. It depends on the cell of the maps (`hazard.cell`): smaller
cells ask for more rocks. The total is the sum of the three, for a bias and an interval do not cancel; a target is met
against the terrain as it is, so its geometric error is 0 there. The cheapest setting is looked for among events and
steps, over all terrains measured; a coarser one is the user's to make, and `rpf3d run --accuracy` keeps to the scene's.

*chance* is the map error between two ensembles of as many, but other, rocks. The rocks of the numerical and geometric
lines are the same as those that they are compared with, so errors far below chance are still seen. But where a setting
leads most rocks elsewhere they are as good as other rocks, and chance is a part of what is told: it is the error's
upper end. Settings too slow for 2,000 rocks are told from a half, a quarter, ... of them (`rocks` in `cost.json`); of
500 rocks one that ends elsewhere moves the map by some thousandths.

**Seconds** are those of one core. Steps have two prices, and in either every step is looked at, as in the thesis: with
VTK called from Python, which is how the thesis and its like are built, and compiled, the closest facet found by this
program's own index (`compiled`; hollow in the picture). Everything else is compiled, so it is the second that compares
the methods, and the first the programs. Events, rasters and terrains are told with the maps that they fill, steps
without. (`method: {stepping: ...}` in a scene is quicker than either: it passes over steps that cannot be a contact.)

Events have errors too: those of rounding. The facets that rocks met are followed again with 50 digits, impact by
impact (`test/accuracy` shows the digits, and that no other facet is met in exact arithmetic). How far a difference
grows
is the scene's matter, not that of the arithmetic: every bounce off another facet may multiply it. So the line of events
tells how far the *map* moves where all rocks start one contact tolerance further east, which is thousands of times what
rounding does.
"""
READING = """## How to read it
- A threshold is a bias that no step removes: from some step on, smaller ones only cost. An impact is found a
  threshold too early, which is a multiple of it along the ground where the rock comes in flat.
- A step so long that a rock moves further than twice the threshold lets rocks fall through the ground (*tunnelled*).
- Where both shrink together the error goes with the step, and the price with its inverse: ten times better is ten
  times dearer (test/accuracy holds the order of one). Events have no such price list: their error is that of rounding.
- Of what lies between steps from Python and events, a factor of four to ten is Python's. The rest is the steps'.
- A raster does not converge to the answer as its step shrinks; it converges to that of another terrain. A
  smaller cell need not be nearer: of a face of 70 degrees it makes stairs.
"""


def main() -> int:
    """Measure, write and say how long it took; the exit code."""
    parts = [HEAD]
    for name, measured in MEASURED.items():
        parts.append(_section(name, measured))
    (DOCS / "explanation" / "accuracy.md").write_text("\n".join([*parts, READING]), encoding="utf-8")
    return 0


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
    return (
        f"## {measured.title}\n{facts}\n\n![what accuracy costs](../pictures/{picture.name})\n\n"
        f"{document(prices, TARGET)}\n"
    )


if __name__ == "__main__":
    sys.exit(main())
