"""Corners of codes in a picture to a pose with its covariance: one step of an iterated filter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.pose import Pose, rotation_from_vector
from scenes.prepare.align.codes.triangulate import UNIT_CORNERS

Floats = NDArray[np.float64]

HEAD_TURN_RAD = float(np.deg2rad(0.05))
"""Standard deviation about each axis by which a headset is off about one picture's direction,
beside its slow drift: an inertial sensor between two pictures; half a pixel at 600 px of focal
length, twenty times what a code's corners are known to."""

HEAD_SHIFT_M = 0.002
"""Likewise its place along each axis."""

FOCAL_SHARE = 0.001
"""Standard deviation of a picture's focal length, of itself: what a calibration of a lens with
autofocus is good for."""

STEPS = 4
"""Iterations of one step of the filter; the fourth moves a corner by less than 0.01 px."""


@dataclass(frozen=True, slots=True, eq=False)
class Belief:
    """A pose `a_from_b` and how well it is known.

    Attributes:
        a_from_b: most likely.
        covariance: (6, 6) of a turn in radians and a shift in metres of b about `pivot`, b's axes.
        pivot: (3,) in b, metres.
        t_ns: when it held.
    """

    a_from_b: Pose
    covariance: Floats
    pivot: Floats
    t_ns: int

    @property
    def sigma_turn_rad(self) -> float:
        """Standard deviation of its direction, over all axes."""
        return float(np.sqrt(np.trace(self.covariance[:3, :3])))

    @property
    def sigma_shift_m(self) -> float:
        """Standard deviation of the pivot's place, over all axes."""
        return float(np.sqrt(np.trace(self.covariance[3:, 3:])))

    def later(self, t_ns: int, *, turn_rad: float, shift_m: float) -> Belief:
        """Return it at a later time, less certain by a random walk of so much in one second."""
        passed_s = max(t_ns - self.t_ns, 0) * 1e-9
        more = np.repeat((turn_rad**2, shift_m**2), 3) * passed_s
        return replace(self, covariance=self.covariance + np.diag(more), t_ns=max(t_ns, self.t_ns))

    def moved(self, change: Floats) -> Pose:
        """Return the pose after a change (6,) as the covariance counts it."""
        turn = rotation_from_vector(change[:3])
        return self.a_from_b @ Pose(turn, self.pivot - turn @ self.pivot + change[3:])


@dataclass(frozen=True, slots=True, eq=False)
class SeenPoints:
    """Points of b in one picture.

    Attributes:
        camera: of the picture.
        camera_from_a: where it was taken from.
        points: (N, 3) in b, metres.
        pixels: (N, 2) where they are seen.
        sigma_px: (N,) of each along either axis.
        more_px2: (2N, 2N) further covariance, px²; None for none.
    """

    camera: Pinhole
    camera_from_a: Pose
    points: Floats
    pixels: Floats
    sigma_px: Floats
    more_px2: Floats | None = None


def joined(seen: Sequence[SeenPoints]) -> SeenPoints:
    """Return all points of one picture together; what further covariance they have goes."""
    return SeenPoints(
        seen[0].camera,
        seen[0].camera_from_a,
        np.concatenate([s.points for s in seen]),
        np.concatenate([s.pixels for s in seen]),
        np.concatenate([s.sigma_px for s in seen]),
    )


def distance(belief: Belief, seen: SeenPoints) -> float:
    """Return the squared Mahalanobis distance of points from where they are expected.

    Infinite where one is expected behind the camera.
    """
    parts = _linearised(belief, belief.a_from_b, seen=seen)
    if parts is None:
        return float("inf")
    left, slope, noise = parts
    spread = slope @ belief.covariance @ slope.T + noise
    return float(left @ np.linalg.solve(spread, left))


def updated(belief: Belief, seen: SeenPoints) -> Belief | None:
    """Return the belief after a picture; None where its steps lead behind the camera."""
    change = np.zeros(6)
    information = np.linalg.inv(belief.covariance)
    normal = information
    for _ in range(STEPS):
        parts = _linearised(belief, belief.moved(change), seen=seen)
        if parts is None:
            return None
        left, slope, noise = parts
        weighted = np.linalg.solve(noise, slope)
        normal = information + slope.T @ weighted
        wanted = weighted.T @ (left + slope @ change)
        change = np.asarray(np.linalg.solve(normal, wanted), dtype=np.float64)
        if not np.isfinite(change).all():
            return None
    covariance = np.linalg.inv(normal)
    covariance = 0.5 * (covariance + covariance.T)
    return Belief(belief.moved(change), covariance, belief.pivot, belief.t_ns)


