"""Compile the loops of a run before they are called; a background process compiles some of them at the same time."""

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
from rpf3d_core.terrain.facets import Terrain


class Precompiler:
    """Compiles all loops that one run needs, and measures the time.

    A background process compiles three kinds of loops. The loops that build the search structure, and the loops that
    find the ground below a rock, have the same types in all scenes; they are compiled while this process reads the
    terrain. The types of the loops that count rocks depend on the terrain; they are compiled while this process checks
    the releases and compiles the loops of flights. Without a background process, this process compiles all loops.
    """

    def __init__(self, background: BackgroundCompiler = NO_BACKGROUND) -> None:
        """Start to compile the loops that have the same types in all scenes, if there is a background process."""
        self._background = background
        background.call(precompile_index, precompile_ground_below)

    def before_index(self, _: Terrain | None = None) -> None:
        """Wait until the background process has compiled the loops that build the search structure.

        `prepared.prepare` calls this method with the terrain, which is not used.
        """
        self._background.wait(precompile_index)

    def compile(self, prepared: Prepared, tallies: Tallies, check: Callable[[], None] = lambda: None) -> float:
        """Compile all further loops of a prepared scene, end the background process, and return the compile time (s).

        The loops that build the search structure were compiled before, when the engine was built. The returned time
        excludes `check` and the wait for the loop that finds the ground below a rock.

        tallies : empty counts of the run, with the loops that count rocks
        check : function that refuses wrong releases, called as early as possible. The check needs the loop that finds
            the ground below a rock. While the background process still compiles this loop, this process compiles the
            loops of flights.
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
        seconds += _seconds(self._background.wait)  # the loops that count rocks
        return seconds + _seconds(tallies.precompile)


@contextmanager
def precompiler_of(scene: Scene) -> Iterator[Precompiler]:
    """Yield the precompiler of a scene; it has a background process if this saves time (`jit.background`).

    There is no such process for the reference engine, without a free core, or if the loops are in the disk cache.
    """
    with background_compiler(*([visit_all] if engine_name(scene) == Compiled.name else [])) as background:
        yield Precompiler(background)


def _seconds(function: Callable[..., Any], *args: Any) -> float:
    """Return the time (s) that a call of a function takes."""
    began = time.perf_counter()
    function(*args)
    return time.perf_counter() - began
