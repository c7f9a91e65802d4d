"""Tests of the inelastic impact at one contact, against all solutions of the contact laws in 50 digits."""

import math

import numpy as np
import pytest
from bodies.bodies_in_contact import Bodies, Ground, random_contacts, results_of, stop
from mpmath import mp, mpf

from rpf3d_core.body.contacts import ARM, IMPULSE, MU, NORMAL

FRICTION = (0.0, 0.5, 2.0, 100.0)
ANGLES = 1440
"""Number of directions of friction between which solutions are bracketed."""


# --- all solutions, in 50 digits --------------------------------------------------------------------------------------


def exact(a):
    return mp.matrix([mpf(float(x)) for x in a])


def crossed(a, b):
    return mp.matrix([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def inner(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


class Contact:
    """One contact of a body in 50 digits: `frame` (normal, two tangents), velocity `u` and matrix `G` in the frame."""

    def __init__(self, bodies: Bodies, i: int) -> None:
        row, motion = bodies.points[i, 0], bodies.motion[i]
        r, n = exact(row[ARM : ARM + 3]), exact(row[NORMAL : NORMAL + 3])
        n /= mp.sqrt(inner(n, n))
        t = crossed(n, exact((0.3, -0.7, 0.2)))
        t /= mp.sqrt(inner(t, t))
        self.frame = (n, t, crossed(n, t))
        moments = exact(bodies.moments[i])
        v, w = exact(motion[:3]), exact(motion[3:])
        levers = [crossed(r, d) for d in self.frame]
        at = v + crossed(w, r)
        self.u = [inner(d, at) for d in self.frame]
        pairs = list(zip(self.frame, levers, strict=True))
        self.G = [[inner(a, b) + sum(p[k] * q[k] / moments[k] for k in range(3)) for b, q in pairs] for a, p in pairs]

    def in_axes(self, p) -> np.ndarray:
        """Return an impulse p, given in `frame`, in the axes of the body (3,)."""
        whole = p[0] * self.frame[0] + p[1] * self.frame[1] + p[2] * self.frame[2]
        return np.array([float(x) for x in whole])

    def after(self, p):
        """Return the velocity of the contact, in `frame`, after an impulse p in `frame`."""
        return [self.u[j] + sum(self.G[j][k] * p[k] for k in range(3)) for j in range(3)]

    def sticking(self):
        """Return the impulse, in `frame`, that stops the contact."""
        p = mp.lu_solve(mp.matrix(self.G), -mp.matrix(self.u))
        return [p[0], p[1], p[2]]

    def sliding(self, mu, angle):
        """Return the impulse that stops the normal velocity with friction mu along an angle (rad), or None."""
        c, s = mp.cos(angle), mp.sin(angle)
        resistance = self.G[0][0] + mu * (c * self.G[0][1] + s * self.G[0][2])
        if resistance <= 0:
            return None
        P = -self.u[0] / resistance
        return [P, mu * P * c, mu * P * s]

    def across(self, mu, angle):
        """Return the tangential velocity after sliding friction along an angle (rad): its parts across and along it."""
        p = self.sliding(mu, angle)
        if p is None:
            return None
        u, c, s = self.after(p), mp.cos(angle), mp.sin(angle)
        return c * u[2] - s * u[1], c * u[1] + s * u[2]


def signs(contact: Contact, mu: float) -> np.ndarray:
    """Return the signs of `Contact.across` at ANGLES + 1 angles in float64; 0 where no impulse is possible."""
    G, u = np.array(contact.G, dtype=float), np.array(contact.u, dtype=float)
    angle = np.arange(ANGLES + 1) * 2.0 * math.pi / ANGLES
    c, s = np.cos(angle), np.sin(angle)
    resistance = G[0, 0] + mu * (c * G[0, 1] + s * G[0, 2])
    P = -u[0] / np.where(resistance > 0.0, resistance, math.nan)
    after = [u[j] + P * (G[j, 0] + mu * (c * G[j, 1] + s * G[j, 2])) for j in (1, 2)]
    return np.nan_to_num(np.sign(c * after[1] - s * after[0]))


def solutions(contact: Contact, mu: float) -> list[np.ndarray]:
    """Return all impulses that satisfy the contact laws, in the axes of the body: sticking (if any) and sliding."""
    found = []
    stuck = contact.sticking()
    if stuck[0] >= 0 and mp.hypot(stuck[1], stuck[2]) <= mu * stuck[0]:
        found.append(contact.in_axes(stuck))
    sign = signs(contact, mu)
    for k in np.flatnonzero(sign[1:] * sign[:-1] < 0.0):
        ends = (mpf(2) * mp.pi * int(k) / ANGLES, mpf(2) * mp.pi * int(k + 1) / ANGLES)
        angle = mp.findroot(lambda a: contact.across(mpf(mu), a)[0], ends, solver="anderson", tol=mpf(10) ** -60)
        if contact.across(mpf(mu), angle)[1] < 0:
            found.append(contact.in_axes(contact.sliding(mpf(mu), angle)))
    return found


def approaching(seed: int, count: int, mu: float) -> Bodies:
    """Return random bodies that approach the ground at one contact with friction mu."""
    bodies = random_contacts(np.random.default_rng(seed), count, 1, Ground(0.0, 0.0, 0.0))
    bodies.points[:, 0, MU] = mu
    r, n = bodies.points[:, 0, ARM : ARM + 3], bodies.points[:, 0, NORMAL : NORMAL + 3]
    speed = np.einsum("ni,ni->n", bodies.motion[:, :3] + np.cross(bodies.motion[:, 3:], r), n)
    bodies.motion[speed > 0.0] *= -1.0
    return bodies


# --- tests ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mu", FRICTION)
def test_the_impulse_is_a_solution_of_the_contact_laws_in_50_digits(mu):
    bodies = approaching(int(10 * mu) + 1, 60, mu)
    found = results_of(bodies, stop)[1][:, 0, IMPULSE : IMPULSE + 3]
    single = stick = 0
    with mp.workdps(50):
        for i in range(len(found)):
            contact = Contact(bodies, i)
            every = solutions(contact, mu)
            assert every, "a solution exists for any friction"
            errors = [np.linalg.norm(found[i] - p) / np.linalg.norm(p) for p in every]
            assert min(errors) < 1e-11, (i, errors)
            single += len(every) == 1
            p = contact.sticking()
            stick += p[0] > 0 and mp.hypot(p[1], p[2]) <= mu * p[0]
    assert single > 50, "there is hardly ever a choice"
    assert {0.0: stick == 0, 0.5: 0 < stick < 60, 2.0: 20 < stick < 60, 100.0: stick > 50}[mu]
