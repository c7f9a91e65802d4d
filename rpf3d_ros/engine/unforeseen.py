"""Errors that nobody has foreseen, on a thread that must not end of them."""

import sys
import traceback
from collections.abc import Callable


def tell(failed: Callable[[BaseException], None], error: BaseException) -> None:
    """Tell of an error; where that fails, too, both are written to standard error."""
    try:
        failed(error)
    except Exception as another:
        traceback.print_exception(error, file=sys.stderr)
        traceback.print_exception(another, file=sys.stderr)
