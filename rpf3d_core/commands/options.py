"""Arguments and options that several commands share, and a function that reads `--rocks`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rpf3d_core.errors import InputError

if TYPE_CHECKING:
    from rpf3d_core.setup.choices import Rocks

SceneFile = Annotated[Path, typer.Argument(help="A scene file (YAML).", show_default=False)]
RocksOption = Annotated[str | None, typer.Option(help="Rocks in total, or auto, instead of the scene's.")]
EngineOption = Annotated[str | None, typer.Option(help="reference, compiled or auto, instead of the scene's.")]


def number_of_rocks(text: str | None) -> "Rocks":
    """Return the value of --rocks: a number or "auto"; None without the option. Raise InputError for other text."""
    if text is None:
        return None
    if text == "auto":
        return "auto"
    try:
        return int(text)
    except ValueError:
        raise InputError(f"--rocks is {text!r}; it must be a whole number of at least 1, or auto") from None
