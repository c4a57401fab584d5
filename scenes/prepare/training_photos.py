"""The photos of a training, at the sizes it asks for, in bounded memory."""

from __future__ import annotations

from collections import OrderedDict

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.prepare.reconstruction import Reconstruction, View, read_picture
from scenes.render.training import TrainingTarget

KEPT_BYTES = 1_500_000_000
"""Prepared photos kept; the one not used for longest goes first and is read again if needed."""


class Photos:
    """Views to train on and views kept aside; pictures are read when first needed.

    Args:
        reconstruction: its views.
        held_out_every: every so many-th view is kept aside, the last of each group; 0 keeps none.
        kept_bytes: memory for prepared photos.

    Raises:
        ValueError: fewer than two views are left to train on.
    """

    def __init__(
        self, reconstruction: Reconstruction, held_out_every: int, kept_bytes: int = KEPT_BYTES
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
        self._kept_bytes = kept_bytes
        self._targets: OrderedDict[tuple[str, int], TrainingTarget] = OrderedDict()

    def target(self, view: View, shrink: int) -> TrainingTarget:
        """A view's photo, its sides divided by `shrink`."""
        key = (view.name, shrink)
        target = self._targets.get(key)
        if target is None:
            camera = smaller(view.camera, shrink)
            picture = read_picture(view)
            if camera is not view.camera:
                size = (camera.width_px, camera.height_px)
                picture = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA))
            target = TrainingTarget(picture.astype(np.uint8), camera, view.world_from_camera)
            self._targets[key] = target
            while len(self._targets) > 1 and self.kept > self._kept_bytes:
                self._targets.popitem(last=False)
        self._targets.move_to_end(key)
        return target

    @property
    def kept(self) -> int:
        """Bytes of prepared photos in memory."""
        return sum(target.nbytes for target in self._targets.values())


def smaller(camera: Pinhole | Fisheye, shrink: int) -> Pinhole | Fisheye:
    """The camera of the picture with its sides divided by `shrink`, rounded to whole pixels."""
    if shrink == 1:
        return camera
    width = max(camera.width_px // shrink, 1)
    height = max(camera.height_px // shrink, 1)
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


def as_floats(picture: NDArray[np.uint8]) -> NDArray[np.float32]:
    """0..255 to 0..1."""
    return picture.astype(np.float32) / np.float32(255)
