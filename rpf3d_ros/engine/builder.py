"""The thread that builds the terrain from surveys while rocks fly over the terrain in use.

The thread also passes each new terrain to the store.
"""

import threading
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any, NamedTuple, Protocol

from rpf3d_core.errors import InputError, TerrainError
from rpf3d_core.live.ground import LiveTerrain, Workshop
from rpf3d_core.live.standing import PreparedTerrain, stand_after, stand_on
from rpf3d_core.live.store import Store
from rpf3d_core.live.survey import CloudSurvey, GridSurvey, Survey, points_missing_inside
from rpf3d_core.scene.model import Scene
from rpf3d_ros.engine.flyer import Flyer
from rpf3d_ros.engine.survey_in_use import Arrival, SurveyInUse
from rpf3d_ros.engine.waiting_terrain import WaitingTerrain
from rpf3d_ros.messages.refusals import MessageRefused, report_error
from rpf3d_ros.messages.stamps import SECOND

REMEMBERED = 1000
"""Largest number of former meshes whose digests are kept in memory, to refuse these meshes."""

SAVED = 200
"""Largest number of these digests that are saved for the next start, to limit the state that the log saves."""

OLD_CLOUD = (
    "its stamp is {:.3f} s older than that of the last cloud that was in use: end the program that publishes it, or "
    "publish a cloud with a newer stamp"
)

CONTRADICTION = (
    "its stamp is that of the last cloud that was in use, but its content is different, so it is not known which of "
    "the two shows the present ground: publish a whole survey with a newer stamp"
)

OLD_MESH = (
    "this mesh is older than the terrain in use, because it was in use before: end the program that repeats it, or "
    "publish it on terrain/points, with the time of its measurement as its stamp"
)


class Built(NamedTuple):
    """The terrain after a whole survey or a patch.

    ground : the terrain; survey : the survey or patch to store, None if the terrain has not changed
    repeats : True if the message contained the survey that the terrain was already built from
    lost : number of patches that the terrain no longer contains, because it was built again from a repeated survey
    """

    ground: LiveTerrain
    survey: Survey | None
    repeats: bool = False
    lost: int = 0


class TerrainListener(Protocol):
    """Receives reports on terrain messages from the builder's thread."""

    def stands(self, ground: LiveTerrain, what: str, holes: int = 0) -> None:
        """Report that the terrain `ground` is in use.

        what : a sentence on how the terrain was made
        holes : number of points that are missing inside the patches since the last whole survey, so that the terrain
            there has its former heights
        """

    def terrain_refused(self, why: str) -> None:
        """Report that a terrain message cannot be used; the terrain stays unchanged."""

    def failed(self, error: BaseException) -> None:
        """Report an unforeseen error."""


