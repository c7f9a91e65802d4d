"""Errors that a user can correct. Each message is one sentence: the file, the key or line, and what would be right."""


class InputError(ValueError):
    """Raised if an input of the user is refused; the command line prints the message and exits with code 2."""


class SceneError(InputError):
    """Raised if a scene file is refused, because one of its keys or values is wrong."""


class TerrainError(InputError):
    """Raised if a terrain file or mesh is refused, because no rock can be simulated on the terrain."""
