"""The metric world from whatever gives the scale: codes, a length, an object, an app or a guess."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from scenes.prepare.align.align import align
from scenes.prepare.align.alignment import Alignment
from scenes.prepare.align.by_length import align_by_length, picked_point
from scenes.prepare.align.by_object import align_by_object
from scenes.prepare.align.codes.anchors import find_anchors
from scenes.prepare.align.gravity import Gravity, find_gravity, standing_world
from scenes.prepare.options import PrepareOptions
from scenes.prepare.progress import Progress
from scenes.prepare.reconstruction import Reconstruction

CARRIED_HEIGHT_M = 1.5
"""How high people carry a phone while they film."""
HEIGHT_SIGMA = 0.25
"""Relative deviation of that guess."""
APP_SIGMA = 0.02
"""Relative deviation of the scale that a phone finds by its inertial sensors."""
TURN_SIGMA_RAD = 0.02
"""Deviation of up as estimated, radians about each axis."""
UPRIGHT = 0.7
"""Cosine to up from which on a camera's x axis gives no level direction."""
GUESSED_GROUPS = 2
"""As little as can be known: bounds on the error become wide."""


def guessed_alignment(reconstruction: Reconstruction, *, rng: np.random.Generator) -> Alignment:
    """Z up, the floor at 0, the cameras carried at 1.5 m, the origin below their middle.

    Args:
        reconstruction: photos with poses, and sparse points.
        rng: for the search of the floor.

    Raises:
        ValueError: there are no views.
    """
    gravity = find_gravity(reconstruction, rng=rng)
    eyes = np.stack([view.world_from_camera.translation for view in reconstruction.views])
    height = float(np.median(eyes @ gravity.up) - gravity.floor)
    warning = (
        "The unit is estimated: nothing in the photos gives it. The phone is taken to have been "
        f"carried {CARRIED_HEIGHT_M} m above the floor; lengths may be a quarter off. Measure one "
        "known length: in the studio, click its two ends in the room and type its metres "
        "(Preparation, Scale). Or film a printed code with the room and give its side."
    )
    scale = CARRIED_HEIGHT_M / height if height > 0 else 1.0
    return replace(
        _standing(reconstruction, gravity, scale, HEIGHT_SIGMA, (warning,)), is_guess=True
    )


def stated_alignment(reconstruction: Reconstruction, *, rng: np.random.Generator) -> Alignment:
    """Z up, the floor at 0, the scale as it is: the poses are said to be in metres.

    Args:
        reconstruction: photos with an app's poses, and sparse points.
        rng: for the search of the floor.

    Raises:
        ValueError: there are no views.
    """
    gravity = find_gravity(reconstruction, rng=rng)
    warning = (
        "The scale is that of the app that found the poses, which nothing checks; film a printed "
        "code and give its side to measure it."
    )
    return _standing(reconstruction, gravity, 1.0, APP_SIGMA, (warning,))


def _standing(
    reconstruction: Reconstruction,
    gravity: Gravity,
    scale: float,
    sigma: float,
    warnings: tuple[str, ...],
) -> Alignment:
    eyes = np.stack([view.world_from_camera.translation for view in reconstruction.views])
    # X is to the right of the first photo; where that points up, it was held sideways.
    axes = reconstruction.views[0].world_from_camera.rotation
    right = axes[:, 0] if abs(float(axes[:, 0] @ gravity.up)) < UPRIGHT else axes[:, 1]
    world_from_reconstruction = standing_world(gravity, eyes.mean(axis=0), right, scale)
    if gravity.floor_points == 0:
        warnings = (
            *warnings,
            "No floor was found either: up is taken from how the photos were held.",
        )
    return Alignment(
        world_from_reconstruction,
        np.diag([TURN_SIGMA_RAD**2] * 3 + [0.0] * 3 + [sigma**2]),
        (),
        gravity,
        GUESSED_GROUPS,
        world_from_reconstruction @ eyes[:1],
        0.0,
        warnings,
    )


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
