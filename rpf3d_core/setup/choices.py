"""Replace the number of rocks, the engine and the seed of a scene by the caller's, such as `--rocks` and `--seed`."""

from pathlib import Path
from typing import Literal

from rpf3d_core.ensemble.releases import share_out
from rpf3d_core.errors import InputError
from rpf3d_core.scene.model import LARGEST_SEED, Scene
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.scene.values import MOST_ROCKS

Rocks = int | Literal["auto"] | None
"""A caller's total number of rocks: a number, "auto" to fly until the target is reached, None for the scene's."""


def chosen_scene(scene: Scene | str | Path, rocks: Rocks, engine: str | None, seed: int | None) -> Scene:
    """Return the scene with the caller's number of rocks, engine and seed.

    scene : a scene, or the path of a scene file; errors are as in `read_scene` and `with_choices`
    """
    return with_choices(scene if isinstance(scene, Scene) else read_scene(scene), rocks, engine, seed)


def with_choices(scene: Scene, rocks: Rocks, engine: str | None, seed: int | None) -> Scene:
    """Return the scene with the caller's number of rocks, engine and seed; None keeps the setting of the scene.

    A total number of rocks, from the caller or from the key `rocks` of the scene, is divided among the sources in
    proportion to their own numbers of rocks.

    Raises
    ------
    InputError
        The number of rocks is below 1 or above MOST_ROCKS, the engine is unknown, or the seed is out of range.
    """
    changes: dict[str, object] = {}
    wanted = scene.rocks if rocks is None else rocks
    if wanted == "auto":
        changes["rocks"] = wanted
    elif wanted is not None:
        if not 1 <= wanted <= MOST_ROCKS:
            raise InputError(f"the number of rocks is {wanted}; it must be from 1 to {MOST_ROCKS}, or auto")
        shares = share_out([source.rocks for source in scene.sources], wanted)
        changes["rocks"] = wanted
        changes["sources"] = tuple(
            source.model_copy(update={"rocks": n}) for source, n in zip(scene.sources, shares, strict=True)
        )
    if engine is not None:
        if engine not in ("auto", "reference", "compiled"):
            raise InputError(f"the engine is {engine!r}; it must be auto, reference or compiled")
        changes["engine"] = engine
    if seed is not None:
        if not 0 <= seed <= LARGEST_SEED:
            raise InputError(f"the seed is {seed}; it must be a whole number from 0 to {LARGEST_SEED}")
        changes["seed"] = seed
    return scene.model_copy(update=changes)
