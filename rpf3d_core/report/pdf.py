"""Lay out a report as PDF with typst, which needs no network, no browser and no fonts of the system."""

import json
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from rpf3d_core.errors import InputError
from rpf3d_core.report.elements import (
    Bullets,
    Element,
    Heading,
    Picture,
    SignOff,
    Table,
    Text,
    View,
    Warnings,
    unbroken,
)
from rpf3d_core.report.need import needed

PNG = b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR"
"""Bytes of a PNG file before its width and height (pixels)."""
WIDTH, BOTTOM = 174.0, 279.0
"""Width of the text (mm), and distance from the upper edge of a page to the end of its text (mm)."""
HIGHEST, LEAST, CAPTION = 115.0, 0.6, 18.0
"""Largest height of a picture (mm); smallest share (-) of its height that a picture keeps if it is reduced to fit the
rest of a page; height of a caption with the space around it (mm)."""
FEW_ROWS = 10
"""Number of rows below which a table is not divided between two pages.

A longer table continues on the next page, where its header is repeated.
"""
STYLE = """\
#set page(paper: "a4", margin: (x: 18mm, y: 18mm), numbering: "1 / 1")
#set text(size: 9.5pt)
#set table(stroke: (x, y) => (bottom: 0.4pt + luma(210)), inset: (x: 4pt, y: 3pt))
#show heading.where(level: 1): set text(size: 18pt)
#show heading.where(level: 2): it => block(sticky: true, above: 14pt)[
  #text(size: 12.5pt, it.body) #v(-6pt) #line(length: 100%, stroke: rgb("#1f4e9c"))]
#show table.cell.where(y: 0): strong
#show table.cell: set text(size: 8pt)
#show figure.caption: set text(size: 8.5pt, fill: luma(90))
"""


class PicturePlace(NamedTuple):
    """The height (mm) of a picture; is_next_page : True if the picture does not fit on the page of the text before."""

    height: float
    is_next_page: bool


def write_pdf(path: Path, title: str, elements: Sequence[Element]) -> None:
    """Write the report as PDF.

    Raises
    ------
    InputError
        typst is not installed or cannot lay out the report, or the file cannot be written.
    """
    typst = needed("typst")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        try:
            content = typst.compile(write_source(folder, title, elements), root=folder, ignore_system_fonts=True)
        except RuntimeError as fault:  # also typst.TypstError
            raise InputError(f"{path}: could not be laid out as PDF ({fault}); the HTML report is complete") from fault
    try:
        path.write_bytes(content)
    except OSError as fault:
        raise InputError(f"{path}: could not be written ({fault.strerror or fault})") from fault


def write_source(folder: Path, title: str, elements: Sequence[Element]) -> Path:
    """Write the report in the language of typst, with its pictures, into a folder; return the path of the typst file.

    A picture that is too high for the rest of its page is reduced to fit, but not below LEAST (60 %) of its height. A
    picture that would become smaller goes to the next page, with a heading directly above it. This is decided here, for
    one picture after another, because typst does not converge if the height of each picture depends on the places of
    all pictures before it. A picture does not affect the pages before it, so each decision is made only once.
    """
    pictures = {number: element for number, element in enumerate(elements) if isinstance(element, Picture)}
    for number, picture in pictures.items():
        (folder / f"{number}.png").write_bytes(picture.png)
    full = {number: _height(picture.png, picture.width) for number, picture in pictures.items()}
    places = {number: PicturePlace(height=height, is_next_page=False) for number, height in full.items()}
    last, source = -1, folder / "report.typ"
    while True:
        text = [STYLE, f"#set document(title: {quoted(title)})"]
        text += [_element(element, number, places) for number, element in enumerate(elements)]
        source.write_text("\n\n".join(text), encoding="utf-8")
        left = _left(source) if pictures else {}
        too_high = [n for n in pictures if n > last and left.get(n, 0.0) < full[n]]
        if not too_high:
            return source
        last = too_high[0]
        rest = left.get(last, 0.0)
        places[last] = (places[last]._replace(height=rest) if rest > LEAST * full[last]
                        else places[last]._replace(is_next_page=True))  # fmt: skip


