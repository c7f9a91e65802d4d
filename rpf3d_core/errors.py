"""Errors that a user can correct. Each message is one sentence: the file, the key or line, and what would be right."""


class InputError(ValueError):
    """Input from the user is refused; the command line prints the message and exits with code 2."""


class SceneError(InputError):
    """A scene file is refused: a key or value in it is wrong."""


class TerrainError(InputError):
    """A terrain file or mesh is refused: no simulation is possible on it."""
