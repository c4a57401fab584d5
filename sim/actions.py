"""The actions of a scripted person. Positions are (x, y) on the floor in world metres."""

from __future__ import annotations

from dataclasses import dataclass

Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Walk:
    """Walk to a place, around furniture.

    Attributes:
        to: where.
        face_deg: direction to face on arrival, degrees from world x; None keeps the walking one.
    """

    to: Point
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
    to: Point
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
    """Grasp an object, lift it, put it down elsewhere at the same height and let go.

    Attributes:
        object: its id.
        to: where it should lie.
        turn_deg: how far it is turned on the way, anticlockwise seen from above.
    """

    object: str
    to: Point
    turn_deg: float = 0.0


@dataclass(frozen=True, slots=True)
class Hide:
    """Stand between the camera and an object for `seconds`."""

    object: str
    seconds: float


Action = Walk | Stand | Push | Turn | Carry | Hide
"""Any action of a person."""
