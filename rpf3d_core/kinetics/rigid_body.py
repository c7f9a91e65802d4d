"""The contact model of rocks with a shape: rigid convex bodies with hard contact, Coulomb friction, rolling resistance.

A scene with this model has its own flight loop, `simulation/bodies`. The ground's restitution is stored in
`Surface.R_n`, its friction in `Surface.mu` and its rolling resistance in `Surface.mu_r`.
"""

from typing import Any, NamedTuple


class RigidBody(NamedTuple):
    """The parameters of the contact model of rigid bodies.

    shapes : `ShapeTable`, the shapes of the ensemble
    accuracy : m, largest distance from the ground at which contact begins; for small bodies, contact begins nearer
    slip : `slippage.SlipFriction`, or None if no ground has slip friction
    """

    shapes: Any
    accuracy: float
    slip: Any = None

    @property
    def asks_rock(self) -> bool:
        """True: the rules for bodies need the mass and the radius of the rock (`simulation.engines.Models`)."""
        return True

    @property
    def bodies(self) -> bool:
        """Always True, because rocks with this model are bodies with a shape."""
        return True

    @property
    def spins(self) -> bool:
        """Always True, because bodies spin."""
        return True
