"""Print the output of all commands: text, warnings on stderr, tables, and the message of an interrupted command."""

from collections.abc import Iterable, Sequence
from typing import NoReturn

from rich.console import Console
from rich.table import Table

screen = Console(markup=False)  # names may have square brackets
complaints = Console(stderr=True, soft_wrap=True, highlight=False)

GAP = (0, 2, 0, 0)
"""Padding of the columns of a table: two blanks on the right."""
INTERRUPTED = 130
"""Exit code after Ctrl-C, as in shells: 128 plus the number of SIGINT."""
PIPE_WIDTH = 240
"""Width (characters) of a table that is written to a file or to another program."""


class CommandInterrupted(SystemExit):
    """The exception that ends an interrupted command; `end_interrupted` raises it after its message."""


def end_interrupted(left: str) -> NoReturn:
    """Print that a command was interrupted and which results exist, and exit with code INTERRUPTED (130).

    left : the clause of the message on the results, such as "nothing was written"
    """
    complaints.print(f"rpf3d: interrupted; {left}", markup=False)
    raise CommandInterrupted(INTERRUPTED)


def print_warnings(sentences: Iterable[str]) -> None:
    """Print warnings to stderr, one line each."""
    for sentence in sentences:
        complaints.print(f"rpf3d: note: {sentence}", markup=False)


def print_table(header: Sequence[str], rows: Iterable[tuple[str, ...]]) -> None:
    """Print a table without ruled lines."""
    table = Table(*header, box=None, padding=GAP)
    for row in rows:
        table.add_row(*row)
    # A pipe has no width; the program that reads it needs each row on one line.
    (screen if screen.is_terminal else Console(markup=False, width=PIPE_WIDTH)).print(table)


def rocks_in_words(number: int) -> str:
    """Return a number of rocks with its noun, such as "1 rock" or "2,000 rocks"."""
    return f"{number:,} {'rock' if number == 1 else 'rocks'}"
