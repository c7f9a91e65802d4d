"""The thread that builds the terrain from surveys while rocks fly over the terrain in use.

The thread also passes each new terrain to the store.
"""

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from rpf3d_core.errors import InputError, TerrainError
from rpf3d_core.live.ground import LiveTerrain, Workshop
from rpf3d_core.live.standing import PreparedTerrain, stand_after, stand_on
from rpf3d_core.live.store import Store
from rpf3d_core.live.survey import CloudSurvey, GridSurvey, Survey
from rpf3d_core.scene.model import Scene
from rpf3d_ros.engine.flyer import Flyer
from rpf3d_ros.engine.waiting_terrain import WaitingTerrain
from rpf3d_ros.messages.map_frame import RigidTransform, same_transform
from rpf3d_ros.messages.refusals import MessageRefused, report_error
from rpf3d_ros.messages.terrain_messages import Buffer, same_bytes


@dataclass(frozen=True, eq=False)
class Arrival:
    """A received terrain message that waits to be built into the terrain.

    convert : returns the survey in the message; stamp_ns : stamp (ns)
    data : bytes of a mesh, to detect that the same mesh is published again; empty for other messages
    moved_by : transform from the frame of the message, from tf2; None for a frame that the parameters define
    """

    convert: Callable[[], Survey]
    stamp_ns: int
    data: Buffer = b""
    moved_by: RigidTransform | None = None

    @property
    def mesh(self) -> "PlacedMesh":
        """The bytes and the transform of a mesh; the bytes are empty for other messages."""
        return PlacedMesh(data=self.data, moved_by=self.moved_by)


class PlacedMesh(NamedTuple):
    """The bytes of a mesh, and the transform from its frame; None for a frame that the parameters define."""

    data: Buffer = b""
    moved_by: RigidTransform | None = None

    def repeats(self, other: "PlacedMesh") -> bool:
        """True if this mesh has the same bytes and the same transform as another mesh.

        A new transform of the frame moves the mesh, so equal bytes alone are no repetition.
        """
        return same_transform(self.moved_by, other.moved_by) and same_bytes(self.data, other.data)


class TerrainListener(Protocol):
    """Receives reports on terrain messages from the builder's thread."""

    def stands(self, ground: LiveTerrain, what: str) -> None:
        """Report that a terrain is in use; what : a sentence on how it was made."""

    def terrain_refused(self, why: str) -> None:
        """Report that a terrain message cannot be used; the terrain stays unchanged."""

    def failed(self, error: BaseException) -> None:
        """Report an unforeseen error."""


class Builder:
    """Builds the terrain from waiting surveys on its own thread, and hands it to the thread that flies rocks."""

    def __init__(
        self,
        scene: Scene,
        workshop: Workshop,
        waiting: WaitingTerrain[Arrival],
        flyer: Flyer,
        listener: TerrainListener,
        store: Store | None,
    ) -> None:
        self._scene, self._workshop, self._waiting, self._flyer = scene, workshop, waiting, flyer
        self._listener, self._store = listener, store
        self._mesh = PlacedMesh()
        self._thread = threading.Thread(target=self._run, name="rpf3d builder", daemon=True)
        self._thread.start()

    def close(self, timeout: float) -> bool:
        """Stop building; wait at most `timeout` (s). Return True if the thread has ended."""
        self._waiting.close()
        self._thread.join(timeout)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while (task := self._waiting.take()) is not None:
            try:
                self._build(*task)
            except Exception as error:
                report_error(self._listener.failed, error)

    def _build(self, kind: str, arrival: Arrival) -> None:
        try:
            made = self._whole(arrival) if kind == "whole" else self._patched(arrival)
        except Exception as error:
            foreseen = isinstance(error, InputError)
            self._refuse(kind, str(error) if foreseen else f"{type(error).__name__}: {error}")
            if not foreseen:
                raise
            return
        if kind == "whole":
            self._waiting.accepted()
        ground, survey = made
        self._listener.stands(ground, "received" if kind == "whole" else "received, patched")
        if self._store is not None and survey is not None:
            self._store.keep(ground, survey, is_patch=kind == "patch")

    def _refuse(self, kind: str, why: str) -> None:
        """Report that a message cannot be used; a refused patch counts as missing in the terrain."""
        if kind == "whole":
            self._waiting.refused(why)
        else:
            self._waiting.lost()
        self._listener.terrain_refused(why)

    def _whole(self, arrival: Arrival) -> tuple[LiveTerrain, Survey | None]:
        """Build the terrain of a whole survey and put it into use; return the terrain and the survey.

        If the survey equals the terrain in use, this terrain stays and the returned survey is None.
        """
        standing = self._flyer.standing
        known = standing.ground if standing is not None else None
        # A mesh has no stamp: if the terrain in use is published again, it keeps its stamp, unless that is invalid.
        keeps = len(arrival.data) and isinstance(known, LiveTerrain) and 0 < known.stamp_ns <= arrival.stamp_ns
        if keeps and arrival.mesh.repeats(self._mesh):
            return known, None
        survey = arrival.convert()
        ground = self._workshop.whole(survey, arrival.stamp_ns)
        if keeps and known.digest == ground.digest:  # for example after a restart with the terrain from the store
            self._mesh = arrival.mesh
            return known, None
        standing = stand_on(ground, self._scene)
        _ = standing.cells  # computed here, so that the first answer need not wait
        self._flyer.hand_over(ready=standing)
        self._mesh = arrival.mesh
        return ground, survey

    def _patched(self, arrival: Arrival) -> tuple[LiveTerrain, Survey]:
        """Join a patch to the terrain in use, and return the changed terrain and the patch."""
        patch = arrival.convert()
        if not isinstance(patch, CloudSurvey | GridSurvey):
            raise MessageRefused("a patch must be a cloud of points")
        grounds: list[LiveTerrain] = []

        def with_patch(standing: PreparedTerrain) -> PreparedTerrain:
            cells = standing.cells
            assert (
                isinstance(standing.ground, LiveTerrain) and cells is standing.cells
            )  # computed before the ground changes
            grounds.append(self._workshop.patched(standing.ground, patch, arrival.stamp_ns))
            return _stood_on(standing, grounds[0])

        self._flyer.hand_over(change=with_patch)
        self._mesh = PlacedMesh()
        return grounds[0], patch


def _stood_on(before: PreparedTerrain, ground: LiveTerrain) -> PreparedTerrain:
    """Return the prepared terrain after a patch; the patch has already changed the arrays of the terrain.

    For the thread that flies rocks, TerrainError means that nothing was changed. Therefore an error here raises
    MessageRefused instead.
    """
    try:
        return stand_after(before, ground)
    except TerrainError as error:
        raise MessageRefused(f"there is no terrain after the patch: {error}") from error
