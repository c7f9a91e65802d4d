"""Quality of service of each kind of topic; a launch file may override it (`qos_overrides`)."""

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions

from rpf3d_ros.interface.recorded_topics import EVENT, RESULT, STATE, TERRAIN

LATCHED = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""State: terrain as we publish it, and every result; who joins late gets the last one."""

RESULTS = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""How results are recorded: those of several runs may wait while a large terrain is being written."""

EVENTS = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.VOLATILE)
"""Events: sources and diagnostics; an old one must not be taken for a new one."""


OVERRIDABLE = QoSOverridingOptions.with_default_policies()
"""History, depth and reliability may be overridden by parameters `qos_overrides.<topic>.<publisher|subscription>.*`."""


def terrain_qos(durability: str) -> QoSProfile:
    """How terrain is received; a transient_local subscriber never matches a volatile publisher, so the user says."""
    if durability == "transient_local":
        return LATCHED
    return QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.VOLATILE)


RECORDED = {
    STATE: LATCHED,
    RESULT: RESULTS,
    EVENT: QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.VOLATILE),
}
"""By how a topic is offered (`recorded_topics`); events may wait while a large terrain is being written."""


def given_qos(offered: str) -> QoSProfile:
    """How an input of the simulator is published by who stands in for a mine: terrain latched, all else as events."""
    return LATCHED if offered == TERRAIN else EVENTS


def recorded_qos(offered: str, durability: str) -> QoSProfile:
    """How a topic is recorded; durability : of terrain, as the user says."""
    return terrain_qos(durability) if offered == TERRAIN else RECORDED[offered]