def _left(source: Path) -> dict[int, float]:
    """Return the height (mm) left for each picture on the page on which the picture would begin, by element number.

    source : path of the report in the language of typst
    """
    marks = needed("typst").query(source, "<picture>", field="value", root=source.parent, ignore_system_fonts=True)
    return {int(number): BOTTOM - CAPTION - float(y) for number, y in json.loads(marks)}


def quoted(text: str) -> str:
    """Return a text as a string literal of typst, with special characters escaped."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") + '"'


def _element(element: Element, number: int, places: Mapping[int, PicturePlace]) -> str:
    """Return one element of the report as typst; places : of the pictures, by number of the element."""
    match element:
        case Heading(text, level):
            return f"#heading(level: {level}, {quoted(text)})"
        case Text(text, quiet):
            return f"#par(text({'size: 8pt, fill: luma(90), ' if quiet else ''}{quoted(text)}))"
        case Bullets(sentences):
            return _bullets(sentences)
        case Warnings(title, sentences):
            return ('#block(width: 100%, inset: 8pt, fill: rgb("#fff8e1"), stroke: (left: 4pt + rgb("#d9a400")))'
                    f"[#strong({quoted(title)}) {_bullets(sentences)}]")  # fmt: skip
        case Table():
            return _table(element)
        case Picture(_, caption, _):
            return _picture(number, places[number], caption)
        case View(_, _, instead):
            return f"#block(sticky: true, text(size: 8pt, fill: luma(90), {quoted(instead)}))"
        case SignOff(fields):
            cells = "".join(f"[#v(28pt) #line(length: 100%, stroke: 0.6pt) #text(size: 8pt, {quoted(field)})], "
                            for field in fields)  # fmt: skip
            return f"#block(breakable: false, grid(columns: (1fr, 1fr), column-gutter: 20pt, {cells}))"


def _height(png: bytes, width: float) -> float:
    """Return the height (mm) of a picture, at most HIGHEST; width : largest share (-) of the width of the text."""
    if not png.startswith(PNG):
        return HIGHEST  # typst then reports what is wrong with the picture
    across, down = (int.from_bytes(png[at : at + 4], "big") for at in (len(PNG), len(PNG) + 4))
    if not across or not down:
        return HIGHEST
    return min(width * WIDTH * down / across, HIGHEST)


def _picture(number: int, place: PicturePlace, caption: str) -> str:
    """Return a picture as typst, after an invisible mark from which `_left` reads the position on the page (mm).

    If the picture does not fit on the page, typst puts the picture on the next page. The mark stays on the first page,
    unless `place.is_next_page` is True: then the mark and a heading directly above it go to the next page, too.

    number : of the element
    """
    sticky = "true" if place.is_next_page else "false"
    return (f"#block(height: 0pt, above: 10pt, below: 0pt, sticky: {sticky})"
            f"[#context [#metadata(({number}, here().position().y / 1mm)) "
            f'<picture>]]\n#figure(image("{number}.png", height: {place.height:.2f}mm), caption: {quoted(caption)}, '
            "numbering: none)")  # fmt: skip


def _bullets(sentences: Sequence[str]) -> str:
    return f"#list({', '.join(map(quoted, sentences))})"


def _table(table: Table) -> str:
    columns, align = len(table.header), "right" if table.right else "left"
    header, *rows = ("".join(f"{quoted(unbroken(cell))}, " for cell in row) for row in (table.header, *table.rows))
    widths = "(auto, " + ("1fr, ") * (columns - 1) + ")"
    whole = "false" if len(rows) < FEW_ROWS else "true"
    return (f"#block(breakable: {whole}, table(columns: {widths}, align: (x, y) => if x == 0 {{ left }} else "
            f"{{ {align} }}, table.header({header}), {''.join(rows)}))")  # fmt: skip
