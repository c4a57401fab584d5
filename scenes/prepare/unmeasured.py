"""A world for photos that nothing measures: up and floor are found, the scale is guessed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scenes.prepare.alignment import Alignment
from scenes.prepare.gravity import find_gravity
from scenes.prepare.reconstruction import Reconstruction
from scenes.prepare.similarity import Similarity

CARRIED_HEIGHT_M = 1.5
"""How high people carry a phone while they film."""
HEIGHT_SIGMA = 0.25
"""Relative deviation of that guess."""
TURN_SIGMA_RAD = 0.02

FloatArray = NDArray[np.float64]


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
    scale = CARRIED_HEIGHT_M / height if height > 0 else 1.0
    # X is to the right of the first photo, whichever way it was held.
    axes = reconstruction.views[0].world_from_camera.rotation
    across = np.cross(axes[:, 2], gravity.up)
    right = axes[:, 0] if np.linalg.norm(across) < 0.1 else across
    x = right - (right @ gravity.up) * gravity.up
    x /= np.linalg.norm(x)
    turn: FloatArray = np.stack([x, np.cross(gravity.up, x), gravity.up])
    below = eyes.mean(axis=0) - (eyes.mean(axis=0) @ gravity.up - gravity.floor) * gravity.up
    covariance = np.diag([TURN_SIGMA_RAD**2] * 3 + [0.0] * 3 + [HEIGHT_SIGMA**2])
    warnings = [
        "The scale is a guess: nothing in the photos tells it. The phone is taken to have been "
        f"carried {CARRIED_HEIGHT_M} m above the floor; lengths may be a quarter off. Print a code, "
        "fix it to a wall, film it with the room and give its side, or give a known length."
    ]
    if gravity.floor_points == 0:
        warnings.append("No floor was found either: up is taken from how the photos were held.")
    return Alignment(
        Similarity(scale, turn, -scale * (turn @ below)),
        covariance,
        (),
        gravity,
        2,
        tuple(warnings),
    )
