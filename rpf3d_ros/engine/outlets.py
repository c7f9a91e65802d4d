"""The outputs of a simulator: publishers, diagnostics and log; after its end, outputs that do nothing."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from rclpy.impl.rcutils_logger import RcutilsLogger

from rpf3d_ros.interface.alert_publishers import AlertPublishers
from rpf3d_ros.interface.answer_publishers import AnswerPublishers
from rpf3d_ros.interface.health_report import HealthReport


@dataclass(frozen=True, eq=False)
class Outlets:
    """The outputs of a simulator: the node's publishers, diagnostics and ROS log.

    now : returns the time of the node's clock (ns)
    """

    answers: AnswerPublishers
    alerts: AlertPublishers
    health: HealthReport
    logger: RcutilsLogger
    now: Callable[[], int]

    def silenced(self) -> "Outlets":
        """Return outputs that discard everything, with the same clock.

        Abandoned threads get these outputs, because another station may already use the real outputs.
        """
        return replace(self, answers=_NO_OUTPUT, alerts=_NO_OUTPUT, health=_NO_OUTPUT, logger=_NO_OUTPUT)


class NoOutput:
    """An output that ignores all calls, in place of the outputs of a simulator that has ended."""

    def __getattr__(self, name: str) -> "NoOutput":
        """Return this object for any attribute."""
        return self

    def __call__(self, *args: object, **named: object) -> "NoOutput":
        """Do nothing, and return this object."""
        return self


_NO_OUTPUT: Any = NoOutput()
