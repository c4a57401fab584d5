"""Reach for a point with hands, and wait until they are there, as several actions do."""

from __future__ import annotations

import numpy as np

from sim.navigation.planar import towards
from sim.people.acts.walking import stand
from sim.people.person import TICK_S, Hand, Person, Script, Vector


def reach(hand: Hand, point: Vector, *, speed_m_s: float = 0.7) -> Script:
    """Move a hand to a point (3,), evenly."""
    hand.wanted = hand.position if hand.wanted is None else hand.wanted
    while float(np.linalg.norm(point - hand.wanted)) > 1e-6:
        hand.wanted = towards(hand.wanted, point, speed_m_s * TICK_S)
        yield None
    while float(np.linalg.norm(point - hand.position)) > 1e-3:
        yield None
    yield from stand(0.06)


def wait_for_hands(person: Person) -> Script:
    """Until both hands are where they are wanted; 2 s at most."""
    for _ in range(200):
        if all(
            hand.wanted is None or np.linalg.norm(hand.wanted - hand.position) < 5e-3
            for hand in person.body.hands
        ):
            return
        yield None


def let_hang(person: Person) -> None:
    """Both hands are idle from now on."""
    for hand in person.body.hands:
        hand.solid = False
        hand.wanted = None
