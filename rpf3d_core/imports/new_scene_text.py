"""Write the text of a new scene: keys, with comments on the terrain file and on what the user must check."""

import json
import re
from collections.abc import Iterator, Sequence
from operator import itemgetter
from typing import NamedTuple

import numpy as np

from rpf3d_core.formats.units import METRE
from rpf3d_core.formats.words import whole_degrees
from rpf3d_core.imports.crests import ENERGY_LINE, LONG, OVER, Crest
from rpf3d_core.imports.scene_text import comment, counted
from rpf3d_core.setup.coverage import plain
from rpf3d_core.terrain.faces import LOWEST, STEEP
from rpf3d_core.terrain.zone_parts import SMALLEST

SCHEMA = "scene.schema.json"
"""File name of the JSON Schema next to a new scene; the first line of the scene names it for editors."""
SETS, EACH = 64, 40
"""Number of parameter sets of a run with ranges, and number of rocks for each set in a new scene."""
LIVE = re.compile("[\x7f-\x9f\u2028\u2029]")
"""Characters that JSON leaves unescaped, but that must be escaped in YAML: control characters and line separators."""
LIBRARY = "bedrock"
"""Library entry for all zones of a new scene: the widest range for hard ground."""


class ZoneFound(NamedTuple):
    """A zone of the terrain: its area (m2), mean slope (degrees), and heights (m); see `heights_of_zone`."""

    name: str
    area: float
    slope: float
    low: float
    high: float


class NewScene(NamedTuple):
    """The content of a terrain file, for the text of a new scene.

    path : of the file, relative to the scene; choice_up : axis that points up; unit : of the coordinates
    crs : reference system, None if unknown; crs_is_stated : True if `crs` is from the file, not from the user
    low, high : (3,) m, smallest and largest coordinates; highest : (3,) m, the highest point
    crests : with points in the input's coordinates
    split : zones of the file that consist of separate surfaces at different heights; `zones` has each surface as a zone
    misread : True if the unit or the axes look wrong, so that no crests were searched
    """

    path: str
    choice_up: str
    unit: str
    crs: str | None
    crs_is_stated: bool
    triangles: int
    holes: int
    low: Sequence[float]
    high: Sequence[float]
    zones: Sequence[ZoneFound]
    crests: Sequence[Crest]
    highest: Sequence[float]
    split: Sequence[str] = ()
    misread: bool = False


def scene_text(found: NewScene) -> str:
    """Return the text of a scene file, which can be run without changes."""
    return "\n".join([
        f"# yaml-language-server: $schema={SCHEMA}",
        *comment("Written by `rpf3d new`. The scene runs as it is: rpf3d check scene.yaml, then rpf3d run scene.yaml "
                 "--out out. It is not your site yet: check every line marked CHECK."),
        "", *_terrain(found), "", *_materials(found), "", *_rock(), "", *_sources(found), "", *_end(), "",
    ])  # fmt: skip


def _terrain(found: NewScene) -> Iterator[str]:
    """Yield the scene file's lines for the terrain, with extents and reference system as comments."""
    ends = zip("xyz", found.low, found.high, strict=True)
    spans = ", ".join(f"{axis} {plain(low)} to {plain(high)}" for axis, low, high in ends)
    yield from comment(
        f"Found: {counted(found.triangles, 'triangle')}, {counted(found.holes, 'hole')}. Extents (m): {spans}.",
        "CHECK: compare the extents with your survey. They show a wrong unit or swapped axes.",
    )
    yield "terrain:"
    unit = "" if found.unit == METRE else f", unit: {found.unit}"
    yield f"  files: [{{path: {_quoted(found.path)}{unit}}}]"
    if found.choice_up != "z":
        yield f"  up: {found.choice_up}"
    if found.split:
        words = ("These layers consist of separate surfaces at different heights. Each becomes a zone, `_1` the "
                 "highest, so that tables state what each bench retains. A material may name the layer or a "
                 "part.")  # fmt: skip
        yield from (f"  {line}" for line in comment(words))
        yield f"  split: [{', '.join(map(_quoted, found.split))}]"
    if found.crs is None:
        yield "  # crs: EPSG:32719   # CHECK: the file states no coordinate reference system in metres; name yours"
    else:
        yield f"  crs: {_quoted(found.crs)}   # {'as the file states' if found.crs_is_stated else 'as you stated'}"


def _materials(found: NewScene) -> Iterator[str]:
    """Yield the scene file's lines for the materials: a library entry for all zones, and a comment for each zone."""
    yield from comment(
        "CHECK: nothing in the file says what the ground is. Everything is bedrock from the library, with the range "
        "over all its sources, so intervals of the results are wide (predictive). `rpf3d materials` lists other "
        "ground. A calibration on observed rocks makes them narrower: `rpf3d calibrate`.")  # fmt: skip
    yield "materials:"
    yield f"  default: {{library: {LIBRARY}}}   # CHECK: friction angle assumed, 10 to 45 degrees"
    yield from comment("Zones of the file; remove the # and name the ground of a zone. Heights leave out the lowest "
                       f"and the highest {100 * SMALLEST:g} % of a zone's area:")  # fmt: skip
    for zone in found.zones:
        heights = f", at {zone.low:,.0f} to {zone.high:,.0f} m" if zone.area else ""
        area = f"{zone.area:,.0f} m2, mean slope {whole_degrees(zone.slope)}{heights}"
        yield f"  # {_quoted(zone.name)}: {{library: {LIBRARY}}}   # {area}"


