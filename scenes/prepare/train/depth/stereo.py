"""Depth of photos by other photos, before anything is trained.

Each photo is compared with a few others over planes at growing distance (plane sweep, Collins
1996), so they may have been taken from anywhere: aside, or ahead on the way. What costs least along
eight ways across the picture is its depth (semi-global matching, Hirschmüller 2008): plain surfaces
take that of what is around them. Both are native.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.pose import Pose
from scenes.prepare.progress import Progress, silent
from scenes.prepare.reconstruction import Reconstruction, View, read_picture

DepthMap = NDArray[np.float32]
FloatArray = NDArray[np.float64]

PARTNERS = 8
"""Views that each view is compared with; at any place the three most similar count. Of two random
rooms 51 and 55 % are seen by 8 and confirmed by other views, right to 1 % of the depth, 46 and 51
by 6; each adds a seventh of the time."""
MIN_PARTNERS = 2
"""Fewer say nothing: what one sees alone may be chance."""
BEST_ANGLE_RAD = 0.15
"""Between the rays of two photos to the same point: less is uncertain, more looks different."""
MIN_ANGLE_RAD, MAX_ANGLE_RAD = 0.03, 0.45
MAX_SIZE_RATIO = 1.6
"""Ratio of sizes in two photos beyond which a surface looks different in them."""
MIN_KNOWN = 20
"""Sparse points of which fewer say nothing about where planes may be."""
ASKED_POINTS = 1000
"""Sparse points of a view by which partners are chosen, up to twice as many: they say to a few
percent how much another view shows. With all 4,600 of a view it took 8 s of 96 photos."""
NEAREST, FARTHEST = 0.6, 1.6
"""Depths are looked for from this share of the nearest known point's to that of the farthest's."""
PLANES = (32, 160)
"""Planes that are tried, at least and at most: as many as a pixel's shift in half of the partners,
if that is within them."""
NOISE = 1.0
"""Grey levels by which neighbours of a plain surface differ. Between 0.75 and 1.5 rooms are seen
better with more (43 to 46 and 46 to 51 %), plain objects with less (42 to 37 % in one room)."""
PRICES = (10, 90, 12)
"""Of the next plane's depth beside a pixel, and of any other's, in bits by which the 24 neighbours
in three photos differ; and the edge, in grey levels, at which a jump costs half. Twice as much
sees rooms better (51 for 46 %, 56 for 51) and small objects worse (34 for 37 %), two thirds the
opposite (41, 46; 38 %)."""
MARGIN = 0.05
"""By which all other depths have to cost more. Without it 1 % more is seen, and 0.1 to 0.3 % more
wrong: other views confirm what counts."""


@dataclass(frozen=True, slots=True, eq=False)
class SeenDepth:
    """Depth of a view, by stereo with its partners.

    Attributes:
        view: whose.
        camera: the lens at the size of the picture.
        picture: (H, W, 3) uint8 RGB.
        depth: (H, W) float32 z in the world's unit; 0 where it is not known.
    """

    view: View
    camera: Pinhole
    picture: NDArray[np.uint8]
    depth: DepthMap


@dataclass(frozen=True, slots=True, eq=False)
class _Small:
    """A view's photo at the size that is compared.

    Attributes:
        view: whose.
        camera: its lens at that size.
        picture: (H, W, 3) uint8 RGB.
        grey: (H, W) uint8.
        known: (N,) z of the sparse points that it sees, 0 of the others.
    """

    view: View
    camera: Pinhole
    picture: NDArray[np.uint8]
    grey: NDArray[np.uint8]
    known: FloatArray

    @property
    def pose(self) -> Pose:
        return self.view.world_from_camera


def seen_depths(
    reconstruction: Reconstruction, *, longest_px: int, progress: Progress = silent
) -> list[SeenDepth]:
    """Depth of every view through a pinhole, in the order of the views; 0 of all without partners.

    Args:
        reconstruction: photos, and points that show which of them see the same.
        longest_px: longer side of the pictures that are compared.
        progress: called with the share done.

    Raises:
        Cancelled: as raised by `progress`.
        ImportError: the native crate has not been built.
    """
    small = [
        _read(view, reconstruction.points, longest_px)
        for view in reconstruction.views
        if isinstance(view.camera, Pinhole)
    ]
    out: list[SeenDepth] = []
    for number, own in enumerate(small):
        progress(number / len(small), "depth from photos beside each other")
        others = [small[k] for k in _partners(number, small, reconstruction.points)]
        depth = np.zeros(own.grey.shape, dtype=np.float32)
        if len(others) >= MIN_PARTNERS:
            depth = _swept(own, others)
        out.append(SeenDepth(own.view, own.camera, own.picture, depth))
    return out


@dataclass(frozen=True, slots=True, eq=False)
class OtherPhoto:
    """A photo to compare with, and where it shows what another shows.

    Pixel (x, y, 1) at inverse depth q is at turn · pixel + q · shift there; whole numbers are pixel
    centres.

    Attributes:
        grey: (H, W) uint8.
        turn: (3, 3).
        shift: (3,).
    """

    grey: NDArray[np.uint8]
    turn: FloatArray
    shift: FloatArray

    def place(self, pixel: FloatArray, inverse: float) -> FloatArray:
        """(2,) of a homogeneous pixel (3,) at an inverse depth."""
        x, y, z = self.turn @ pixel + inverse * self.shift
        return np.array([x, y]) / z


def inverse_depths(
    grey: NDArray[np.uint8], others: Sequence[OtherPhoto], *, tried: tuple[float, float, int]
) -> NDArray[np.float32]:
    """(H, W) inverse depth of a photo by others, 0 where none is clearly the best.

    What it does is spelt out in numpy in `tests.twins.swept_depth`; a test holds the two together.

    Args:
        grey: (H, W) uint8.
        others: at least two.
        tried: the first inverse depth, the step, and how many.

    Raises:
        ImportError: the native crate has not been built.
        ValueError: fewer than three depths, or a photo of none or of more than four million pixels.
    """
    from scenes import _native

    asked = [(o.grey, o.turn.ravel().tolist(), o.shift.tolist()) for o in others]
    flat = _native.swept_depth(
        grey, asked, inverse=tried, prices=PRICES, margin=MARGIN, noise=NOISE
    )
    return flat.reshape(grey.shape)


def _swept(own: _Small, others: Sequence[_Small]) -> DepthMap:
    """(H, W) z of a photo by its partners; 0 where no depth is clearly the best."""
    near, far = np.quantile(own.known[own.known > 0], (0.01, 0.99)) * (NEAREST, FARTHEST)
    asked = [_seen_from(own, other) for other in others]
    # How far the picture's middle moves says how close planes have to be.
    middle = np.array([own.camera.cx - 0.5, own.camera.cy - 0.5, 1.0])
    moves = [np.linalg.norm(o.place(middle, 1 / near) - o.place(middle, 1 / far)) for o in asked]
    count = int(np.clip(np.ceil(np.median(moves)), *PLANES))
    tried = (float(1 / far), float((1 / near - 1 / far) / (count - 1)), count)
    inverse = inverse_depths(own.grey, asked, tried=tried)
    with np.errstate(divide="ignore"):
        return np.where(inverse > 0, 1 / inverse, 0).astype(np.float32)


def _seen_from(own: _Small, other: _Small) -> OtherPhoto:
    other_from_own = other.pose.inverse() @ own.pose
    onto = other.camera.opencv_matrix()
    turn = onto @ other_from_own.rotation @ np.linalg.inv(own.camera.opencv_matrix())
    return OtherPhoto(other.grey, turn, onto @ other_from_own.translation)


def _read(view: View, points: FloatArray, longest_px: int) -> _Small:
    full = view.camera
    assert isinstance(full, Pinhole)
    scale = min(1.0, longest_px / max(full.width_px, full.height_px))
    width, height = round(full.width_px * scale), round(full.height_px * scale)
    x, y = width / full.width_px, height / full.height_px
    camera = Pinhole(width, height, full.fx * x, full.fy * y, full.cx * x, full.cy * y)
    picture = cv2.resize(read_picture(view), (width, height), interpolation=cv2.INTER_AREA)
    in_camera = view.world_from_camera.inverse() @ points
    _, is_seen = camera.project(in_camera)
    return _Small(
        view,
        camera,
        np.asarray(picture, dtype=np.uint8),
        np.ascontiguousarray(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), dtype=np.uint8),
        np.where(is_seen, in_camera[:, 2], 0.0),
    )


def _partners(number: int, views: Sequence[_Small], points: FloatArray) -> list[int]:
    """Numbers of up to `PARTNERS` views that show most of the same from somewhere else.

    Each point wants several, so what a partner adds to a point is worth less the more it has.
    """
    own = views[number]
    mine = np.flatnonzero(own.known > 0)
    if len(mine) < MIN_KNOWN:
        return []
    mine = mine[:: max(len(mine) // ASKED_POINTS, 1)]
    gains = np.stack([_gains(own, other, points, mine) for other in views])
    gains[number] = 0.0
    chosen: list[int] = []
    had = np.zeros(len(mine))
    while len(chosen) < PARTNERS:
        gain = (np.sqrt(had + gains) - np.sqrt(had)).sum(axis=1)
        best = int(gain.argmax())
        if gain[best] <= 0:
            break
        chosen.append(best)
        had = had + gains[best]
        gains[best] = 0.0
    return chosen


def _gains(own: _Small, other: _Small, points: FloatArray, mine: NDArray[np.intp]) -> FloatArray:
    """(K,) 0..1, the use of another view for each of the points that a view sees."""
    ways = [points[mine] - view.pose.translation for view in (own, other)]
    far, away = (np.maximum(np.linalg.norm(way, axis=1), 1e-12) for way in ways)
    cosine = np.einsum("kc,kc->k", *ways) / (far * away)
    angle = np.arccos(np.clip(cosine, -1, 1))
    is_useful = (angle > MIN_ANGLE_RAD) & (angle < MAX_ANGLE_RAD) & (other.known[mine] > 0)
    is_useful &= np.maximum(far / away, away / far) < MAX_SIZE_RATIO
    like = np.minimum(angle / BEST_ANGLE_RAD, BEST_ANGLE_RAD / np.maximum(angle, 1e-9))
    return np.where(is_useful, like, 0.0)
