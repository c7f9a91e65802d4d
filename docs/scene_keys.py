"""Write docs/scene-file.md from the scene's own model, so that no key, bound or default is told twice.

    python docs/scene_keys.py
"""

from pathlib import Path
from typing import Any

from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from rpf3d_core.io import scene_model
from rpf3d_core.terrain.pit_parameters import RANGES, Pit

PARTS = (
    ("The scene", scene_model.Scene),
    ("terrain", scene_model.TerrainSpec),
    ("terrain.files[]", scene_model.TerrainFile),
    ("zones[]", scene_model.ZoneSpec),
    ("materials.NAME", scene_model.Material),
    ("rock", scene_model.RockSpec),
    ("sources[]", scene_model.SourceSpec),
    ("areas_of_interest[]", scene_model.AreaSpec),
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
- A zone's material is that of its exact name, else of the first pattern that fits (`bench_*`), else `default`.
- With `--rocks N` the total is dealt to the sources in proportion; a source deals its rocks to its points in turn.
"""


def document() -> str:
    """The whole page."""
    tables = [table(title, part) for title, part in PARTS]
    return "\n".join([HEAD, *tables, pit_table()])


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
        return "its own defaults" if isinstance(made, BaseModel) else "none"
    if field.default is PydanticUndefined:
        return "must be given"
    return "none" if field.default in (None, ()) else f"`{plain(field.default)}`"


def plain(value: Any) -> str:
    """A default as it would stand in the file."""
    return str(list(value)) if isinstance(value, tuple) else str(value)


def pit_table() -> str:
    """The synthetic pit's parameters with their bounds."""
    pit = Pit()
    rows = []
    for name in Pit.__dataclass_fields__:
        low, high = RANGES.get(name, (None, None))
        bounds = "" if low is None else f"{low:g} to {high:g}"
        rows.append(f"| `{name}` | {bounds} | `{plain(getattr(pit, name))}` |")
    text = "Lengths in m, angles in degrees; what each means stands in `rpf3d_core/terrain/pit_parameters.py`."
    return "\n".join(["## terrain.pit", text, "", "| key | bounds | default |", "|---|---|---|", *rows, ""])


if __name__ == "__main__":
    Path(__file__).with_name("scene-file.md").write_text(document())
