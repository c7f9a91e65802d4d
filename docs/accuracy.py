"""Write docs/explanation/accuracy.md and its pictures: error and time of each setting, at the demo pit and Authume.

python docs/accuracy.py            (or make accuracy; takes about a minute a scene)
python docs/accuracy.py --as-is    rewrites the text and keeps the measured figures
"""

import argparse
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
    """A section of the page, on one scene.

    stem : name of the scene file without extension; title : heading; rebound : replaces that of the scene, None to keep
    maps_alone : True to show only the map errors
    """

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
This page explains how to choose a method, a mesh and a number of rocks, from the error and the time of each choice.

## How do I measure error and time on my own scene?
```
rpf3d cost SCENE --out DIR                  # a table on the screen; cost.json, cost.png, cost.rrd in DIR
rpf3d run SCENE --out DIR --accuracy 0.05   # as many rocks as a total error of 0.05 needs
```

`rpf3d cost` writes a *price list*: error and time of each setting. `run --accuracy` reads the price list in DIR; if
there is none for this scene and version, `run --accuracy` measures it first. The rocks of `run --accuracy` always fly
over the full terrain, with exact contacts; rocks with a shape fly with the `accuracy` of the scene. `make accuracy`
(`docs/accuracy.py`) measures and writes this page.

## Which errors are measured?
All errors are differences of two maps of reach probability. The **map error** is the sum over all cells of |p - q|,
divided by the sum over all cells of p + q, with p and q the reach probabilities of a cell in the two maps. 0 means
equal maps, 1 means maps without a common cell. The map error depends on `hazard.cell`: smaller cells need more rocks.
There are four errors. How the numerical error is measured depends on the shape of the rocks:

