"""Text messages of people, read and checked: hello, seen, ping, and what they do."""

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass
from typing import Any, NoReturn, cast

import numpy as np
from numpy.typing import NDArray

from devices.hub.media.offer import OfferError
from devices.hub.media.signals import MediaSignal, OfferSignal, read_signal
from devices.hub.roles import Op
from devices.hub.wire import MAX_ROOM_M

MAX_TEXT_BYTES = 128 * 1024
"""Length of a text: a line of `MAX_POINTS` points as browsers print doubles, and as much again."""

MAX_POINTS = 1000
"""Points of a line; chosen: 20 m in steps of 2 cm."""

MAX_NAME = 40
"""Characters of a person's name."""

MAX_COUNT = 2**53
"""Largest whole number that every JSON reader keeps."""

_ID = re.compile(r"[A-Za-z0-9_.-]{1,40}(?:/[A-Za-z0-9_.-]{1,40})?")
"""Name that a client gives a line, a surface or an operation."""


class MessageError(ValueError):
    """A text that is no message; says which field."""


class OpError(ValueError):
    """An operation that cannot be done as it was asked for; says why.

    Args:
        why: in words for the person.
        op_id: the client's name of it, where it could be read.
    """

    def __init__(self, why: str, *, op_id: str | int | None = None) -> None:
        super().__init__(why)
        self.op_id = op_id


@dataclass(frozen=True, slots=True)
class Hello:
    """First message: who, and up to where the log is known."""

    token: str
    name: str | None
    log_seq: int | None


@dataclass(frozen=True, slots=True)
class Seen:
    """A state has come."""

    version: int


@dataclass(frozen=True, slots=True)
class Ping:
    """A client asks for the time; `t_us` is its own."""

    t_us: float


@dataclass(frozen=True, slots=True, eq=False)
class Do:
    """An operation.

    Attributes:
        op_id: the client's name of it.
        op: its kind.
        key: the client's name of the line or surface; empty for an undo.
        points: (N, 3) of a line or (4, 3) corners of a surface, metres, y up; empty to erase.
        colour: of a line, 0..1.
    """

    op_id: str | int
    op: Op
    key: str
    points: NDArray[np.float64]
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0)


Message = Hello | Seen | Ping | Do | OfferSignal | MediaSignal
"""Texts that a client may send."""


def read_message(text: str) -> Message | None:
    """Return a client's message; None for a kind that is not known.

    Raises:
        MessageError: it is none.
        OpError: it is an operation with a field that is wrong.
    """
    fields = read_object(text)
    kind = fields.get("kind")
    if kind == "hello":
        name, log_seq = fields.get("name"), fields.get("log_seq")
        return Hello(
            _text(fields, "token"),
            None if name is None else clean_name(name),
            None if log_seq is None else _count(fields, "log_seq"),
        )
    if kind == "seen":
        return Seen(_count(fields, "version"))
    if kind == "ping":
        return Ping(_number(fields.get("t_us"), "t_us"))
    if kind == "do":
        return _read_do(fields)
    if not isinstance(kind, str):
        raise MessageError("kind: wanted a text")
    try:
        return read_signal(fields)
    except OfferError as error:
        raise MessageError(str(error)) from None


def read_object(text: str | bytes) -> dict[str, Any]:
    """Return the fields of a JSON object.

    Raises:
        MessageError: it is none.
    """
    try:
        value: Any = json.loads(text, parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        raise MessageError(f"no JSON: {type(error).__name__}") from None
    if not isinstance(value, dict):
        raise MessageError("wanted a JSON object")
    return cast(dict[str, Any], value)


def clean_name(value: object) -> str:
    """Return a name that can be shown and logged: printable, one line, 1..40 characters.

    Raises:
        MessageError: it is no text.
    """
    if not isinstance(value, str):
        raise MessageError("name: wanted a text")
    printable = "".join(c if c.isprintable() else " " for c in value[: 4 * MAX_NAME])
    return " ".join(printable.split())[:MAX_NAME].strip() or "somebody"


def _read_do(fields: dict[str, Any]) -> Do:
    op_id = fields.get("id")
    if isinstance(op_id, str) and _ID.fullmatch(op_id):
        known: str | int = op_id
    elif isinstance(op_id, int) and not isinstance(op_id, bool) and abs(op_id) <= MAX_COUNT:
        known = op_id
    else:
        raise MessageError("do: id: wanted a number or a short text")
    try:
        op = Op(_text(fields, "op"))
        if op is Op.UNDO:
            return Do(known, op, "", np.zeros((0, 3)))
        if op is Op.LINE:
            return Do(known, op, _key(fields, "line"), _points(fields), _colour(fields))
        return Do(known, op, _key(fields, "surface"), _corners(fields))
    except ValueError as error:  # MessageError is one
        raise OpError(str(error), op_id=known) from None


def _points(fields: dict[str, Any]) -> NDArray[np.float64]:
    given: object = fields.get("points")
    if given is None:
        return np.zeros((0, 3))
    if not isinstance(given, list):
        raise MessageError("points: wanted a list")
    points = cast(list[Any], given)
    if len(points) > MAX_POINTS:
        raise MessageError(f"points: {len(points)}, at most {MAX_POINTS}")
    return np.array([_point(p, "points") for p in points], dtype=np.float64).reshape(-1, 3)


def _corners(fields: dict[str, Any]) -> NDArray[np.float64]:
    given = fields.get("corners")
    if given is None or given == []:
        return np.zeros((0, 3))
    corners = cast(list[Any], given)
    if not isinstance(given, list) or len(corners) != 4:
        raise MessageError("corners: wanted 4 places, or none to remove the surface")
    return np.array([_point(p, "corners") for p in corners], dtype=np.float64)


def _point(value: object, field: str) -> list[float]:
    if not isinstance(value, list) or len(cast(list[Any], value)) != 3:
        raise MessageError(f"{field}: wanted places of 3 numbers")
    place = [_number(number, field) for number in cast(list[Any], value)]
    if any(abs(number) > MAX_ROOM_M for number in place):
        raise MessageError(f"{field}: a place is over {MAX_ROOM_M:g} m away")
    return place


def _colour(fields: dict[str, Any]) -> tuple[float, float, float]:
    value = fields.get("colour", [1.0, 1.0, 1.0])
    if not isinstance(value, list) or len(cast(list[Any], value)) != 3:
        raise MessageError("colour: wanted 3 numbers of 0..1")
    r, g, b = (_number(number, "colour") for number in cast(list[Any], value))
    if not all(0.0 <= part <= 1.0 for part in (r, g, b)):
        raise MessageError("colour: wanted 3 numbers of 0..1")
    return r, g, b


def _key(fields: dict[str, Any], field: str) -> str:
    key = _text(fields, field)
    if not _ID.fullmatch(key):
        raise MessageError(f"{field}: wanted 1..40 letters, digits, - _ .")
    return key


def _text(fields: dict[str, Any], field: str) -> str:
    value = fields.get(field)
    if not isinstance(value, str):
        raise MessageError(f"{field}: wanted a text")
    return value


def _count(fields: dict[str, Any], field: str) -> int:
    value = fields.get(field)
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value <= MAX_COUNT:
        raise MessageError(f"{field}: wanted a whole number of 0 or more")
    return value


def _number(value: object, field: str) -> float:
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not is_number or not abs(cast(float, value)) <= MAX_COUNT:
        raise MessageError(f"{field}: wanted a number")
    number = float(cast(float, value))
    if not math.isfinite(number):
        raise MessageError(f"{field}: wanted a number")
    return number


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(name)
