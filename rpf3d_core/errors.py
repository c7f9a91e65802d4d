"""Errors that a user can correct. Each message is one sentence: the file, the key or line, and what would be right."""


class InputError(ValueError):
    """An error that is raised if an input is refused; the command line prints its message and exits with code 2."""


class SceneError(InputError):
    """An error that is raised if a scene file is refused, because one of its keys or values is wrong."""


class TerrainError(InputError):
    """An error that is raised if terrain is refused: a file, mesh, patch, or the parameters of a synthetic slope."""
