"""Read the alert of the site and of each area from the DiagnosticArray of `alerts`.

The message may be an object of rclpy or, if read from a bag, of rosbags.
"""

from collections.abc import Iterable
from typing import TYPE_CHECKING, NamedTuple

from rpf3d_ros.messages.health import Health, healths_of
from rpf3d_ros.messages.refusals import MessageRefused

LEVELS = ("normal", "watch", "restrict", "evacuate", "fault")
"""The words of the alert levels; the number of a level is its index. `fault` is last, but `evacuate` is more severe."""


if TYPE_CHECKING:
    from diagnostic_msgs.msg import DiagnosticArray

ALERT = "rpf3d: alert"
"""Name of the status of the site. The status of an area has this name, a space and the name of the area."""

LATEST = 2**63 - 1
"""Largest accepted time (ns): the largest signed 64-bit integer."""


class ReceivedLevel(NamedTuple):
    """The alert level of the site or of an area, as read from a message.

    area : name of the area; None for the site
    level : index into LEVELS
    health : the received status
    """

    area: str | None
    level: int
    health: Health

    @property
    def state(self) -> str:
        """The alert level as a word of LEVELS."""
        return LEVELS[self.level]


def alerts_of(array: "DiagnosticArray") -> list[ReceivedLevel]:
    """Return the alert levels of site and areas in a message; other statuses are skipped.

    Raises MessageRefused for an unknown level, and if the message has no alert of the site.
    """
    alerts = [_alert(health) for health in healths_of(array) if f"{health.name} ".startswith(f"{ALERT} ")]
    if not any(alert.area is None for alert in alerts):
        raise MessageRefused(f"the message has no status '{ALERT}' with the level of the site")
    return alerts


def decided_at_ns(alerts: Iterable[ReceivedLevel]) -> int:
    """Return the time (ns) of the decision in a message of `alerts`; 0 if it is missing or invalid."""
    number = next((alert.health.values.get("decided_at_ns", "") for alert in alerts if alert.area is None), "")
    is_number = number.isascii() and number.isdigit() and len(number) <= len(str(LATEST))
    return int(number) if is_number and int(number) <= LATEST else 0


def _alert(health: Health) -> ReceivedLevel:
    level = health.values.get("level", "")
    if level not in LEVELS:
        raise MessageRefused(f"'{health.name}' has the level '{level}'; it must be one of {', '.join(LEVELS)}")
    area = None if health.name == ALERT else health.name.removeprefix(f"{ALERT} ")
    return ReceivedLevel(area=area, level=LEVELS.index(level), health=health)
