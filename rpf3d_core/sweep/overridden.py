"""Refuse varied keys without effect, whose value is set elsewhere: by an unknown, a material or the total of rocks."""

from collections.abc import Iterable, Sequence

from rpf3d_core.errors import InputError
from rpf3d_core.scene.key_paths import Steps, steps_to
from rpf3d_core.scene.library import LIBRARY, keys_of_entry, models_of, published_ranges
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.unknowns import sampled

ROCKS = "rocks"
"""Name of the key for the total number of rocks, and of the key for the rocks of a source."""


def check_rocks(scene: Scene, keys: Sequence[str], totals: Iterable[int | str | None]) -> None:
    """Refuse a sweep that varies the `rocks` of a source if a cell of the sweep has a total number of rocks.

    The key of the source would have no effect: the total is divided among the sources.

    keys : key paths of all varied keys
    totals : the total number of rocks of each cell of the sweep; None for a cell without a total

    Raises
    ------
    InputError
        The message names the key.
    """
    total = next((each for each in totals if each is not None), None)
    numbers = [key for key in keys if any(len(at) > 1 and at[-1] == ROCKS for at in steps_to(scene, key))]
    if numbers and total is not None:
        raise InputError(f"{scene.path}: `{numbers[0]}` is varied, but the total `{ROCKS}: {total}` is dealt to the "
                         f"sources; vary `{ROCKS}`, or give no total")  # fmt: skip


def check_libraries(scenes: Iterable[Scene], keys: Sequence[str]) -> None:
    """Refuse a varied key `library` without effect.

    The key has no effect if each material with this key states all coefficients of the library's entry itself.

    scenes : the scenes of the cells; keys : key paths of all varied keys

    Raises
    ------
    InputError
        The message names the key.
    """
    of_library = [key for key in keys if key.rpartition(".")[2] == LIBRARY]
    for scene in scenes if of_library else ():
        priors = {} if scene.unknowns is None else scene.unknowns.priors
        for key in of_library:
            names = [str(steps[1]) for steps in steps_to(scene, key)]
            materials = {name: scene.materials[name] for name in names if scene.materials[name].library is not None}
            if materials and not any(
                keys_of_entry(each, name, priors, models_of(scene)).intersection(published_ranges(each.library))
                for name, each in materials.items()
            ):
                raise InputError(f"{scene.path}: `{key}` is varied, but the material gives all coefficients of the "
                                 "entry itself; remove those that the library shall give")  # fmt: skip


def check_priors(scene: Scene, keys: Sequence[str]) -> None:
    """Raise InputError if a sweep varies a key whose prior also sets values that the sweep does not vary.

    scene : the scene with the priors; keys : key paths of all varied keys

    Raises
    ------
    InputError
        A key path leads nowhere, or a prior also sets values that do not vary; the message names the prior and the key.
    """
    varied = [(key, steps_to(scene, key)) for key in keys]
    for path in {} if scene.unknowns is None else scene.unknowns.priors:
        places = steps_to(scene, path)
        keys_over = [key for key, sections in varied if _below(places, sections)]
        if keys_over and len(_below(places, [steps for _, sections in varied for steps in sections])) < len(places):
            raise InputError(
                f"{scene.path}: `{keys_over[0]}` is varied, but the prior of `{path}` gives its value too; give a "
                "prior to each of the other places instead"
            )


def check_samples(scenes: Iterable[Scene], keys: Sequence[str]) -> None:
    """Refuse a varied key if the sample of a calibration has a column for this key.

    scenes : the scenes of the cells; keys : key paths of all varied keys

    Raises
    ------
    InputError
        A sample is refused or has such a column; the message names the key and the column.
    """
    by_file = {scene.unknowns.sample: scene for scene in scenes if scene.unknowns is not None}
    for file, scene in by_file.items():
        for column in sampled(scene):
            for key in keys:
                if _below(steps_to(scene, column), _sections(scene, key)):
                    raise InputError(
                        f"{scene.path}: `{key}` is varied, but `{column}` has its values in the sample {file}, which a "
                        "calibration found; vary another key, or leave out `unknowns.sample`"
                    )


def _below(places: Iterable[Steps], sections: Sequence[Steps]) -> list[Steps]:
    """Return the places in a scene that are equal to one of the sections, or lie below a section."""
    return [place for place in places if any(place[: len(section)] == section for section in sections)]


def _sections(scene: Scene, key: str) -> list[Steps]:
    """Return the places in a scene that a key changes; the key `library` of a material changes the whole material."""
    return [steps[:-1] if steps[-1] == LIBRARY else steps for steps in steps_to(scene, key)]
