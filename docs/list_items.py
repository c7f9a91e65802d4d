"""Write items of Markdown lists, for the programs that write pages: a table cannot wrap a long sentence, a list can."""

import re
import textwrap

WIDTH = 120
"""Largest number of characters in a line."""
BEGINS_BLOCK = r"(?:[-+*]|#+|\d+[.)]) |>"
"""Pattern of signs that begin a list, a heading or a quotation if they are first in a line."""


def item(text: str, indent: str = "") -> str:
    """Return a text as an item of a Markdown list, with a full stop, in lines of at most WIDTH characters.

    Code between backticks is not broken. indent : spaces before the item
    """
    kept = re.sub(r"`[^`]*`", lambda code: code[0].replace(" ", "\0"), text.rstrip("."))
    kept = re.sub(f" (?={BEGINS_BLOCK})", "\0", kept)
    lines = textwrap.fill(
        f"{kept}.", WIDTH, initial_indent=f"{indent}- ", subsequent_indent=f"{indent}  ", break_long_words=False,
        break_on_hyphens=False,
    )  # fmt: skip
    return lines.replace("\0", " ")


def key(name: str, value: str, meaning: str, source: str = "") -> str:
    """Return the item of a list for a key or a parameter: its name, its default, its meaning, and its source if given.

    value : `must be given`, or the default
    """
    default = value if value == "must be given" else f"default: {value}"
    about = f"{meaning.rstrip('.')}. Source: {source}" if source else meaning
    return item(f"**`{name}`** ({default}): {about}")
