"""Write docs/reference/scene-file.md from the classes that check scenes, so that each bound is written only once.

python docs/scene_keys.py
"""

import re
from pathlib import Path
from types import ModuleType
from typing import Any

from list_items import key
from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from rpf3d_core.ensemble.fly import REFERENCE_ROCKS, REFERENCE_SPHERES
from rpf3d_core.scene import calibration as scene_calibration
from rpf3d_core.scene import hazard as scene_hazard
from rpf3d_core.scene import material as scene_material
from rpf3d_core.scene import method as scene_method
from rpf3d_core.scene import model as scene_model
from rpf3d_core.scene import releases as scene_releases
from rpf3d_core.scene import shapes as scene_shapes
from rpf3d_core.scene import terrain as scene_terrain
from rpf3d_core.scene import unknowns as scene_unknowns
from rpf3d_core.scene.models import keys as model_keys
from rpf3d_core.terrain.benches import parameters as benches
from rpf3d_core.terrain.pit import parameters as pit

HEAD = """# The scene file
This page lists every key of the scene, the YAML file that describes a run, with its unit, bounds and default.

`docs/scene_keys.py` writes this page from the model that checks scenes. Examples: [config/scenes](../../config/scenes).
Parameters of models and effects: [effects.md](effects.md).

The smallest possible scene:

```yaml
terrain: {pit: {}}
materials: {default: {normal_restitution: 0.5, tangential_restitution: 0.8}}
sources: [{name: west, line: [[-570, -10, 0], [-570, 40, 0]], above_ground: 1, velocity: [3, 0, 0]}]
```

## Rules for all keys
- Units are SI. Angles are in degrees where a key ends in `_deg`.
- Positions are in the input's own axes and coordinates. Azimuths are clockwise from north: from y towards x or, with
  `up: y`, from -z towards x.
- Paths are relative to the scene file.
- A key that does not exist, or a value out of bounds, is refused. The message shows the file, the line, the key and
  what would be right.
- YAML aliases: `*name` is a copy of the value with the anchor `&name`. A message about the copy has the key of the copy
  and the line of the original. All aliases of a file may repeat at most 100,000 values. Merge keys (`<<`), and an alias
  inside the value of its own anchor, are refused.
- In the lists of keys, a value without a stated type is a number; (-) means without a unit. The text after *left out*
  applies if the scene does not have the key.
"""
SOURCES = """\
A source has exactly one of the keys `points`, `points_file`, `line`, `crest`, `polygon` and `zone`.

- **Number.** Without `rocks`, a source of points has one rock for each point; every other source has one rock.
- **Places.** Rocks are assigned to points in turn. On a line, a polygon or a zone they start at random places: all
  places along the line, or on the inclined surface of the polygon or zone (not its area in plan), are equally likely.
- **Heights.** With `above_ground`, points may be `[x, y]` (with `up: y`: `[x, z]`), and heights in the file of a source
  are not used. rpf3d warns if the median difference between these heights and the ground is above 2 m plus
  `above_ground`.
- **Files of lines** (`.geojson .json .gpkg .shp .dxf .str`) need `above_ground`. Rocks are spread over the length of
  all lines of the file, also of all layers of a DXF file; rpf3d warns of several layers.
- **Order of points.** The points of a line must be in their order along the crest: rpf3d warns of a line that turns
  back and would be shorter in another order. Rocks also start along the last segment of a closed line, which leads back
  to the first point; rpf3d warns if this segment is long, or if the line has at most five points.
- **Polygons.** If part of a polygon is outside the terrain, `rpf3d check` prints the share of the polygon that is on
  the terrain.
- **Size.** A source may have its own `diameter`, `mass` or `volume`; density and shape are always those of `rock`. The
  live node refuses a scene in which a source has a size.
- **Speed.** A source has `velocity`, or `speed` with `azimuth_deg`. A release speed above 10,000 m/s is refused.
- **Spread.** Polygons and zones have no `spread`.
"""
PIT = "Lengths are in m, angles in degrees."
BENCHES = """\
A slope of level berms and plane faces, for a design without a mesh ([how-to](../howto/catch-bench-design.md)). Lengths
are in m, angles in degrees. The uppermost edge is at x = 0, the floor at z = 0; x points away from the faces, and y = 0
is the middle of the slope. Here a *berm* is a level step between two faces, not a
[ridge of loose rock](#terrainberms).

Zones from the top: `crest`, `face_1`, `berm_1`, `face_2` and so on, `floor`. Materials may name them by pattern
(`face_*`). A source with `crest: 1` releases rocks along the middle half of the upper edge of `face_1`, at
`above_ground`. `roughness` moves the points of crest, faces, berms and floor normal to the surface (the floor by a
third). The edges of these surfaces stay in place: the effect of `roughness` grows over the first 3 m from an edge.
"""
POINTS = """## Files of points
| file | content |
|---|---|
| text with spaces between the numbers | x y z first on each line; a `#` begins a comment |
| CSV: a comma, semicolon or tab in the first line | the columns that the header names, otherwise the first three; \
a line that begins with `#` is a comment |
| `.geojson`, `.json` | Points and MultiPoints, `[x, y, z]` in the input's coordinates |
| `.gpkg`, `.shp`, `.dxf`, `.str` | points, as [file formats](formats.md) describes |

- A first line without a number is a header. It names x, y and z, in any order, among any other columns, in upper or
  lower case.
- Without a header, a file with more than three columns is refused if its first column grows by 1 in each line: this
  column may have the numbers of the points.
- Other names of x are `east`, `easting`, `e`; of y `north`, `northing`, `n`; of z `elevation`, `elev`, `height`,
  `altitude`, `alt`, `rl`. With `up: y`, only the names x, y and z are accepted.
- A name may state a unit of length, from which the numbers are converted to m: `E (mm)`, `N [ft]`, `z_m`. Without a
  unit they are read in m. Other words in brackets are refused, as in `RL (UTM)`.
- A cell must be a plain number. `1,234.5` and `1,5` are refused with line and column.
- With `above_ground`, the height may be missing: no column for it, or `[x, y]` (with `up: y`, x and z).
"""
ROCKS = """## rocks
The total number of rocks; `--rocks` of `rpf3d run` replaces it. Without this key, each source flies its own `rocks`.

- With a number, sources share the total in proportion to their own `rocks`.
- With `auto`, first at least 1,000 rocks fly. Then the number of rocks doubles, at least twice, until it is sufficient
  for `target`, or until another doubling would exceed `most_rocks`. Each doubling keeps the proportions of the sources.
  The summary has the intervals after each doubling.
"""
TARGET = """\
The places of the target are the areas of interest or, in a scene without areas, all zones that rocks
[reached](outputs.md#bench-table). The number of rocks is sufficient when three figures of each place are certain
enough: the share of rocks that reached the place, the share that stopped there, and the p95 energy there (if at least
20 rocks reached the place).
"""
MATERIALS = """\
A zone has the material with the exact name of the zone; otherwise the first material whose pattern matches this name,
such as `bench_*`; otherwise `default`. A part of a split zone without a material of its own name has the material of
the whole zone. A material other than `default` is refused if its name matches no zone of the terrain. Upper and lower
case differ: the pattern of layers such as `FACES_NORTH` is `FACES_*`.

A material has coefficients for one kind of rocks; coefficients of both kinds together are refused:

| rocks | must be given | may be given |
|---|---|---|
| points, spheres | `normal_restitution`, `tangential_restitution` | `friction_angle_deg`, `rolling_friction` |
| rocks with a shape | `restitution`, and either `friction` or `slip_friction` | `rolling_resistance` |

A material with a `library` entry for the kind of the rocks needs none of them; `rpf3d materials` lists the entries. In
the list of keys below, *must be given* applies to points and spheres, in a material without a `library` entry.
"""
ROCK = """\
`diameter`, `mass` and `volume` exclude each other; `diameter` is that of the sphere of equal volume. Without a size,
boxes and blocks from files keep their own size, and all other rocks have a diameter of 1 m: 1,414 kg at the default
density. `rpf3d check` prints mass and size.
"""
TERRAIN = """\
A terrain has exactly one of the keys `files`, `pit` and `benches`. Files are meshes, grids, files of mine planning
programs, or clouds of points: [all formats](formats.md). Heights of a grid are at the centres of cells; NODATA is a
hole. Maps have the reference system `crs`, which must be in metres; a terrain file that states another system in
metres is refused. A terrain file may state a [system in feet](formats.md#reference-systems).

An open seam up to 20 mm wide between a vertex and the edge of another facet, for example from rounding, is
[closed](../explanation/never-below.md#how-does-rpf3d-close-open-seams): the facet is cut, its first part keeps the
number of the facet, and the other parts follow after all facets. `rpf3d check` prints the number of closed seams.

The surfaces of a zone of `split` become zones as follows:

- A surface with at least 2 % of the zone's area (a large surface) becomes a zone.
- A smaller surface of at least 100 m2 also becomes a zone, if its mean height is more than 3 m above or below all
  heights of each large surface.
- Surfaces whose mean heights differ by less than 3 m are one zone.
- Every other surface joins the zone nearest in height. A note reports surfaces whose mean height differs by more than
  3 m from that of the zone that they joined.
"""
ZONES = """\
A facet belongs to the zone if its centroid lies inside one of the polygons in plan.
"""
SCENE = f"""\
More on some of these keys:

- `stop_speed`: a rock on the ground stops below this speed, if friction holds it there. `ground: none` ignores
  friction; `rolling_stone` has a separate `stop_speed`.
- `smallest_bounce`: when the next bounce would be lower than this height, bouncing
  [ends](../explanation/physics.md#the-end-of-bouncing). The rebound model decides whether the remaining bounces are
  summed in closed form, simulated or left out.
- `max_time` and `max_impacts`: the flight of a rock that still moves at this limit ends with the outcome of the same
  name. `max_impacts` counts impacts, contacts with obstacles and slides over facets together.
- `engine`: both engines give the same result with `method: events`. `auto` uses the engine that usually finishes first:
  `reference` up to {REFERENCE_ROCKS} rocks ({REFERENCE_SPHERES} spheres or rocks with a shape) or without numba, else
  `compiled`.
- `method`: `events` is exact; fixed steps ([`stepping`](#methodstepping)) are only for comparison, and only for points.
"""
BERMS = """\
A berm of `terrain.berms` is a ridge of loose rock, the *windrow* of the [glossary](glossary.md). The key `berm` of
[`terrain.benches`](#terrainbenches) means something else: the level step between two faces.

The crest of a berm has a constant height above the ground below. The berm slopes down to its foot on both sides and
beyond its ends. Where two berms cross, their heights are added.

Berms are a part of the ground: they are added before rpf3d corrects the winding, applies the polygons of `zones`, and
splits zones. The facets of a berm form the zone `berm_<name>`, even inside a polygon of `zones`; `materials` and the
bench table can use this name. If a berm cuts a facet into parts, the first part keeps the number of the facet.

Example: `berms: [{name: haul_road, along: [[0, 0], [120, 40]], height: 2, width: 6, crest: 1}]`
"""
AREAS = """\
An area of interest outside the terrain is refused. If part of an area is outside, `rpf3d check` prints the share of the
area that is on the terrain. Files with polygons or lines, here and elsewhere, are GeoJSON, GeoPackage, Shapefile, DXF
or Surpac strings: [file formats](formats.md#areas-lines-and-points).
"""
HAZARD = """\
[What a run writes](outputs.md#hazard) describes the maps, with an example of this section.
"""
DRAWS = """## Distributions
If a key of this page has "or a distribution", a distribution may replace the number. `min` and `max` cut the
distribution off, and must be within the limits of the key.

- `{mean: 0.5, sd: 0.1, min: 0.2, max: 0.8}`: normal; mean and sd are those before the cut.
- `{lognormal: {mean: 0.4, sd: 0.3, min: 0.05, max: 3}}`: lognormal; mean and sd of the number, not of its logarithm.
- `{uniform: [0.2, 0.8]}`: uniform between the two numbers.
- `{power_law: {exponent: 0.5, min: 0.01, max: 8}}`: before the cut, the number of values above x is proportional to
  x^-exponent. For volumes of rocks the exponent is 0.4 to 0.6 (unconfirmed).
- `{weibull: {shape: 1.5, scale: 0.8, min: 0.1, max: 3}}`: Weibull; before the cut, the share of values below x is
  1 - exp(-(x/scale)^shape).
- `{triangular: {min: 0.2, mode: 0.5, max: 1.4}}`: triangular, most frequent at its mode.
- `{measured: [0.4, 0.7, 1.1]}`, `{measured: blocks.csv}`: sizes of rocks only; a value of the list, each with the same
  probability. A file has a number on each line, and may have a header.
- `{measured: blocks.csv, column: diameter_m}`: the same, from the column of a table with that name in its header.

The name of a column of measured sizes may state a unit; `rpf3d check` prints the unit:

| name of the column | sizes |
|---|---|
| `length (mm)`, `diameter_cm`, `mass (t)` | converted to m, kg or m3 |
| without a unit; `Length (L)`, `mass (m)`, `thickness (t)`, where the letter is the symbol of the quantity | read in \
m, kg or m3 |
| `mass_t`, `mass_g` | converted, with a warning: if the letter after `_` is a unit, write `mass (t)` |
| `ton` | 1 ton is 1,000 kg, with a warning, because there are other tons |
| an unknown word in brackets; `tonnage` or `mass t` for masses | read in m, kg or m3, with a warning |
| a unit of another quantity, such as `width (m)` or `width_m` for masses | refused |
| another quantity, such as `tonnage` for diameters (also German: `Masse`, `Durchmesser`, `Volumen`) | refused, with \
the right key |
| a radius or circumference, such as `Radius (m)` | refused: sizes are diameters, masses or volumes |

- rpf3d warns of these values, and names a likely unit:
  - masses without a unit that give only rocks below about 5 kg;
  - a named column of masses without a unit, with values below 50 only;
  - sizes converted from a smaller unit, such as mm, that give only very small rocks;
  - a density from 100 to 300 kg/m3, which may be in lb/ft3.
- Random numbers are the same on both engines.
- A coefficient of a material is drawn for each rock and zone; with `draw: per_impact`, for each impact. The last
  bounces, which are summed, and the slide after them share one draw.

```yaml
materials:
  face: {normal_restitution: {mean: 0.47, sd: 0.3, min: 0.1, max: 1}, tangential_restitution: 0.55}
  default:
    normal_restitution: {mean: 0.5, sd: 0.2, min: 0.3, max: 0.8}
    tangential_restitution: {uniform: [0.5, 1]}
    friction_angle_deg: {mean: 30, sd: 2, min: 20, max: 40}
    draw: per_impact
rock: {density: 2700, volume: {power_law: {exponent: 0.5, min: 0.01, max: 8}}}
sources:
  - {name: crest, line: [[0, 0, 90], [40, 0, 90]], above_ground: 0.5, rocks: 500, velocity: [0, 1, 0]}
  - {name: scar, polygon: [[0, 0], [10, 0], [10, 20]], rocks: 500}
  - {name: unstable, polygon: unstable.geojson, above_ground: 0.2, rocks: 500}
  - {name: faces, zone: face_*, steeper_than_deg: 45, rocks: 5000}
  - name: blast
    points_file: holes.csv
    speed: {uniform: [2, 6]}
    azimuth_deg: 90
    elevation_deg: 30
    spread_deg: 20
```
"""
UNKNOWNS = f"""\
A coefficient is **unknown** if it has one value for the whole site, but this value is not known. It
[varies](../explanation/statistics.md#what-is-the-difference-between-unknown-and-varying) if it differs from rock to
rock or from impact to impact ([distributions](#distributions)). [How-to](../howto/unknown-ground.md).

- These keys, and keys below them, may have unknown numbers:
  {", ".join(f"`{root}`" for root in scene_unknowns.ROOTS)}. (Not
  `effects.forest` and `effects.barriers`: all parameter sets share the obstacles.)
- There are three ways to make a number unknown:
  - write `{{prior: {{min, max}}}}` in place of the number;
  - write its key path in `unknowns.priors`;
  - write `library` in a material. The library also gives ranges for
    [coefficients that its source leaves out](../howto/unknown-ground.md#take-ground-from-the-library).
- The number may be a part of a distribution: `{{mean: {{prior: {{min: 0.3, max: 0.5}}}}, sd: 0.1, min: 0.1, max: 0.8}}`
  varies, and its mean is unknown.
- In a [key path](glossary.md), `*` stands for all keys of a mapping: `materials.*.friction` is one value for all
  materials.
- The rocks of a run with unknowns are shared among `sets` parameter sets. Without unknowns, `sets` has no effect.
- A parameter with a column in `sample` is drawn from the sample, even if it also has a prior.
- `rpf3d cost`, `rpf3d check` and pictures of models use the middle of each range. A
  [run in parts](../howto/parallel-runs.md#run-one-scene-in-parts) refuses a scene with unknowns.

```yaml
materials:
  face: {{library: hoek_bedrock}}
  default: {{normal_restitution: {{prior: {{min: 0.3, max: 0.5}}}}, tangential_restitution: 0.8}}
unknowns: {{sets: 128, priors: {{materials.*.friction_angle_deg: {{mean: 32, sd: 3, min: 25, max: 40}}}}}}
```
"""
PRIOR = """\
With `min` and `max` alone, all values between them are equally probable. With `mean` and `sd`, the values have a normal
distribution that is cut off at `min` and `max`.
"""
CALIBRATION = """\
`rpf3d calibrate` determines unknowns from `observed` and from the data of this section
([how-to](../howto/calibrate-a-ramp.md)). A run ignores the section.

- **Unknowns.** The calibration determines at most 12 `unknowns` of this section, and all other unknowns of the scene,
  such as the ranges of a library. If two ranges are given for a value, the range of this section applies.
- **Columns.** `mass_column` and `shape_column` name columns of the file of end points, at any place in the file. A
  simulated rock is then compared only with blocks of about its mass, and of its shape.
- **Heights** of stops are not compared, so x and y are enough.
"""
SHAPE = """\
`shape: point` is the default. Spheres have the rocks' size, roll and spin, and need the same coefficients of materials
as points. All other shapes are convex bodies. [Effects by shape](effects-by-shape.md) shows which effects act on which
rocks.
"""
MODELS = (
    ("rebound", "The rebound model, one of:", model_keys.ReboundSpec),
    ("ground", "The ground model, one of:", model_keys.GroundSpec),
    ("contact", "The contact model of spheres, and that of rocks with a shape:", scene_shapes.ContactSpec),
    ("effects", "Any number of:", model_keys.EffectsSpec),
)
"""Title, text and class of each key that names models or effects; the page of effects has their parameters."""
WITHOUT_KEYS: dict[type, str] = {scene_method.MethodSpec: "`events`", model_keys.EffectsSpec: "none"}
"""Class of a part of the scene -> default in the list, for parts whose default has no keys."""
BY_PLACE = {(scene_releases.SourceSpec, "rocks"): "one for each point, otherwise `1`"}
"""Part of the scene and key -> default in words, for keys whose default depends on other keys."""


