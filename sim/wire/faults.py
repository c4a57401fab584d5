"""Faults on the wire: which there are, as a person writes them, and the state at any moment."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, cast

from sim.faults.device import Bump
from sim.faults.fault import Fault, Span
from sim.faults.light import Exposure
from sim.timed_fault import (
    FaultError,
    FaultRange,
    TimedFault,
    check_count,
    fault_of_values,
    read_timed_fault,
)

NANOSECONDS = 1_000_000_000


class FaultKind(StrEnum):
    """Kinds of faults on the wire."""

    DELAY = "delay"
    JITTER = "jitter"
    LOSS = "loss"
    FREEZE = "freeze"
    BLACK_HOLE = "black_hole"
    HALF_OPEN = "half_open"
    RESTART = "restart"
    GARBAGE = "garbage"
    CLOCK_DRIFT = "clock_drift"
    BUMP = "bump"
    LIGHT = "light"


FILMED = frozenset({FaultKind.BUMP, FaultKind.LIGHT})
"""Faults that are drawn into the film instead of put on the wire."""


RANGES = {
    FaultKind.DELAY: FaultRange("s", 0.5, 0.0, 5.0, math.inf),
    FaultKind.JITTER: FaultRange("s", 0.1, 0.0, 2.0, math.inf),
    FaultKind.LOSS: FaultRange("", 0.05, 0.0, 1.0, math.inf),
    FaultKind.FREEZE: FaultRange("", 1.0, 1.0, 1.0, 3.0),
    FaultKind.BLACK_HOLE: FaultRange("", 1.0, 1.0, 1.0, 5.0),
    FaultKind.HALF_OPEN: FaultRange("", 1.0, 1.0, 1.0, 3.0),
    FaultKind.RESTART: FaultRange("", 1.0, 1.0, 1.0, 3.0),
    FaultKind.GARBAGE: FaultRange("bytes", 4096.0, 1.0, 65536.0, 0.2),
    FaultKind.CLOCK_DRIFT: FaultRange("ppm", 100.0, -10000.0, 10000.0, math.inf),
    FaultKind.BUMP: FaultRange("°", 2.0, 0.0, 10.0, math.inf),
    FaultKind.LIGHT: FaultRange("", 0.5, 0.0625, 16.0, 3.0),
}
"""Sizes: those that a receiver is likely to meet as usual ones, ten times as much as limits.
`delay` and `jitter` are limited by what an output holds back (`streaming/outbox.py`); `light` is
the factor by which there is more of it, within the exposure fault's ±4 EV."""

MAX_FAULTS = 1000
"""Faults in one schedule."""


@dataclass(frozen=True, slots=True)
class WireFault(TimedFault):
    """One fault; it begins so many seconds from the stream's beginning."""

    ranges = RANGES

    kind: FaultKind


@dataclass(frozen=True, slots=True)
class WireState:
    """State of the wire at one moment.

    Attributes:
        delay_s: every picture is sent that much later.
        jitter_s: and up to that much more, at random.
        loss: share of pictures (over UDP: of packets) that are never sent.
        frozen: the same picture is sent again and again.
        black_hole: the connection stays, but nothing is sent or read.
        vanished: the camera is gone without a word; its old connection is left open for good.
        away: the camera is switched off; it has closed its connections.
        garbage_bytes: random bytes before every picture.
    """

    delay_s: float = 0.0
    jitter_s: float = 0.0
    loss: float = 0.0
    frozen: bool = False
    black_hole: bool = False
    vanished: bool = False
    away: bool = False
    garbage_bytes: int = 0

    @property
    def is_on(self) -> bool:
        """Whether there is a camera that takes pictures."""
        return not (self.vanished or self.away)


