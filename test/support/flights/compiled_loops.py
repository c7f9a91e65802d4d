"""List the types for which the compiled engine's loop over flights has been compiled."""

from typing import Any, NamedTuple

from rpf3d_core.simulation import engines


class LoopTypes(NamedTuple):
    """The types of one compiled loop over flights, as numba names them; "none" for a part that the flights lack."""

    rebound: str
    effects: str
    materials: str
    sizes: str
    keys: str


def compiled_loops() -> list[LoopTypes]:
    """Return the types of each loop over flights that this process has compiled or loaded."""
    return [_types_of(*signature[:3]) for signature in engines._follow_all.signatures]


def _types_of(physics: Any, locator: Any, launches: Any) -> LoopTypes:
    models = dict(zip(physics.fields, physics.types, strict=True))
    rocks = dict(zip(launches.fields, launches.types, strict=True))
    return LoopTypes(
        rebound=str(models["rebound"]), effects=str(models["effects"]), materials=str(models["materials"]),
        sizes=str(rocks["sizes"]), keys=str(rocks["keys"]),
    )  # fmt: skip
