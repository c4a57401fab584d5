# pyright: standard
"""The photos of a training, at the sizes it asks for, in bounded memory."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.prepare.reconstruction import Reconstruction, View, read_picture
from scenes.prepare.train.depth.seen_surfaces import Surface
from scenes.render.training import FARTHEST, DepthBounds, TrainingTarget

KEPT_BYTES = 1_500_000_000
"""Prepared photos kept; the one not used for longest goes first and is read again if needed."""

SEEN_SLACK, LENT_SLACK = 0.003, 0.006
"""A surface may be nearer or farther by so much of its depth. Little: a splat is seen by many
photos, whose errors cancel where its price has a slope for each."""


@dataclass(frozen=True, slots=True, eq=False)
class Photo:
    """A view's picture, at the size that it is used in.

    Attributes:
        name: the view's.
        picture: (H, W, 3) uint8 RGB.
        camera: the lens that would take it at this size.
        world_from_camera: where it was taken.
    """

    name: str
    picture: NDArray[np.uint8]
    camera: Pinhole | Fisheye
    world_from_camera: Pose

    @property
    def colours(self) -> NDArray[np.float32]:
        """(H, W, 3) float32, 0..1."""
        return self.picture.astype(np.float32) / np.float32(255)

    def target(self, bounds: DepthBounds | None = None) -> TrainingTarget:
        """Ready to be compared with."""
        return TrainingTarget(self.picture, self.camera, self.world_from_camera, bounds)


def read_photo(view: View, longest_px: int, shrink: int = 1) -> Photo:
    """A view's photo with its longer side brought down to `longest_px`, then divided by `shrink`.

    Raises:
        ValueError: the file is missing, no picture, or not of the camera's size.
    """
    full = view.camera
    longest = max(full.width_px, full.height_px)
    camera = smaller(full, max(1.0, longest / longest_px) * shrink)
    picture = read_picture(view)
    if camera is not full:
        size = (camera.width_px, camera.height_px)
        resized = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
        picture = np.asarray(resized, dtype=np.uint8)
    return Photo(view.name, picture, camera, view.world_from_camera)


class Photos:
    """Views to train on and views kept aside; pictures are read when first needed.

    Args:
        reconstruction: its views.
        held_out_every: every so many-th view is kept aside, the last of each group; 0 keeps none.
        longest_px: photos with a longer side are made smaller.
        kept_bytes: memory for prepared photos.

    Attributes:
        surfaces: what views show, by name; their photos are bounded by it once it is known.

    Raises:
        ValueError: fewer than two views are left to train on.
    """

    def __init__(
        self,
        reconstruction: Reconstruction,
        *,
        held_out_every: int,
        longest_px: int,
        kept_bytes: int = KEPT_BYTES,
    ) -> None:
        self.training: tuple[View, ...]
        self.held_out: tuple[View, ...]
        aside = [
            held_out_every > 0 and place % held_out_every == held_out_every - 1
            for place in range(len(reconstruction.views))
        ]
        views = reconstruction.views
        self.training = tuple(v for v, is_aside in zip(views, aside, strict=True) if not is_aside)
        self.held_out = tuple(v for v, is_aside in zip(views, aside, strict=True) if is_aside)
        if len(self.training) < 2:
            raise ValueError(
                f"training: {len(self.training)} views to train on, wanted at least 2; "
                "film more photos that overlap"
            )
        self._longest_px = longest_px
        self._kept_bytes = kept_bytes
        self.surfaces: Mapping[str, Surface] = {}
        self._targets: OrderedDict[tuple[str, int], TrainingTarget] = OrderedDict()

    def target(self, view: View, shrink: int) -> TrainingTarget:
        """A view's photo to train on, its sides divided by `shrink`; kept for the next time."""
        key = (view.name, shrink)
        target = self._targets.get(key)
        if target is None:
            photo = read_photo(view, self._longest_px, shrink)
            surface = self.surfaces.get(view.name)
            bounds = None if surface is None else depth_bounds(surface, photo.camera)
            target = photo.target(bounds)
            self._targets[key] = target
            while len(self._targets) > 1 and self.kept > self._kept_bytes:
                self._targets.popitem(last=False)
        self._targets.move_to_end(key)
        return target

    def photo(self, view: View) -> Photo:
        """A view's photo at the full size that is trained on."""
        return read_photo(view, self._longest_px)

    @property
    def kept(self) -> int:
        """Bytes of prepared photos in memory."""
        return sum(target.nbytes for target in self._targets.values())


def smaller(camera: Pinhole | Fisheye, shrink: float) -> Pinhole | Fisheye:
    """The camera of the picture with its sides divided by `shrink`, rounded to whole pixels."""
    if shrink == 1:
        return camera
    width = max(round(camera.width_px / shrink), 1)
    height = max(round(camera.height_px / shrink), 1)
    x, y = width / camera.width_px, height / camera.height_px
    if isinstance(camera, Pinhole):
        return Pinhole(width, height, camera.fx * x, camera.fy * y, camera.cx * x, camera.cy * y)
    # An equidistant lens has one focal length; a pixel of rounding goes to the centre.
    return Fisheye(width, height, camera.f_px * x, camera.cx * x, camera.cy * y, camera.max_angle)


def typical_distance(reconstruction: Reconstruction) -> float:
    """Median over views of the median distance to the points that they see.

    Raises:
        ValueError: no view sees a point: the poses and the points are not of one world.
    """
    medians = []
    for view in reconstruction.views:
        in_camera = view.world_from_camera.inverse() @ reconstruction.points
        _, is_seen = view.camera.project(in_camera)
        if is_seen.any():
            medians.append(float(np.median(np.linalg.norm(in_camera[is_seen], axis=1))))
    if not medians:
        raise ValueError(
            "training: no view sees a point; the poses and the points are not of one world"
        )
    return float(np.median(medians))


def depth_bounds(surface: Surface, camera: Pinhole | Fisheye) -> DepthBounds:
    """Depth bounds of a photo's pixels by its surface.

    Args:
        surface: of the same view.
        camera: its lens at the size wanted.
    """
    slack = np.where(surface.is_seen, SEEN_SLACK, LENT_SLACK)
    is_known = surface.is_seen | surface.is_propagated
    near = np.where(is_known, surface.depth * (1 - slack), 0.0)
    far = np.where(is_known, surface.depth * (1 + slack), FARTHEST)
    size = (camera.width_px, camera.height_px)
    near, far = (cv2.resize(v, size, interpolation=cv2.INTER_NEAREST) for v in (near, far))
    return DepthBounds(near.astype(np.float32), far.astype(np.float32))
