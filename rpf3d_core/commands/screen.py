"""How all commands say things: the screen, complaints, tables, and the end of one that was interrupted."""

from collections.abc import Iterable, Sequence
from typing import NoReturn

from rich.console import Console
from rich.table import Table

screen = Console(markup=False)  # names of zones, sources and folders may hold square brackets
complaints = Console(stderr=True, soft_wrap=True, highlight=False)

GAP = (0, 2, 0, 0)
"""Two blanks to the right of each column of a table."""
INTERRUPTED = 130
"""Exit code after Ctrl-C, as shells have it: 128 and the number of SIGINT."""
PIPE_WIDTH = 240
"""Columns of a table that goes to a file or another program."""


class CommandInterrupted(SystemExit):
    """The end of a command that was interrupted and has said what it leaves behind."""


def end_interrupted(left: str) -> NoReturn:
    """Say what an interrupted command leaves behind, and end."""
    complaints.print(f"rpf3d: interrupted; {left}", markup=False)
    raise CommandInterrupted(INTERRUPTED)


def print_warnings(sentences: Iterable[str]) -> None:
    """What a user should know and has not asked for, a line each."""
    for sentence in sentences:
        complaints.print(f"rpf3d: note: {sentence}", markup=False)


def print_table(header: Sequence[str], rows: Iterable[tuple[str, ...]]) -> None:
    """A table without lines."""
    table = Table(*header, box=None, padding=GAP)
    for row in rows:
        table.add_row(*row)
    # A pipe has no width; tables that are read on there are not folded.
    (screen if screen.is_terminal else Console(markup=False, width=PIPE_WIDTH)).print(table)


def rocks_in_words(number: int) -> str:
    """So many rocks, or one."""
    return f"{number:,} {'rock' if number == 1 else 'rocks'}"
