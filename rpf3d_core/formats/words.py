"""Join words for messages."""

from collections.abc import Sequence


def either(words: Sequence[str]) -> str:
    """Return one or more words as a choice, such as "mm, cm or ft"."""
    *others, last = words
    return f"{', '.join(others)} or {last}" if others else last
