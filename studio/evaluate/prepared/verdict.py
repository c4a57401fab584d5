"""What a preparation came to, in one line and a few notes: for the report and for the terminal."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scenes.prepare.pipeline import Prepared

GOOD_PSNR_DB = 24.0
"""Below this, views from between the photos look blurred or wrong at first sight."""
PREVIEW_PSNR_DB = 20.0
"""From here on a preview shows the room."""
FEW_STEPS, WANTED_STEPS = 600, 1500
PLACED_SHARE = 0.8
LEAST_VIEWS_FOR_ROOM = 20


@dataclass(frozen=True, slots=True)
class Verdict:
    """What came out.

    Attributes:
        good: nothing is wrong with it.
        headline: in one line.
        notes: what to mind, in whole sentences.
    """

    good: bool
    headline: str
    notes: tuple[str, ...]


def verdict_of(prepared: Prepared) -> Verdict:
    """Whether the room can be worked with, and what is wrong with it."""
    faults = [
        fault for fault in (_similarity(prepared), _places(prepared), _scale(prepared)) if fault
    ]
    notes = [note for _, note in faults if note]
    known = (*prepared.sfm.advice, *prepared.alignment.warnings)
    headline = "The room is ready"
    if faults:
        headline += ", but " + _listed([short for short, _ in faults])
    return Verdict(not faults, headline, (*notes, *known))


def preview_min(prepared: Prepared) -> float:
    """Minutes from the start to the first picture that shows the room; nan if there was none."""
    before = 0.0
    for stage in prepared.package.stages:
        if stage.name == "training":
            break
        before += stage.seconds or 0.0
    shown = [
        moment.seconds
        for moment in prepared.training.history
        if moment.psnr_db is not None and moment.psnr_db >= PREVIEW_PSNR_DB
    ]
    return (before + shown[0]) / 60 if shown else math.nan


def _similarity(prepared: Prepared) -> tuple[str, str] | None:
    training = prepared.training
    quality = training.psnr_db
    if not quality < GOOD_PSNR_DB:
        return None
    steps = training.history[-1].iteration if training.history else 0
    if 0 < steps < FEW_STEPS:
        return (
            f"it is hardly trained ({quality:.1f} dB)",
            f"The training came to {steps} steps only, so views kept aside are drawn at "
            f"{quality:.1f} dB: the machine was busy or is slow. Prepare again with --steps "
            f"{WANTED_STEPS}, which takes as long as it takes; the stages before are kept.",
        )
    return (
        f"it looks poor from new places ({quality:.1f} dB)",
        f"Views kept aside are drawn at {quality:.1f} dB, good is {GOOD_PSNR_DB:.0f} or more: the "
        "room looks right near the photos and blurred or wrong between them. Take more photos, "
        "half a metre apart rather than in steps of metres, and let nothing move meanwhile; or "
        "train longer with --quality fine.",
    )


def _places(prepared: Prepared) -> tuple[str, str] | None:
    placed = len(prepared.sfm.placed)
    count = placed + len(prepared.sfm.failed)
    if placed < PLACED_SHARE * count:
        # What to film again is among the advice of structure from motion.
        return f"only {placed} of {count} pictures found their place", ""
    if placed < LEAST_VIEWS_FOR_ROOM:
        return (
            f"it is made of {placed} pictures only",
            f"{placed} pictures show little of a room: film {LEAST_VIEWS_FOR_ROOM} or more, all "
            "the way round.",
        )
    return None


def _scale(prepared: Prepared) -> tuple[str, str] | None:
    scale, sigma = prepared.alignment.metres_per_unit()
    # The alignment's own warnings say what to do about it.
    return ("its scale is uncertain", "") if sigma > 0.1 * scale else None


def _listed(parts: list[str]) -> str:
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"
