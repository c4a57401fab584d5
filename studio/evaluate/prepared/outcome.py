"""What a preparation came to, as JSON beside its report: for windows and other programs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from studio.evaluate.prepared.verdict import is_unit_estimated, verdict_of

if TYPE_CHECKING:
    from scenes.prepare.pipeline import Prepared

OUTCOME = "outcome.json"
"""In the work folder."""

EXTENT_PERCENT = (1.0, 99.0)
"""Of the splats, between which a room's size is measured: some lie far out behind windows."""


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
