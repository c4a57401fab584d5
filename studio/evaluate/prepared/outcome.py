"""What a preparation came to, as JSON beside its report: for windows and other programs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from studio.evaluate.prepared.verdict import is_unit_estimated, verdict_of

if TYPE_CHECKING:
    from scenes.prepare.pipeline import Prepared

OUTCOME = "outcome.json"
"""In the work folder."""


def outcome_of(prepared: Prepared) -> dict[str, Any]:
    """Codes with their residuals, scale, size and verdict; plain values."""
    verdict = verdict_of(prepared)
    scale, sigma = prepared.alignment.metres_per_unit()
    means = prepared.package.room.means
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
        "low_m": [float(x) for x in means.min(axis=0)],
        "high_m": [float(x) for x in means.max(axis=0)],
        "photos_placed": len(prepared.sfm.placed),
        "photos_failed": list(map(str, prepared.sfm.failed)),
        "good": verdict.good,
        "unit_estimated": is_unit_estimated(prepared),
        "headline": verdict.headline,
        "notes": list(verdict.notes),
    }
