"""The lifecycle node rpf3d_simulator: receives terrain, sources and areas; publishes answers and alerts.

The executor's thread only receives messages, converts small messages, and puts them in queues. Long work is done by the
threads of the `Station`, which exists from configuring to cleaning up.
"""

import time
from typing import TYPE_CHECKING, Any

from rclpy.clock import Clock, ClockType
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger as TriggerService

from rpf3d_core.errors import InputError
from rpf3d_ros.engine.clock_watch import STANDS, ClockWatch
from rpf3d_ros.engine.outlets import Outlets
from rpf3d_ros.engine.station import Station
from rpf3d_ros.interface.alert_publishers import AlertPublishers
from rpf3d_ros.interface.answer_publishers import AnswerPublishers
from rpf3d_ros.interface.declared_parameters import ParameterLock, declare, values_of
from rpf3d_ros.interface.health_report import HealthReport
from rpf3d_ros.interface.parameters import SimulatorParameters
from rpf3d_ros.interface.recorded_topics import check_full_names
from rpf3d_ros.interface.scene_parameters import SceneParameters
from rpf3d_ros.interface.tf_buffer import TfTransforms
from rpf3d_ros.interface.transforms import TransformLookup
from rpf3d_ros.messages.health import ERROR, OK, WARN
from rpf3d_ros.nodes.configuring import (
    ContextEnded,
    noting_errors,
    on_a_thread,
    refuse_impossible_transitions,
    watch_clock,
)
from rpf3d_ros.nodes.executor_delay import PERIOD, ExecutorDelay
from rpf3d_ros.nodes.heap import exempt_from_collection, free_unused_objects
from rpf3d_ros.nodes.inputs import Inputs
from rpf3d_ros.nodes.service_clients import clients_of

if TYPE_CHECKING:
    from rpf3d_ros.engine.configuration import StationConfiguration

NAME = "rpf3d_simulator"

TICK = 0.25
"""Time (s) between two checks whether the validity of a decision ends soon, and other regular work.

All regular work has one timer, because each waking of the executor costs rclpy about a millisecond of CPU time.
"""

NAMED_FOR = 10.0
"""Time (s) for which a value of `acknowledged_by` is valid; otherwise an old value could acknowledge a later alert."""

DONE, FAILED = (
    TransitionCallbackReturn.SUCCESS,
    TransitionCallbackReturn.FAILURE,
)


