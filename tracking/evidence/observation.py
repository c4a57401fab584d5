"""Observation of a window, in the terms in which every pose of an object is compared.

Each pixel has three competing accounts: the room as it was without the object, something that is in
no scan, and the object at a pose. The first two do not depend on the pose and are computed here,
once per window; `tracking.likelihood.pose_likelihood` adds the third.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye
from scenes.pose import Pose
from tracking.background.images import expose
from tracking.evidence.evidence import Evidence, Scene
from tracking.model.misfit import MAX_MISFIT, misfit
from tracking.window.filters import blurred, resized
from tracking.window.window import Layer

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

SURROUNDINGS_PX = 2.5
"""Gaussian blur, px, that predicts a pixel of an unknown object from those around it: about twice
the blur of a lens, below which neighbours are no prediction but the same measurement."""

FOREGROUND_VARIANCE = 9.0
"""Half the denominator of the exponent by which `tracking.background.images.difference` turns a
squared difference into a probability: maps it back to a misfit."""

SURE_FOREGROUND = 1.0 - 1e-4
"""Largest probability of change that is mapped back; beyond it the misfit is at its cap anyway."""


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """A window, with what it shows if the object is not in it.

    Attributes:
        live: (H, W, 3) float32 0..1.
        empty: (H, W, 3) float32, the window without the object; the live picture where others are.
        expected: (H, W, 3) float32, the room and the others in it as scanned, without the object.
        changed: (H, W) float32 0..1, probability that a pixel does not show the empty room.
        room_misfit: (H, W) float32 nats of the live picture as the empty room.
        foreign_misfit: (H, W) float32 nats of the live picture as something that is in no scan: how
            badly its surroundings predict each pixel.
        hidden: (H, W) float32 0..1, behind a nearer tracked object.
        range_m: (H, W) float32, distance of the static room; 0 where unknown.
        camera: of the window.
        world_from_camera: its pose.
        lens_px: pixels of the lens, each way, that one pixel is the mean of.
        in_any_light: whether the room may be in another light than it is expected in: in the first
            frame, and where an object is looked for. A shade there is no object.
    """

    live: FloatArray
    empty: FloatArray
    expected: FloatArray
    changed: FloatArray
    room_misfit: FloatArray
    foreign_misfit: FloatArray
    hidden: FloatArray
    range_m: FloatArray
    camera: Fisheye
    world_from_camera: Pose
    lens_px: int
    in_any_light: bool

    def shrunk(self, times: int) -> Observation:
        """The same seen with so many times fewer pixels each way."""
        height, width = self.changed.shape
        size = (width // times, height // times)
        if times == 1 or min(size) == 0:
            return self

        def smaller(picture: FloatArray) -> FloatArray:
            whole = picture[: size[1] * times, : size[0] * times]
            return resized(np.ascontiguousarray(whole), size)

        camera = replace(
            self.camera,
            width_px=size[0],
            height_px=size[1],
            f_px=self.camera.f_px / times,
            cx=self.camera.cx / times,
            cy=self.camera.cy / times,
        )
        return observation_of(
            smaller(self.live),
            smaller(self.empty),
            smaller(self.expected),
            smaller(self.changed),
            hidden=smaller(self.hidden),
            range_m=smaller(self.range_m),
            camera=camera,
            world_from_camera=self.world_from_camera,
            lens_px=self.lens_px * times,
            in_any_light=self.in_any_light,
        )


def observe(scene: Scene, evidence: Evidence) -> Observation:
    """The observation of an object's window."""
    view, live = evidence.view, evidence.live
    height, width = live.shape[:2]
    cut = (
        slice(view.top, view.top + height * view.shrink),
        slice(view.left, view.left + width * view.shrink),
    )
    lens = scene.frame.rig.lenses[view.lens]

    def small(picture: FloatArray) -> FloatArray:
        return resized(np.ascontiguousarray(picture), (width, height))

    columns: Points = np.arange(int(width), dtype=np.float64) + 0.5
    rows: Points = np.arange(int(height), dtype=np.float64) + 0.5
    x = (view.left + columns * view.shrink) * 2 / lens.width_px - 1
    y = (view.top + rows * view.shrink) * 2 / lens.height_px - 1
    radius2 = (x[None, :] ** 2 + y[:, None] ** 2).astype(np.float32)
    plain = scene.background.images[view.lens][cut]
    laid, alpha = with_layers(plain, evidence.layers, cut)
    exposure = scene.exposures[view.lens]
    room = expose(small(plain), exposure, radius2=radius2)
    expected = expose(small(laid), exposure, radius2=radius2)
    return observation_of(
        live,
        laid_over(room, live, alpha=small(alpha)),
        expected,
        evidence.foreground,
        hidden=evidence.hidden,
        range_m=small(scene.background.ranges_m[view.lens][cut]),
        camera=view.camera,
        world_from_camera=view.world_from_camera,
        lens_px=view.shrink,
        in_any_light=scene.is_first,
    )


