"""Quality of service of each kind of topic; a launch file may override it (`qos_overrides`)."""

from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, HistoryPolicy, LivelinessPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions

from rpf3d_ros.interface.recorded_topics import EVENT, RESULT, STATE, TERRAIN

LATCHED = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""Quality of service of topics that show a state, such as terrain: a late subscriber receives the last message."""

HEARTBEAT = 1.0
"""Time (s) after which `alerts` and `alarm` are published again, even if nothing has changed."""

DEADLINE, LEASE = 2.5, 3.0
"""Longest time (s) between two messages of `alerts` or `alarm`, and time (s) after which a dead node is reported.

A subscriber may require these times, or longer times. A subscriber that requires no times also receives the messages.
"""

ALERTS = QoSProfile(
    depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL,
    deadline=Duration(seconds=DEADLINE), liveliness=LivelinessPolicy.AUTOMATIC,
    liveliness_lease_duration=Duration(seconds=LEASE),
)  # fmt: skip
"""Quality of service of `alerts` and `alarm`, offered by the simulator and required by `rpf3d_alarm_bridge`."""

RESULTS = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""Quality of service with which the recorder subscribes to results: many may wait while a large terrain is written."""

EVENTS = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.VOLATILE)
"""Quality of service of topics of events, such as sources and diagnostics: a late subscriber must get no old event."""


SOURCES = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.VOLATILE)
"""Quality of service with which the simulator subscribes to sources: a later message must not overwrite an earlier one.

A sensor may report its walls one after the other without a pause. The queue takes memory only for messages that wait.
"""


def depth_of(qos: QoSProfile) -> int:
    """Return the largest number of waiting messages, above which a subscription deletes the oldest; 0: no limit."""
    return 0 if qos.history == HistoryPolicy.KEEP_ALL else qos.depth


OVERRIDABLE = QoSOverridingOptions.with_default_policies()
"""Setting by which a launch file may override history, depth and reliability of a topic.

The parameters are `qos_overrides.<topic>.<publisher|subscription>.*`.
"""


def terrain_qos(durability: str) -> QoSProfile:
    """Return the quality of service of terrain subscriptions.

    durability : "volatile" or "transient_local", chosen by the user, because a transient_local subscriber never matches
        a volatile publisher
    """
    if durability == "transient_local":
        return LATCHED
    return QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.VOLATILE)


RECORDED = {
    STATE: LATCHED,
    RESULT: RESULTS,
    EVENT: QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.VOLATILE),
}
"""Quality of service with which each kind of topic (`recorded_topics`) is recorded.

Events may wait while a large terrain is written.
"""


def given_qos(offered: str) -> QoSProfile:
    """Return the quality of service for a program that publishes in place of a survey or radar.

    Topics of kind TERRAIN are latched; all others are published as EVENTS.

    offered : STATE, EVENT, RESULT or TERRAIN, as in `RecordedTopic`
    """
    return LATCHED if offered == TERRAIN else EVENTS


def recorded_qos(offered: str, durability: str) -> QoSProfile:
    """Return the quality of service for recording a topic.

    offered : STATE, EVENT, RESULT or TERRAIN, as in `RecordedTopic`
    durability : as in `terrain_qos`; it matters for terrain topics only
    """
    return terrain_qos(durability) if offered == TERRAIN else RECORDED[offered]
