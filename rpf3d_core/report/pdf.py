"""Lay out a report as PDF with typst, which needs no network, no browser and no fonts of the system."""

import tempfile
from collections.abc import Sequence
from pathlib import Path

from rpf3d_core.errors import InputError
from rpf3d_core.report.elements import Bullets, Element, Heading, Picture, SignOff, Table, Text, View, Warnings
from rpf3d_core.report.need import needed

STYLE = """\
#set page(paper: "a4", margin: (x: 18mm, y: 20mm), numbering: "1 / 1")
#set text(size: 9.5pt)
#set table(stroke: (x, y) => (bottom: 0.4pt + luma(210)), inset: (x: 4pt, y: 3pt))
#show heading.where(level: 1): set text(size: 18pt)
#show heading.where(level: 2): it => block(sticky: true, above: 14pt)[
  #text(size: 12.5pt, it.body) #v(-6pt) #line(length: 100%, stroke: rgb("#1f4e9c"))]
#show table.cell.where(y: 0): strong
#show table.cell: set text(size: 8pt)
#show figure.caption: set text(size: 8.5pt, fill: luma(90))
"""


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
        text = [STYLE, f"#set document(title: {quoted(title)})"]
        text += [_element(element, folder, number) for number, element in enumerate(elements)]
        (folder / "report.typ").write_text("\n\n".join(text), encoding="utf-8")
        try:
            content = typst.compile(folder / "report.typ", root=folder, ignore_system_fonts=True)
        except typst.TypstError as fault:
            raise InputError(f"{path}: could not be laid out as PDF ({fault}); the HTML report is complete") from fault
    try:
        path.write_bytes(content)
    except OSError as fault:
        raise InputError(f"{path}: could not be written ({fault.strerror or fault})") from fault


def quoted(text: str) -> str:
    """Return a text as a string literal of typst, with special characters escaped."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") + '"'


def _element(element: Element, folder: Path, number: int) -> str:
    """Return one element of the report as typst; a picture is written into the folder under the element's number."""
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
        case Picture(png, caption, width):
            (folder / f"{number}.png").write_bytes(png)
            image = f'image("{number}.png", width: {100.0 * width:.0f}%)'
            return f"#figure({image}, caption: {quoted(caption)}, numbering: none)"
        case View(_, _, instead):
            return f"#par(text(size: 8pt, fill: luma(90), {quoted(instead)}))"
        case SignOff(fields):
            cells = "".join(f"[#v(28pt) #line(length: 100%, stroke: 0.6pt) #text(size: 8pt, {quoted(field)})], "
                            for field in fields)  # fmt: skip
            return f"#block(breakable: false, grid(columns: (1fr, 1fr), column-gutter: 20pt, {cells}))"


def _bullets(sentences: Sequence[str]) -> str:
    return f"#list({', '.join(map(quoted, sentences))})"


def _table(table: Table) -> str:
    columns, align = len(table.header), "right" if table.right else "left"
    cells = "".join(f"{quoted(cell)}, " for row in (table.header, *table.rows) for cell in row)
    widths = "(auto, " + ("1fr, ") * (columns - 1) + ")"
    return (f"#block(breakable: {'false' if len(table.rows) < 15 else 'true'}, table(columns: {widths}, "
            f"align: (x, y) => if x == 0 {{ left }} else {{ {align} }}, {cells}))")  # fmt: skip
