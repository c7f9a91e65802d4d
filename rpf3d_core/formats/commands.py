"""Format paths for the commands that messages offer to the user."""

import shlex
from pathlib import Path


def path_in_a_command(path: Path) -> str:
    """Return a path as a quoted word for a command in the current folder: relative if the path is below this folder."""
    here = Path.cwd()
    return shlex.quote(str(path.relative_to(here) if path.is_relative_to(here) else path))
