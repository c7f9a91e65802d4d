"""Five minutes of a working shift in a mine: the actions of survey, radar and operator, and their times.

The same rocks fall three times. First a bench catches the rocks. Then the crest of the bench fails, and the rocks reach
the haul ramp over the muck; the ramp is evacuated. Then the bench is cleaned. No recorded results are used: the nodes
answer the messages that they receive.
"""

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray
from rclpy.serialization import deserialize_message
from std_msgs.msg import Header

from rpf3d_core.errors import InputError
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.demo.shift_content import ShiftContent, patch_message
from rpf3d_ros.demo.stand_in import StandIn
from rpf3d_ros.interface.qos import RESULTS
from rpf3d_ros.interface.simulated_clock import SimulatedClock
from rpf3d_ros.messages.alert_reading import ALERT
from rpf3d_ros.messages.health import healths_of
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.refusals import TAKEN_UP
from rpf3d_ros.messages.result_messages import facts_of
from rpf3d_ros.messages.source_messages import poses_of_sources
from rpf3d_ros.messages.stamps import SECOND, nanoseconds, stamp_of

LENGTH = 300.0
"""Length of the shift (s)."""

RADAR = 5.0
"""Time between two messages of the radar (s), which also publishes while no rock moves."""

NONE = np.empty((0, 3))

LONGEST_STEP = 0.05
"""Longest wall-clock time (s) that counts in one step through a quiet stretch.

A busy machine may stop the demo for a second. At 20 times the speed the clock would jump by 20 s, and the nodes would
report the silence of the radar.
"""


class Event(NamedTuple):
    """One action of survey, radar or operator in the shift, with its time.

    at : time since the beginning of the shift (s)
    action : name of the method of `Shift` that does the action
    sentence : a sentence for the person who watches the demo
    """

    at: float
    action: str
    sentence: str


EVENTS = (
    Event(at=0.0, action="survey", sentence="the survey of the morning: the whole pit"),
    Event(
        at=30.0, action="falls", sentence="rocks leave a bench 30 m above the haul ramp; the bench below catches them"
    ),
    Event(at=60.0, action="quiet", sentence="the wall is quiet"),
    Event(at=90.0, action="fails", sentence="survey, first update: a crest has failed, and its muck fills the bench"),
    Event(at=120.0, action="falls", sentence="the same rocks again: over the muck they come down to the ramp"),
    Event(at=160.0, action="quiet", sentence="the wall is quiet; the alert stays until a person acknowledges it"),
    Event(at=190.0, action="acknowledge", sentence="the shift supervisor acknowledges"),
    Event(at=210.0, action="cleaned", sentence="survey, second update: the bench is cleaned"),
    Event(at=240.0, action="falls", sentence="the same rocks a third time"),
    Event(at=275.0, action="quiet", sentence="the wall is quiet"),
)
"""The actions of the shift: two updates of the terrain, three bursts of sources; one alert rises and falls."""

BY = "M. Supervisor: ramp closed and inspected, radar quiet for 30 s"
ANSWERING = 30.0
"""Longest wait for an answer, in wall-clock time (s)."""


