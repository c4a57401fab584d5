# pyright: standard
"""Depth from pairs of photos, before anything is trained.

Two photos are turned until the same point lies on the same row of both (rectified along the line
between their cameras), and semi-global matching finds by how much it is shifted (Hirschmüller 2008,
OpenCV's). A pixel's depth is believed where the pairs of its view agree.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole, pixel_centres
from scenes.pose import Pose
from scenes.prepare.progress import Progress, silent
from scenes.prepare.reconstruction import Reconstruction, View, read_picture

DepthMap = NDArray[np.float32]

PARTNERS = 4
"""Views that each view is matched with: two that agree are needed, and each costs time."""
BEST_ANGLE_RAD = 0.15
"""Between the rays of two photos to the same point: less is uncertain, more looks different."""
MIN_ANGLE_RAD, MAX_ANGLE_RAD = 0.03, 0.45
MIN_SHARED = 0.25
"""Share of a view's points that its partner has to see."""
MAX_COSINE_ALONG = 0.75
"""Cosine between the line to a partner and the view's axis from which on nothing can be turned to
the same rows."""
NEAREST, FARTHEST = 0.6, 1.6
"""Depths are looked for from this share of the nearest known point's to that of the farthest's."""
MIN_FORWARD = 0.3
"""Cosine-like: z of a corner's ray, of z = 1 in its own view, once it is turned to the common rows;
less is stretched more than threefold."""
MAX_STRETCH = 8
"""Pixels of the common picture over those of a view, at most: more is stretched beyond use."""
MAX_SHIFT_PX = 256
"""Disparities that are searched, px."""
BLOCK_PX = 5
"""Side of a matched block, px."""
AGREEMENT = 0.015
"""Relative difference of depths that agree."""
MIN_AGREEING = 2
"""Partners that have to agree about a depth."""


@dataclass(frozen=True, slots=True, eq=False)
class SeenDepth:
    """Depth of a view, by stereo with its partners.

    Attributes:
        view: whose.
        camera: the lens at the size of the picture.
        picture: (H, W, 3) uint8 RGB.
        depth: (H, W) float32 z in the world's unit; 0 where partners do not agree.
    """

    view: View
    camera: Pinhole
    picture: NDArray[np.uint8]
    depth: DepthMap


@dataclass(frozen=True, slots=True, eq=False)
class _Small:
    """A view's photo at the size that is matched."""

    view: View
    camera: Pinhole
    picture: NDArray[np.uint8]
    grey: NDArray[np.uint8]
    known: NDArray[np.float64]
    """(N,) z of the sparse points seen, 0 of those not seen."""

    @property
    def pose(self) -> Pose:
        return self.view.world_from_camera


def seen_depths(
    reconstruction: Reconstruction, *, longest_px: int, progress: Progress = silent
) -> list[SeenDepth]:
    """Depth of every view through a pinhole, in the order of the views; 0 of all without partners.

    Args:
        reconstruction: photos, and points that show which of them see the same.
        longest_px: longer side of the pictures that are matched.
        progress: called with the share done.

    Raises:
        Cancelled: as raised by `progress`.
    """
    small = [
        _read(view, reconstruction.points, longest_px)
        for view in reconstruction.views
        if isinstance(view.camera, Pinhole)
    ]
    out = []
    for number, own in enumerate(small):
        progress(number / len(small), "depth from pairs of photos")
        pairs = (
            _rectify(own, other, _range_of(own))
            for other in _partners(own, small, reconstruction.points)
        )
        # What cannot be rectified must not take the place of a partner that can.
        usable = islice((pair for pair in pairs if pair is not None), PARTNERS)
        depths = [_pair_depth(pair) for pair in usable]
        nothing = np.zeros(own.grey.shape, dtype=np.float32)
        depth = consistent_depth(depths) if len(depths) >= MIN_AGREEING else nothing
        out.append(SeenDepth(own.view, own.camera, own.picture, depth))
    return out


