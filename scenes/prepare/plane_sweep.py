# pyright: standard
"""Depth from photos that were taken in the direction of walking.

Such photos cannot be turned until their rows agree. Each is compared with a few others over planes
at growing distance (plane sweep, Collins 1996, with normalised cross-correlation). Planes that face
the camera constrain little about a wall that is passed or a road: it has another distance in every
column and another size in every photo. So the planes lie as streets do: across, level, and along
the way on both sides (Gallup et al. 2007).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole, pixel_centres
from scenes.pose import Pose
from scenes.prepare.reconstruction import Reconstruction, View
from scenes.prepare.train.training_photos import read_photo

PARTNERS = 4
"""Photos that each is compared with."""
ON_THE_WAY = 5
"""Photos that give the direction of walking, the one in question among them."""
MIN_ANGLE_DEG, BEST_ANGLE_DEG = 0.5, 6.0
MAX_SIZE_RATIO = 1.6
"""Ratio of sizes in two photos beyond which a surface looks different in them."""
WINDOW = (7, 7)
"""Pixels that are compared around each."""
MIN_CORRELATION = 0.8
"""Correlation of windows from which on they show the same place."""
MIN_CONTRAST = 3.0
"""Grey levels of standard deviation below which a window shows nothing to compare."""
MIN_POINTS = 10
"""Sparse points of which fewer say nothing about where planes may be."""

FloatArray = NDArray[np.float64]
GreyPicture = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class _Family:
    """Parallel planes that are tried.

    Attributes:
        count: how many.
        quantiles: of the distances of sparse points along the normal: the nearest and the farthest.
        shares: of those two distances, where the planes begin and end.
    """

    count: int
    quantiles: tuple[float, float]
    shares: tuple[float, float]


ACROSS = _Family(64, (0.02, 0.98), (0.5, 2.0))
"""Planes across the view."""
LEVEL = _Family(32, (0.9, 0.9), (0.5, 1.7))
"""Most of what lies far below a camera is what it stands on."""
BESIDE = _Family(40, (0.2, 0.98), (0.7, 1.2))
"""Upright planes at the sides."""


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """A photo, small, and where it was taken.

    Attributes:
        colours: (H, W, 3) uint8 RGB.
        grey: (H, W) float32, 0..255.
        camera: the lens at this size.
        world_from_camera: its pose.
        known: (K, 3) the sparse points that it sees, in the camera.
    """

    colours: NDArray[np.uint8]
    grey: GreyPicture
    camera: Pinhole
    world_from_camera: Pose
    known: FloatArray

    @property
    def eye(self) -> FloatArray:
        """(3,) where it was taken, world."""
        return self.world_from_camera.translation

    def sees(self, points: FloatArray) -> NDArray[np.bool_]:
        """(N,) which world points (N, 3) fall into the picture."""
        _, is_seen = self.camera.project(self.world_from_camera.inverse() @ points)
        return is_seen


def looks_of(metric: Reconstruction, views: Sequence[View], longest_px: int) -> list[Look]:
    """The views through a pinhole that see enough sparse points, their photos made small.

    Raises:
        ValueError: a photo cannot be read.
    """
    looks = []
    for view in views:
        if not isinstance(view.camera, Pinhole):
            continue
        in_camera = view.world_from_camera.inverse() @ metric.points
        _, is_seen = view.camera.project(in_camera)
        if is_seen.sum() < MIN_POINTS:
            continue
        photo = read_photo(view, longest_px)
        assert isinstance(photo.camera, Pinhole)
        grey = cv2.cvtColor(photo.picture, cv2.COLOR_RGB2GRAY).astype(np.float32)
        pose = view.world_from_camera
        looks.append(Look(photo.picture, grey, photo.camera, pose, in_camera[is_seen]))
    return looks


def ways_of(looks: Sequence[Look]) -> FloatArray:
    """(K, 3) unit vectors, world: along which each photo and those next to it were taken."""
    eyes = np.stack([look.eye for look in looks])
    distance = np.linalg.norm(eyes[None] - eyes[:, None], axis=2)
    ways = []
    for near in distance.argsort(axis=1)[:, :ON_THE_WAY]:
        # Nobody walks straight from one photo to the next.
        _, _, axes = np.linalg.svd(eyes[near] - eyes[near].mean(axis=0))
        ways.append(axes[0])
    return np.stack(ways)


def partners_of(looks: Sequence[Look], points: FloatArray) -> list[list[int]]:
    """For each photo the others that show most of the same, from neither too near nor too far."""
    eyes = np.stack([look.eye for look in looks])
    seen = np.stack([look.sees(points) for look in looks])
    towards = points[None] - eyes[:, None]
    distance = np.maximum(np.linalg.norm(towards, axis=2), 1e-12)
    towards /= distance[..., None]
    chosen = []
    for number in range(len(looks)):
        cosine = np.einsum("kpc,pc->kp", towards, towards[number]).clip(-1, 1)
        angle = np.degrees(np.arccos(cosine))
        larger = np.maximum(distance / distance[number], distance[number] / distance)
        # What is seen under a small angle has no distance, under a large one another look.
        gain_of = np.minimum(angle / BEST_ANGLE_DEG, BEST_ANGLE_DEG / np.maximum(angle, 1e-6))
        useful = seen & seen[number] & (angle > MIN_ANGLE_DEG) & (larger < MAX_SIZE_RATIO)
        gain_of = np.where(useful, gain_of, 0.0)
        gain_of[number] = 0.0
        chosen.append(_covering(gain_of))
    return chosen


def _covering(gain_of: FloatArray) -> list[int]:
    """Rows of (K, P) whose gains together are highest, each point counted by its best row."""
    chosen: list[int] = []
    had = np.zeros(gain_of.shape[1])
    for _ in range(PARTNERS):
        gain = np.maximum(gain_of - had, 0.0).sum(axis=1)
        best = int(gain.argmax())
        if gain[best] <= 0:
            break
        chosen.append(best)
        had = np.maximum(had, gain_of[best])
    return chosen


def swept(look: Look, others: Sequence[Look], way: FloatArray) -> GreyPicture:
    """(H, W) inverse z where the photo looks like its partners; 0 where it does not.

    Args:
        look: whose.
        others: its partners.
        way: (3,) unit, world: along which the photos were taken.
    """
    inverse, correlation = np.zeros_like(look.grey), np.zeros_like(look.grey)
    for normal, family in _families(look, way):
        found, score = _swept_along(look, others, normal, family)
        better = score > correlation
        inverse[better], correlation[better] = found[better], score[better]
    return np.where(correlation >= MIN_CORRELATION, inverse, 0).astype(np.float32)


def _families(look: Look, way: FloatArray) -> list[tuple[FloatArray, _Family]]:
    """Unit normals in the camera, away from it, with the planes to be tried along them."""
    turn = look.world_from_camera.rotation.T
    up = np.array([0.0, 0.0, 1.0])
    families = [(np.array([0.0, 0.0, 1.0]), ACROSS), (-(turn @ up), LEVEL)]
    aside = np.cross(up, way)
    if np.linalg.norm(aside) > 0.1:
        aside = turn @ (aside / np.linalg.norm(aside))
        families += [(aside, BESIDE), (-aside, BESIDE)]
    return families


def _swept_along(
    look: Look, others: Sequence[Look], normal: FloatArray, family: _Family
) -> tuple[GreyPicture, GreyPicture]:
    """(H, W) inverse z of the likeliest of parallel planes, and the photos' correlation there."""
    nothing = np.zeros_like(look.grey)
    away = look.known @ normal
    away = away[away > 0]
    if not others or len(away) < MIN_POINTS:
        return nothing, nothing
    low, high = np.quantile(away, family.quantiles) * family.shares
    tried = np.linspace(1 / high, 1 / low, family.count)
    rays = look.camera.unproject(pixel_centres(look.camera))
    along = ((rays / rays[:, 2:]) @ normal).reshape(look.grey.shape)
    mean, deviation = _moments(look.grey)
    z = np.quantile(look.known[:, 2], ACROSS.quantiles) * ACROSS.shares
    score = np.zeros((family.count, *look.grey.shape), dtype=np.float32)
    for number, inverse in enumerate(tried):
        in_range = (along * inverse > 1 / z[1]) & (along * inverse < 1 / z[0])
        for other in others:
            onto = _onto(look, other, normal * inverse)
            found = _correlation(look.grey, mean, deviation, other.grey, onto)
            # Hidden in some of the partners, a place is seen in the one that it looks like.
            np.maximum(score[number], np.where(in_range, found, 0), out=score[number])
    best = score.argmax(axis=0)
    inner = (best > 0) & (best < family.count - 1) & (deviation >= MIN_CONTRAST)
    best = best.clip(1, family.count - 2)
    before, there, after = (
        np.take_along_axis(score, best[None] + step, axis=0)[0] for step in (-1, 0, 1)
    )
    # The top of the parabola through the three, as the correlation falls off to both sides.
    bend = np.maximum(2 * there - before - after, 1e-6)
    off = np.clip(0.5 * (after - before) / bend, -0.5, 0.5)
    inverse = along * (tried[best] + off * (tried[1] - tried[0]))
    return inverse.astype(np.float32), np.where(inner, there, 0)


