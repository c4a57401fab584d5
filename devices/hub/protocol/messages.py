"""Text messages of people, read and checked: hello, seen, ping, and what they do."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from devices.hub.entities.drawn import Drawn
from devices.hub.entities.reading import read_drawn, read_key, read_person
from devices.hub.media.offer import OfferError
from devices.hub.media.signals import MediaSignal, OfferSignal, read_signal
from devices.hub.protocol.fields import (
    MessageError,
    read_count,
    read_label,
    read_number,
    read_object,
    read_text,
)
from devices.hub.roles import Op

MAX_TEXT_BYTES = 128 * 1024
"""Length of a text: a line of 1,000 points as browsers print doubles, and as much again."""

MAX_NAME = 40
"""Characters of a person's name."""


class OpError(ValueError):
    """An operation that cannot be done as it was asked for; says why.

    Args:
        why: in words for the person.
        op_id: the client's name of it, where it could be read.
    """

    def __init__(self, why: str, *, op_id: str | int | None = None) -> None:
        super().__init__(why)
        self.op_id = op_id


MAX_MODEL = 40
"""Characters of a model's name, as of a person's; more are cut off."""

MAX_HZ = 1_000.0
"""Pictures a second beyond which a page does not count: far above any display."""


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
        drawn: what it is to become, its key the client's own; of a gift only its name matters; None
            of an undo.
        drag: the client's name of operations that are undone as one; None where it gives none.
        to: id of the person who is given a primitive; empty of all else.
    """

    op_id: str | int
    op: Op
    drawn: Drawn | None = None
    drag: str | int | None = None
    to: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Wish:
    """An operation on a shape, by its name in full, and who asks their site's room for it."""

    person_id: str
    do: Do


class Immersion(StrEnum):
    """Way in which a headset shows the room."""

    NONE = "none"
    VR = "vr"
    AR = "ar"


@dataclass(frozen=True, slots=True)
class DeviceSaid:
    """A headset as its page says it.

    Attributes:
        model: as its browser names it; empty where it does not.
        immersion: whether the page is beside the wearer, around them, or over the real room.
        is_worn: whether it is worn and knows where it is; false while it is not immersive.
        rate_hz: pictures a second; None before they were counted.
        battery_percent: None where the browser does not say it.
        is_charging: whether it is charged; false where that is not known.
    """

    model: str
    immersion: Immersion
    is_worn: bool
    rate_hz: float | None
    battery_percent: float | None
    is_charging: bool


Message = Hello | Seen | Ping | Do | DeviceSaid | OfferSignal | MediaSignal
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
            read_text(fields, "token"),
            None if name is None else clean_name(name),
            None if log_seq is None else read_count(fields, "log_seq"),
        )
    if kind == "seen":
        return Seen(read_count(fields, "version"))
    if kind == "ping":
        return Ping(read_number(fields.get("t_us"), "t_us"))
    if kind == "do":
        return read_do(fields)
    if kind == "device":
        return read_device(fields)
    if not isinstance(kind, str):
        raise MessageError("kind: wanted a text")
    try:
        return read_signal(fields)
    except OfferError as error:
        raise MessageError(str(error)) from None


def read_device(fields: dict[str, Any]) -> DeviceSaid:
    """Return what a page says of its headset.

    Raises:
        MessageError: a field is wrong.
    """
    model = fields.get("model", "")
    if not isinstance(model, str):
        raise MessageError("model: wanted a text")
    try:
        immersion = Immersion(fields.get("immersion"))
    except ValueError:
        wanted = ", ".join(Immersion)
        raise MessageError(f"immersion: wanted one of {wanted}") from None
    battery = _optional(fields, "battery", limit=100.0)
    return DeviceSaid(
        "".join(letter for letter in model[:MAX_MODEL] if letter.isprintable()).strip(),
        immersion,
        _is_true(fields, "worn"),
        _optional(fields, "hz", limit=MAX_HZ),
        battery,
        _is_true(fields, "charging"),
    )


def clean_name(value: object) -> str:
    """Return a name that can be shown and logged: printable, one line, 1..40 characters.

    Raises:
        MessageError: it is no text.
    """
    if not isinstance(value, str):
        raise MessageError("name: wanted a text")
    printable = "".join(c if c.isprintable() else " " for c in value[: 4 * MAX_NAME])
    return " ".join(printable.split())[:MAX_NAME].strip() or "somebody"


def read_do(fields: dict[str, Any]) -> Do:
    """Return an operation.

    Raises:
        MessageError: it has no name.
        OpError: a field is wrong.
    """
    op_id = read_label(fields.get("id"))
    if op_id is None:
        raise MessageError("do: id: wanted a number or a short text")
    try:
        op, drag = Op(read_text(fields, "op")), read_label(fields.get("drag"))
        if drag is None and fields.get("drag") is not None:
            raise MessageError("drag: wanted a number or a short text")
        if op is Op.GIVE:
            given = Drawn(Op.PRIMITIVE, read_key(fields, "primitive"), "")
            return Do(op_id, op, given, to=read_person(fields, "to"))
        return Do(op_id, op, None if op is Op.UNDO else read_drawn(op, fields), drag)
    except ValueError as error:  # MessageError is one
        raise OpError(str(error), op_id=op_id) from None


def _optional(fields: dict[str, Any], field: str, *, limit: float) -> float | None:
    value = fields.get(field)
    if value is None:
        return None
    number = read_number(value, field)
    if not 0.0 <= number <= limit:
        raise MessageError(f"{field}: {number:g}, wanted 0..{limit:g}")
    return number


def _is_true(fields: dict[str, Any], field: str) -> bool:
    value = fields.get(field, False)
    if not isinstance(value, bool):
        raise MessageError(f"{field}: wanted true or false")
    return value
