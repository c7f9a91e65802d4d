"""Errors that a user can mend: each is one sentence naming the file, the key or the line, and what would be right."""


class InputError(ValueError):
    """Something the user gave is refused; the command line prints the sentence and ends with exit code 2."""


class SceneError(InputError):
    """A scene file is refused."""


class TerrainError(InputError):
    """A terrain file or mesh is refused."""
