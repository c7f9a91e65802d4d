"""Prepare a scene for the compiled engine in a thread, while the user looks at it and the first rocks fly.

The thread is a daemon, so that the end of the desk does not wait for the compiler.
"""

import threading
from dataclasses import replace

from rpf3d_core.errors import InputError
from rpf3d_core.jit.dispatch import HAS_NUMBA
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.choices import with_choices
from rpf3d_core.setup.precompiler import Precompiler
from rpf3d_core.setup.prepared import Prepared, empty_tallies, prepare
from rpf3d_core.simulation.engines import Compiled
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.mesh.faults import FaultReport

ONE = threading.Lock()
"""Lock during a compilation, so that the loops of several quickly edited scenes are not compiled at the same time."""
PAUSE = 0.05
"""Time (s) between two checks whether the user has stopped the rocks."""


def prepared_for(scene: Scene, engine: str, ground: tuple[Terrain, FaultReport]) -> Prepared:
    """Return a scene prepared for the given engine, even if the scene names another engine.

    `Prepared.scene` is the given scene without a change. Both engines give the same results to the last bit. Errors are
    as in `prepare`.

    engine : name of the engine; ground : the scene's terrain and its faults, already read
    """
    return replace(prepare(with_choices(scene, None, engine, None), terrain_read=ground), scene=scene)


class Compiling:
    """A thread that prepares a scene for the compiled engine, and compiles its loops."""

    def __init__(self, scene: Scene, ground: tuple[Terrain, FaultReport]) -> None:
        """Start the thread; without numba, no thread is started, and nothing is compiled."""
        self._found: Prepared | None = None
        self._ended = threading.Event()
        self._cancelled = False
        if HAS_NUMBA:
            threading.Thread(target=self._compile, args=(scene, ground), name="compile", daemon=True).start()
        else:
            self._ended.set()

    def cancel(self) -> None:
        """Ask the thread not to compile; a compilation that has already started is not interrupted."""
        self._cancelled = True

    def done(self) -> Prepared | None:
        """Return the prepared scene if its loops are compiled, else None, without waiting."""
        return self._found

    def wait(self, stop: threading.Event) -> Prepared | None:
        """Wait until the loops are compiled, and return the prepared scene.

        Return None if the user stops the rocks, or if the thread ended without compiled loops, for example because the
        scene was refused.

        stop : set when the user stops the rocks
        """
        while not self._ended.wait(PAUSE):
            if stop.is_set():
                return None
        return self._found

    def _compile(self, scene: Scene, ground: tuple[Terrain, FaultReport]) -> None:
        try:
            with ONE:
                if not self._cancelled:
                    prepared = prepared_for(scene, Compiled.name, ground)
                    Precompiler().compile(prepared, empty_tallies(prepared))
                    self._found = prepared
        except InputError:
            pass  # the thread that flies prepares the same scene, and reports the refusal
        finally:
            self._ended.set()