class SimulatorNode(LifecycleNode):
    """The simulator node, with the transitions of a lifecycle node.

    `configure` reads files and compiles; `activate` subscribes and begins to answer; `deactivate` ends the
    subscriptions and forgets waiting sources; `cleanup` frees the memory.

    broken : (attribute) the error of the last failed transition, "" if there is none
    abandoned : (attribute) True if a thread could not be ended, so that only `os._exit` ends the process in time
    """

    def __init__(self) -> None:
        super().__init__(NAME)
        self.scene_parameters = SceneParameters(self)
        parameters = declare(self, SimulatorParameters, fixed=False, others=self.scene_parameters.names)
        _ = parameters.frame, parameters.sensors  # raises an error here if one of them is refused
        self.lock = ParameterLock(self, free=("acknowledged_by",))
        self.health = HealthReport(self, timer=False)
        self.outlets = Outlets(
            answers=AnswerPublishers(self), alerts=AlertPublishers(self), health=self.health, logger=self.get_logger(),
            now=self._now,
        )  # fmt: skip
        self.transforms: TransformLookup | None = None
        self.station: Station | None = None
        self.inputs: Inputs | None = None
        self.broken = ""
        self.abandoned = False
        self._ticked, self._named_at, self._reported_at = 0, -NAMED_FOR, time.monotonic()
        self._clock_watch, self._clock_stands = ClockWatch(parameters.clock_patience), False
        self.add_post_set_parameters_callback(self._note_name)
        self.executor_delay = ExecutorDelay(self, self.health)
        self._acknowledging = self.create_service(TriggerService, "~/acknowledge", self.on_acknowledge)
        self.create_timer(TICK, self._on_timer, clock=Clock(clock_type=ClockType.STEADY_TIME))  # also if time goes back
        refuse_impossible_transitions(self)
        watch_clock(self, self._clock_went_back)
        self._report("unconfigured", OK)
        if parameters.autostart:
            self._starting = self.create_timer(0.0, self._start)

    # --- transitions

    @noting_errors
    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Read parameters, scene and site file, compile, and restore the last good terrain.

        Return FAILURE if an input is refused, or if a signal ends the node during this work.
        """
        self.broken = ""
        self._report("configuring: reading files and compiling", OK)
        try:
            parameters, given = values_of(self, SimulatorParameters), self.scene_parameters.given
            sensors = parameters.sensors
            check_full_names((*sensors.poses, *sensors.clouds), self.resolve_topic_name)
            self.transforms = TfTransforms(self) if parameters.use_tf else None
            now = self._now()
            configuration = on_a_thread(self, lambda: _configuration(parameters, given, now), self.health.publish)
            exempt_from_collection()
            self.station = Station(configuration, self.outlets)
        except ContextEnded:
            self.abandoned = True
            return FAILED
        except InputError as refusal:
            self._close_transforms()
            self._report(f"not configured: {refusal}", ERROR)
            return FAILED
        self.lock.closed = True
        self._report(f"inactive, compiled in {configuration.compile_s:.1f} s", OK)
        return super().on_configure(state)

    @noting_errors
    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Subscribe to the inputs, and begin to answer sources and to decide on alerts."""
        assert self.station is not None
        done = super().on_activate(state)
        self.inputs = Inputs(
            self, values_of(self, SimulatorParameters), self.station, self.health, self._notice_jump, self.transforms
        )
        self.station.activate()
        self.executor_delay.reset()
        self._report("active", OK)
        return done

    @noting_errors
    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Unsubscribe from all inputs, discard waiting sources, and stop publishing."""
        self._stop()
        self._report("inactive", OK)
        self.health.set("run", OK, "inactive")
        return super().on_deactivate(state)

    @noting_errors
    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Free the terrain and everything else that was built."""
        self._close_station()
        self.lock.closed = False
        self.health.clear("terrain", "sources", "run", "queues", "areas", "decision log", "store")
        self._report("unconfigured", OK)
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop, and release everything; the node cannot be configured again."""
        self._release()
        self._report("shut down", OK)
        return super().on_shutdown(state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Release everything after an error in a transition and report the error; the node can be configured again."""
        self._release()
        self.lock.closed = False
        self._report(f"unconfigured after an error: {self.broken or f'in the transition from {state.label}'}", ERROR)
        return DONE

    # --- called by the executor

    def _start(self) -> None:
        """Configure the node, then activate it; called once after the start, only if `autostart` is set."""
        self._starting.cancel()
        if self.trigger_configure() == DONE and self.context.ok():
            self.trigger_activate()

    def _on_timer(self) -> None:
        """Repeat the diagnostics if they are due, and do all other regular work."""
        self._repeat_diagnostics()
        self._tick()

    def _tick(self) -> None:
        """Check the clock and the publishers, and do the station's regular work.

        A clock that went back is noticed here, because ROS reports jumps of simulated time only.
        """
        now = self._notice_jump()
        if self.station is not None and self.inputs is not None:
            self._check_clock(now)
            self.inputs.publishers.look()
            self.station.beat()

    def _repeat_diagnostics(self) -> None:
        """Report the delay of the executor, and publish all diagnostics, if PERIOD (s) has passed since the last time.

        The times of two ticks differ a little from TICK, so half a tick is allowed.
        """
        now = time.monotonic()
        if now - self._reported_at >= PERIOD - 0.5 * TICK:
            self._reported_at = now
            self.executor_delay.report()
            self.health.publish()

    def _notice_jump(self) -> int:
        """Return the current time (ns); if the clock went back since the last call, first forget all sources."""
        now = self._now()
        if now < self._ticked:
            self._clock_went_back((self._ticked - now) * 1e-9)
        self._ticked = now
        return now

    def _check_clock(self, now_ns: int) -> None:
        """Report whether the node's clock runs or stands still; a clock that stands still is a fault.

        A timer of a steady clock calls this method, because a timer of the node's clock would stand still, too.

        now_ns : time of the node's clock (ns)
        """
        stands = self._clock_watch.stands(now_ns, time.monotonic())
        if stands != self._clock_stands:
            self._clock_stands = stands
            self.health.set("clock", ERROR if stands else OK, STANDS if stands else "the clock runs")
        if self.station is not None:
            self.station.report_fault("clock", STANDS if stands else "")

    def _clock_went_back(self, seconds: float) -> None:
        self._ticked = self._now()
        if self.transforms is not None:
            self.transforms.clear()
        if self.station is not None:
            self.station.clock_went_back(seconds)
        if self.inputs is not None and self.station is not None:
            self.station.forget(f"the clock went back by {seconds:.3f} s: all sources received before are discarded")
            self.health.set("clock", WARN, f"the clock went back by {seconds:.3f} s: waiting for new sources")

    def on_acknowledge(
        self, request: TriggerService.Request, response: TriggerService.Response
    ) -> TriggerService.Response:
        """Acknowledge the alert for the person in the parameter `acknowledged_by`, and clear this parameter.

        The acknowledgement is refused if the node is not active.
        """
        acknowledged_by = self._named()
        self.set_parameters([Parameter("acknowledged_by", Parameter.Type.STRING, "")])
        if self.station is None or self.inputs is None:
            response.success, response.message = False, "the node is not active"
        else:
            client = clients_of(self, self._acknowledging.service_name)
            response.success, response.message = self.station.acknowledged(acknowledged_by, client)
        return response

    def _named(self) -> str:
        """Return the value of `acknowledged_by`; "" if it was set more than NAMED_FOR seconds ago."""
        recent = time.monotonic() - self._named_at <= NAMED_FOR
        return str(self.get_parameter("acknowledged_by").value) if recent else ""

    def _note_name(self, parameters: list[Parameter]) -> None:
        if any(parameter.name == "acknowledged_by" for parameter in parameters):
            self._named_at = time.monotonic()

    def destroy_node(self) -> None:
        """Stop the station's threads, then destroy the node; threads that do not end in time are abandoned."""
        for each in (self.outlets.answers, self.outlets.alerts, self.health):
            each.closed = True
        self._close_station()
        super().destroy_node()

    def _stop(self) -> None:
        """Unsubscribe from all inputs and stop answering; the last published alert is a fault."""
        self._unsubscribe()
        if self.station is not None:
            self.station.deactivate()

    def _release(self) -> None:
        self._stop()
        self._close_station()

    def _close_station(self) -> None:
        if self.station is not None:
            self.abandoned = not self.station.close() or self.abandoned
            self.station = None
            free_unused_objects()
        self._close_transforms()

    def _close_transforms(self) -> None:
        if self.transforms is not None:
            self.transforms.close()
            self.transforms = None

    def _unsubscribe(self) -> None:
        if self.inputs is not None:
            self.inputs.close()
            self.inputs = None

    def _report(self, what: str, level: int) -> None:
        self.health.set("lifecycle", level, what)
        if level == OK:
            self.get_logger().info(what)  # the health report logs only problems and their ends

    def _now(self) -> int:
        return int(self.get_clock().now().nanoseconds)


def _configuration(parameters: SimulatorParameters, given: dict[str, Any], now_ns: int) -> "StationConfiguration":
    from rpf3d_ros.engine.configuration import (
        configuration_of,  # a long import, so on a thread
    )

    return configuration_of(parameters, given, now_ns)