def _onto(look: Look, other: Look, plane: FloatArray) -> FloatArray:
    """(3, 3) from the photo's pixels to the other's for points x of the plane `plane` · x = 1."""
    other_from_look = other.world_from_camera.inverse() @ look.world_from_camera
    onto = other_from_look.rotation + np.outer(other_from_look.translation, plane)
    return other.camera.opencv_matrix() @ onto @ np.linalg.inv(look.camera.opencv_matrix())


def _correlation(
    grey: GreyPicture,
    mean: GreyPicture,
    deviation: GreyPicture,
    other: GreyPicture,
    onto: FloatArray,
) -> GreyPicture:
    """(H, W) correlation of windows with another picture through a homography; 0 outside it."""
    warped = cv2.warpPerspective(
        other,
        onto,
        (grey.shape[1], grey.shape[0]),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=-1.0,
    )
    warped = np.asarray(warped, dtype=np.float32)
    other_mean, other_deviation = _moments(warped)
    product = cv2.blur(grey * warped, WINDOW) - mean * other_mean
    found = product / np.maximum(deviation * other_deviation, 1.0)
    return np.where(warped < 0, 0.0, found).astype(np.float32)


def _moments(grey: GreyPicture) -> tuple[GreyPicture, GreyPicture]:
    """(H, W) mean and standard deviation in a window."""
    mean = np.asarray(cv2.blur(grey, WINDOW), dtype=np.float32)
    square = np.asarray(cv2.blur(grey * grey, WINDOW), dtype=np.float32)
    return mean, np.sqrt(np.maximum(square - mean * mean, 0.0))
