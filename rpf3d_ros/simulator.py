"""The node rpf3d_simulator: terrain and sources in; trajectories, impacts, deposits and hazard zones out."""

import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

from geometry_msgs.msg import PoseArray
from rclpy.node import Node
from sensor_msgs.msg import PointCloud2
from shape_msgs.msg import Mesh

from rpf3d_core.errors import InputError, TerrainError
from rpf3d_ros.health import ERROR, OK, WARN
from rpf3d_ros.health_report import HealthReport
from rpf3d_ros.latest_request import LatestRequest
from rpf3d_ros.parameters import SimulatorParameters, declare
from rpf3d_ros.qos import EVENTS, OVERRIDABLE, terrain_qos
from rpf3d_ros.refusals import MessageRefused
from rpf3d_ros.result_publishers import ResultPublishers
from rpf3d_ros.simulation import Answer, Ground, Simulator
from rpf3d_ros.simulator_node import NAME
from rpf3d_ros.source_messages import Sources, sources_of_poses
from rpf3d_ros.terrain_messages import Survey, grid_of_cloud, mesh_of_cdr

CLOSING_TIME = 2.0
"""Seconds that a run may still take when the node ends; it is abandoned after that."""

V = TypeVar("V")


UNTRIED = 3
"""Surveys that may wait to be tried as terrain: a bad one must not push out a good one, nor many fill the memory."""


@dataclass(frozen=True)
class Request:
    """surveys : the last received first, then those that it overtook before they were tried; sources : the last."""

    surveys: tuple[Survey, ...]
    sources: Sources | None


def merged(overtaken: Request, newer: Request) -> Request:
    """The newer request, with the overtaken one's surveys to fall back on."""
    distinct = {id(survey): survey for survey in (*newer.surveys, *overtaken.surveys)}
    return Request(tuple(distinct.values())[:UNTRIED], newer.sources)


class SimulatorNode(Node):
    """Receives, converts, hands over to a worker thread, publishes; the executor never waits for a run."""

    def __init__(self) -> None:
        super().__init__(NAME)
        self.parameters = declare(self, SimulatorParameters)
        self.frame = self.parameters.frame
        self.survey: Survey | None = None
        self.sources: Sources | None = None
        self.last_mesh = b""
        self.simulator = Simulator(self.parameters)
        self.flown: tuple[Ground, Sources] | None = None
        self.results = ResultPublishers(self, self.parameters)
        self.health = HealthReport(self)
        self.health.set("terrain", WARN, "no terrain yet")
        self.health.set("sources", OK, "no sources yet")
        self.worker = LatestRequest(self.serve, merged)
        self.abandoned = False
        self._subscribe()

    def _subscribe(self) -> None:
        terrain = terrain_qos(self.parameters.terrain_durability)
        overridable: dict[str, Any] = {"qos_overriding_options": OVERRIDABLE}
        self.create_subscription(PointCloud2, "terrain/points", self.on_points, terrain, **overridable)
        self.create_subscription(Mesh, "terrain/mesh", self.on_mesh, terrain, raw=True, **overridable)
        self.create_subscription(PoseArray, "sources", self.on_sources, EVENTS, **overridable)

    def on_points(self, cloud: PointCloud2) -> None:
        """Take a grid of heights as the terrain."""
        if self._take_terrain(lambda: grid_of_cloud(cloud, self.frame)):
            self.last_mesh = b""

    def on_mesh(self, data: bytes) -> None:
        """Take a mesh as the terrain; a latched publisher's repetition of the last one changes nothing."""
        if data == self.last_mesh:
            self.health.set("terrain", OK, "received")
        elif self._take_terrain(lambda: mesh_of_cdr(data, self.frame, self.parameters.mesh_frame)):
            self.last_mesh = data

    def on_sources(self, poses: PoseArray) -> None:
        """Fly one rock from each pose."""
        sources = self._accept("sources", lambda: sources_of_poses(poses, self.frame))
        if sources is not None:
            self.sources = sources
            self.health.set("sources", OK, "received", {"rocks": str(len(sources.positions))})
            self._request()

    def _take_terrain(self, convert: Callable[[], Survey]) -> bool:
        survey = self._accept("terrain", convert)
        if survey is None:
            return False
        self.survey = survey
        self.health.set("terrain", OK, "received")
        self._request()
        return True

    def _accept(self, part: str, convert: Callable[[], V]) -> V | None:
        try:
            return convert()
        except MessageRefused as refusal:
            self.health.set(part, WARN, f"message refused: {refusal}")
            return None

    def _request(self) -> None:
        if self.sources is None:
            self.health.set("run", OK, "waiting for sources")
        if self.survey is None:
            self.health.set("run", WARN, "waiting for terrain")
        elif self.worker.submit(Request((self.survey,), self.sources)):
            self.get_logger().info("a newer request replaced one that had not begun")

    def serve(self, request: Request) -> None:
        """Build the terrain, fly, publish; called on the worker's thread, where no error may escape."""
        try:
            self._stand_on(request.surveys)
            if request.sources is not None:
                self._fly(request.sources)
        except Exception as error:
            self.get_logger().error(traceback.format_exc())
            self.health.set("run", ERROR, f"{type(error).__name__}: {error}")

    def _stand_on(self, surveys: tuple[Survey, ...]) -> None:
        for survey in surveys:
            try:
                self.simulator.stand_on(survey)
                return
            except TerrainError as refusal:
                self.last_mesh = b""  # its repetition is refused again
                self.health.set("terrain", WARN, f"message refused: {refusal}")

    def _fly(self, sources: Sources) -> None:
        ground = self.simulator.ground
        if ground is None:
            self.health.set("run", WARN, "waiting for terrain")
        elif self.flown != (ground, sources):  # a refused terrain has changed nothing
            self.flown = (ground, sources)
            try:
                answer = self.simulator.fly(sources)
            except InputError as refusal:
                self.health.set("run", WARN, f"sources refused: {refusal}")
                return
            self.results.publish(sources.header, answer.results)
            self._report(answer)

    def _report(self, answer: Answer) -> None:
        level = WARN if answer.warnings else OK
        self.health.set("run", level, "; ".join(answer.warnings) or "every rock has an outcome", answer.figures)

    def destroy_node(self) -> None:
        """Let the running request end, or abandon it, before what it publishes on is gone."""
        self.results.closed = True
        self.health.closed = True
        self.abandoned = not self.worker.close(CLOSING_TIME)
        super().destroy_node()
