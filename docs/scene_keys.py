"""Write docs/reference/scene-file.md from the scene's own model, so that no key, bound or default stands twice.

python docs/scene_keys.py
"""

from pathlib import Path
from typing import Any

from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from rpf3d_core.scene import air as scene_effects_air
from rpf3d_core.scene import barriers as scene_barriers
from rpf3d_core.scene import berms as scene_berms
from rpf3d_core.scene import forest as scene_forest
from rpf3d_core.scene import fragmentation as scene_effects_fragmentation
from rpf3d_core.scene import grounds as scene_grounds
from rpf3d_core.scene import hazard as scene_hazard
from rpf3d_core.scene import method as scene_method
from rpf3d_core.scene import model as scene_model
from rpf3d_core.scene import models as scene_models
from rpf3d_core.scene import rebounds as scene_rebounds
from rpf3d_core.scene import releases as scene_releases
from rpf3d_core.scene import roughness as scene_roughness
from rpf3d_core.scene import scarring as scene_effects_scarring
from rpf3d_core.scene import sphere as scene_sphere
from rpf3d_core.scene import terrain as scene_terrain
from rpf3d_core.terrain.pit.parameters import RANGES, Pit

PARTS = (
    ("The scene", scene_model.Scene),
    ("terrain", scene_terrain.TerrainSpec),
    ("terrain.files[]", scene_terrain.TerrainFile),
    ("terrain.berms[]", scene_berms.BermSpec),
    ("zones[]", scene_terrain.ZoneSpec),
    ("materials.NAME", scene_model.Material),
    ("rock", scene_releases.RockSpec),
    ("sources[]", scene_releases.SourceSpec),
    ("areas_of_interest[]", scene_model.AreaSpec),
    ("rebound", scene_models.ReboundSpec),
    ("rebound.pfeiffer_bowen", scene_rebounds.PfeifferBowenSpec),
    ("rebound.velocity_scaled", scene_rebounds.VelocityScaledSpec),
    ("rebound.mass_scaled", scene_rebounds.MassScaledSpec),
    ("rebound.v_half", scene_rebounds.VHalfSpec),
    ("rebound.angle_table", scene_rebounds.AngleTableSpec),
    ("rebound.stochastic_matrix", scene_rebounds.StochasticMatrixSpec),
    ("effects", scene_models.EffectsSpec),
    ("effects.roughness", scene_roughness.RoughnessSpec),
    ("effects.drag", scene_effects_air.DragSpec),
    ("effects.drag_layer", scene_effects_air.DragLayerSpec),
    ("effects.scarring", scene_effects_scarring.ScarringSpec),
    ("effects.scarring.zones.NAME", scene_effects_scarring.SoftZoneSpec),
    ("effects.fragmentation", scene_effects_fragmentation.FragmentationSpec),
    ("method", scene_method.MethodSpec),
    ("method.stepping", scene_method.SteppingSpec),
    ("rebound.coulomb_sphere", scene_sphere.CoulombSphereSpec),
    ("ground.rolling_stone", scene_grounds.RollingStoneSpec),
    ("effects.forest", scene_forest.ForestSpec),
    ("effects.forest.energy_factors", scene_forest.EnergyFactors),
    ("effects.forest.deflection", scene_forest.DeflectionSpec),
    ("effects.barriers", scene_barriers.BarriersSpec),
    ("effects.barriers.panels[]", scene_barriers.BarrierSpec),
    ("hazard", scene_hazard.HazardSpec),
    ("hazard.matrix", scene_hazard.MatrixSpec),
    ("target", scene_model.TargetSpec),
    ("outputs", scene_model.OutputSpec),
    ("observed", scene_model.ObservedSpec),
)
HEAD = """# The scene file
One YAML file says everything about a run. `docs/scene_keys.py` writes this page from the model that checks scenes;
`config/scenes/` has examples.

- Everything is in the input's own axes and coordinates. SI units; angles in degrees where a key ends in `_deg`.
- Paths are relative to the scene file. Files: `.stl .ply .obj .vtp .vtk` meshes, `.asc .asc.gz .tif .tiff` grids
  (heights at cell centres, NODATA is a hole).
- An unknown key is refused, and so is a value out of bounds: the message names the file, the line, the key and what
  would be right.
- A zone's material is that of its exact name, else of the first pattern that fits (`bench_*`), else `default`. One that
  fits no zone of the terrain is refused, but for `default`.
- Without `rock`, rocks are spheres of 1 m and 2,700 kg/m3: 1,414 kg. `rpf3d check` tells mass and size.
- A source that does not say `rocks` has one for each of its points; a line, polygon or zone has one.
- With `rocks: N`, or `--rocks N`, the total is dealt to the sources in proportion; a source deals its rocks to its
  points in turn, and spreads them evenly over the length of a line, or over the true area of the surface in a polygon
  or zone.
- With `rocks: auto` at least 1,000 rocks fly, then as many again, and so on, until `target` is met or twice as many
  would be more than its `most_rocks`; each doubling keeps the sources' proportions. The summary says what was reached.
- `target` looks at the areas of interest or, where the scene names none, at every zone that rocks reached: at the
  shares of all rocks that reached it and that stopped in it, and at the p95 energy there where 20 rocks or more came. A
  zone is reached by a rock that touched one of its facets or passed straight above one, at whatever height.
- Azimuths are clockwise from north: from y towards x or, with `up: y`, from -z towards x.
- The reference system of the maps is `terrain.crs` or, left out, that of GeoTIFF files; both must agree where both say.
- An area of interest that lies off the terrain is refused; `rpf3d check` tells how much of one, or of a source's
  polygon, lies on it.
"""
POINTS = """## Files of points
| file | is read as |
|---|---|
| lines of numbers between blanks | x y z first on each line; what follows a `#` is a comment |
| CSV: a comma, semicolon or tab stands in the first line | the columns that the header names, without one the \
first three; a line that begins with `#` is a comment |
| `.geojson`, `.json` | Points and MultiPoints, `[x, y, z]` in the input's coordinates |

A header is a first line without a number. It names x, y and z, in any order and beside others, in small letters or
capitals: x is also `east`, `easting` or `e`; y `north`, `northing` or `n`; z `elevation`, `elev`, `height`, `altitude`,
`alt` or `rl`; each may end in `_m`, `(m)` or `[m]`. With `up: y` only x, y and z are names. A cell is taken as it
stands: one that is no plain number, such as `1,234.5` or `1,5`, is refused with its line and column. Where the source
says `above_ground`, points in plan will do: no column for the height, or `[x, y]` (with `up: y` x and z).
"""
OBSTACLES = """## Barriers, berms and trees
```yaml
terrain:
  files: [{path: pit.stl}]
  berms: [{name: haul_road, along: [[0, 0], [120, 40]], height: 2, width: 6, crest: 1}]
effects:
  barriers:
    panels:
      - {name: fence_1, along: [[0, 60], [120, 90]], height: 4, capacity_kj: 1000}
      - {name: counted, along: portal.geojson, height: 3, capacity_kj: 0}
  forest: {file: trees.csv}
```

- A **berm** is ground: it is raised on the terrain before anything else is made of it, by its height over whatever
  lies below, follows that, and slopes to its foot and beyond its ends. Its facets are the zone `berm_<name>`,
  whatever else is drawn there, so `materials` and the bench table know it; where two cross, their heights add up.
  Facets that it cuts keep their number for the first of their parts.
- A **barrier** stands vertically on the ground straight below its line. A rock that crosses its plane at most
  `height` times `residual_height` above that ground meets it: with no more translational energy than `capacity_kj` it
  is caught there (outcome `caught`); with more it breaks through, in the same direction, and `taken_by_break` times
  the capacity is gone. Higher up it flies over, and nothing of its path changes. Rocks that slide, roll or settle
  meet barriers, too.
- Every rock finds a barrier as the scene gives it: rocks are independent of each other, so none finds what another
  has broken. For a net that has been hit, say what is left of its height. Whether a net is high and strong enough is
  for the engineer: the summary tells p95 energies and heights, and no factor of safety is applied.
- A barrier of `capacity_kj: 0` stops nothing and changes no bit of any path: it counts the rocks that cross a line.
- Energies that nets are tested with by ETAG 027 (now EAD 340059), in kJ at the maximum energy level, are,
  unconfirmed: 100, 250, 500, 1000, 1500, 2000, 3000, 4500 for classes 0 to 7; look them up for the product that is
  planned.
- A file of **trees** is a CSV with a header that names x, y, `dbh_cm` and, where known, `height` (m), `kind`
  (`conifer`, `broadleaved`, `silver_fir`) and the foot's z, which must lie within 2 m of the ground; or without a
  header those five columns from x to kind. Trees that are drawn stand anywhere with the same chance; each is a
  function of the seed and its number. A tree that takes all of a rock's energy drops it at its foot; one that slides
  or rolls lies against it.
"""
DRAWS = """## Distributions
Where a key says "or a distribution", one of these may stand instead of a number. All are cut off at their bounds, which
must keep to the limits of the key.

| written | drawn |
|---|---|
| `{mean: 0.5, sd: 0.1, min: 0.2, max: 0.8}` | normal; mean and sd are those before the cut |
| `{lognormal: {mean: 0.4, sd: 0.3, min: 0.05, max: 3}}` | lognormal; mean and sd of the number, not of its logarithm |
| `{uniform: [0.2, 0.8]}` | every number between the two alike |
| `{power_law: {exponent: 0.5, min: 0.01, max: 8}}` | N(> x) ~ x^-exponent: volumes of blocks have 0.4 to 0.6 |

Every draw is a function of the seed, the source, the number of the rock and what it is for, and of nothing else: it is
the same on any engine, and whatever else is drawn. A coefficient of a material is drawn for each rock and zone, or with
`draw: per_impact` for each impact; between two impacts it stays as it is, so the bounces that are summed up at the end
and the slide after them have one restitution and one friction angle.

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


def document() -> str:
    """The whole page."""
    tables = [table(title, part) for title, part in PARTS]
    return "\n".join([HEAD, *tables, pit_table(), POINTS, DRAWS, OBSTACLES])


def table(title: str, part: type[BaseModel]) -> str:
    """One part of the scene, a row a key."""
    rows = [
        f"| `{name}` | {field.description} | {default_of(field)} |"
        for name, field in part.model_fields.items()
        if (part, name) != (scene_model.Scene, "path")
    ]
    return "\n".join([f"## {title}", "| key | value | default |", "|---|---|---|", *rows, ""])


def default_of(field: Any) -> str:
    """What a key is when it is left out."""
    if field.default_factory is not None:
        made = field.default_factory()
        if isinstance(made, scene_models.OneOf):
            return f"`{made.name}`"
        return "its own defaults" if isinstance(made, BaseModel) else "none"
    if field.default is PydanticUndefined:
        return "must be given"
    return "none" if field.default in (None, ()) else f"`{plain(field.default)}`"


def plain(value: Any) -> str:
    """A default as it would stand in the file."""
    if isinstance(value, bool):
        return str(value).lower()
    return str(list(value)) if isinstance(value, tuple) else str(value)


def pit_table() -> str:
    """The synthetic pit's parameters with their bounds."""
    pit = Pit()
    rows = []
    for name in Pit.__dataclass_fields__:
        low, high = RANGES.get(name, (None, None))
        bounds = "" if low is None else f"{low:g} to {high:g}"
        rows.append(f"| `{name}` | {bounds} | `{plain(getattr(pit, name))}` |")
    text = "Lengths in m, angles in degrees; what each means stands in `rpf3d_core/terrain/pit/parameters.py`."
    return "\n".join(["## terrain.pit", text, "", "| key | bounds | default |", "|---|---|---|", *rows, ""])


if __name__ == "__main__":
    Path(__file__).parent / "reference" / "scene-file.md".write_text(document())
