"""A progress bar, and an end in good order where the user or the system asks for one."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.text import Text

from rpf3d_core.commands.screen import screen


@contextmanager
def progress() -> Iterator[tuple[Callable[[int], Callable[[int], None]], Callable[[], None]]]:
    """A progress bar: a function that begins with a number of rocks, and one that says that results are written.

    The first returns a function to be told how many were flown since; each further call of it adds rocks.
    """
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), _Rate(), TimeRemainingColumn())
    with Progress(*columns, console=screen, transient=True, disable=not screen.is_terminal) as bar:
        task = bar.add_task("preparing: terrain, index, compiled code", total=None)
        total = 0

        def begin(rocks: int) -> Callable[[int], None]:
            nonlocal total, task
            if not total:
                bar.remove_task(task)
                task = bar.add_task("flying rocks", total=rocks)
            total += rocks
            bar.update(task, total=total)
            return lambda done: bar.advance(task, done)

        def writing() -> None:
            bar.remove_task(task)
            bar.add_task("writing results", total=None)

        yield begin, writing


class _Rate(ProgressColumn):
    """Rocks a second."""

    def render(self, task: Task) -> Text:
        """The rate of the last seconds, nothing before there is one."""
        return Text(f"{task.speed:,.0f} rocks/s" if task.speed and task.total else "")


@contextmanager
def interruptible() -> Iterator[tuple[Callable[[], bool], Callable[[bool], None]]]:
    """Whether Ctrl-C or SIGTERM came while rocks flew, and a function to be told when they begin and end to fly.

    At any other time, and the second time, either ends the program at once.
    """
    flying, asked = False, False

    def on_signal(number: int, _: object) -> None:
        nonlocal asked
        if not flying or asked:
            raise KeyboardInterrupt
        asked = True

    def told(now: bool) -> None:
        nonlocal flying
        flying = now

    handled = [number for number in (signal.SIGINT, signal.SIGTERM) if signal.getsignal(number) != signal.SIG_IGN]
    before = {number: signal.signal(number, on_signal) for number in handled}
    try:
        yield lambda: asked, told
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
