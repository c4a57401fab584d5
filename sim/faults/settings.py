"""The faults of a scenario: which there are, how they are read, and which are there when."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

from scenes.mesh import PhysicalRoom
from sim.faults.device import Bump, Freeze, HeadsetOff
from sim.faults.fault import Fault, Stage
from sim.faults.light import Blur, Exposure, WhiteBalance
from sim.faults.occluder import Occluder
from sim.faults.twins import Twins
from sim.faults.way import Burst, ClockDrift, Delay, HiddenCode, Loss
from sim.tables import ScenarioError, Table

NUMBERS: tuple[type[Fault], ...] = (Loss, Delay, Bump, ClockDrift)
"""Faults whose keys stand in `[faults]` itself. Loss is drawn before delay from one generator."""

LINES: tuple[type[Fault], ...] = (
    Blur,
    Burst,
    Exposure,
    Freeze,
    HeadsetOff,
    HiddenCode,
    Occluder,
    Twins,
    WhiteBalance,
)
"""Faults that are a table of their own, or several, under their name in `[faults]`."""

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Faults:
    """Everything that goes wrong in one rehearsal.

    Attributes:
        each: the faults, those of one kind in the order of the file.
    """

    each: tuple[Fault, ...] = (Loss(), Delay())

    def of(self, kind: type[T]) -> tuple[T, ...]:
        """Those of one kind, or of one place such as `LightFault`."""
        return tuple(fault for fault in self.each if isinstance(fault, kind))

    def at(self, kind: type[T], t_s: float) -> tuple[T, ...]:
        """The same, as far as they are there at a moment."""
        return tuple(f for f in self.each if isinstance(f, kind) and f.size_at(t_s))

    def sizes(self, t_s: float) -> Mapping[str, float]:
        """Sizes by name of all that are there at a moment; of several of a kind, the largest."""
        found: dict[str, float] = {}
        for fault in self.each:
            size = fault.size_at(t_s)
            if size and abs(size) >= abs(found.get(fault.name, 0.0)):
                found[fault.name] = size
        return found

    def described(self, t_s: float) -> Mapping[str, None]:
        """The words of all that are there at a moment, in order, each once."""
        words = (fault.described() for fault in self.each if fault.size_at(t_s))
        return {text: None for text in words if text}

    def check(self, room: PhysicalRoom, people: tuple[str, ...], *, source: str) -> None:
        """Refuse what doesn't fit a room.

        Args:
            room: whose objects may be named.
            people: ids of the scenario's local people.
            source: the scenario's file, for messages.

        Raises:
            ScenarioError: a fault names an object, person or place that isn't there.
        """
        (low_x, low_y), (high_x, high_y) = room.footprint_m.tolist()
        objects = tuple(item.object_id for item in room.objects)
        stage = Stage(objects, people, (low_x, low_y), (high_x, high_y))
        for fault in self.each:
            wrong = fault.misfit(stage)
            if wrong is not None:
                key, value, wanted = wrong
                raise ScenarioError(
                    f"{source}: faults.{fault.name}.{key} = {value!r}, wanted {wanted}"
                )


def read_faults(table: Table, *, more: Sequence[type[Fault]] = ()) -> Faults:
    """The faults of a `[faults]` table.

    Args:
        table: as it is written.
        more: kinds beside `LINES`, such as those of plug-ins; they come last.

    Raises:
        ScenarioError: a key or value is wrong, or one of `more` raises.
    """
    numbers = (kind.read(table) for kind in NUMBERS)
    lines = [kind.read(line) for kind in LINES for line in table.table_or_tables(kind.name)]
    for kind in more:
        for line in table.table_or_tables(kind.name):
            try:
                lines.append(kind.read(line))
            except ScenarioError:
                raise
            except Exception as error:  # it may be of any kind: it is somebody else's
                words = f"{type(error).__name__}: {error}"
                raise table.error(kind.name, kind.__name__, f"one that reads ({words})") from error
    faults = Faults(tuple(fault for fault in (*numbers, *lines) if fault is not None))
    table.done()
    return faults


def changes_in_words(before: Mapping[str, None], now: Mapping[str, None]) -> list[str]:
    """The faults that have come and those that have gone, of what `Faults.described` gave."""
    begun = [words for words in now if words not in before]
    return begun + [f"no more: {words}" for words in before if words not in now]