class Shift:
    """Plays the working shift to the nodes: publishes as survey and radar, and acknowledges as operator.

    The clock must run in real time, so that recorded delays are real. In quiet stretches the shift sets the clock
    forward.
    """

    def __init__(self, content: ShiftContent, stand_in: StandIn, clock: SimulatedClock, speed: float) -> None:
        """Subscribe to results and alerts.

        speed : seconds of the shift per second of wall-clock time, while no answer is awaited
        """
        self._content, self._stand_in, self._clock, self._speed = content, stand_in, clock, speed
        self._began_ns = clock.now_ns()
        self._detected: tuple[FloatArray, FloatArray] = (NONE, NONE)
        self._published_ns, self._answered_ns, self._flown_over = 0, 0, ""
        self.levels: list[str] = []
        stand_in.subscribe("results", self._note_answer)
        stand_in.subscribe("alerts", self._note_alert, RESULTS)

    def play(self, report: Callable[[str], None]) -> None:
        """Do each action at its time; report : called with a line of text before each action.

        Raises InputError if a node does not answer or refuses an acknowledgement.
        """
        if not self._stand_in.wait(lambda: self.levels, ANSWERING):
            raise InputError(f"no alert came within {ANSWERING:g} s")
        for event in EVENTS:
            self._pass_until(event.at)
            report(f"  {event.at:3.0f} s  {event.sentence}")
            getattr(self, event.action)()
        self._pass_until(LENGTH)

    def survey(self) -> None:
        """Publish the whole pit as terrain, then the sources that the radar detects, and wait for the answer."""
        self._stand_in.publish("terrain/mesh", self._content.mesh)
        self._publish_sources()

    def falls(self) -> None:
        """Publish moving rocks as the sources that the radar detects from now on, and wait for the answer."""
        self._detected = (self._content.places, self._content.velocities)
        self._publish_sources()

    def quiet(self) -> None:
        """Publish that the radar detects no sources from now on, and wait for the answer."""
        self._detected = (NONE, NONE)
        self._publish_sources()

    def fails(self) -> None:
        """Publish a patch with the muck of the failed crest on the bench; wait for an answer over the new terrain."""
        self._update(self._content.muck)

    def cleaned(self) -> None:
        """Publish a patch with the bench without muck, and wait for an answer over the new terrain."""
        self._update(self._content.bench)

    def acknowledge(self) -> None:
        """Acknowledge the alert as the operator. Raises InputError if the acknowledgement is refused."""
        done, answer = self._stand_in.acknowledge(BY, ANSWERING)
        if not done and answer != TAKEN_UP:  # taken up on a slow machine: the later alerts show the level
            raise InputError(f"the acknowledgement was refused: {answer}")

    def _update(self, points: FloatArray) -> None:
        """Publish a patch of points (H, W, 3) m, and wait for an answer that uses the new terrain."""
        before = self._flown_over

        def publish() -> None:
            self._stand_in.publish("terrain/update", patch_message(points, self._clock.now_ns()))

        self._await(publish, lambda: self._flown_over != before)

    def _publish_sources(self) -> None:
        """Publish the sources that the radar detects, and wait for the answer."""

        def publish() -> None:
            self._published_ns = self._clock.now_ns()
            header = Header(stamp=stamp_of(self._published_ns), frame_id=MapFrame().name)
            places, velocities = self._detected
            message = poses_of_sources(header, places, velocities) if len(places) else PoseArray(header=header)
            self._stand_in.publish("sources", message)

        self._await(publish, lambda: self._answered_ns >= self._published_ns)

    def _pass_until(self, at: float) -> None:
        """Let the clock run fast until `at` (s) after the beginning of the shift; the radar publishes in the meantime.

        The method waits for the answer to each message of the radar. Otherwise, on a busy machine, the clock would run
        ahead of the nodes. The nodes would then refuse the next messages of the radar as stale or from the future.
        """
        end = self._began_ns + round(at * SECOND)
        while (now := self._clock.now_ns()) < end:
            if now - self._published_ns >= RADAR * SECOND:
                self._publish_sources()
            began = time.monotonic()
            self._stand_in.spin_once()
            self._clock.jump((self._speed - 1.0) * min(time.monotonic() - began, LONGEST_STEP))

    def _await(self, ask: Callable[[], None], answered: Callable[[], bool]) -> None:
        """Publish the current time on /clock, then a message, and wait for the answer to this message.

        ask : publishes the message; answered : returns True once the answer has been received

        Raises InputError if no answer is received within ANSWERING seconds.
        """

        self._clock.publish()
        ask()
        if not self._stand_in.wait(answered, ANSWERING):
            raise InputError(f"the simulator has not answered within {ANSWERING:g} s")

    def _note_answer(self, data: bytes, at_ns: int) -> None:
        message = deserialize_message(data, DiagnosticArray)
        self._answered_ns = nanoseconds(message.header.stamp)
        self._flown_over = facts_of(message).terrain_digest

    def _note_alert(self, data: bytes, at_ns: int) -> None:
        level = level_of(data)
        if level and self.levels[-1:] != [level]:
            self.levels.append(level)


def level_of(data: bytes) -> str:
    """Return the alert level of the site in a message of `alerts`; "" if the message has no status of the site."""
    healths = healths_of(deserialize_message(data, DiagnosticArray))
    return next((health.values["level"] for health in healths if health.name == ALERT), "")