class FaultSchedule:
    """All faults of one stream.

    Args:
        faults: in any order; those of the film are left out.

    Raises:
        FaultError: there are too many.
    """

    def __init__(self, faults: Iterable[WireFault] = ()) -> None:
        self._set(tuple(fault for fault in faults if fault.kind not in FILMED))

    def _set(self, faults: tuple[WireFault, ...]) -> None:
        check_count(len(faults), most=MAX_FAULTS)
        self.faults = tuple(sorted(faults, key=lambda fault: (fault.at_s, fault.kind)))
        self._drifts = [f for f in self.faults if f.kind is FaultKind.CLOCK_DRIFT]
        self._returns_s = sorted(f.end_s for f in self.faults if f.kind is FaultKind.RESTART)

    def add(self, fault: WireFault) -> None:
        """One more, while the camera streams; it begins after the moments that were asked about.

        Raises:
            FaultError: there are too many, or it is one of the film or needs pictures made before.
        """
        if fault.kind in FILMED or fault.kind is FaultKind.FREEZE:
            raise FaultError(f"fault {fault.kind}: give it when the camera is started")
        self._set((*self.faults, fault))

    def at(self, t_ns: int) -> WireState:
        """State of the wire, nanoseconds from the stream's beginning."""
        t_s = t_ns / NANOSECONDS
        there = [fault for fault in self.faults if fault.holds(t_s)]
        kinds = {fault.kind for fault in there}

        def largest(kind: FaultKind) -> float:
            return max((fault.size for fault in there if fault.kind is kind), default=0.0)

        return WireState(
            delay_s=largest(FaultKind.DELAY),
            jitter_s=largest(FaultKind.JITTER),
            loss=largest(FaultKind.LOSS),
            frozen=FaultKind.FREEZE in kinds,
            black_hole=FaultKind.BLACK_HOLE in kinds,
            vanished=FaultKind.HALF_OPEN in kinds,
            away=FaultKind.RESTART in kinds,
            garbage_bytes=round(largest(FaultKind.GARBAGE)),
        )

    def stamp_ns(self, t_ns: int) -> int:
        """A moment on the camera's own clock, which begins anew when the camera restarts."""
        t_s = t_ns / NANOSECONDS
        on_since_s = max((end for end in self._returns_s if end <= t_s), default=0.0)
        drift_s = sum(
            1e-6 * fault.size * _overlap(fault, on_since_s, t_s) for fault in self._drifts
        )
        return t_ns - round((on_since_s - drift_s) * NANOSECONDS)

    def boot(self, t_ns: int) -> int:
        """How often the camera has restarted by a moment."""
        return sum(end * NANOSECONDS <= t_ns for end in self._returns_s)

    def between(self, after_ns: int, until_ns: int) -> Sequence[tuple[WireFault, bool]]:
        """Faults that begin (True) or end (False) after one moment and up to another, in order."""
        marks = [(fault.at_s, True, fault) for fault in self.faults]
        marks += [(fault.end_s, False, fault) for fault in self.faults]
        inside = [mark for mark in marks if after_ns < mark[0] * NANOSECONDS <= until_ns]
        inside.sort(key=lambda mark: (mark[0], mark[1]))
        return [(fault, begins) for _, begins, fault in inside]


def film_faults(faults: Iterable[WireFault]) -> tuple[Fault, ...]:
    """Faults drawn into the film, as the rehearsal's own."""
    found: list[Fault] = []
    for fault in faults:
        if fault.kind is FaultKind.BUMP:
            found.append(Bump(fault.at_s, fault.size, 0.0))
        elif fault.kind is FaultKind.LIGHT:
            span = Span(fault.at_s, fault.end_s)
            found.append(Exposure(math.log2(fault.size), span))
    return tuple(found)


def _overlap(fault: WireFault, from_s: float, to_s: float) -> float:
    return max(0.0, min(fault.end_s, to_s) - max(fault.at_s, from_s))


def read_fault(text: str) -> WireFault:
    """Return the fault of a text, see `read_timed_fault`.

    Raises:
        FaultError: it is none; says what is wanted.
    """
    return read_timed_fault(WireFault, text)


def read_faults_file(path: Path) -> tuple[WireFault, ...]:
    """The faults of a TOML file: tables `[[fault]]` with `kind`, `at`, `for` and `size`.

    Raises:
        FaultError: one is none, or the file is no TOML.
        OSError: it cannot be read.
    """
    try:
        values = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise FaultError(f"{path}: no TOML ({error})") from None
    tables: Any = values.pop("fault", [])
    if values or not isinstance(tables, list):
        raise FaultError(f"{path}: {', '.join(values) or 'fault'}, wanted tables [[fault]] only")
    faults: list[WireFault] = []
    for number, table in enumerate(cast("list[Any]", tables)):
        where = f"{path}: fault[{number}]"
        if not isinstance(table, Mapping):
            raise FaultError(f"{where}: {table!r}, wanted a table")
        given = dict(cast("Mapping[str, Any]", table))
        kind = given.pop("kind", "")
        faults.append(fault_of_values(WireFault, kind, values=given, source=where))
    return tuple(faults)
