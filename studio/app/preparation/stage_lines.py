"""Progress lines of a preparation as stages."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal

StageState = Literal["running", "done", "failed"]

BEGUN = re.compile(r"(?P<name>[a-z][\w -]*?) …")
ON_ITS_WAY = re.compile(
    r"(?P<name>[a-z][\w -]*?) +(?P<share>\d+)%(, (?P<left>[^ ].*? (s|min)) left)?(  (?P<note>.*))?"
)
DONE = re.compile(r"(?P<name>[a-z][\w -]*?): (?P<spent>(\d+ min )?\d+ s)(, .*)?")
SPAN = re.compile(r"((?P<min>\d+) min )?(?P<s>\d+) s")


@dataclass(frozen=True, slots=True)
class StageLine:
    """One stage as far as it has come.

    Attributes:
        name: of the stage.
        state: how it is.
        done: share, 0..1.
        left_s: seconds that it will take, or None where that is not known yet.
        spent_s: seconds that it took; None before it has ended.
        note: what is going on.
    """

    name: str
    state: StageState = "running"
    done: float = 0.0
    left_s: float | None = None
    spent_s: float | None = None
    note: str = ""


def stages_of(lines: Iterable[str], *, has_failed: bool = False) -> tuple[StageLine, ...]:
    """The stages that lines of progress are about, in the order in which they began.

    Args:
        lines: of `studio.console.progress`, among others that are left out.
        has_failed: whether the program has ended with an error: the last stage was its place.
    """
    stages: dict[str, StageLine] = {}
    for line in lines:
        if (match := BEGUN.fullmatch(line)) is not None:
            stages[match["name"]] = StageLine(match["name"])
        elif (match := ON_ITS_WAY.fullmatch(line)) is not None and match["name"] in stages:
            stages[match["name"]] = StageLine(
                match["name"],
                done=min(int(match["share"]) / 100, 1.0),
                left_s=seconds_of(match["left"]),
                note=match["note"] or "",
            )
        elif (match := DONE.fullmatch(line)) is not None and match["name"] in stages:
            spent_s = seconds_of(match["spent"])
            stages[match["name"]] = StageLine(match["name"], "done", 1.0, 0.0, spent_s)
    if has_failed and stages:
        last = next(reversed(stages))
        stages[last] = replace(stages[last], state="failed", left_s=None)
    return tuple(stages.values())


def seconds_of(text: str | None) -> float | None:
    """Seconds of "12 s" or "3 min 05 s"; None of anything else."""
    match = SPAN.fullmatch(text or "")
    return None if match is None else 60.0 * int(match["min"] or 0) + int(match["s"])