def _rock() -> Iterator[str]:
    yield from comment("CHECK: density and size are assumed. Measure blocks at the foot of the face: a distribution "
                       "such as {mean: 0.8, sd: 0.3, min: 0.3, max: 2} can replace the diameter (m).")  # fmt: skip
    yield "rock: {density: 2700, diameter: 1.0}"


def _sources(found: NewScene) -> Iterator[str]:
    """Yield the scene file's lines for the sources: the crest with the longest fall, and other crests as comments.

    Without crests, the source is the highest point.
    """
    if not found.crests:
        why = f"no crest was found, that is, no face steeper than {STEEP:g} degrees and {LOWEST:g} m high"
        if found.misread:
            why = "the unit or the axes of the file look wrong, so no crest was searched: correct them first"
        yield from comment(
            f"CHECK: {why}. The source is the highest point of the terrain. Place it where rocks are released."
        )
        yield "sources:"
        yield f"  - {{name: highest, points: [{_point(found.highest)}], above_ground: 0.5, rocks: {SETS * EACH}}}"
        return
    yield from comment(
        f"CHECK: {counted(len(found.crests), 'crest candidate')}, where flat ground ends above a face steeper than "
        f"{STEEP:g} degrees. Each lies {OVER:g} m over the brow, so that rocks fall and do not rest behind it. The "
        f"source is the crest with the longest fall, of those at least {LONG:g} m long. The fall is the height down to "
        f"the lowest ground in front of the crest that a line steeper than {ENERGY_LINE:g} degrees reaches. Of many "
        "crests the largest and the highest are listed; crest_1 is the highest. A mesh does not show where rocks are "
        "released: choose yours; "
        "remove the # of others.")  # fmt: skip
    yield "sources:"
    (first, crest), *others = zip(crest_numbers(found), found.crests, strict=True)
    yield from _crest(first, crest, found.choice_up, "")
    for number, other in sorted(others, key=itemgetter(0)):
        yield from _crest(number, other, found.choice_up, "# ")


def crest_numbers(found: NewScene) -> list[int]:
    """Return the number in the name of each crest, such as crest_2: 1 for the crest with the highest median altitude.

    The separate surfaces of a layer that `terrain.split` splits are numbered in the same way, from the highest down.
    """
    order = np.argsort([-_altitude(crest, found.choice_up) for crest in found.crests], kind="stable")
    return [int(place) + 1 for place in np.argsort(order)]


def _crest(number: int, crest: Crest, up: str, mark: str) -> Iterator[str]:
    """Yield the scene file's lines for a source along a crest.

    number : of the crest, from 1; up : axis that points up; mark : "# " to comment the source out, otherwise ""
    """
    points = crest.points.tolist()
    yield f"  {mark}- name: crest_{number}   # {words_on_crest(crest, up)}"
    yield f"  {mark}  line:"
    yield from (f"  {mark}    - {_point(point)}" for point in points)
    yield f"  {mark}  above_ground: 0.5"
    yield f"  {mark}  rocks: {SETS * EACH}   # {EACH} for each of the {SETS} parameter sets"


def words_on_crest(crest: Crest, up: str) -> str:
    """Return length, altitude, height of the face and fall of a crest as text; up : axis that points up.

    The altitude is that of the line of release, a little in front of the brow.
    """
    line = _altitude(crest, up)
    return (f"{crest.length:.0f} m long, line at {line:,.0f} m just below the brow, above a face of "
            f"{crest.height:.0f} m, fall {crest.fall:.0f} m")  # fmt: skip


def _altitude(crest: Crest, up: str) -> float:
    """Return the median altitude (m) of the points of a crest; up : axis that points up."""
    return float(np.median(crest.points[:, "xyz".index(up)]))


def _end() -> Iterator[str]:
    """Yield the scene file's last lines: areas of interest and effects as comments, and the seed."""
    yield from comment("Areas of interest, such as a ramp (polygons in the coordinates of the terrain):")
    yield "# areas_of_interest:"
    yield "#   - {name: ramp, polygons: ramp.geojson}"
    yield from comment("Small-scale relief that the survey does not show lets rocks spread. CHECK: a range that fits "
                       "your face; it is not part of the answer as long as it is commented out.")  # fmt: skip
    yield "# effects: {roughness: {angle_sd_deg: {prior: {min: 1, max: 10}}}}"
    yield "seed: 1"


def _point(point: Sequence[float]) -> str:
    """Return a point as a YAML list, rounded to centimetres."""
    return f"[{', '.join(f'{value:.2f}' for value in point)}]"


def _quoted(text: str) -> str:
    """Return a name as a YAML string in double quotes, on one line.

    JSON does not escape control characters above 0x7e and line separators. They are escaped here, because they would
    end a comment in YAML.
    """
    return LIVE.sub(lambda found: f"\\u{ord(found[0]):04x}", json.dumps(text, ensure_ascii=False))
