"""The metric world from whatever gives the scale: codes, a length, an object, an app or a guess."""

from __future__ import annotations

import numpy as np

from scenes.prepare.align.align import align
from scenes.prepare.align.alignment import Alignment
from scenes.prepare.align.by_length import align_by_length, picked_point
from scenes.prepare.align.by_object import align_by_object
from scenes.prepare.align.codes.anchors import find_anchors
from scenes.prepare.align.unmeasured import guessed_alignment, stated_alignment
from scenes.prepare.options import PrepareOptions
from scenes.prepare.progress import Progress
from scenes.prepare.reconstruction import Reconstruction


def metric_alignment(
    reconstruction: Reconstruction, options: PrepareOptions, progress: Progress
) -> Alignment:
    """The metric world from whatever gives the scale.

    Args:
        reconstruction: photos with poses and sparse points, in their own frame.
        options: which of it is given.
        progress: called while codes are looked for.

    Raises:
        ValueError: no code can be used, codes contradict each other, the length's ends are no
            points of the photos, or the object does not fit its boxes.
        Cancelled: from `progress`.
    """
    rng = np.random.default_rng(options.seed)
    if options.known_length is not None:
        length = options.known_length
        return align_by_length(
            reconstruction,
            picked_point(reconstruction, length.a_px),
            picked_point(reconstruction, length.b_px),
            length_m=length.metres,
            rng=rng,
        )
    if options.known_object is not None:
        return align_by_object(reconstruction, options.known_object, rng=rng)
    if options.sides_m is None:
        return (stated_alignment if options.metric_poses else guessed_alignment)(
            reconstruction, rng=rng
        )
    return align(
        reconstruction,
        find_anchors(reconstruction, progress=progress),
        sides_m=options.sides_m,
        world_from_codes={code.payload: code.world_from_code for code in options.known_codes},
        rng=rng,
    )


def alignment_in_words(alignment: Alignment) -> str:
    """One line for people."""
    if not alignment.anchors:
        return alignment.warnings[0] if alignment.warnings else "on a measured length or object"
    codes = ", ".join(
        f"{anchor.payload} ({len(anchor.views)} photos, {anchor.residual_mm:.1f} mm)"
        for anchor in alignment.anchors
    )
    return f"on {codes}"
