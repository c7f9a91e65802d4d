"""Types of values in a scene, such as numbers, names, vectors, outlines and files, with their checks."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Discriminator, Field, Tag, ValidationInfo
from pydantic_core import PydanticCustomError

from rpf3d_core.errors import InputError
from rpf3d_core.formats.polygons import polygon_of

MOST_ROCKS = 4_000_000_000
"""Largest number of rocks of a scene, because a rock's number has 32 bits in the random streams."""

MISSING_FILE = "missing_file"
"""Type of the error for a missing file, after which a message also shows the scene's `data_hint`."""


def refuse(sentence: str, *at: str | int, kind: str = "refused") -> PydanticCustomError:
    """Return the error that refuses a value of a scene, for a validator to raise; the message is `<key> <sentence>`.

    sentence : the rest of the message, such as "is 3, but must be at most 2"
    at : path from the key being validated to the faulty key; kind : type of the error for pydantic
    """
    return PydanticCustomError(kind, "{sentence}", {"sentence": sentence, "at": at})


def existing_file(value: Any, info: ValidationInfo) -> Path:
    """Return the absolute path of an existing file, given relative to the scene's folder.

    Raises
    ------
    PydanticCustomError
        The value is not a path, or the path is a folder or does not exist.
    """
    if not isinstance(value, str | Path) or not str(value):
        raise refuse(f"is {value!r}, but must be the path of a file, relative to the scene file")
    folder = (info.context or {}).get("folder", Path())
    path = Path(os.path.abspath(folder / value))
    if not path.is_file():
        what = "that is a folder" if path.is_dir() else "there is no such file"
        raise refuse(f"names {str(value)!r}, but {what} (looked for {path})", kind=MISSING_FILE)
    return path


def exactly_one(part: BaseModel, *names: str) -> None:
    """Raise a PydanticCustomError unless exactly one of the named keys of a section is given (not None)."""
    given = [name for name in names if getattr(part, name) is not None]
    if len(given) != 1:
        has = " and ".join(given) if given else "none of them"
        raise refuse(f"must have exactly one of {', '.join(names)}, but has {has}")


def no_two_alike(parts: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return the items of a list unchanged; raise a PydanticCustomError if two items have the same name."""
    first: dict[str, int] = {}
    for i, part in enumerate(parts):
        if first.setdefault(part.name, i) != i:
            other = first[part.name] + 1
            raise refuse(
                f"is {part.name!r}, but so is the name of number {other} in the list; names must differ", i, "name"
            )
    return parts


def _enclosing(corners: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    """Return the corners (N, 2) m of an outline unchanged; raise a PydanticCustomError if they form no polygon."""
    try:
        polygon_of(corners)
    except InputError as fault:
        raise refuse(str(fault)) from None
    return corners


Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Count = Annotated[int, Field(strict=True)]
Name = Annotated[str, Field(strict=True, min_length=1)]
Vector = tuple[Number, Number, Number]
Rocks = Annotated[Count, Field(ge=1, le=MOST_ROCKS)]
ROCKS_MARKS = ("[rocks]", "[auto]")
if TYPE_CHECKING:
    RocksOrAuto = int | Literal["auto"]
else:
    RocksOrAuto = Annotated[
        Annotated[Rocks, Tag(ROCKS_MARKS[0])] | Annotated[Literal["auto"], Tag(ROCKS_MARKS[1])],
        Discriminator(lambda value: ROCKS_MARKS[isinstance(value, str)]),
    ]
HalfWidths = tuple[Annotated[Number, Field(ge=0)], Annotated[Number, Field(ge=0)], Annotated[Number, Field(ge=0)]]
InputFile = Annotated[Path, BeforeValidator(existing_file)]
Corner = tuple[Number, Number]
Corners = Annotated[tuple[Corner, ...], Field(min_length=3), AfterValidator(_enclosing)]
if TYPE_CHECKING:
    Outline = Path | Corners
else:
    Outline = Annotated[
        Annotated[InputFile, Tag("[file]")] | Annotated[Corners, Tag("[corners]")],
        Discriminator(lambda value: "[file]" if isinstance(value, str | Path) else "[corners]"),
    ]

Places = Annotated[tuple[Corner, ...], Field(min_length=2)]
if TYPE_CHECKING:
    Along = Path | Places
else:
    Along = Annotated[
        Annotated[InputFile, Tag("[file]")] | Annotated[Places, Tag("[corners]")],
        Discriminator(lambda value: "[file]" if isinstance(value, str | Path) else "[corners]"),
    ]
"""A line in plan, as written in a scene: its corners, or the path of a file with lines."""

if TYPE_CHECKING:
    Track = Path | tuple[Vector, ...]
else:
    Track = Annotated[
        Annotated[InputFile, Tag("[file]")] | Annotated[tuple[Vector, ...], Field(min_length=2), Tag("[corners]")],
        Discriminator(lambda value: "[file]" if isinstance(value, str | Path) else "[corners]"),
    ]
"""A line in space, as written in a scene: its points, or the path of a file with lines in plan."""


class StrictModel(BaseModel):
    """Base class of the sections of a scene: objects are frozen, and unknown keys are errors."""

    model_config = ConfigDict(frozen=True, extra="forbid")
