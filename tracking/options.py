"""The settings of the default tracker that a user may change, also while it runs."""

from __future__ import annotations

from dataclasses import dataclass, fields

SEARCH_MS = 30.0
"""Most time in ms that a search takes of one frame, however slow the stream: half of the promised
latency of 60 ms."""

SEARCH_MS_RANGE = (1.0, 1000.0)
"""Least and most milliseconds a frame that a user may give to the search: below, no step of it
fits; above, no stream is followed."""


@dataclass(frozen=True, slots=True)
class TrackerOptions:
    """Settings of the tracker.

    Attributes:
        calibrate: refine the camera's pose against the room's splats whenever the camera moved.
        texture: use the objects' inner colours as well as their contours.
        recover: search for objects that are not where the scene has them.
        search_ms: most time of one frame that this search may use, ms.

    Raises:
        ValueError: `search_ms` is out of `SEARCH_MS_RANGE`.
    """

    calibrate: bool = True
    texture: bool = True
    recover: bool = True
    search_ms: float = SEARCH_MS

    def __post_init__(self) -> None:
        low, high = SEARCH_MS_RANGE
        if not low <= self.search_ms <= high:
            raise ValueError(f"search_ms = {self.search_ms!r}, wanted {low:g} to {high:g} ms")


def options_text(options: TrackerOptions) -> str:
    """The settings as words of a recording, such as `calibrate=on … search_ms=30.0`."""
    values = ((field.name, getattr(options, field.name)) for field in fields(options))
    return " ".join(f"{name}={_word(value)}" for name, value in values)


def options_from_text(text: str) -> TrackerOptions:
    """Inverse of `options_text`; what is not named is as usual.

    Raises:
        ValueError: a setting is unknown, or has no such value.
    """
    usual = TrackerOptions()
    values: dict[str, bool | float] = {}
    for word in text.split():
        name, _, value = word.partition("=")
        if name not in {field.name for field in fields(usual)}:
            raise ValueError(f"the tracker has no setting {name!r}")
        values[name] = _value(name, value, getattr(usual, name))
    return TrackerOptions(**values)  # type: ignore[arg-type]  # each has its own kind: see _value


def _word(value: bool | float) -> str:
    return {True: "on", False: "off"}[value] if isinstance(value, bool) else repr(float(value))


def _value(name: str, word: str, usual: bool | float) -> bool | float:
    if not isinstance(usual, bool):
        return float(word)
    if word not in ("on", "off"):
        raise ValueError(f"{name} = {word!r}, wanted on or off")
    return word == "on"
