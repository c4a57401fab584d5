"""State of somebody's headset, as its browser says it: worn or not, pictures a second, battery."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from devices.hub.fields import MessageError, read_number
from devices.hub.roles import Person

MAX_MODEL = 40
"""Characters of a model's name, as of a person's; more are cut off."""

MAX_HZ = 1_000.0
"""Pictures a second beyond which a page does not count: far above any display."""


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


@dataclass(frozen=True, slots=True)
class PageHeadset:
    """A headset whose wearer has joined by the page.

    Attributes:
        person: the wearer, with the round trip to them.
        said: newest of its page.
        said_age_s: time since it came.
        body_age_s: since the wearer's newest head and hands; None before the first.
    """

    person: Person
    said: DeviceSaid
    said_age_s: float
    body_age_s: float | None


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