def consistent_depth(depths: Sequence[DepthMap]) -> DepthMap:
    """Mean of the depths that agree with most others, pixel by pixel; 0 where too few do."""
    stack = np.stack(depths)
    known = stack > 0
    best = np.zeros(stack.shape[1:], dtype=np.float32)
    votes = np.zeros(stack.shape[1:], dtype=np.int64)
    for candidate in stack:
        close = known & (np.abs(stack - candidate) <= AGREEMENT * candidate) & (candidate > 0)
        count = close.sum(axis=0)
        mean = (stack * close).sum(axis=0) / np.maximum(count, 1)
        better = count > votes
        best[better], votes[better] = mean[better], count[better]
    return np.where(votes >= MIN_AGREEING, best, 0.0).astype(np.float32)


@dataclass(frozen=True, slots=True, eq=False)
class _Rectified:
    """Two views turned to the same rows.

    Attributes:
        own, other: the views.
        turned_from_own, turned_from_other: (3, 3) rotations into the common orientation.
        low: (2,) x and y of the common picture's first pixel, px from the axis.
        size: its width and height, px.
        least: shift of the farthest depth looked for, px.
        count: shifts looked for beyond that, px.
        baseline: between the cameras, in the world's unit.
    """

    own: _Small
    other: _Small
    turned_from_own: NDArray[np.float64]
    turned_from_other: NDArray[np.float64]
    low: NDArray[np.float64]
    size: tuple[int, int]
    least: float
    count: int
    baseline: float


def _rectify(own: _Small, other: _Small, depths: tuple[float, float]) -> _Rectified | None:
    """The pair on the same rows; None where the common picture would be all but endless."""
    line = other.pose.translation - own.pose.translation
    baseline = float(np.linalg.norm(line))
    world_from_turned = _turn(own.pose, other.pose, line / baseline)
    focal = own.camera.fx
    near, far = depths
    least = focal * baseline / far
    count = min(focal * baseline / near - least, MAX_SHIFT_PX)
    count = int(16 * np.ceil(max(count, 16) / 16))
    turned_from_own = world_from_turned.T @ own.pose.rotation
    corners = _directions(own.camera, np.array(_corners(own.camera))) @ turned_from_own.T
    if (corners[:, 2] < MIN_FORWARD).any():
        return None
    flat = focal * corners[:, :2] / corners[:, 2:]
    low, high = np.floor(flat.min(axis=0)), np.ceil(flat.max(axis=0))
    low[0] -= count
    size = int(high[0] - low[0]), int(high[1] - low[1])
    if size[0] * size[1] > MAX_STRETCH * own.grey.size:
        return None
    turned_from_other = world_from_turned.T @ other.pose.rotation
    return _Rectified(
        own, other, turned_from_own, turned_from_other, low, size, least, count, baseline
    )


def _pair_depth(pair: _Rectified) -> DepthMap:
    """(H, W) z of the pixels of the pair's own view as the pair sees it; 0 without a match."""
    own, low, focal = pair.own, pair.low, pair.own.camera.fx
    left = _lens(focal, -low[0], -low[1])
    right = _lens(focal, -low[0] + pair.least, -low[1])
    pictures = [
        _redrawn(own, left, pair.turned_from_own, pair.size),
        _redrawn(pair.other, right, pair.turned_from_other, pair.size),
    ]
    matcher = cv2.StereoSGBM.create(
        minDisparity=0,
        numDisparities=pair.count,
        blockSize=BLOCK_PX,
        P1=8 * BLOCK_PX**2,
        P2=32 * BLOCK_PX**2,
        disp12MaxDiff=1,
        uniquenessRatio=8,
        speckleWindowSize=100,
        speckleRange=1,
        preFilterCap=31,
        mode=cv2.STEREO_SGBM_MODE_SGBM_3WAY,
    )
    shift = matcher.compute(*pictures).astype(np.float32) / 16
    shift[shift < 0] = -1e6
    rays = _directions(own.camera, pixel_centres(own.camera)) @ pair.turned_from_own.T
    place = focal * rays[:, :2] / rays[:, 2:] - low
    column = np.clip(np.floor(place[:, 0]).astype(int), 0, pair.size[0] - 1)
    row = np.clip(np.floor(place[:, 1]).astype(int), 0, pair.size[1] - 1)
    found = shift[row, column]
    depth = focal * pair.baseline / np.maximum(found + pair.least, 1e-6) / rays[:, 2]
    return np.where(found >= 0, depth, 0.0).reshape(own.grey.shape).astype(np.float32)


