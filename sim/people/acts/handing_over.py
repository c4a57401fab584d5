"""One person gives an object to another, who waits for it and takes it."""

from __future__ import annotations

import numpy as np

from sim.navigation.planar import bearing
from sim.people.acts.carrying import bring, take
from sim.people.acts.reaching import reach
from sim.people.acts.walking import face, stand
from sim.people.person import TICK_S, Hand, Person, Script, Vector
from sim.scenarios.actions import HandOver, Receive

PATIENCE_S = 30.0
"""Time that a person holds something out, or waits for it, at most."""
BETWEEN_M = 1.05
"""Distance between two people of whom one gives something to the other."""
OFFERED_AT_M = 1.05
"""Height above the floor at which it is held out."""
OTHER_SIDE_M = 0.06
"""How far beside the giver's hand the receiver's hand takes hold: a fist's width."""
NEAR_M = 1.4
"""Distance to the giver's hand within which the receiver stretches out."""


def hand_over(person: Person, action: HandOver) -> Script:
    """Bring an object to somebody, hold it out until they have it, and let go."""
    hand = person.held_hand(action.object)
    if hand is None:
        hand = yield from take(person, action.object)
    other = person.others[action.to]
    place = _opposite(person, other)
    facing = bearing(place, other.body.position)
    yield from bring(person, hand, place=place, facing=facing)
    yield from reach(hand, _between(person, other))
    person.offers = action.object
    yield f"holds out {action.object} to {action.to}"
    for _ in range(round(PATIENCE_S / TICK_S)):
        if other.held_hand(action.object) is not None:
            break
        yield None
    else:
        person.offers = None
        yield f"keeps {action.object}: {action.to} does not take it"
        return
    yield from stand(0.2)
    hand.holds = person.offers = None
    yield f"gives {action.object} to {action.to}"
    hand.wanted = None
    hand.yaw = 0.0
    yield from stand(0.3)


def receive(person: Person, action: Receive) -> Script:
    """Wait for somebody to hold an object out, and take it."""
    for _ in range(round(PATIENCE_S / TICK_S)):
        giver = _giver(person, action.object)
        if giver is not None:
            break
        yield None
    else:
        yield f"has waited for {action.object} in vain"
        return
    other, theirs = giver
    yield from face(person, bearing(person.body.position, other.body.position))
    hand = person.body.hands[1]
    beside = np.array([0.0, 0.0, OTHER_SIDE_M])
    yield from reach(hand, theirs.position + beside)
    hand.holds = action.object
    yield f"takes {action.object}"
    while other.held_hand(action.object) is not None:
        yield None
    yield from stand(0.2)


def _opposite(person: Person, other: Person) -> Vector:
    """Free floor at arm's length from somebody, on the giver's side."""
    way = person.body.position - other.body.position
    distance = max(float(np.linalg.norm(way)), 1e-6)
    wanted = other.body.position + way / distance * BETWEEN_M
    floor = person.floor()
    return floor.nearest_free(wanted) if floor.free.any() else wanted


def _between(person: Person, other: Person) -> Vector:
    middle = 0.5 * (person.body.position + other.body.position)
    return np.array([middle[0], middle[1], OFFERED_AT_M])


def _giver(person: Person, object_id: str) -> tuple[Person, Hand] | None:
    """Find the person who holds an object out within reach, and the hand."""
    for other in person.others.values():
        hand = other.held_hand(object_id)
        if hand is None:
            continue
        way = float(np.linalg.norm(hand.position[:2] - person.body.position))
        if other.offers == object_id and way < NEAR_M:
            return other, hand
    return None
