"""The DiagnosticArray of `alerts` -> the alert of the site and of each area, whoever made the message."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, NamedTuple

from rpf3d_ros.messages.health import Health, healths_of
from rpf3d_ros.messages.refusals import MessageRefused

LEVELS = ("normal", "watch", "restrict", "evacuate", "fault")
"""Levels of an alert, from the lowest; a level's number is its place."""


if TYPE_CHECKING:
    from diagnostic_msgs.msg import DiagnosticArray

ALERT = "rpf3d: alert"
"""Name of the status of the site; that of an area is followed by a space and the area's name."""

LATEST = 2**63 - 1
"""A time (ns) at most."""


class ReceivedLevel(NamedTuple):
    """area : its name, None of the site; level : an index into LEVELS; health : the status as it came."""

    area: str | None
    level: int
    health: Health

    @property
    def state(self) -> str:
        """The name of the level."""
        return LEVELS[self.level]


def alerts_of(array: "DiagnosticArray") -> list[ReceivedLevel]:
    """The alerts in a message; other statuses are passed over.

    Raises MessageRefused for a level that is none, and where the message holds no alert of the site.
    """
    alerts = [_alert(health) for health in healths_of(array) if f"{health.name} ".startswith(f"{ALERT} ")]
    if not any(alert.area is None for alert in alerts):
        raise MessageRefused(f"the message has no status named '{ALERT}', which tells the level of the site")
    return alerts


def decided_at_ns(alerts: Iterable[ReceivedLevel]) -> int:
    """When the alert of the site was decided (ns); 0 where it does not say, or in no number."""
    told = next((alert.health.values.get("decided_at_ns", "") for alert in alerts if alert.area is None), "")
    is_number = told.isascii() and told.isdigit() and len(told) <= len(str(LATEST))
    return int(told) if is_number and int(told) <= LATEST else 0


def _alert(health: Health) -> ReceivedLevel:
    level = health.values.get("level", "")
    if level not in LEVELS:
        raise MessageRefused(f"'{health.name}' has the level '{level}'; it must be one of {', '.join(LEVELS)}")
    area = None if health.name == ALERT else health.name.removeprefix(f"{ALERT} ")
    return ReceivedLevel(area, LEVELS.index(level), health)
