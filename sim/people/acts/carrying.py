"""To take an object, bring it somewhere and put it down: on what is under the goal."""

from __future__ import annotations

import math
from collections.abc import Generator

import numpy as np

from scenes.pose import Pose, wrap_angle
from sim.navigation.planar import bearing
from sim.people.acts.reaching import reach
from sim.people.acts.supports import HIGHEST_M, support_at
from sim.people.acts.walking import face, stand, walk_to
from sim.people.person import ON_FLOOR_M, TICK_S, Hand, Person, Script, Vector
from sim.scenarios.actions import Carry, Put

LIFT_M = 0.14
CARRIED_AT_M = np.array([0.36, -0.08, 1.08])
GRASP_HEIGHT_M = 0.02
RELEASE_GAP_M = 0.004
SAME_HEIGHT_M = 0.03
"""Difference in height within which a goal is on the surface that the object stands on."""
APART_M = 0.08
"""Distance that somebody who leans over an object keeps from it beyond the usual one."""
BEFORE_GOAL_M = 0.5
"""Distance from the goal at which somebody stands who puts something down in front of them."""
HEADROOM_M = 0.3
"""Height above an object that a hand needs to put it below something."""
LAGGING_RAD = 0.7
"""Angle that may be missing when lowering begins, chosen: it comes round on the way down."""
STILL_RAD_S = 0.5
"""Turning rate below which what was lagging has come round, chosen."""
LONGEST_TURN_S = 2.0
"""Time after which something is put down as it hangs, seconds."""
NEXT_LEVEL_M = 0.03
"""Step down to look for the surface below a surface: a board's thickness, and the scan's noise."""


def carry(person: Person, action: Carry) -> Script:
    """Take an object and put it down elsewhere, at the same height if something is there."""
    height = float(person.physics.object_pose(action.object).translation[2])
    hand = person.held_hand(action.object)
    is_level = hand is None and _is_on_same_level(person, action, height)
    if not is_level:
        height = support_at(person, action.to, without=action.object)
    hand = hand or (yield from take(person, action.object))
    goal = np.array([*action.to, height])
    turn_rad = math.radians(action.turn_deg)
    yield from _put_down(person, hand, goal=goal, turn_rad=turn_rad, from_above=not is_level)


def put(person: Person, action: Put) -> Script:
    """Take an object and put it on top of whatever is at the goal."""
    hand = person.held_hand(action.object)
    if hand is None:
        hand = yield from take(person, action.object)
    height = action.height_m
    if height is None:
        height = support_at(person, action.to, without=action.object)
    goal = np.array([*action.to, height])
    turn_rad = math.radians(action.turn_deg)
    yield from _put_down(person, hand, goal=goal, turn_rad=turn_rad, from_above=True)


def take(person: Person, object_id: str) -> Generator[str | None, None, Hand]:
    """Go to an object, grasp it with the right hand and lift it; gives that hand."""
    pose = person.physics.object_pose(object_id)
    yield from walk_to(person, person.beside(pose.translation[:2]))
    yield from face(person, bearing(person.body.position, pose.translation[:2]))
    hand = person.body.hands[1]
    hold, lift = _hold(person, object_id), np.array([0.0, 0.0, LIFT_M])
    yield from reach(hand, pose.translation + hold + lift)
    yield from reach(hand, pose.translation + hold)
    hand.holds = object_id
    yield f"takes {object_id}"
    yield from reach(hand, pose.translation + hold + lift)
    return hand


def bring(person: Person, hand: Hand, *, place: Vector, facing: float) -> Script:
    """Walk to a place with what is held in front of the chest, and face somewhere (radians)."""
    b = person.body
    turned_at_start = b.yaw - hand.yaw

    def way() -> Script:
        yield from walk_to(person, place)
        yield from face(person, math.radians(math.degrees(facing)))

    for said in way():
        hand.wanted = Pose.from_yaw(b.yaw, (*b.position, 0.0)) @ CARRIED_AT_M
        hand.yaw = b.yaw - turned_at_start
        yield said


