"""Write docs/reference/effects-by-shape.md: which effects act on points, on spheres and on rocks with a shape.

    python docs/effects_by_shape.py
"""

import textwrap
from pathlib import Path

from rpf3d_core.scene.listings.catalogue import CatalogueEntry, entries
from rpf3d_core.scene.models.keys import EffectsSpec
from rpf3d_core.scene.models.spec import ModelSpec

PAGE = Path(__file__).parent / "reference" / "effects-by-shape.md"
ACTS, REFUSED = "acts", "refused"
SHAPES = ("point", "sphere", "body")
"""Kinds of rocks: a body is a rock with the shape of a box, a family or a file."""
HEAD = """# Effects by shape
This page lists which effects act on which rocks.

`rock.shape` determines the kind of the rocks: `point`, `sphere`, or a body (`box`, `family` or `files`). *Refused*
means that rpf3d refuses a scene that names the effect for these rocks; the message names the effect.
`docs/effects_by_shape.py` writes this page, and `test/scene/test_effects_by_shape.py` checks each cell of the table.

"""
ON_BODIES = """
## How do effects act on bodies?
- A body hits a barrier or a tree if the path of its centre of mass crosses the barrier or tree. rpf3d compares the sum
  of the body's translational and rotational energy with the energy that the barrier or tree can absorb. The absorbed
  energy is subtracted from this sum, so speed and spin decrease by the same factor.
- A body that stops against an obstacle while it touches the ground has `leaning` in `stopped_because`.
- Drag and drag layers act on the centre of mass. They do not change the spin. Drag uses the area of the sphere of equal
  volume.
- Soft ground (`scarring`) slows the centre of mass before each impact. It does not change the spin.

"""


def cell(spec: type[ModelSpec], shape: str) -> str:
    """Return ACTS or REFUSED for an effect on rocks of a kind; shape : one of SHAPES."""
    return REFUSED if shape == "body" and spec.NOT_FOR_BODIES is not None else ACTS


def specs() -> dict[str, type[ModelSpec]]:
    """Return a dictionary from the name of each effect of the package to its class."""
    return {entry.name: _spec(entry) for entry in entries() if entry.kind == "effects"}


def _spec(entry: CatalogueEntry) -> type[ModelSpec]:
    kinds: tuple[type, ...] = EffectsSpec.model_fields[entry.name].annotation.__args__  # type: ignore[union-attr]
    return next(kind for kind in kinds if issubclass(kind, ModelSpec))


def document() -> str:
    """Return the whole page as Markdown."""
    rows = [
        f"| [`{name}`](effects.md#{name}) | " + " | ".join(cell(spec, shape) for shape in SHAPES) + " |"
        for name, spec in specs().items()
    ]
    table = "\n".join([f"| effect | {' | '.join(SHAPES)} |", "|---|---|---|---|", *rows, ""])
    return HEAD + table + ON_BODIES + "## What is refused for bodies?\n" + "\n".join(_refusals()) + "\n"


def _refusals() -> list[str]:
    """Return a list item for each effect that is refused on bodies, and for each replacement of refused parameters."""
    found = []
    for name, spec in specs().items():
        if spec.NOT_FOR_BODIES is not None:
            found.append(f"- `{name}`: {spec.NOT_FOR_BODIES}.")
        for instead in dict.fromkeys(spec.REPLACED_FOR_BODIES.values()):
            keys = [f"`{name}.{key}`" for key, other in spec.REPLACED_FOR_BODIES.items() if other == instead]
            found.append(f"- {', '.join(keys)}: give {instead} instead.")
    return [textwrap.fill(item, 120, subsequent_indent="  ", break_on_hyphens=False) for item in found]


if __name__ == "__main__":
    PAGE.write_text(document(), encoding="utf-8")