def laid_over(behind: FloatArray, picture: FloatArray, *, alpha: FloatArray) -> FloatArray:
    """(H, W, 3) a picture over another one, covering (H, W) so much of it."""
    laid = np.empty(picture.shape, dtype=np.float32)
    # By channel: numpy takes thrice as long where its innermost loop runs over three values.
    for channel in range(3):
        laid[..., channel] = alpha * picture[..., channel] + (1.0 - alpha) * behind[..., channel]
    return laid


def observation_of(
    live: FloatArray,
    empty: FloatArray,
    expected: FloatArray,
    changed: FloatArray,
    *,
    hidden: FloatArray,
    range_m: FloatArray,
    camera: Fisheye,
    world_from_camera: Pose,
    lens_px: int,
    in_any_light: bool = False,
) -> Observation:
    """An observation of pictures of one size.

    Args:
        live: (H, W, 3) 0..1.
        empty: (H, W, 3) the same without the object.
        expected: (H, W, 3) the room and other objects as scanned.
        changed: (H, W) probability that a pixel does not show the empty room.
        hidden: (H, W) 0..1, behind a nearer tracked object.
        range_m: (H, W) distance of what stands still; 0 where unknown.
        camera: of the pictures.
        world_from_camera: its pose.
        lens_px: pixels of the lens, each way, that one pixel is the mean of.
        in_any_light: whether the room may be in another light than it is expected in: in the first
            frame, and where an object is looked for. A shade there is no object.
    """
    sure = np.minimum(changed, SURE_FOREGROUND)
    room_misfit = np.minimum(-FOREGROUND_VARIANCE * np.log1p(-sure), MAX_MISFIT)
    return Observation(
        live=live,
        empty=empty,
        expected=expected,
        changed=changed,
        room_misfit=room_misfit.astype(np.float32),
        foreign_misfit=misfit(live - blurred(live, SURROUNDINGS_PX)),
        hidden=hidden,
        range_m=range_m,
        camera=camera,
        world_from_camera=world_from_camera,
        lens_px=lens_px,
        in_any_light=in_any_light,
    )


def with_layers(
    room: FloatArray, layers: Sequence[Layer], cut: tuple[slice, slice]
) -> tuple[FloatArray, FloatArray]:
    """(H, W, 3) a part of an empty lens with objects laid over it; (H, W) how much they cover.

    Args:
        room: the part, before exposure.
        layers: objects, the farthest first.
        cut: rows and columns of the part.
    """
    rows, columns = cut
    laid = room.copy()
    others = np.zeros(room.shape[:2], np.float32)
    for layer in layers:
        height, width = layer.alpha.shape
        top, bottom = max(layer.top, rows.start), min(layer.top + height, rows.stop)
        left, right = max(layer.left, columns.start), min(layer.left + width, columns.stop)
        if top >= bottom or left >= right:
            continue
        here = (
            slice(top - layer.top, bottom - layer.top),
            slice(left - layer.left, right - layer.left),
        )
        there = (
            slice(top - rows.start, bottom - rows.start),
            slice(left - columns.start, right - columns.start),
        )
        alpha = layer.alpha[here]
        laid[there] = layer.rgb[here] + (1.0 - alpha)[..., None] * laid[there]
        np.maximum(others[there], alpha, out=others[there])
    return laid, others
