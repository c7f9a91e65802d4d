"""Compile the loops that a run calls, before the run calls them and partly in a background process."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from rpf3d_core.ensemble.stream import precompile_fragments
from rpf3d_core.hazard.tallies import Tallies
from rpf3d_core.hazard.walks.visiting import visit_all
from rpf3d_core.jit.background import NO_BACKGROUND, BackgroundCompiler, background_compiler
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.prepared import Prepared, engine_name
from rpf3d_core.simulation.engines import (
    Compiled,
    precompile_flights,
    precompile_ground_below,
    precompile_index,
)


class Precompiler:
    """Compiles all loops of one run.

    The loops that build the index and find the ground below a rock have the same types in all scenes: a background
    process compiles them while this process reads the terrain. The types of the loops that count rocks are known only
    over the terrain: the background process compiles them while this process checks the releases and compiles flights.
    Without a background process, this process compiles everything.
    """

    def __init__(self, background: BackgroundCompiler = NO_BACKGROUND) -> None:
        """Order the loops that have the same types in all scenes."""
        self._background = background
        background.call(precompile_index, precompile_ground_below)

    def before_index(self) -> None:
        """Wait until the index can be built without compiling; see `prepared.prepare`."""
        self._background.wait(precompile_index)

    def compile(self, prepared: Prepared, tallies: Tallies, check: Callable[[], None] = lambda: None) -> float:
        """Compile all that rocks of a prepared scene call and end the background process; return the wall seconds.

        check : refuses releases; called as early as possible. The check needs the loop for the ground below a rock:
            while the background process still compiles that loop, this process compiles the loops of flights. The
            seconds do not include the check.
        """
        engine, flight = prepared.engine, prepared.flight
        physics = flight.models, flight.materials, flight.settings
        self._background.compile(*tallies.loops())
        seconds = 0.0
        if not self._background.has_done(precompile_ground_below):
            seconds += _seconds(precompile_flights, engine, *physics)
        self._background.wait(precompile_ground_below)
        check()
        seconds += _seconds(precompile_flights, engine, *physics)
        seconds += _seconds(precompile_ground_below, engine)
        seconds += _seconds(precompile_fragments, engine, flight)
        seconds += _seconds(self._background.wait)  # for the loops of the tallies
        return seconds + _seconds(tallies.precompile)


@contextmanager
def precompiler_of(scene: Scene) -> Iterator[Precompiler]:
    """Yield the precompiler of a scene; a background process starts if the scene needs the compiled engine."""
    with background_compiler(*([visit_all] if engine_name(scene) == Compiled.name else [])) as background:
        yield Precompiler(background)


def _seconds(function: Callable[..., Any], *args: Any) -> float:
    """Call a function and return the wall seconds that it took."""
    began = time.perf_counter()
    function(*args)
    return time.perf_counter() - began
