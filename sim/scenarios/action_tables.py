"""Actions out of a scenario file's tables."""

from __future__ import annotations

from sim.scenarios.actions import (
    ACTION_NAMES,
    Action,
    Carry,
    Draw,
    HandOver,
    Hide,
    Place3,
    Point,
    Push,
    Put,
    Receive,
    Sit,
    Stand,
    Turn,
    Walk,
)
from sim.tables import Table

LONGEST_S = 600.0


def read_action(table: Table) -> Action:
    """An action of a person.

    Raises:
        ScenarioError: it is unknown, or one of its keys is wrong.
    """
    kind = table.text("do")
    action = _moving(kind, table) or _with_object(kind, table) or _showing(kind, table)
    if action is None:
        *names, last = ACTION_NAMES.values()
        raise table.error("do", kind, f"{', '.join(names)} or {last}")
    table.done()
    return action


def read_line(table: Table) -> tuple[Place3, ...]:
    """The corners of a line that is drawn, at least two."""
    points = table.points("points")
    if len(points) < 2:
        raise table.error("points", [list(p) for p in points], "at least two [x, y, z] in metres")
    return points


def read_colour(table: Table) -> tuple[float, float, float]:
    """Red, green, blue, 0..1."""
    colour = table.optional_point3("colour")
    if colour is None:
        return Draw(()).colour
    if not all(0.0 <= value <= 1.0 for value in colour):
        raise table.error("colour", list(colour), "[red, green, blue] within 0..1")
    return colour


def _moving(kind: str, table: Table) -> Action | None:
    """Actions of a person alone."""
    match kind:
        case "walk":
            return Walk(table.point("to"), table.optional_number("face_deg", -360.0, 360.0))
        case "stand":
            return Stand(_seconds(table))
        case "sit":
            return _sit(table)
        case "hide":
            return Hide(table.text("object"), _seconds(table))
        case _:
            return None


def _with_object(kind: str, table: Table) -> Action | None:
    """Actions that move an object."""
    match kind:
        case "push":
            usual = Push("", (0.0, 0.0)).speed_m_s
            speed = table.number("speed_m_s", usual, low=0.05, high=1.5)
            return Push(table.text("object"), table.point("to"), speed)
        case "turn":
            return Turn(table.text("object"), table.number("by_deg", low=-180.0, high=180.0))
        case "carry":
            return Carry(table.text("object"), table.point("to"), _turn_deg(table))
        case "put":
            height = table.optional_number("height_m", 0.0, 2.0)
            return Put(table.text("object"), table.point("to"), height, _turn_deg(table))
        case "hand_over":
            return HandOver(table.text("object"), table.text("to"))
        case "receive":
            return Receive(table.text("object"))
        case _:
            return None


def _showing(kind: str, table: Table) -> Action | None:
    """Actions that show something to others."""
    match kind:
        case "point":
            item, at = table.optional_text("object"), table.optional_point3("at")
            if (item is None) == (at is None):
                raise table.error("object", item, "either object or at = [x, y, z]")
            return Point(_seconds(table), item, at)
        case "draw":
            speed = table.number("speed_m_s", Draw(()).speed_m_s, low=0.02, high=3.0)
            return Draw(read_line(table), speed, read_colour(table))
        case _:
            return None


def _sit(table: Table) -> Sit:
    item, to = table.optional_text("object"), table.optional_point("to")
    if (item is None) == (to is None):
        raise table.error("object", item, "either object or to = [x, y]")
    height = table.optional_number("seat_height_m", 0.15, 0.8)
    return Sit(_seconds(table), item, to, height, table.optional_number("face_deg", -360.0, 360.0))


def _seconds(table: Table) -> float:
    return table.number("seconds", low=0.0, high=LONGEST_S)


def _turn_deg(table: Table) -> float:
    return table.number("turn_deg", 0.0, low=-180.0, high=180.0)