def spread_px2(belief: Belief, seen: SeenPoints) -> Floats | None:
    """Return (2N, 2N) px² by which a belief alone spreads points; None behind the camera."""
    parts = _linearised(belief, belief.a_from_b, seen=seen)
    return None if parts is None else parts[1] @ belief.covariance @ parts[1].T


def poses_of_square(camera: Pinhole, corners_px: Floats, *, side_m: float) -> list[Pose]:
    """Return the poses `camera_from_code` of a square that explain its corners, best first.

    A small square that is seen from afar has two: it may lean either way.
    """
    square = code_corners(side_m)
    lens = np.array([[camera.fx, 0.0, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]])
    try:
        count, turns, shifts, _ = cv2.solvePnPGeneric(
            square, corners_px.reshape(4, 1, 2), lens, None, flags=cv2.SOLVEPNP_IPPE_SQUARE
        )
    except cv2.error:
        return []
    found: list[Pose] = []
    for k in range(int(count)):
        turn, shift = np.asarray(turns[k], float).ravel(), np.asarray(shifts[k], float).ravel()
        if np.isfinite(turn).all() and np.isfinite(shift).all() and shift[2] > 0.0:
            found.append(Pose(rotation_from_vector(turn), shift))
    return found


def code_corners(side_m: float) -> Floats:
    """Return (4, 3) corners in a code's own frame: x right, y up, from its middle."""
    return side_m * UNIT_CORNERS


def slopes_of(camera: Pinhole, in_camera: Floats) -> Floats:
    """Return (N, 2, 3) how pixels move with points (N, 3) of the camera."""
    x, y, z = in_camera.T
    zero = np.zeros_like(z)
    across = np.stack([camera.fx / z, zero, -camera.fx * x / z**2], axis=1)
    down = np.stack([zero, camera.fy / z, -camera.fy * y / z**2], axis=1)
    return np.stack([across, down], axis=1)


def crosses(vectors: Floats) -> Floats:
    """Return (N, 3, 3) matrices that take the cross product with vectors (N, 3) from the left."""
    x, y, z = vectors.T
    zero = np.zeros_like(z)
    rows = [zero, -z, y, z, zero, -x, -y, x, zero]
    return np.stack(rows, axis=1).reshape(-1, 3, 3)


def _linearised(
    belief: Belief, a_from_b: Pose, *, seen: SeenPoints
) -> tuple[Floats, Floats, Floats] | None:
    """Return residuals (2N,), their slope (2N, 6) and noise (2N, 2N); None behind the camera."""
    camera_from_b = seen.camera_from_a @ a_from_b
    in_camera = camera_from_b @ seen.points
    if float(in_camera[:, 2].min()) < 0.05:
        return None
    camera = seen.camera
    expected = in_camera[:, :2] / in_camera[:, 2:] * (camera.fx, camera.fy) + (camera.cx, camera.cy)
    by_point = slopes_of(camera, in_camera)
    # With the pose's own change, b moves about the pivot; with the headset's error, the camera.
    turn = -camera_from_b.rotation @ crosses(seen.points - belief.pivot)
    slope = np.concatenate([by_point @ turn, by_point @ camera_from_b.rotation], axis=2)
    head = np.concatenate([by_point @ -crosses(in_camera), by_point], axis=2).reshape(-1, 6)
    focal = (expected - (camera.cx, camera.cy)).reshape(-1, 1) * FOCAL_SHARE
    head = head * np.repeat((HEAD_TURN_RAD, HEAD_SHIFT_M), 3)
    noise = np.diag(np.repeat(seen.sigma_px, 2) ** 2) + head @ head.T + focal @ focal.T
    if seen.more_px2 is not None:
        noise = noise + seen.more_px2
    return (seen.pixels - expected).ravel(), slope.reshape(-1, 6), noise