- **numerical, for points** (the default shape of rocks): the error of the search for contacts. The same rocks fly with
  two methods: from event to event, which is exact, and in fixed time steps, as in the
  [thesis](design.md#what-is-rpf3d-for) (`method: {stepping: ...}` in a scene). At each step VTK finds the closest
  facet. If the rock is nearer to the facet than the *threshold* and moves into the facet, it has an impact. All other
  code is the same. The steps have two variants:
  - *squared* compares the squared distance with the threshold, as the thesis' code does: a threshold of 0.05 m2 is
    a distance of 0.22 m.
  - *raster* replaces the mesh by a grid of heights; the impact is at the first step below the ground. A scene cannot
    choose *raster*.
- **numerical, for rocks with a shape**: the error of the contact's key `accuracy`. The same rocks fly with several
  values of `accuracy`, from four times to one eighth of the scene's value. Each map is compared with the map of the
  smallest value; the part of the difference that chance explains is subtracted. Fixed steps, rasters and impacts with
  50 digits are not measured.
- **numerical, for spheres** (`rock.shape: sphere`): only the rounding error of events. Fixed steps, rasters and impacts
  with 50 digits are not measured, because these methods find only contacts of points.
- **geometric**: the error of a coarser terrain. The same rocks, from the same heights above the ground, fly over
  terrains with 1/2 to 1/64 of the triangles (quadric decimation). Each map is compared with the map on the full
  terrain. The error of the survey itself is unknown; the best estimate is the error of half the triangles.
- **statistical**: the error of a small number of rocks. The map of n rocks is compared with the map of all N rocks
  flown, which include the n rocks. The difference, divided by the square root of 1 - n/N, is the expected difference
  from the map of infinitely many rocks. Above the largest measured n, rpf3d assumes that the error is proportional to
  1 / square root of the number of rocks.
- **parametric**: the error of unknown values of the ground. If a scene has ranges (`prior`, `library`) or the sample
  of a calibration, up to 32 parameter sets fly two groups of rocks each. The error is the root mean square of the map
  errors between two sets, without the map error that chance causes between the two groups of one set. If a scene
  gives one value for each coefficient, the parametric error exists, but its size is unknown.

The **total** is the sum of the numerical, the geometric and the statistical error, because systematic and random errors
do not cancel. The full terrain has the geometric error 0.

The parametric error is not in the total, because no setting reduces it. If it is above the target, `rpf3d cost` and
`run --accuracy` report that more rocks cannot reach the target. The largest of the four errors shows what to improve
next: the method, the survey, the number of rocks, or the knowledge of the ground (by a calibration).

## What do the columns mean?
| column | meaning |
| --- | --- |
| dt | length of a time step |
| chance | map error between two ensembles of the same number of different rocks |
| shares | largest difference of the share of rocks that reaches, or stops in, an area of interest or zone |
| impact, stop, bounce | medians: shift of the first impact and of the end point, change of the first bounce's height |
| tunnelled | share of rocks that fell through the ground |
| shares, half-width | half the width of the widest 95 % Wilson interval of a share |
| p95 energy, half-width | half the width of the 95 % interval of the p95 energy, divided by the p95 energy |
| s / 1,000 rocks | computing time of 1,000 rocks, seconds of one core; with ~, estimated (see below) |
| compiled | s / 1,000 rocks, if rpf3d's own compiled search finds the closest facet |

- **Chance.** Numerical and geometric rows compare the same rocks, so their errors may be far below chance. But if a
  setting moves most rocks elsewhere, the error also contains chance, and is an upper limit. Numerical rows have 2,000
  rocks; if a setting is too slow, only a half, a quarter or fewer of them fly (`rocks` in `cost.json`). Small map
  errors are then uncertain: if one of 500 rocks ends elsewhere, the map error is a few thousandths.
- **Seconds of steps.** For the times of fixed steps on the mesh, every step is tested for contact, as in the thesis,
  and no maps are made; the times of all other rows include maps. For *s / 1,000 rocks*, Python calls VTK, as the
  thesis' program does. With ~, the setting was too slow to time a step: the time per step is that of a coarser setting.
  *compiled* (hollow markers in the picture) is the time of the same steps in compiled code; compared with the time of
  events, it shows what the method alone costs. `method: {stepping: ...}` is faster than both, because it skips steps
  at which no contact is possible.
- **Events** have rounding errors only. The map error in the row *events* is an upper limit: it compares the map with
  the map of the same rocks, released one tolerance farther east. A tolerance is thousands of times larger than a
  rounding error. For the errors of single impacts, rpf3d calculates the impacts again with 50 digits, on the facets
  that the rocks hit. (`test/accuracy` checks that this calculation agrees with closed forms to 45 digits, and that with
  exact arithmetic no rock hits another facet.) The errors of single impacts do not show the error of the map, because
  each bounce off a new facet may multiply a small difference between two paths.

## How do I read the lines of a scene?
- *events against 50 digits*: rounding errors of the impacts of 50 rocks.
- *errors of this scene*: the errors with the method, the terrain and the number of rocks of the scene file, and advice
  on the largest of them. The geometric error is the error that half of the triangles of this terrain would cause.
- *total up to 0.05*: the cheapest measured setting with a *total* of at most 0.05 (`rpf3d cost --target`), with events
  or with fixed steps, on the full or on a coarser terrain. If this setting has a coarser terrain, you must make that
  terrain yourself. The time is calculated: the number of rocks times the time per rock in the numerical and geometric
  tables. The measured time of a few hundred rocks is longer (statistical table). *Without the unknown ground* means
  that the parametric error alone is above the target.
- *`rpf3d run --accuracy 0.05`*: the setting that this command chooses.
"""
READING = """## What follows from the tables?
- **With steps, a ten times smaller error takes ten times more time.** If step and threshold shrink together, the error
  is proportional to the step (`test/accuracy` checks this), and the time is inversely proportional to the step. With
  events there is no step or threshold to choose, because their error is only rounding.
- **A threshold causes a systematic error that no smaller step removes.** An impact is found when the rock is still one
  threshold away from the ground. If the rock hits the ground at a low angle, the shift along the ground is several
  times the threshold. Steps below a certain length cost more time, but do not reduce the error.
- **A long step loses rocks**: a rock that moves more than twice the threshold in one step can fall through the ground.
- **Python makes steps four to twelve times slower**: compare the columns *s / 1,000 rocks* and *compiled*. The rest of
  the difference between steps and events is due to the steps themselves.
- **A raster gives the result of another terrain**, however short the step is. A smaller cell may even be worse, because
  the cells turn a face of 70 degrees into stairs.
"""


def main(arguments: list[str]) -> int:
    """Measure and write the page, or with `--as-is` write only its text; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--as-is", action="store_true")
    as_is = parser.parse_args(arguments).as_is
    sections = kept_sections() if as_is else [_section(*one) for one in MEASURED.items()]
    PAGE.write_text("\n".join([HEAD, *sections, READING]), encoding="utf-8")
    return 0


def kept_sections() -> list[str]:
    """Return the measured sections of the existing page, so that `--as-is` can keep them."""
    page = PAGE.read_text(encoding="utf-8")
    begin, end = page.index(f"## {MEASURED['demo'].title}\n"), page.index(READING.splitlines()[0])
    return [page[begin : end - 1]]


def _section(name: str, measured: Measured) -> str:
    """Measure a scene, write its picture, and return its section of the page.

    The section has only the reason if the scene cannot be measured. name : part of the name of the picture
    """
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
        f"in cells of {prices.cell:g} m.\nMeasured in {seconds:.0f} s of one core, compiling included."
    )
    found = "\n".join(bullet(line) for line in findings(prices, TARGET))
    shown = maps_alone(tables(prices)) if measured.maps_alone else [markdown(*one) for one in tables(prices)]
    head = f"## {measured.title}\n{facts}\n\n![what accuracy costs](../pictures/{picture.name})"
    return "\n\n".join([head, found, *shown]) + "\n"


def bullet(text: str) -> str:
    """Return a text as a Markdown bullet with lines of at most 118 characters."""
    return textwrap.fill(f"- {text}", 118, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)


def maps_alone(measured: list[tuple[Row, list[Row]]]) -> list[str]:
    """Return short Markdown tables with the map errors only; the table of unknowns stays as it is.

    measured : the tables of a scene, each as header and rows (`tables`)
    """
    (_, numerical), (_, geometric), (_, statistical), *unknowns = measured
    errors = {(method, dt): error for method, dt, error, *_ in numerical if dt}
    steps = sorted({dt for _, dt in errors}, key=float, reverse=True)
    methods = dict.fromkeys(method for method, _ in errors)
    rows = [(method, *(errors.get((method, dt), "") for dt in steps)) for method in methods]
    return [
        "Map errors alone (`rpf3d cost` prints all columns):",
        markdown(("numerical: method", *(f"dt {dt} s" for dt in steps)), rows),
        markdown(("triangles", *(row[0] for row in geometric)), [("map error", *(row[2] for row in geometric))]),
        markdown(("rocks", *(row[0] for row in statistical)), [("map error", *(row[1] for row in statistical))]),
        *(markdown(*one) for one in unknowns),
    ]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
