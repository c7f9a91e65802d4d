"""Make scenes of the small pit with some of its sources, and other numbers of rocks."""

from pathlib import Path

from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import read_scene
from scenes.small_pit import scene_file

UNKNOWN = """\
unknowns:
  sets: 40
  priors: {materials.default.normal_restitution: {min: 0.3, max: 0.6}}
"""
MISFIT = f"{UNKNOWN}  misfit: 12\n"


def scene_of(folder: Path, *sources: str, more: str = "", rocks: dict[str, int] | None = None) -> Scene:
    """Return the scene of the small pit with only the named sources, in this order.

    rocks : source -> number of rocks, for sources whose number differs from the scene of the small pit
    """
    scene = read_scene(scene_file(folder, more=more))
    found = {source.name: source for source in scene.sources}
    changed = [
        found[name].model_copy(update={"rocks": (rocks or {}).get(name, found[name].rocks)})
        for name in sources or found
    ]  # fmt: skip
    return scene.model_copy(update={"sources": tuple(changed)})