def document() -> str:
    """Return the whole page as Markdown."""
    return "\n".join(
        [
            HEAD,
            key_list("The scene", scene_model.Scene),
            SCENE,
            key_list("terrain", scene_terrain.TerrainSpec, TERRAIN),
            key_list("terrain.files[]", scene_terrain.TerrainFile),
            key_list("terrain.berms[]", scene_terrain.BermSpec, BERMS),
            parameter_table("terrain.pit", PIT, pit.Pit(), pit),
            parameter_table("terrain.benches", BENCHES, benches.Benches(), benches),
            key_list("zones[]", scene_terrain.ZoneSpec, ZONES),
            key_list("materials.NAME", scene_material.Material, MATERIALS),
            key_list("materials.NAME.slip_friction", scene_shapes.SlipFrictionSpec),
            key_list("rock", scene_releases.RockSpec, ROCK),
            key_list("rock.shape", scene_shapes.ShapeSpec, SHAPE),
            key_list("sources[]", scene_releases.SourceSpec, SOURCES),
            POINTS,
            DRAWS,
            ROCKS,
            key_list("target", scene_model.TargetSpec, TARGET),
            *(names(*each) for each in MODELS),
            key_list("areas_of_interest[]", scene_model.AreaSpec, AREAS),
            key_list("hazard", scene_hazard.HazardSpec, HAZARD),
            key_list("hazard.matrix", scene_hazard.MatrixSpec),
            key_list("outputs", scene_model.OutputSpec),
            key_list("method", scene_method.MethodSpec),
            key_list("method.stepping", scene_method.SteppingSpec),
            key_list("observed", scene_model.ObservedSpec),
            key_list("unknowns", scene_unknowns.UnknownsSpec, UNKNOWNS),
            key_list("prior", scene_unknowns.PriorSpec, PRIOR),
            key_list("calibration", scene_calibration.CalibrationSpec, CALIBRATION),
            key_list("calibration.gates[]", scene_calibration.GateSpec),
            key_list("calibration.shares[]", scene_calibration.ShareSpec),
        ]
    )


