"""Show a progress bar; after Ctrl-C or SIGTERM, end a run so that the rocks flown so far are still written."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.text import Text

from rpf3d_core.commands.screen import screen

ROCKS = "flying rocks"
PERIOD = 3600.0
"""Length (s) of the recent period from whose speed the time left is estimated; a cell of a sweep may take minutes."""


@contextmanager
def progress(what: str = ROCKS) -> Iterator[tuple[Callable[[int], Callable[[int], None]], Callable[[], None]]]:
    """Show a progress bar; yield the functions `begin` and `writing`.

    begin(rocks) : to be called when rocks start to fly; each further call adds rocks to the total. The call returns a
        function, which must be called with the number of rocks flown since its previous call
    writing() : to be called when the writing of the results starts
    what : text before the bar, such as ROCKS ("flying rocks") or "flying cells"; only ROCKS adds rocks per second
    """
    rate = (_Rate(),) if what == ROCKS else ()
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), *rate, TimeRemainingColumn())
    with Progress(
        *columns, console=screen, transient=True, disable=not screen.is_terminal, speed_estimate_period=PERIOD
    ) as bar:
        task = bar.add_task("preparing: terrain, index, compiled code", total=None)
        total = 0

        def begin(rocks: int) -> Callable[[int], None]:
            nonlocal total, task
            if not total:
                bar.remove_task(task)
                task = bar.add_task(what, total=rocks)
            total += rocks
            bar.update(task, total=total)
            return lambda done: bar.advance(task, done)

        def writing() -> None:
            bar.remove_task(task)
            bar.add_task("writing results", total=None)

        yield begin, writing


class _Rate(ProgressColumn):
    """The column of the progress bar that shows rocks per second."""

    def render(self, task: Task) -> Text:
        """Return the number of rocks flown per second, as text; empty if it is unknown."""
        return Text(f"{task.speed:,.0f} rocks/s" if task.speed and task.total else "")


@contextmanager
def interruptible() -> Iterator[tuple[Callable[[], bool], Callable[[bool], None]]]:
    """Let Ctrl-C and SIGTERM stop a run properly: after a signal, the rocks flown so far are still written.

    Yield two functions. The first function returns True after a signal. Call the second function with True before the
    first rock flies, and with False after the last rock has flown. A signal at any other time, or a second signal, ends
    the program immediately with KeyboardInterrupt.
    """
    flying, asked = False, False

    def on_signal(number: int, _: object) -> None:
        nonlocal asked
        if not flying or asked:
            raise KeyboardInterrupt
        asked = True

    def show(now: bool) -> None:
        nonlocal flying
        flying = now

    handled = [number for number in (signal.SIGINT, signal.SIGTERM) if signal.getsignal(number) != signal.SIG_IGN]
    before = {number: signal.signal(number, on_signal) for number in handled}
    try:
        yield lambda: asked, show
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
