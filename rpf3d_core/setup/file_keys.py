"""Name the key of a scene in the error about a file that the key names."""

from collections.abc import Iterator
from contextlib import contextmanager

from rpf3d_core.errors import InputError
from rpf3d_core.formats.yaml import key_name, place_in_file
from rpf3d_core.scene.model import Scene


@contextmanager
def named_by_key(scene: Scene, *key: str | int) -> Iterator[None]:
    """If a `with` block raises an InputError about a file, raise it again with the key that names the file in front.

    The scene and the line of the key are added, too.

    key : names and indices that lead to the key, such as "sources", 0, "points_file"

    Raises
    ------
    InputError
        The file is refused; the message has the scene, the line, the key and the reason.
    """
    try:
        yield
    except InputError as fault:
        place = place_in_file(scene.path, key)
        raise InputError(f"{place}: `{key_name(key)}` names a file that cannot be used: {fault}") from fault
