"""The exception for a refused message, and how a node reports a slow disk and unforeseen errors."""

import sys
import traceback
from collections.abc import Callable

from rpf3d_core.errors import InputError

TAKEN_UP = (
    "the acknowledgement is received, but its result is not known yet, because the simulator or the disk of its "
    "decision log is slow: see alerts for the result"
)
"""Reply to an acknowledgement that is not yet in the decision log."""


class MessageRefused(InputError):
    """Raised if a received message cannot be used; the text states what is wrong, and often what would be right."""


def report_error(report: Callable[[BaseException], None], error: BaseException) -> None:
    """Call `report` with an unforeseen error of a thread that continues.

    If `report` itself fails, write both errors to standard error.
    """
    try:
        report(error)
    except Exception as another:
        traceback.print_exception(error, file=sys.stderr)
        traceback.print_exception(another, file=sys.stderr)
