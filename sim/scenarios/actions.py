"""Scripted people and their actions. Places are (x, y) on the floor or (x, y, z), world metres."""

from __future__ import annotations

from dataclasses import dataclass

Place = tuple[float, float]
Place3 = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Walk:
    """Walk to a place, around furniture.

    Attributes:
        to: where.
        face_deg: direction to face on arrival, degrees from world x; None keeps the walking one.
    """

    to: Place
    face_deg: float | None = None


@dataclass(frozen=True, slots=True)
class Stand:
    """Stand still for `seconds`."""

    seconds: float


@dataclass(frozen=True, slots=True)
class Push:
    """Go behind an object and push it by contact until its centre has come to `to`, or past it.

    Attributes:
        object: its id.
        to: where it should go.
        speed_m_s: of the hands.
    """

    object: str
    to: Place
    speed_m_s: float = 0.45


@dataclass(frozen=True, slots=True)
class Turn:
    """Take an object by two opposite sides and turn it about up.

    Attributes:
        object: its id.
        by_deg: anticlockwise seen from above.
    """

    object: str
    by_deg: float


@dataclass(frozen=True, slots=True)
class Carry:
    """Grasp an object, lift it, put it down elsewhere and let go.

    It ends at the height it was at if something is there to carry it, or else on what is.

    Attributes:
        object: its id.
        to: where it should lie.
        turn_deg: how far it is turned on the way, anticlockwise seen from above.
    """

    object: str
    to: Place
    turn_deg: float = 0.0


@dataclass(frozen=True, slots=True)
class Hide:
    """Stand between the camera and an object for `seconds`."""

    object: str
    seconds: float


@dataclass(frozen=True, slots=True)
class Put:
    """Like `Carry`, but onto the highest surface at the goal, the room's or another object.

    Attributes:
        object: its id.
        to: where it should lie.
        height_m: of what it is put on; None finds the highest below the shoulders.
        turn_deg: how far it is turned on the way, anticlockwise seen from above.
    """

    object: str
    to: Place
    height_m: float | None = None
    turn_deg: float = 0.0


@dataclass(frozen=True, slots=True)
class Sit:
    """Sit down on an object, or at a place, and stand up again.

    Attributes:
        seconds: time on the seat.
        object: what is sat on, or None.
        to: the seat's middle if it is no object.
        seat_height_m: above the base of what is sat on; None finds it.
        face_deg: where to look from there, degrees from world x; None looks away from the back.
    """

    seconds: float
    object: str | None = None
    to: Place | None = None
    seat_height_m: float | None = None
    face_deg: float | None = None


@dataclass(frozen=True, slots=True)
class HandOver:
    """Bring an object to another person and hold it out until they `Receive` it.

    Attributes:
        object: its id.
        to: the other person's id.
    """

    object: str
    to: str


@dataclass(frozen=True, slots=True)
class Receive:
    """Wait until another person holds an object out, and take it; `Carry` or `Put` come next.

    Attributes:
        object: its id.
    """

    object: str


@dataclass(frozen=True, slots=True)
class Point:
    """Stretch an arm towards an object, or a place, for `seconds`.

    Attributes:
        seconds: how long.
        object: what is pointed at, or None.
        at: the place if it is no object.
    """

    seconds: float
    object: str | None = None
    at: Place3 | None = None


@dataclass(frozen=True, slots=True)
class Draw:
    """Draw a line in the air or on a surface, which stays.

    Attributes:
        points: its corners, at least two.
        speed_m_s: of the pen.
        colour: red, green, blue, 0..1.
    """

    points: tuple[Place3, ...]
    speed_m_s: float = 0.4
    colour: tuple[float, float, float] = (1.0, 0.45, 0.1)


Action = Walk | Stand | Push | Turn | Carry | Put | Hide | Sit | HandOver | Receive | Point | Draw
"""Any action of a person."""


@dataclass(frozen=True, slots=True)
class PersonSettings:
    """A person in the room.

    Attributes:
        person_id: unique.
        start: (x, y) on the floor, metres.
        facing_deg: from world x, anticlockwise.
        actions: done in order.
    """

    person_id: str
    start: tuple[float, float]
    facing_deg: float
    actions: tuple[Action, ...]


ACTION_NAMES: dict[type[Action], str] = {
    Walk: "walk",
    Stand: "stand",
    Push: "push",
    Turn: "turn",
    Carry: "carry",
    Put: "put",
    Hide: "hide",
    Sit: "sit",
    HandOver: "hand_over",
    Receive: "receive",
    Point: "point",
    Draw: "draw",
}
"""Names of the actions in scenario files."""


def name_of(action: Action) -> str:
    """Name of an action in scenario files."""
    return ACTION_NAMES[type(action)]
