"""Base of all faults, and the places at which one can act.

A fault is a frozen dataclass that says how large it is at a moment; beside that it implements what
it does at one place: to the light (`LightFault`), on the way (`WayFault`), or what the rehearsal
asks it for (`Freeze`, `Bump`, `Occluder`, `Twins`, `HeadsetOff`).
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from sim.tables import Table

Picture = NDArray[np.uint8]
"""(H, W, 3) uint8 sRGB of one lens."""


@dataclass(frozen=True, slots=True)
class Stage:
    """The scenario's room and people, which faults may name.

    Attributes:
        objects: ids of the room's objects.
        people: ids of the local people.
        low: (x, y) of the room's lowest corner, metres.
        high: (x, y) of its highest.
    """

    objects: tuple[str, ...]
    people: tuple[str, ...]
    low: tuple[float, float]
    high: tuple[float, float]


LONGEST_S = 3600.0
"""A scenario's longest duration, seconds."""


@dataclass(frozen=True, slots=True)
class Span:
    """A part of a rehearsal, in seconds from its start.

    Attributes:
        from_s: first moment.
        to_s: the moment after it; infinite to the end.
    """

    from_s: float = 0.0
    to_s: float = math.inf

    def holds(self, t_s: float) -> bool:
        """Whether a moment is in it."""
        return self.from_s <= t_s < self.to_s

    @property
    def lasts_s(self) -> float:
        """How long it is."""
        return self.to_s - self.from_s


def read_span(table: Table) -> Span:
    """A span from `from_s` and either `to_s` or `lasts_s`; without these, the whole rehearsal.

    Raises:
        ScenarioError: a value is wrong, it ends before it begins, or both ends are given.
    """
    from_s = table.number("from_s", 0.0, low=0.0, high=LONGEST_S)
    to_s = table.optional_number("to_s", 0.0, LONGEST_S)
    lasts_s = table.optional_number("lasts_s", 0.0, LONGEST_S)
    if to_s is not None and lasts_s is not None:
        raise table.error("lasts_s", lasts_s, "either to_s or lasts_s, not both")
    if to_s is not None and to_s < from_s:
        raise table.error("to_s", to_s, f"a time from from_s = {from_s:g} on")
    if lasts_s is not None:
        return Span(from_s, from_s + lasts_s)
    return Span(from_s, math.inf if to_s is None else to_s)


class Fault(ABC):
    """Something that goes wrong; the same at the same moment, whatever happened before.

    Attributes:
        name: its key in `[faults]` and in the truth.
        sizes: the keys that say how large it is, each with its unit; the first is the truth's.
    """

    name: ClassVar[str]
    sizes: ClassVar[Mapping[str, str]]

    @classmethod
    @abstractmethod
    def read(cls, table: Table) -> Self | None:
        """One from its own table, or for numbers of `[faults]` itself from that; None without.

        Raises:
            ScenarioError: a value is wrong.
        """

    @abstractmethod
    def size_at(self, t_s: float) -> float:
        """How large it is at a moment, in the unit of its first size; 0 where it is not there."""

    def described(self) -> str:
        """Words for the report while it is there; empty for what only figures show."""
        return ""

    def misfit(self, stage: Stage) -> tuple[str, object, str] | None:
        """Return what doesn't fit the room: key, value and what is wanted; None if all does."""
        del stage
        return None


class LightFault(Fault):
    """A fault of lens or exposure: changes the picture before the sensor's noise is added."""

    @abstractmethod
    def seen(self, pictures: Sequence[Picture], t_s: float) -> tuple[Picture, ...]:
        """The pictures, one a lens, as this fault leaves them; asked only while it is there."""


@dataclass(frozen=True, slots=True)
class Passage:
    """How a frame gets from the camera to the session.

    Attributes:
        seq: frame counter.
        t_ns: true capture time, session clock.
        stamp_ns: the capture time that the camera reports.
        delay_ns: from capture to arrival.
        is_lost: whether it never arrives.
        is_posed: whether the camera's pose is known when it arrives.
    """

    seq: int
    t_ns: int
    stamp_ns: int
    delay_ns: int = 0
    is_lost: bool = False
    is_posed: bool = True


class WayFault(Fault):
    """A fault on the way from the camera: changes how, when or whether a frame arrives."""

    @abstractmethod
    def passed(self, passage: Passage, rng: np.random.Generator) -> Passage:
        """The passage of one frame with this fault; asked for every frame, in order."""


def misfit_of_object(key: str, object_id: str, stage: Stage) -> tuple[str, object, str] | None:
    """See `Fault.misfit`: the object must be one of the room's."""
    if object_id in stage.objects:
        return None
    return key, object_id, f"one of {', '.join(sorted(stage.objects))}"
