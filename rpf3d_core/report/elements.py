"""Define the kinds of elements of a report: headings, text, tables, pictures, the 3D view and others.

`html.py` and `pdf.py` lay out these elements.
"""

import re
from collections.abc import Sequence
from typing import NamedTuple


class Heading(NamedTuple):
    """A heading; level : 1 for the title, 2 for a section, 3 for a part of a section."""

    text: str
    level: int = 2


class Text(NamedTuple):
    """A paragraph; quiet : True for a note in small print."""

    text: str
    quiet: bool = False


class Bullets(NamedTuple):
    """A list of sentences."""

    sentences: Sequence[str]


class Warnings(NamedTuple):
    """A box with a title and sentences that the reader must know before the rest of the report."""

    title: str
    sentences: Sequence[str]


NUMBER_AND_UNIT = re.compile(r"(?<=\d) (?=(?:kJ|km|m2|m3|m|mm|cm|s|kg|t|%)(?![\w/]))")
"""Pattern of the space between a number and its unit."""


def unbroken(cell: str) -> str:
    """Return the text of a cell in which a no-break space keeps each number and its unit on one line."""
    return NUMBER_AND_UNIT.sub("\u00a0", cell)


class Table(NamedTuple):
    """A table of text; each row has as many cells as the header.

    right : True to align all columns but the first on the right
    """

    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    right: bool = True


class Picture(NamedTuple):
    """A picture as PNG, with a caption; width : share (-) of the page."""

    png: bytes
    caption: str
    width: float = 1.0


class View(NamedTuple):
    """The rotatable 3D view, as an HTML fragment; instead : the text that a PDF shows in its place."""

    html: str
    caption: str
    instead: str


class SignOff(NamedTuple):
    """Empty lines with labels for signatures and dates by hand; fields : the labels, such as "Checked by, date"."""

    fields: Sequence[str]


Element = Heading | Text | Bullets | Warnings | Table | Picture | View | SignOff
