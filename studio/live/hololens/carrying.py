"""Shapes in the wearer's hands: a pinch takes one that is theirs, and lets it go at somebody."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from devices.hololens.values import HandJoints, HeadAndHands, Joint
from devices.hub.elsewhere import Elsewhere
from devices.hub.entities.drawn import Drawn, drawn_entity
from devices.hub.inbox import Avatars
from devices.hub.protocol.messages import Do, OpError
from devices.hub.protocol.wire import MAX_ROOM_M
from devices.hub.roles import Op, Person, can_have_shapes
from scenes.pose import Pose
from scenes.state import Avatar, SceneState, SharedPrimitive

PINCH_M, OPEN_M = 0.015, 0.03
"""Between the tips of thumb and index finger, metres: below the first a hand closes, as on the page
in a headset; above the second, twice as much, it opens, so that noise lets nothing fall."""

REACH_M = 0.08
"""From a pinch to a shape that it takes, and from a shape to the hand of whoever gets it, metres:
as on the page in a headset."""

FACE_M = 0.4
"""From a shape to the head of somebody who shows no hands, and is given it, metres; chosen: an
arm's length before the face is farther, their own body is not."""

SEND_NS = 80_000_000
"""Time between two places of a shape that is carried, as a page sends them."""

LOST_NS = 500_000_000
"""Time without sight of a hand after which it has let go; chosen: as long as an arm hides the other
in passing."""

SETTLES_NS = 500_000_000
"""Time for which a shape is shown where it was let go: the session's state has it there by then, at
the camera's period and its delay."""


class Doing(Protocol):
    """Part of a hub that lets somebody without a page do what others do."""

    def act(self, person_id: str, do: Do) -> object:
        """Do what somebody asks for who is here another way."""
        ...

    def elsewhere(self, *, but: str) -> list[Elsewhere]:
        """Return people of other sites, and nobody who is here that way."""
        ...

    def bodies(self) -> list[tuple[Person, bytes]]:
        """Return its own people who show a body, and the newest of each."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Held:
    """A shape in a hand.

    Attributes:
        primitive: as it is now.
        hand_from_primitive: where it is in the hand.
        side: of the hand: 0 left, 1 right.
        drag: number of the grip, by which its moves are undone as one.
        seen_ns: when the hand was seen last, session time.
    """

    primitive: SharedPrimitive
    hand_from_primitive: Pose
    side: int
    drag: int
    seen_ns: int


@dataclass(frozen=True, slots=True)
class Hands:
    """Both hands of the wearer between two samples.

    Attributes:
        closed: whether each pinches.
        held: the shape that one of them has.
        drags: grips so far.
    """

    closed: tuple[bool, bool] = (False, False)
    held: Held | None = None
    drags: int = 0


def hands_after(
    hands: Hands,
    sample: HeadAndHands | None,
    *,
    own: Iterable[SharedPrimitive],
    world_from_device: Pose,
    now_ns: int,
) -> Hands:
    """Return the hands after a sample.

    Args:
        hands: before it.
        sample: of the headset; None where there is no new one.
        own: shapes that are the wearer's.
        world_from_device: the headset's world in the room.
        now_ns: session time.
    """
    joints = (None, None) if sample is None else (sample.left, sample.right)
    pairs = zip(joints, hands.closed, strict=True)
    left, right = (was if hand is None else _is_closed(hand, was=was) for hand, was in pairs)
    after = replace(hands, closed=(left, right))
    held = hands.held
    if held is not None:
        hand = joints[held.side]
        if hand is None:
            is_lost = now_ns - held.seen_ns >= LOST_NS
            return replace(after, held=None) if is_lost else after
        if not after.closed[held.side]:
            return replace(after, held=None)
        pose = world_from_device @ _pinch(hand) @ held.hand_from_primitive
        moved = replace(held.primitive, world_from_primitive=pose)
        return replace(after, held=replace(held, primitive=moved, seen_ns=now_ns))
    for side, hand in enumerate(joints):
        if hand is None or hands.closed[side] or not after.closed[side]:
            continue
        world_from_hand = world_from_device @ _pinch(hand)
        found = _nearest(own, world_from_hand.translation)
        if found is not None:
            inside = world_from_hand.inverse() @ found.world_from_primitive
            grip = Held(found, inside, side, hands.drags + 1, now_ns)
            return replace(after, held=grip, drags=grip.drag)
    return after


class Carrying:
    """Takes, carries and lets go shapes by the wearer's hands, on the thread of their samples.

    Args:
        wearer: id of the wearer among people.
        hub: returns the hub of the moment; None while nobody can join.
        note: takes an event of the session: kind and text.
    """

    def __init__(
        self, wearer: str, *, hub: Callable[[], Doing | None], note: Callable[[str, str], None]
    ) -> None:
        self._wearer, self._hub, self._note = wearer, hub, note
        self._state = SceneState()
        self._hands = Hands()
        self._count = 0
        self._sent_ns = 0
        self._let_go: tuple[SharedPrimitive, int] | None = None
        """The shape that was let go last, and until when it is shown there."""

    def publish(self, state: SceneState) -> None:
        """Take a new state; any thread, returns at once."""
        self._state = state

    def shown(self, now_ns: int) -> SharedPrimitive | None:
        """Return the shape that is, or was a moment ago, in a hand, as it is there."""
        held, let_go = self._hands.held, self._let_go
        if held is not None:
            return held.primitive
        return let_go[0] if let_go is not None and now_ns < let_go[1] else None

    def step(
        self, sample: HeadAndHands | None, *, device_from_world: Pose | None, now_ns: int
    ) -> None:
        """Follow the hands: take a shape, carry it, let it go at somebody."""
        hub = self._hub()
        if hub is None or device_from_world is None:
            self._hands = Hands(drags=self._hands.drags)
            return
        own = [it for it in self._state.primitives.values() if it.user_id == self._wearer]
        before = self._hands.held
        self._hands = hands_after(
            self._hands,
            sample,
            own=own,
            world_from_device=device_from_world.inverse(),
            now_ns=now_ns,
        )
        held = self._hands.held
        if held is not None and now_ns - self._sent_ns >= SEND_NS:
            self._sent_ns = now_ns
            if not self._put(hub, held):
                self._hands = replace(self._hands, held=None)
        if before is not None and held is None:
            self._let_go = before.primitive, now_ns + SETTLES_NS
            if self._put(hub, before) and now_ns - before.seen_ns < LOST_NS:
                self._give(hub, before.primitive)

    def _put(self, hub: Doing, held: Held) -> bool:
        """Have everybody see a shape where it is; return whether it is still the wearer's."""
        return self._do(hub, Op.PRIMITIVE, drawn=drawn_entity(held.primitive), drag=held.drag)

    def _give(self, hub: Doing, primitive: SharedPrimitive) -> None:
        others = [(it.person, it.body) for it in hub.elsewhere(but=self._wearer) if it.body]
        bodies = [*hub.bodies(), *others]
        ids = {person.person_id for person, _ in bodies if can_have_shapes(person)}
        seen = [it for it in Avatars().of(bodies) if it.user_id in ids]
        taker = taker_at(primitive, seen)
        if taker is not None:
            given = Drawn(Op.PRIMITIVE, primitive.primitive_id, "")
            self._do(hub, Op.GIVE, drawn=given, to=taker)

    def _do(
        self, hub: Doing, op: Op, *, drawn: Drawn, drag: int | None = None, to: str = ""
    ) -> bool:
        away_m = np.abs(drawn.room_from_entity.translation).max()
        if not (drawn.is_finite and away_m <= MAX_ROOM_M):
            return False  # a headset that is lost says that it is kilometres away
        self._count += 1
        try:
            hub.act(self._wearer, Do(self._count, op, drawn, drag, to))
        except OpError as error:
            self._note("refused", f"{drawn.key}, of the headset's wearer: {error}")
            return False
        except KeyError:
            return False  # not among the people yet, or no more
        return True