def _is_on_same_level(person: Person, action: Carry, height_m: float) -> bool:
    """Whether the surface that an object stands on goes on at the goal, with room above it."""
    needed = person.room.object_by_id(action.object).box_m[2] + HEADROOM_M
    above, level = math.inf, HIGHEST_M
    while True:
        found = person.physics.support_height(np.array([*action.to, level]))
        if abs(found - height_m) < SAME_HEIGHT_M:
            return above - found > needed
        # Nobody puts what stands on the floor below a table: it goes onto it.
        if height_m < ON_FLOOR_M or found < height_m or found >= above:
            return False
        above, level = found, found - NEXT_LEVEL_M


def _put_down(
    person: Person, hand: Hand, *, goal: Vector, turn_rad: float, from_above: bool
) -> Script:
    """Put what a hand holds down at `goal` (3,), and let go."""
    object_id = hand.holds
    assert object_id is not None
    hold, lift = _hold(person, object_id), np.array([0.0, 0.0, LIFT_M])
    is_on_floor = bool(goal[2] < ON_FLOOR_M)
    # What goes onto the floor goes there in front of the feet, not onto them.
    place = person.beside(goal[:2], min_m=BEFORE_GOAL_M if is_on_floor else 0.0)
    if from_above:
        place = person.beside(goal[:2], min_m=BEFORE_GOAL_M, apart_m=APART_M)
    over = goal + hold + lift
    if from_above or not person.floor().is_clear(person.body.position, place):
        yield from bring(person, hand, place=place, facing=bearing(place, goal[:2]))
    if from_above:
        # Straight on it would run into the side or the back of what it is put on.
        over[2] = max(over[2], CARRIED_AT_M[2])
        yield from reach(hand, np.array([*hand.position[:2], over[2]]))
    yield from _sidestep(person, hand, over=over, place=place, turn_rad=turn_rad)
    yield from reach(hand, goal + hold + (0.0, 0.0, RELEASE_GAP_M), speed_m_s=0.35)
    yield from stand(0.1)
    hand.holds = None
    yield f"puts down {object_id}"
    yield from reach(hand, goal + hold + lift)
    hand.wanted = None
    hand.yaw = 0.0
    yield from stand(0.3)


def _hold(person: Person, object_id: str) -> Vector:
    """Place of the hand above the origin of the object it holds."""
    return np.array([0.0, 0.0, person.room.object_by_id(object_id).box_m[2] + GRASP_HEIGHT_M])


def _sidestep(
    person: Person, hand: Hand, *, over: Vector, place: Vector, turn_rad: float
) -> Script:
    """Move what is held straight to `over` while the feet go straight to `place`.

    Large objects turn more slowly than the hand wants: they are waited for.
    """
    assert hand.holds is not None
    yaw_at_start = person.physics.object_pose(hand.holds).yaw()
    b = person.body
    from_hand, from_feet, from_yaw, from_turn = hand.position, b.position, b.yaw, hand.yaw
    # The shorter way round; somebody who walked here may have turned it already.
    turn = turn_rad - from_turn
    turn = wrap_angle(turn) if abs(turn) > math.pi else turn
    facing = wrap_angle(bearing(place, over[:2]) - from_yaw)
    seconds = max(
        float(np.linalg.norm(place - from_feet)) / 0.8,
        float(np.linalg.norm(over - from_hand)) / 0.6,
    )
    ticks = max(1, round(seconds / TICK_S))
    for k in range(1, ticks + 1):
        t = k / ticks
        eased = t * t * (3.0 - 2.0 * t)
        hand.wanted = from_hand + eased * (over - from_hand)
        hand.yaw = from_turn + eased * turn
        b.position = from_feet + eased * (place - from_feet)
        b.yaw = from_yaw + eased * facing
        yield None
    turned = person.physics.object_pose(hand.holds).yaw() - yaw_at_start
    if abs(wrap_angle(turn - turned)) > LAGGING_RAD:
        yield from _until_still(person, hand.holds)


def _until_still(person: Person, object_id: str) -> Script:
    """Wait until what is held has stopped turning."""
    yaw = person.physics.object_pose(object_id).yaw()
    for _ in range(round(LONGEST_TURN_S / TICK_S)):
        yield None
        before, yaw = yaw, person.physics.object_pose(object_id).yaw()
        if abs(wrap_angle(yaw - before)) < STILL_RAD_S * TICK_S:
            return
