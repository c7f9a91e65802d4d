"""Measure the numerical error of rocks with a shape: fly the same rocks with other values of the contact's `accuracy`.

Flight is exact, so `accuracy` limits all errors of a rock with a shape: the distance at which contact begins, and the
error of each step while contact lasts.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

from rpf3d_core.accuracy.differences import AnswerDifference, difference
from rpf3d_core.accuracy.flown import fly
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.ensemble.stream import taken
from rpf3d_core.setup.prepared import Prepared

FACTORS = (4.0, 2.0, 1.0, 0.5, 0.25)
"""Measured accuracies of contact, as multiples of the scene's own accuracy.

For a small rock, several accuracies give the same result: the distance at which contact begins is at most 0.4 % of the
largest distance of a corner from the body's centre (`simulation.bodies.motion.SKIN`), whatever the accuracy is.
"""
FINEST = 0.125
"""Accuracy of contact with which all others are compared, as a multiple of the scene's own accuracy."""
BUDGET = 10.0
"""Time budget to fly rocks with the finest accuracy: seconds of one core."""


class InContact(NamedTuple):
    """The measured error and cost of one accuracy of the contact.

    accuracy : m, value of `accuracy` of the contact, for rocks with a shape; rocks : number of rocks flown
    seconds_per_1000 : s of one core for 1,000 rocks
    off : difference from the result of the same rocks with the smallest `accuracy`
    """

    accuracy: float
    rocks: int
    off: AnswerDifference
    seconds_per_1000: float


def accuracies(prepared: Prepared, releases: Releases) -> Iterator[InContact]:
    """Yield the error and the cost of each accuracy of the contact, from the coarsest to the finest.

    The accuracies are multiples of the scene's own accuracy, from 4 down to 1/8. All accuracies fly the same rocks: as
    many as fly with the finest accuracy within about BUDGET (10 s of one core).
    """
    own = prepared.flight.models.rebound.accuracy
    exact = fly(with_accuracy(prepared, FINEST * own), releases, BUDGET, paths=True)
    some = taken(releases, exact.rows)
    for factor in FACTORS:
        found = fly(with_accuracy(prepared, factor * own), some, paths=True)
        off = difference(found, exact, prepared.scene.gravity)
        yield InContact(factor * own, len(found.rows), off, found.seconds_per_1000)
    off = difference(exact, exact, prepared.scene.gravity)
    yield InContact(FINEST * own, len(exact.rows), off, exact.seconds_per_1000)


def with_accuracy(prepared: Prepared, accuracy: float) -> Prepared:
    """Return the scene with another accuracy of the contact (m), for rocks with a shape."""
    flight = prepared.flight
    models = flight.models._replace(rebound=flight.models.rebound._replace(accuracy=accuracy))
    return replace(prepared, flight=replace(flight, models=models))