def taker_at(primitive: SharedPrimitive, avatars: Iterable[Avatar]) -> str | None:
    """Return the id of whoever's hand, or head of one without hands, is at a shape, or None."""
    found: list[tuple[float, str]] = []
    for avatar in avatars:
        head = avatar.world_from_head.translation.reshape(1, 3)
        places = np.concatenate(avatar.hands) if avatar.hands else head
        reach_m = REACH_M if avatar.hands else FACE_M
        away_m = min(metres_to(primitive, place) for place in places)
        if away_m <= reach_m:
            found.append((away_m / reach_m, avatar.user_id))
    return min(found)[1] if found else None


def metres_to(primitive: SharedPrimitive, place: np.ndarray) -> float:
    """Return how far a (3,) place in the room is from a shape's box; 0 inside."""
    x, y, z = primitive.size_m
    low, high = np.array([-0.5 * x, -0.5 * y, 0.0]), np.array([0.5 * x, 0.5 * y, z])
    inside = primitive.world_from_primitive.inverse() @ place
    return float(np.linalg.norm(inside - np.clip(inside, low, high)))


def _nearest(own: Iterable[SharedPrimitive], place: np.ndarray) -> SharedPrimitive | None:
    """Return the nearest shape within reach of a pinch."""
    found = [(metres_to(it, place), it.primitive_id, it) for it in own]
    nearest = min(found, key=lambda each: each[:2], default=None)
    return nearest[2] if nearest is not None and nearest[0] <= REACH_M else None


def _is_closed(hand: HandJoints, *, was: bool) -> bool:
    thumb, index = hand.positions_m[Joint.THUMB_TIP], hand.positions_m[Joint.INDEX_TIP]
    return float(np.linalg.norm(thumb - index)) < (OPEN_M if was else PINCH_M)


def _pinch(hand: HandJoints) -> Pose:
    """Return device from hand: between the tips, turned as the palm."""
    tips = hand.positions_m[[Joint.THUMB_TIP, Joint.INDEX_TIP]]
    return Pose(hand.rotations[Joint.PALM], tips.mean(axis=0))