class Builder:
    """Builds the terrain from waiting surveys on its own thread, and passes the terrain to the thread that flies rocks.

    The thread starts when the object is created.

    scene : the scene of the node; workshop : builds terrains from surveys
    waiting : the queue of surveys; flyer : the thread that flies rocks; listener : receives reports
    store : keeps the terrain on disk, None for no store; now : returns the current time (ns) by the node's clock
    in_use : the whole survey in use at the start; replaced : digests of meshes that were in use before this survey
    """

    def __init__(
        self,
        scene: Scene,
        workshop: Workshop,
        waiting: WaitingTerrain[Arrival],
        flyer: Flyer,
        listener: TerrainListener,
        store: Store | None,
        now: Callable[[], int],
        in_use: SurveyInUse = SurveyInUse(),  # noqa: B008
        replaced: Iterable[str] = (),
    ) -> None:
        self._scene, self._workshop, self._waiting, self._flyer = scene, workshop, waiting, flyer
        self._listener, self._store = listener, store
        self._now, self._in_use = now, in_use
        self._replaced = deque(replaced, maxlen=REMEMBERED)
        self._holes = 0
        self._back_to_ns: int | None = now() or None  # the clock may have gone back before the start
        self._thread = threading.Thread(target=self._run, name="rpf3d builder", daemon=True)
        self._thread.start()

    def close(self, timeout: float) -> bool:
        """Stop building; wait at most `timeout` (s). Return True if the thread has ended."""
        self._waiting.close()
        self._thread.join(timeout)
        return not self._thread.is_alive()

    def to_remember(self) -> dict[str, Any]:
        """Return the facts about former surveys to save for the next start, as plain values; any thread may call."""
        cloud_ns, digest, is_mesh = self._in_use.cloud_ns, self._in_use.cloud_digest, self._in_use.is_mesh
        replaced = list(self._replaced)[-SAVED:]
        return {"cloud_ns": cloud_ns, "cloud_digest": digest, "is_mesh": is_mesh, "replaced": replaced}

    def clock_went_back(self, now_ns: int) -> None:
        """Record that the clock went back to `now_ns` (ns): clouds with later stamps may then be used.

        Older clouds, and meshes that were in use before, are still refused. Any thread may call. The step takes effect
        when the builder's thread begins to build the next whole survey.
        """
        back_to = self._back_to_ns
        self._back_to_ns = now_ns if back_to is None else min(back_to, now_ns)

    def _run(self) -> None:
        while (task := self._waiting.take()) is not None:
            try:
                self._build(*task)
            except Exception as error:
                report_error(self._listener.failed, error)

    def _build(self, kind: str, arrival: Arrival) -> None:
        try:
            built = self._whole(arrival) if kind == "whole" else self._patched(arrival)
        except Exception as error:
            foreseen = isinstance(error, InputError)
            self._refuse(kind, str(error) if foreseen else f"{type(error).__name__}: {error}")
            if not foreseen:
                raise
            return
        if built.repeats:
            self._waiting.repeated(built.lost, is_rebuilt=built.survey is not None)
        elif kind == "whole":
            self._waiting.accepted()
        if kind == "whole" and (not built.repeats or built.lost):
            self._holes = 0
        self._listener.stands(
            built.ground, "whole survey received" if kind == "whole" else "patch received", self._holes
        )
        if self._store is not None and built.survey is not None:
            self._store.keep(built.ground, built.survey, is_patch=kind == "patch")

    def _refuse(self, kind: str, why: str) -> None:
        """Report that a message cannot be used; a refused patch counts as missing in the terrain.

        kind : "whole" or "patch"; why : reason of the refusal
        """
        if kind == "whole":
            self._waiting.refused(why)
        else:
            self._waiting.lost()
        self._listener.terrain_refused(why)

    def _whole(self, arrival: Arrival) -> Built:
        """Build the terrain of a whole survey and put it into use.

        If the terrain in use was built from the same survey, the terrain stays with its stamp and its patches, unless
        `SurveyInUse.may_stay` is False. A mesh has no stamp; if it is the survey that was in use before a restart, it
        keeps the time at which it was first received.

        Raises
        ------
        MessageRefused
            The mesh was in use before the current survey. Or the cloud is older than the last cloud that was in use, or
            has the stamp of this cloud but other content. Or the message cannot be converted.
        InputError
            The survey is not a terrain, or the scene cannot be prepared over this terrain.
        """
        self._follow_clock()
        standing, in_use = self._flyer.standing, self._in_use
        known = standing.ground if standing is not None and isinstance(standing.ground, LiveTerrain) else None
        stays = known if in_use.may_stay(arrival) else None
        if stays is not None and in_use.is_same_mesh(arrival):
            return Built(stays, None, repeats=True)
        survey = arrival.convert()
        ground = self._workshop.whole(survey, arrival.stamp_ns)
        repeats = in_use.is_repeated(arrival, ground.digest)
        if arrival.is_mesh and not repeats and ground.digest in self._replaced:
            raise MessageRefused(OLD_MESH)
        if not repeats and in_use.is_older(arrival, ground.digest):
            raise MessageRefused(OLD_CLOUD.format((in_use.cloud_ns - arrival.stamp_ns) / SECOND))
        if in_use.contradicts(arrival, ground.digest):
            raise MessageRefused(CONTRADICTION)
        if stays is not None and repeats:  # for example after a restart with the terrain from the store
            self._in_use = in_use._replace(mesh=arrival.mesh)
            return Built(stays, None, repeats=True)
        if repeats and arrival.is_mesh and in_use.may_stay(arrival):  # after a restart without a store
            ground = replace(ground, stamp_ns=in_use.stamp_ns, whole_ns=in_use.stamp_ns)
        standing = stand_on(ground, self._scene)
        _ = standing.cells  # computed here, so that the first answer need not wait
        self._flyer.hand_over(ready=standing)
        if in_use.is_mesh and in_use.digest and not repeats and in_use.digest not in self._replaced:
            self._replaced.append(in_use.digest)
        self._in_use = in_use.followed_by(arrival, ground.digest, ground.whole_ns)
        return Built(ground, survey, repeats, lost=in_use.patches if repeats else 0)

    def _follow_clock(self) -> None:
        """Apply a step back of the clock, noted by `clock_went_back` or possible before the start, to `_in_use`."""
        back_to, self._back_to_ns = self._back_to_ns, None
        if back_to is not None:
            self._in_use = self._in_use.after_clock_went_back(back_to)

    def _patched(self, arrival: Arrival) -> Built:
        """Build a patch into the terrain in use, and return the new terrain with the patch.

        Raises MessageRefused if the patch cannot be converted or is not a point cloud, or if the terrain with the patch
        cannot be used. Raises InputError if there is no terrain, TerrainError if the workshop refuses the patch.
        """
        patch = arrival.convert()
        if not isinstance(patch, CloudSurvey | GridSurvey):
            raise MessageRefused("a patch must be a point cloud")
        grounds: list[LiveTerrain] = []

        def with_patch(standing: PreparedTerrain) -> PreparedTerrain:
            cells = standing.cells
            assert (
                isinstance(standing.ground, LiveTerrain) and cells is standing.cells
            )  # computed before the ground changes
            grounds.append(self._workshop.patched(standing.ground, patch, arrival.stamp_ns))
            return _stood_on(standing, grounds[0])

        self._flyer.hand_over(change=with_patch)
        self._in_use = self._in_use._replace(patches=self._in_use.patches + 1)
        self._holes += points_missing_inside(patch) if isinstance(patch, GridSurvey) else 0
        return Built(grounds[0], patch)


def _stood_on(before: PreparedTerrain, ground: LiveTerrain) -> PreparedTerrain:
    """Return the prepared terrain after a patch.

    before : the prepared terrain before the patch; ground : the terrain with the patch

    Raises MessageRefused if the terrain cannot be used. A TerrainError would be wrong: for the thread that flies rocks,
    a TerrainError means that the terrain is unchanged, but the patch has already changed the arrays of the terrain.
    """
    try:
        return stand_after(before, ground)
    except TerrainError as error:
        raise MessageRefused(f"the terrain cannot be used after this patch: {error}") from error
