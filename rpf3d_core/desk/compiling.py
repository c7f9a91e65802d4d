"""Prepare a scene for the compiled engine in a thread, while the user looks at the scene and the first rocks fly.

A second process compiles the loops that are not in the disk cache. If this process compiled them, the first rocks and
**Stop** would wait for a lock that numba holds while it compiles (`jit.from_cache`). The thread is a daemon, so that
the end of the desk does not wait for the compiler.
"""

import threading
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from rpf3d_core.errors import InputError
from rpf3d_core.jit.cache import compile_apart, compiled_apart
from rpf3d_core.jit.dispatch import HAS_NUMBA
from rpf3d_core.jit.from_cache import NotCached, only_from_cache
from rpf3d_core.results.second_process import SecondProcess, second_process
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import scene_of_text
from rpf3d_core.setup.choices import with_choices
from rpf3d_core.setup.precompiler import Precompiler
from rpf3d_core.setup.prepared import Prepared, empty_tallies, prepare
from rpf3d_core.setup.terrain import read_terrain
from rpf3d_core.simulation.engines import Compiled
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.mesh.faults import FaultReport

ONE = threading.Lock()
"""Lock during a compilation, so that the loops of several quickly edited scenes are not compiled at the same time."""


def prepared_for(scene: Scene, engine: str, ground: tuple[Terrain, FaultReport]) -> Prepared:
    """Return a scene prepared for the given engine, even if the scene names another engine.

    `Prepared.scene` is the given scene without a change. Both engines give the same results to the last bit. Errors are
    as in `prepare`.

    engine : name of the engine; ground : the scene's terrain and its faults, already read
    """
    return replace(prepare(with_choices(scene, None, engine, None), terrain_read=ground), scene=scene)


def compiled_for(scene: Scene, ground: tuple[Terrain, FaultReport]) -> Prepared:
    """Return a scene prepared for the compiled engine, with compiled loops; ground : as in `prepared_for`."""
    prepared = prepared_for(scene, Compiled.name, ground)
    Precompiler().compile(prepared, empty_tallies(prepared))
    return prepared


class CacheFiller:
    """Compiles the loops of scenes into the disk cache; objects of this class exist only in a second process."""

    def fill(self, text: str, path: Path, digests: Sequence[str]) -> None:
        """Compile all loops of a scene; errors are as in `prepare`.

        text, path : of the scene
        digests : of the user's own code, from `compiled_apart` in the first process, so that both processes use the
            same folder of the disk cache
        """
        for digest in digests:
            compile_apart(digest)
        scene = scene_of_text(text, path)
        compiled_for(scene, read_terrain(scene))


class Compiling:
    """A thread that prepares a scene for the compiled engine, and compiles its loops."""

    def __init__(self, scene: Scene, text: str, ground: tuple[Terrain, FaultReport]) -> None:
        """Start the thread; without numba, no thread is started, and nothing is compiled.

        text : text of the scene; ground : as in `prepared_for`
        """
        self._found: Prepared | None = None
        self._cancelled = False
        self._second: SecondProcess | None = None
        if HAS_NUMBA:
            threading.Thread(target=self._compile, args=(scene, text, ground), name="compile", daemon=True).start()

    def cancel(self) -> None:
        """Ask the thread not to compile, and end its second process."""
        self._cancelled = True
        if (second := self._second) is not None:
            second.end()

    def done(self) -> Prepared | None:
        """Return the prepared scene if its loops are compiled, else None, without waiting."""
        return self._found

    def _compile(self, scene: Scene, text: str, ground: tuple[Terrain, FaultReport]) -> None:
        try:
            with ONE:
                if not self._cancelled:
                    self._found = self._prepared(scene, text, ground)
        except InputError:
            pass  # the thread that flies prepares the same scene, and reports the refusal

    def _prepared(self, scene: Scene, text: str, ground: tuple[Terrain, FaultReport]) -> Prepared | None:
        """Return the scene prepared for the compiled engine, with compiled loops.

        Loops that are not in the disk cache are compiled in a second process. If it cannot start or fails, the process
        of the desk compiles. The result is None if `cancel` was called before the second process ended.
        """
        with suppress(NotCached), only_from_cache():
            return compiled_for(scene, ground)
        # Whatever fails in the second process, this process can do, if more slowly.
        with second_process(__name__, CacheFiller.__name__, compiles=True) as second, suppress(Exception):
            self._second = second
            if second is not None and not self._cancelled:
                second.ask("fill", text, scene.path, compiled_apart())
                second.wait()
        self._second = None
        return None if self._cancelled else compiled_for(scene, ground)