def _read(view: View, points: NDArray[np.float64], longest_px: int) -> _Small:
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
        cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY).astype(np.uint8),
        np.where(is_seen, in_camera[:, 2], 0.0),
    )


def _range_of(own: _Small) -> tuple[float, float]:
    near, far = np.quantile(own.known[own.known > 0], (0.01, 0.99))
    return NEAREST * float(near), FARTHEST * float(far)


def _partners(own: _Small, views: Sequence[_Small], points: NDArray[np.float64]) -> list[_Small]:
    """All views that see the same from a little aside, the best first."""
    mine = own.known > 0
    if mine.sum() < 20:
        return []
    rays = points - own.pose.translation
    axis = own.pose.rotation[:, 2]
    ranked = []
    for other in views:
        shared = mine & (other.known > 0)
        line = other.pose.translation - own.pose.translation
        baseline = np.linalg.norm(line)
        if other is own or baseline < 1e-9 or shared.sum() < MIN_SHARED * mine.sum():
            continue
        if abs(line @ axis) > MAX_COSINE_ALONG * baseline:
            continue
        theirs = points[shared] - other.pose.translation
        cosine = (rays[shared] * theirs).sum(axis=1)
        cosine /= np.linalg.norm(rays[shared], axis=1) * np.linalg.norm(theirs, axis=1)
        angle = float(np.median(np.arccos(np.clip(cosine, -1, 1))))
        if MIN_ANGLE_RAD < angle < MAX_ANGLE_RAD:
            ranked.append((abs(np.log(angle / BEST_ANGLE_RAD)), other))
    ranked.sort(key=lambda entry: entry[0])
    return [other for _, other in ranked]


def _turn(own: Pose, other: Pose, along: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, 3) world from a camera that looks where both do, with rows along the line between."""
    forward = own.rotation[:, 2] + other.rotation[:, 2]
    forward = forward - (forward @ along) * along
    forward /= np.linalg.norm(forward)
    return np.stack([along, np.cross(forward, along), forward], axis=1)


def _lens(focal: float, cx: float, cy: float) -> NDArray[np.float64]:
    return np.array([[focal, 0, cx], [0, focal, cy], [0, 0, 1]])


def _corners(camera: Pinhole) -> list[tuple[float, float]]:
    width, height = float(camera.width_px), float(camera.height_px)
    return [(0.0, 0.0), (width, 0.0), (0.0, height), (width, height)]


def _directions(camera: Pinhole, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 3) rays through pixels, with z = 1."""
    x = (pixels[:, 0] - camera.cx) / camera.fx
    y = (pixels[:, 1] - camera.cy) / camera.fy
    return np.stack([x, y, np.ones(len(x))], axis=1)


def _redrawn(
    view: _Small,
    lens: NDArray[np.float64],
    turned_from_camera: NDArray[np.float64],
    size: tuple[int, int],
) -> NDArray[np.uint8]:
    """The photo as the turned camera would take it."""
    camera = view.camera
    own = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]])
    # OpenCV counts pixels from the centre of the first.
    half = np.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1]])
    camera_from_turned = own @ turned_from_camera.T @ np.linalg.inv(lens)
    matrix = np.linalg.inv(half) @ camera_from_turned @ half
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return np.asarray(cv2.warpPerspective(view.grey, matrix, size, flags=flags), dtype=np.uint8)
