"""A world for photos that nothing measures: up and floor are found, the scale is guessed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from scenes.prepare.align.alignment import Alignment
from scenes.prepare.align.gravity import Gravity, find_gravity, standing_world
from scenes.prepare.reconstruction import Reconstruction

CARRIED_HEIGHT_M = 1.5
"""How high people carry a phone while they film."""
HEIGHT_SIGMA = 0.25
"""Relative deviation of that guess."""
APP_SIGMA = 0.02
"""Relative deviation of the scale that a phone finds by its inertial sensors."""
TURN_SIGMA_RAD = 0.02
UPRIGHT = 0.7
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