def names(title: str, text: str, part: type[BaseModel]) -> str:
    """Return the section on a key that names models or effects, with links to their parameters; part : its class."""
    links = [f"[`{name}`](effects.md#{name})" for name in part.model_fields if name != "own"]
    closed = part in (model_keys.GroundSpec, scene_shapes.ContactSpec)
    own = "" if closed else ", or [your own](../howto/own-models.md)"
    return f"## {title}\n{text}\n" + ",\n".join(links) + f"{own}.\n"


def key_list(title: str, part: type[BaseModel], text: str = "") -> str:
    """Return the section on a part of the scene: a text, and a list of its keys; part : class of the part."""
    items = [
        key(name, BY_PLACE.get((part, name)) or default_of(field), short(field.description or ""))
        for name, field in part.model_fields.items()
        if (part, name) != (scene_model.Scene, "path")
    ]
    return "\n".join([f"## {title}", *filter(None, [text]), "Keys:", "", *items, ""])


def short(description: str) -> str:
    """Return the description of a key without its first article or the words "a number", for a list."""
    return re.sub(r"^(a number |an? |the )", "", description)


def default_of(field: Any) -> str:
    """Return the default of a key in words; field : field of a pydantic model."""
    if field.default_factory is not None:
        made = field.default_factory()
        if isinstance(made, model_keys.OneOf):
            return f"`{made.name}`"
        if type(made) in WITHOUT_KEYS:
            return WITHOUT_KEYS[type(made)]
        return "the defaults of its keys" if isinstance(made, BaseModel) else "none"
    if field.default is PydanticUndefined:
        return "must be given"
    return "none" if field.default in (None, ()) else f"`{plain(field.default)}`"


def plain(value: Any) -> str:
    """Return a default as it is written in a scene file."""
    if isinstance(value, bool):
        return str(value).lower()
    return str(list(value)) if isinstance(value, tuple) else str(value)


def parameter_table(title: str, text: str, made: object, module: ModuleType) -> str:
    """Return the section on a generated terrain: a text, and a table of its parameters with bounds and defaults.

    made : object with the defaults; module : has RANGES and MEANINGS of the parameters
    """
    rows = []
    for name in vars(made):
        low, high = module.RANGES.get(name, (None, None))
        bounds = "" if low is None else f"{low:g} to {high:g}"
        rows.append(f"| `{name}` | {module.MEANINGS[name]} | {bounds} | `{plain(getattr(made, name))}` |")
    head = [f"## {title}", text, ""]
    return "\n".join([*head, "| key | meaning | bounds | default |", "|---|---|---|---|", *rows, ""])


if __name__ == "__main__":
    (Path(__file__).parent / "reference" / "scene-file.md").write_text(document())
