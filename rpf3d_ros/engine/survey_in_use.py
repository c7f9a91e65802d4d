"""The whole survey that the terrain in use was built from, to notice that the same survey is published again.

Some programs publish the same survey again and again. A repetition contains none of the patches that were received
since the survey, so it must not replace the terrain with these patches.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from rpf3d_core.live.ground import LiveTerrain
from rpf3d_core.live.survey import Survey
from rpf3d_ros.messages.map_frame import RigidTransform, same_transform
from rpf3d_ros.messages.terrain_messages import Buffer, same_bytes


@dataclass(frozen=True, eq=False)
class Arrival:
    """A received terrain message that waits to be built into the terrain.

    convert : returns the survey in the message
    stamp_ns : stamp of the message (ns); for a mesh, which has no stamp, the time at which it was received
    data : bytes of a mesh; empty for other messages
    moved_by : tf2's transform from the message's frame into the map frame; None for a frame that the parameters define
    """

    convert: Callable[[], Survey]
    stamp_ns: int
    data: Buffer = b""
    moved_by: RigidTransform | None = None

    @property
    def is_mesh(self) -> bool:
        """True for a mesh, which has no stamp."""
        return len(self.data) > 0

    @property
    def mesh(self) -> "PlacedMesh":
        """The bytes and the transform of a mesh; the bytes are empty for other messages."""
        return PlacedMesh(data=self.data, moved_by=self.moved_by)


class PlacedMesh(NamedTuple):
    """The bytes of a mesh, and the transform `moved_by` from the mesh's frame into the map frame.

    moved_by : None if the parameters of the node define the mesh's frame
    """

    data: Buffer = b""
    moved_by: RigidTransform | None = None

    def repeats(self, other: "PlacedMesh") -> bool:
        """True if this mesh has the same bytes and the same transform as another mesh.

        A new transform of the frame moves the mesh, so equal bytes alone are no repetition.
        """
        return same_transform(self.moved_by, other.moved_by) and same_bytes(self.data, other.data)


class SurveyInUse(NamedTuple):
    """The whole survey that the terrain in use was built from.

    digest : SHA-256 (hex) of the survey without patches; "" if it is not known
    stamp_ns : stamp of the survey (ns); for a mesh, the time at which it was first received
    mesh : bytes and transform of the last message with this survey; the bytes are empty if the survey is not a mesh
    patches : number of patches in the terrain since this survey
    is_mesh : True if the survey is a mesh, or its kind is not known
    cloud_ns, cloud_digest : stamp (ns) and digest of the last survey in use that was a cloud, so that this
        cloud and older clouds are refused after another survey has replaced it; 0 and "" if no such cloud is known
    """

    digest: str = ""
    stamp_ns: int = 0
    mesh: PlacedMesh = PlacedMesh()
    patches: int = 0
    is_mesh: bool = True
    cloud_ns: int = 0
    cloud_digest: str = ""

    def is_older(self, arrival: Arrival, digest: str) -> bool:
        """True if a message is an outdated cloud: older than the last cloud in use, or this cloud again.

        The last cloud itself is outdated only after another survey, such as a mesh, has replaced it. The result is
        False if the message is a mesh.

        digest : SHA-256 (hex) of the survey in the message
        """
        if arrival.is_mesh:
            return False
        again = arrival.stamp_ns == self.cloud_ns and digest == self.cloud_digest
        return arrival.stamp_ns < self.cloud_ns or (again and digest != self.digest)

    def contradicts(self, arrival: Arrival, digest: str) -> bool:
        """True if a message is a cloud with the stamp of the last cloud in use, but with other content.

        It is then unknown which of the two clouds shows the current ground.

        digest : SHA-256 (hex) of the survey in the message
        """
        same_stamp = not arrival.is_mesh and 0 < arrival.stamp_ns == self.cloud_ns
        return same_stamp and bool(self.cloud_digest) and digest != self.cloud_digest

    def followed_by(self, arrival: Arrival, digest: str, stamp_ns: int) -> "SurveyInUse":
        """Return the record of the survey in use after the survey in a message has become the terrain.

        The message may have a new survey, or this survey again. The new record has no patches. It stores the stamp and
        the digest of a cloud that is not older than the last cloud.

        arrival : the message
        digest : SHA-256 (hex) of the survey in the message
        stamp_ns : time (ns) from which the age of the survey counts
        """
        cloud_ns, cloud_digest = self.cloud_ns, self.cloud_digest
        if not arrival.is_mesh and arrival.stamp_ns >= cloud_ns:
            cloud_ns, cloud_digest = arrival.stamp_ns, digest
        return SurveyInUse(
            digest=digest, stamp_ns=stamp_ns, mesh=arrival.mesh, is_mesh=arrival.is_mesh, cloud_ns=cloud_ns,
            cloud_digest=cloud_digest,
        )  # fmt: skip

    def after_clock_went_back(self, now_ns: int) -> "SurveyInUse":
        """Return this record after the clock went back: clouds with stamps from `now_ns` on can then be used.

        A cloud that is older than both `now_ns` and the last cloud in use is still too old.

        now_ns : time (ns) to which the clock went back
        """
        if self.cloud_ns <= now_ns:
            return self
        return self._replace(cloud_ns=now_ns, cloud_digest="")  # a cloud with this stamp is another cloud

    def is_same_mesh(self, arrival: Arrival) -> bool:
        """True if a message is a mesh with the bytes and transform of the last message with this survey.

        This is a quick check before `is_repeated`, which needs the digest.
        """
        return arrival.is_mesh and arrival.mesh.repeats(self.mesh)

    def is_repeated(self, arrival: Arrival, digest: str) -> bool:
        """True if a message contains this survey again; a cloud with a later stamp than this survey is a new survey.

        digest : SHA-256 (hex) of the survey in the message
        """
        return bool(digest) and digest == self.digest and (arrival.is_mesh or arrival.stamp_ns <= self.stamp_ns)

    def may_stay(self, arrival: Arrival) -> bool:
        """True if the terrain in use may stay unchanged after a message that contains the same whole survey again.

        For a cloud, the result is True if its stamp is the stamp of the survey in use. For a mesh, the result is False
        if the clock went back, so that the stamp of the survey in use is in the future, or if the clock had not begun
        when the survey in use arrived (stamp 0).
        """
        if arrival.is_mesh:
            return 0 < self.stamp_ns <= arrival.stamp_ns
        return arrival.stamp_ns == self.stamp_ns


def patches_in(ground: LiveTerrain) -> int:
    """Return the number of patches in a terrain; at least 1 if a patch, or a store, has replaced the whole survey.

    Such a terrain counts no patches, but differs from its last whole survey.
    """
    return max(ground.patches, int(ground.digest != ground.whole_digest))


def survey_in_use(ground: LiveTerrain | None, memory: Mapping[str, Any]) -> SurveyInUse:
    """Return the whole survey that is in use when the node starts, or was in use before the start.

    ground : the restored terrain; None if there is none: then the result is made from `memory` only
    memory : the facts that `terrain_to_remember` and the builder saved before the start
    """
    before = SurveyInUse(
        digest=str(memory.get("whole", "")), stamp_ns=int(memory.get("whole_ns", 0)),
        is_mesh=bool(memory.get("is_mesh", True)), cloud_ns=int(memory.get("cloud_ns", 0)),
        cloud_digest=str(memory.get("cloud_digest", "")),
    )  # fmt: skip
    if ground is None:
        return before
    return before._replace(digest=ground.whole_digest, stamp_ns=ground.whole_ns, patches=patches_in(ground))
