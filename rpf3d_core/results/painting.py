"""Draw the pictures of a run while other files are written: in a second process if there is a core for it.

The import of matplotlib takes nearly 1 s, and drawing a picture about 0.2 s. The second process imports matplotlib
while the main process reads the terrain, and draws while the main process writes the other files.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from rpf3d_core.errors import InputError
from rpf3d_core.jit.cores import has_spare_core
from rpf3d_core.results.second_process import SecondProcess, SecondProcessEnded, second_process

if TYPE_CHECKING:  # the imports would delay the start of the second process by a second
    from rpf3d_core.results.shown import RunPictures
    from rpf3d_core.terrain.facets import Terrain

PAINTER = ("rpf3d_core.results.plots.run", "Painter")
"""Module and name of the class that draws the pictures."""


class Painting:
    """The pictures of one run: call `begin`, `draw` and `wait` in this order.

    If there is no second process, or if it has not started in time, `draw` draws the pictures in this process.

    waited_s : wall time (s) that `wait` took
    """

    def __init__(self, second: SecondProcess | None = None) -> None:
        """Set the process that draws the pictures: `second`, or this process if `second` is None."""
        self._second = second
        self.waited_s = 0.0

    def begin(self, terrain: "Terrain") -> None:
        """Send the terrain of the run to the second process, if there is one; call this once the terrain is known."""
        if self._second is not None:
            self._second.ask("begin", terrain)

    def draw(self, folder: Path, shown: "RunPictures", terrain: "Terrain") -> None:
        """Draw all pictures into a result folder; they are complete after `wait`.

        terrain : the terrain passed to `begin`; used only if this process draws
        """
        if self._second is not None and self._second.has_begun():
            self._second.ask("draw", folder, shown)
            return
        self.end()
        from rpf3d_core.results.plots.run import Painter  # only a run with pictures needs matplotlib

        painter = Painter()
        painter.begin(terrain)
        painter.draw(folder, shown)

    def end(self) -> None:
        """Stop the second process; pictures that are not complete are lost."""
        if self._second is not None:
            self._second.end()
            self._second = None

    def wait(self) -> None:
        """Wait until all pictures are complete.

        Raises
        ------
        Exception
            The error of a picture that could not be drawn, such as `OSError`.
        InputError
            The second process ended before the pictures were complete, for example because it was killed.
        """
        if self._second is None:
            return
        began = time.perf_counter()
        try:
            self._second.wait()
        except SecondProcessEnded as end:
            raise InputError(
                f"the process that draws the pictures {end}, perhaps because memory ran out; "
                "`outputs: {pictures: false}` in the scene leaves the pictures out"
            ) from None
        finally:
            self.waited_s += time.perf_counter() - began


@contextmanager
def painting(threads: int | None = None) -> Iterator[Painting]:
    """Yield the `Painting` of a run; its second process starts immediately, and ends with the `with` block.

    There is no second process if no core is free, if the run uses one thread, or if the process cannot start.

    threads : number of threads of the run; None for one for each core
    """
    if threads == 1 or not has_spare_core():
        yield Painting()
        return
    with second_process(*PAINTER) as second:
        if second is not None:
            second.ask("warm_up")
        yield Painting(second)
