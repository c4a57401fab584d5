# pyright: standard
"""A reconstruction's place in the metric world, and how well it is known."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from scenes.cameras import Pinhole
from scenes.pose import Pose
from scenes.prepare.align.gravity import Gravity
from scenes.prepare.align.similarity import Similarity
from scenes.prepare.reconstruction import Reconstruction

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Anchor:
    """A printed code with its place in the world.

    Attributes:
        payload: what it says.
        side_m: its printed side.
        world_from_code: x right, y up, z out of the wall, origin in its centre.
        corners_m: (4, 3) world, each corner from its own rays: where they leave the square is what
            the capture got wrong.
        residual_px: root mean square of seen minus predicted corners, along one axis.
        residual_mm: the same at the code's distance.
        corner_mm: root mean square distance of `corners_m` from the fitted square's corners.
        views: names of the photos it was measured in.
    """

    payload: str
    side_m: float
    world_from_code: Pose
    corners_m: FloatArray
    residual_px: float
    residual_mm: float
    corner_mm: float
    views: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Alignment:
    """Placement of a reconstruction in the metric world.

    The world is Z up with the floor at z = 0. Unless the codes' world poses were given, its origin
    is on the floor under the centre of the first code (by payload), and X is the way that code
    faces (the way its print points up, if it lies flat).

    Attributes:
        world_from_reconstruction: metres from the reconstruction's units.
        covariance: (7, 7) of a small change of the world: rotation vector (radians), translation
            (metres), logarithm of the scale. It says how far points are from where they really are
            as measured from the codes: errors that move codes and points alike are no errors.
        anchors: by payload; empty if the scale came from something else.
        gravity: up and floor, in the reconstruction; None if the codes' world poses gave them.
        groups: independent groups of photos behind `covariance`; few make its bounds wide.
        references_m: (K, 3) world: where the scale was measured, such as the codes' centres.
        bend_per_metre: how far the reconstruction itself bends away, metres per metre from the
            nearest reference (standard deviation).
        warnings: what the user should know, in whole sentences.
        is_guess: nothing gave the scale: how long a metre is was estimated.
    """

    world_from_reconstruction: Similarity
    covariance: FloatArray
    anchors: tuple[Anchor, ...]
    gravity: Gravity | None
    groups: int
    references_m: FloatArray
    bend_per_metre: float
    warnings: tuple[str, ...]
    is_guess: bool = False

    def predicted_error_m(self, points: ArrayLike, *, bound: float | None = None) -> FloatArray:
        """How far points may be off, metres.

        Args:
            points: (N, 3) world.
            bound: a probability, such as 0.95: the error that is not exceeded so often. If not
                given, the root mean square error.

        Returns:
            (N,) metres.

        Raises:
            ValueError: `bound` is not between 0 and 1.
        """
        if bound is not None and not 0 < bound < 1:
            raise ValueError(f"predicted error: bound {bound}, wanted between 0 and 1")
        p = np.atleast_2d(np.asarray(points, dtype=np.float64))
        slopes = np.zeros((len(p), 3, 7))
        slopes[:, :, :3] = np.swapaxes(np.cross(p[:, None, :], np.eye(3)[None], axis=2), 1, 2)
        slopes[:, :, :3] *= -1.0
        slopes[:, :, 3:6] = np.eye(3)
        slopes[:, :, 6] = p
        spread = slopes @ self.covariance @ np.swapaxes(slopes, 1, 2)
        away_m = np.linalg.norm(p[:, None] - self.references_m[None], axis=2).min(axis=1)
        bent = (self.bend_per_metre * away_m) ** 2 / 3.0
        spread = spread + bent[:, None, None] * np.eye(3)
        mean_square = np.trace(spread, axis1=1, axis2=2)
        if bound is None:
            return np.sqrt(mean_square)
        # The sum of squares of unequal normal components is near to a scaled chi-square (Welch &
        # Satterthwaite); the scatter itself is estimated, which makes it an F distribution.
        twice = np.maximum(np.einsum("nij,nji->n", spread, spread), 1e-300)
        freedom = mean_square**2 / twice
        return np.sqrt(mean_square * stats.f.ppf(bound, freedom, max(self.groups - 1, 1)))

    def metres_per_unit(self) -> tuple[float, float]:
        """The scale and its standard deviation."""
        scale = self.world_from_reconstruction.scale
        return scale, scale * math.sqrt(float(self.covariance[6, 6]))


BEND = 2.0
"""How much more a reconstruction bends over a distance than one feature's error subtends there.
Measured on a room filmed in one round of 60 photos (0.36 px, 2.7 mm over some 2.5 m)."""


def bend_per_metre(reconstruction: Reconstruction) -> float:
    """How far a reconstruction bends, from how well its points reproject.

    Poses are only as good as the features they were found with: an error of so many pixels is an
    angle, and over a distance that is a length. The codes cannot show this, having no truth beside
    them; it is a rule of thumb, and said to be one.
    """
    if len(reconstruction.errors_px) == 0:
        return 0.0
    focal_px = [
        v.camera.fx if isinstance(v.camera, Pinhole) else v.camera.f_px
        for v in reconstruction.views
    ]
    return BEND * float(np.mean(reconstruction.errors_px)) / float(np.median(focal_px))


def apply_alignment(reconstruction: Reconstruction, alignment: Alignment) -> Reconstruction:
    """The reconstruction in world metres; camera poses stay rigid."""
    return alignment.world_from_reconstruction.moved_reconstruction(reconstruction)
