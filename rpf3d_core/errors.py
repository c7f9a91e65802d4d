"""Errors that a user can correct. Each message is one sentence: the file, the key or line, and what would be right."""


class InputError(ValueError):
    """Error: an input of the user is refused. The command line prints its message and exits with code 2."""


class SceneError(InputError):
    """Error: a scene file is refused, because one of its keys or values is wrong."""


class TerrainError(InputError):
    """Error: a terrain file or mesh is refused, because no rock can be simulated on the terrain."""
