"""Turn the docstrings of rpf3d, which are plain text, into reStructuredText for the API reference.

A docstring consists of paragraphs, sections (a title over a line of dashes), lists whose lines begin with `- `, and
definitions: `name : meaning; name : meaning`, continued by indented lines. Code stands between single backticks. Every
other character means itself.
"""

import re
from collections.abc import Iterator
from itertools import groupby
from typing import Any

NAMES = r"\*{0,2}[A-Za-z_]\w*(?:, \*{0,2}[A-Za-z_]\w*)*"
"""One name or several, separated by commas."""
DEFINITION = re.compile(rf"^({NAMES}) : ")
NEXT_DEFINITION = re.compile(rf"; (?={NAMES} : )")
ITEM = "- "
DASHES = re.compile(r"-{3,}")
CODE = re.compile(r"(`[^`\n]+`)")
DOTTED = re.compile(r"[a-z_]\w*(\.\w+)+")
"""A name in a module, such as `values.Outcome`."""
SPECIAL = re.compile(r"([\\*_|`])")
"""Characters that reStructuredText would take for markup."""


def as_rst(docstring: str) -> str:
    """Convert a docstring of rpf3d to reStructuredText, so that Sphinx shows its lists and definitions."""
    return "\n\n".join(filter(None, map(paragraph_as_rst, re.split(r"\n\s*\n", docstring.strip("\n")))))


def paragraph_as_rst(paragraph: str) -> str:
    """Return lines without a blank line between them as reStructuredText: a section, an example, or text and lists."""
    lines = paragraph.split("\n")
    if lines[0].lstrip().startswith(">>> "):
        return paragraph
    if len(lines) > 1 and DASHES.fullmatch(lines[1].strip()):
        return f"**{lines[0].strip()}**\n\n{blocks_as_rst(list(entries(lines[2:])))}"
    return blocks_as_rst(list(parts_of(lines)))


def blocks_as_rst(parts: list[str]) -> str:
    """Return texts and entries of lists as reStructuredText, with the blank line that a list needs before it."""
    groups = groupby(parts, key=is_entry)
    return "\n\n".join("\n".join(map(part_as_rst, group)) for _, group in groups)


def entries(lines: list[str]) -> Iterator[str]:
    """Yield the parts of a section, in which a line is a name or a type, and the indented lines below explain it."""
    for part in re.split(r"\n(?! )", "\n".join(lines)):
        first, *more = (line.strip() for line in part.split("\n"))
        if more and not is_entry(first):
            yield f"{ITEM}`{first}`: {' '.join(more)}"
        elif more and more[0][0].isupper() and not first.endswith((",", ";")):
            yield f"{first}. {' '.join(more)}"
        else:
            yield " ".join([first, *more])


def parts_of(lines: list[str]) -> Iterator[str]:
    """Yield the texts and entries in lines of a paragraph; an entry takes the indented lines that follow."""
    part: list[str] = []
    for line in lines:
        if part and not line.startswith(" ") and (is_entry(line) or is_entry(part[0])):
            yield " ".join(part)
            part = []
        part.append(line.strip())
    yield " ".join(part)


def is_entry(line: str) -> bool:
    """Return True if a line begins an entry of a list: an item or a definition."""
    return line.startswith(ITEM) or bool(DEFINITION.match(line))


def part_as_rst(part: str) -> str:
    """Return a text, an item or a line of definitions as reStructuredText."""
    if DEFINITION.match(part):
        return "\n".join(map(definition_as_rst, NEXT_DEFINITION.split(part)))
    return f"* {text_as_rst(part.removeprefix(ITEM))}" if part.startswith(ITEM) else text_as_rst(part)


def definition_as_rst(text: str) -> str:
    """Return `name : meaning` as an item of a list."""
    names, _, meaning = text.partition(" : ")
    return f"* {', '.join(f'``{name}``' for name in names.split(', '))}: {text_as_rst(meaning)}"


def text_as_rst(text: str) -> str:
    """Return a text as reStructuredText: code as literals, all other characters as themselves."""
    parts = CODE.split(text)
    return "".join(code_as_rst(part[1:-1]) if CODE.fullmatch(part) else SPECIAL.sub(r"\\\1", part) for part in parts)


def code_as_rst(code: str) -> str:
    r"""Return code as a literal; a dotted name is also a link if the API reference has that name.

    The escaped blanks let the literal touch the letters next to it.
    """
    if not DOTTED.fullmatch(code):
        return rf"\ ``{code}``\ "
    target = code if code.startswith("rpf3d_") else f"rpf3d_core.{code}"
    return rf"\ :py:obj:`{code} <{target}>`\ "


def replace_docstring(app: Any, kind: str, name: str, item: Any, options: Any, lines: list[str]) -> None:
    """Convert a docstring for the API reference (handler of the Sphinx event `autodoc-process-docstring`)."""
    lines[:] = [*as_rst("\n".join(lines)).split("\n"), ""]


def skips(app: Any, kind: str, name: str, item: Any, skip: bool, options: Any) -> bool | None:
    """Return False for members that are shown without a docstring, else None (the event `autoapi-skip-member`).

    Shown are packages, and names with a capital: members of enumerations, types, constants. With None, autoapi decides.
    """
    if kind in ("package", "module"):
        return False
    shown = kind in ("attribute", "data") and item.short_name[0].isupper() and not item.imported
    return False if shown else None


def setup(app: Any) -> dict[str, bool]:
    """Connect the two handlers of this module to Sphinx, which calls this function at the start of a build."""
    app.connect("autodoc-process-docstring", replace_docstring)
    app.connect("autoapi-skip-member", skips)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
