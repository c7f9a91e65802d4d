"""The scene's key `method`: how contacts of rocks with the ground are found, exactly or in fixed steps.

The method `events` is exact; fixed steps serve as a comparison.
"""

from typing import Any

from pydantic import Field

from rpf3d_core.scene.values import Number, StrictModel, refuse

EVENTS = "events"
LONGEST_STEP = 1.0
"""Longest time step (s) that a scene may have; a rock falls 5 m in one second."""
SHORTEST_STEP = 1e-7
"""Shortest time step (s) that a scene may have; a fall of 10 s then needs a hundred million steps."""


class SteppingSpec(StrictModel):
    """Settings of the search for contacts in fixed time steps, as in the thesis, sections 3.1 and 3.4.

    Defaults: a time step of 0.1 ms, and contact at 5 cm.
    """

    dt: Number = Field(
        1e-4, ge=SHORTEST_STEP, le=LONGEST_STEP,
        description=f"a number from {SHORTEST_STEP:g} to {LONGEST_STEP:g} (s), the time step",
    )  # fmt: skip
    threshold: Number = Field(
        0.05, gt=0, description="a number above 0 (m), the distance from the ground below which the rock is in contact"
    )
    squared: bool = Field(
        False, strict=True,
        description="true or false, whether the squared distance is compared with `threshold`, as in the thesis' code",
    )  # fmt: skip


class MethodSpec(StrictModel):
    """The method of finding contacts: exact, event by event, unless `stepping` is given."""

    stepping: SteppingSpec | None = Field(None, description="a mapping with dt, threshold and squared")

    def describe(self) -> str:
        """Return the method of finding contacts in words, for reports."""
        if self.stepping is None:
            return EVENTS
        squared = ", compared with the squared distance" if self.stepping.squared else ""
        return f"stepping (dt {self.stepping.dt:g} s, threshold {self.stepping.threshold:g} m{squared}): inexact"


def method_values(value: Any) -> Any:
    """Return the fields of `MethodSpec` from the scene's value of `method`: the word `events`, or a mapping.

    A value that is already a `MethodSpec` is returned unchanged.

    Raises
    ------
    PydanticCustomError
        The value is neither the word `events` nor a mapping with at least one key.
    """
    if value == EVENTS:
        return {}
    if isinstance(value, MethodSpec):
        return value
    if not isinstance(value, dict) or not value:
        raise refuse(f"is {value!r}, but must be events, or a mapping {{stepping: {{dt, threshold, squared}}}}")
    return value
