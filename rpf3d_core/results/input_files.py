"""List the files that a run read, with their digests, so that a report can compare them with the current files."""

from rpf3d_core.scene.files import digest_of_file, files_of
from rpf3d_core.scene.model import Scene

SCENE = "scene"
"""Name of the scene file in the list of files; all other files have the key path of the scene that names them."""


def input_files(scene: Scene) -> list[dict[str, str]]:
    """Return key, full path and digest (SHA-256, 64 hex digits) of the scene file and of all files named in it.

    A file that does not exist is not listed, such as the scene file of a scene made in Python.
    """
    named = ((SCENE, scene.path), *files_of(scene))
    return [{"key": key, "path": str(path.resolve()), "sha256": digest_of_file(path)}
            for key, path in dict.fromkeys(named) if path.is_file()]  # fmt: skip
