"""Fields of forms: the keys of every action and fault, with unit and range."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Kind = Literal["number", "object", "person", "place", "place3", "line", "colour", "choice", "count"]


@dataclass(frozen=True, slots=True)
class Field:
    """One key of a table.

    Attributes:
        key: as it is written.
        title: what people read.
        kind: what is asked for.
        unit: of a number; empty without one.
        low: least number.
        high: largest number.
        usual: what a new one begins with; None if the key may be missing.
        choices: of a choice.
    """

    key: str
    title: str
    kind: Kind = "number"
    unit: str = ""
    low: float = 0.0
    high: float = 600.0
    usual: float | str | None = None
    choices: tuple[str, ...] = ()


_SECONDS = Field("seconds", "for", unit="s", usual=2.0)
_OBJECT = Field("object", "object", "object", usual="")
_TO = Field("to", "to", "place", usual="")
_TURN = Field("turn_deg", "turned by", unit="°", low=-180.0, high=180.0)
_FACE = Field("face_deg", "then facing", unit="°", low=-360.0, high=360.0)

ACTION_FIELDS: Mapping[str, tuple[Field, ...]] = {
    "walk": (_TO, _FACE),
    "stand": (_SECONDS,),
    "push": (_OBJECT, _TO, Field("speed_m_s", "speed", unit="m/s", low=0.05, high=1.5)),
    "turn": (_OBJECT, Field("by_deg", "by", unit="°", low=-180.0, high=180.0, usual=45.0)),
    "carry": (_OBJECT, _TO, _TURN),
    "put": (_OBJECT, _TO, Field("height_m", "height", unit="m", high=2.0), _TURN),
    "hide": (_OBJECT, _SECONDS),
    "sit": (
        Field("object", "object", "object"),
        Field("to", "or at", "place"),
        _SECONDS,
        Field("seat_height_m", "seat height", unit="m", low=0.15, high=0.8),
        _FACE,
    ),
    "hand_over": (_OBJECT, Field("to", "to", "person", usual="")),
    "receive": (_OBJECT,),
    "point": (Field("object", "object", "object"), Field("at", "or at", "place3"), _SECONDS),
    "draw": (
        Field("points", "line", "line", usual=""),
        Field("speed_m_s", "speed", unit="m/s", low=0.02, high=3.0),
        Field("colour", "colour", "colour"),
    ),
}
"""By action, in the order of a form; ranges are the reader's (`sim.scenarios.action_tables`)."""

_FROM = Field("from_s", "from", unit="s", high=3600.0)
_UNTIL = Field("to_s", "until", unit="s", high=3600.0)

FAULT_FIELDS: Mapping[str, tuple[Field, ...]] = {
    "drop_share": (Field("drop_share", "frames lost", unit="share", high=0.9, usual=0.1),),
    "delay_ms": (
        Field("delay_ms", "delay", unit="ms", high=10_000.0, usual=150.0),
        Field("jitter_ms", "spread", unit="ms", high=1_000.0, usual=6.0),
    ),
    "bump": (
        Field("bump_s", "at", unit="s", high=3600.0, usual=1.0),
        Field("bump_deg", "turned by", unit="°", high=10.0, usual=0.6),
        Field("bump_cm", "shifted by", unit="cm", high=30.0, usual=0.5),
    ),
    "clock_drift_ppm": (
        Field("clock_drift_ppm", "drift", unit="ppm", low=-5e3, high=5e3, usual=100.0),
    ),
    "blur": (
        Field("px", "spread", unit="px", high=50.0, usual=2.0),
        Field("kind", "kind", "choice", choices=("defocus", "motion")),
        Field("angle_deg", "direction", unit="°", low=-360.0, high=360.0),
        _FROM,
        _UNTIL,
    ),
    "burst": (
        Field("lasts_s", "lasts", unit="s", high=60.0, usual=0.5),
        Field("every_s", "every", unit="s", low=0.1, high=3600.0, usual=3.0),
        _FROM,
    ),
    "exposure": (Field("ev", "off by", unit="EV", low=-4.0, high=4.0, usual=1.0), _FROM, _UNTIL),
    "freeze": (
        Field("from_s", "from", unit="s", high=3600.0, usual=1.0),
        Field("to_s", "until", unit="s", high=3600.0, usual=2.0),
    ),
    "headset_off": (Field("person", "person", "person", usual=""), _FROM, _UNTIL),
    "hidden_code": (
        Field("from_s", "from", unit="s", high=3600.0, usual=1.0),
        Field("to_s", "until", unit="s", high=3600.0, usual=2.0),
    ),
    "occluder": (
        _OBJECT,
        Field("share", "hidden", unit="share", high=0.9, usual=0.5),
        _FROM,
        _UNTIL,
    ),
    "twins": (
        _OBJECT,
        Field("at", "first at", "place", usual=""),
        Field("count", "copies", "count", unit="copies", high=8.0, usual=1.0),
        Field("yaw_deg", "facing", unit="°", low=-360.0, high=360.0),
        Field("step", "apart", "place"),
    ),
    "white_balance": (
        Field("warmth", "redder by", unit="share", low=-0.6, high=1.5, usual=0.3),
        _FROM,
        _UNTIL,
    ),
}
"""By fault; ranges are the readers' (`sim.faults`)."""

FAULT_TITLES: Mapping[str, str] = {
    "drop_share": "Lost frames",
    "delay_ms": "Delay",
    "bump": "Camera bumped",
    "clock_drift_ppm": "Clock drift",
    "blur": "Blur",
    "burst": "Frames lost in a row",
    "exposure": "Exposure",
    "freeze": "Frozen picture",
    "headset_off": "Headset off",
    "hidden_code": "Camera's code hidden",
    "occluder": "Object covered",
    "twins": "Unscanned copies",
    "white_balance": "White balance",
}
"""Titles."""


def fault_title(name: str) -> str:
    """Title of a fault; one of a plug-in has its own name."""
    return FAULT_TITLES.get(name, name)


def new_values(
    fields: tuple[Field, ...],
    *,
    objects: tuple[str, ...],
    people: tuple[str, ...],
    x: float,
    y: float,
) -> dict[str, object]:
    """The values that a new action or fault begins with.

    Args:
        fields: of its kind.
        objects: ids of the room's objects.
        people: ids of the scenario's people.
        x: of places, metres.
        y: of places, metres.
    """
    found: dict[str, object] = {}
    for field in fields:
        if field.usual is None:
            continue
        match field.kind:
            case "object":
                found[field.key] = objects[0] if objects else "object-1"
            case "person":
                found[field.key] = people[-1] if people else "person-1"
            case "place":
                found[field.key] = [x, y]
            case "line":
                found[field.key] = [[x, y, 0.01], [x + 0.5, y, 0.01]]
            case "count":
                found[field.key] = int(field.usual)
            case _:
                found[field.key] = field.usual
    if fields == ACTION_FIELDS["sit"] or fields == ACTION_FIELDS["point"]:
        found = {"object": objects[0] if objects else "object-1", **found}
    return found
