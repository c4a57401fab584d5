"""Whether a preparation is good, and why: in a line and notes for people, as JSON for programs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from scenes.prepare.train.trainer import PRESETS

if TYPE_CHECKING:
    from scenes.prepare.pipeline import Prepared

OUTCOME = "outcome.json"
"""Name of the JSON file of `outcome_of`, in the work folder."""

EXTENT_PERCENT = (1.0, 99.0)
"""Of the splats, between which a room's size is measured: some lie far out behind windows."""

GOOD_PSNR_DB = 28.0
"""dB, mean over the views kept aside, from which on a room is good. Photos that are shrunk to a
quarter of their size and enlarged again have 28 dB against themselves in the built-in `desk` and
30 dB in a foreign room (medians at the sizes that are trained on), at an eighth 25 and 26 dB: what
is below has lost more than three quarters of the photos' sharpness."""
POOR_VIEW_DB = 20.0
"""dB; a view drawn worse than this shows something else than its photo: at 20 dB the error's root
mean square is a tenth of the way from black to white."""
POOR_VIEWS_SHARE = 0.1
"""Of the views kept aside. More that are poor are no accident of one photo: a part of the room is
missing, which a mean over all views hides (25 dB with three views of twelve at 14 to 17 dB)."""
PREVIEW_PSNR_DB = 20.0
"""From here on a preview shows the room."""
PLACED_SHARE = 0.8
MIN_VIEWS_FOR_ROOM = 20
MAX_NAMED = 3
"""Poor views named in a note: enough to know where to film again."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """Judgement of a preparation.

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
    not_read = prepared.capture.not_read()
    known = (*((not_read,) if not_read else ()), *prepared.capture.notes, *known)
    headline = "The room is ready"
    if is_unit_estimated(prepared):
        headline = "The room is ready, its unit is estimated: measure one known length in it"
    if faults:
        headline = "The room is not good yet: " + _listed([short for short, _ in faults])
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
    """Return the fault in how views kept aside are drawn; nan, of none kept aside, says nothing."""
    training = prepared.training
    quality = training.psnr_db
    poor = [score for score in training.held_out if score.psnr_db < POOR_VIEW_DB]
    is_poor_mean = quality < GOOD_PSNR_DB
    if not is_poor_mean and len(poor) <= POOR_VIEWS_SHARE * len(training.held_out):
        return None
    steps = training.history[-1].iteration if training.history else 0
    wanted = PRESETS["default"].iterations or 0
    if is_poor_mean and 0 < steps < wanted:
        return (
            f"it is hardly trained ({quality:.1f} dB after {steps:,} steps)",
            f"The training came to {steps:,} steps only, so views kept aside are drawn at "
            f"{quality:.1f} dB, good is {GOOD_PSNR_DB:.0f} or more. Prepare again with --steps "
            f"{wanted}, which takes as long as it takes; the stages before are kept.",
        )
    if poor:
        names = ", ".join(score.view for score in poor[:MAX_NAMED])
        return (
            f"it looks wrong from {len(poor)} of {len(training.held_out)} new places",
            f"Views kept aside are drawn at {quality:.1f} dB, {len(poor)} of them below "
            f"{POOR_VIEW_DB:.0f} ({names}): what they show is missing or elsewhere. Take more "
            "photos of it, half a metre apart rather than turning on the spot.",
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
    if placed < MIN_VIEWS_FOR_ROOM:
        return (
            f"it is made of {placed} pictures only",
            f"{placed} pictures show little of a room: film {MIN_VIEWS_FOR_ROOM} or more, all "
            "the way round.",
        )
    return None


def is_unit_estimated(prepared: Prepared) -> bool:
    """Whether nothing that was given says how long a metre is; a measured length mends it later."""
    return prepared.alignment.is_guess


def _scale(prepared: Prepared) -> tuple[str, str] | None:
    if is_unit_estimated(prepared):
        return None
    scale, sigma = prepared.alignment.metres_per_unit()
    # The alignment's own warnings say what to do about it.
    return ("its scale is uncertain", "") if sigma > 0.1 * scale else None


def _listed(parts: list[str]) -> str:
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"


def outcome_of(prepared: Prepared) -> dict[str, Any]:
    """Codes with their residuals, scale, size and verdict; plain values."""
    verdict = verdict_of(prepared)
    scale, sigma = prepared.alignment.metres_per_unit()
    means = prepared.package.room.means
    low, high = np.percentile(means, EXTENT_PERCENT, axis=0, method="nearest")
    return {
        "codes": [
            {
                "payload": anchor.payload,
                "side_m": anchor.side_m,
                "photos": len(anchor.views),
                "residual_px": anchor.residual_px,
                "residual_mm": anchor.residual_mm,
            }
            for anchor in prepared.alignment.anchors
        ],
        "metres_per_unit": scale,
        "scale_sigma_share": sigma / scale,
        "splats": len(prepared.package.room),
        "low_m": low.tolist(),
        "high_m": high.tolist(),
        "photos_placed": len(prepared.sfm.placed),
        "photos_failed": list(map(str, prepared.sfm.failed)),
        "good": verdict.good,
        "unit_estimated": is_unit_estimated(prepared),
        "headline": verdict.headline,
        "notes": list(verdict.notes),
    }
