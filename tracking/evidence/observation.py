"""Observation of a window, in the terms in which every pose of an object is compared.

Each pixel has three competing accounts: the room as it was without the object, something that is in
no scan, and the object at a pose. The first two do not depend on the pose and are computed here,
once per window; `tracking.likelihood.pose_likelihood` adds the third.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye
from scenes.pose import Pose
from tracking.background.images import expose
from tracking.evidence.evidence import Evidence, Scene
from tracking.model.misfit import MAX_MISFIT, RESIDUAL_SIGMA, misfit
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

SHADOW_PX = 2.5
"""Gaussian blur, px, of the pixels that one shadow darkens by the same factor: as of those that
predict a pixel of an unknown object."""

DARKEST_SHADOW = 0.4
"""Share of the room's light that is left in the darkest shadow."""

SHADOWED = 0.3
"""Odds of a shadow on a place of the empty room against none. With 0.1 and 0.3, the log loss of 90
labelled windows of two random rooms is 0.78 and 0.76, and 0.91 without shadows."""

DARK = 1e-4
"""Square of a colour of the room from which a shadow on it shows."""

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
        foreground: (H, W) float32 0..1, probability that it shows something in front of the room:
            in the first frame a shadow is none; later a passer-by may look like one.
        room_misfit: (H, W) float32 nats of the live picture as the empty room; in a shadow, too,
            in the first frame and where an object is looked for.
        foreign_misfit: (H, W) float32 nats of the live picture as something that is in no scan: how
            badly its surroundings predict each pixel.
        hidden: (H, W) float32 0..1, behind a nearer tracked object.
        claimed: (H, W) float32 0..1, covered by the object at another of the compared poses: no
            surroundings of it, see `tracking.likelihood.drawn_object.claim`.
        range_m: (H, W) float32, distance of the static room; 0 where unknown.
        camera: of the window.
        world_from_camera: its pose.
        lens_px: pixels of the lens, each way, that one pixel is the mean of.
        in_any_light: whether the room may be in another light than it is expected in: in the first
            frame, and where an object is looked for. A shade there is no object.
        in_shadow: whether shadows may have fallen on the room since it was learned.
    """

    live: FloatArray
    empty: FloatArray
    expected: FloatArray
    changed: FloatArray
    foreground: FloatArray
    room_misfit: FloatArray
    foreign_misfit: FloatArray
    hidden: FloatArray
    claimed: FloatArray
    range_m: FloatArray
    camera: Fisheye
    world_from_camera: Pose
    lens_px: int
    in_any_light: bool
    in_shadow: bool

    def shadowed(self) -> Observation:
        """The same where shadows may have fallen on the room since it was learned."""
        if self.in_shadow:
            return self
        misfit_here = np.minimum(misfit_in_shadow(self.live, self.empty), MAX_MISFIT)
        room_misfit = np.minimum(self.room_misfit, misfit_here).astype(np.float32)
        return replace(self, room_misfit=room_misfit, in_shadow=True)

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
            claimed=smaller(self.claimed),
            range_m=smaller(self.range_m),
            camera=camera,
            world_from_camera=self.world_from_camera,
            lens_px=self.lens_px * times,
            in_any_light=self.in_any_light,
            in_shadow=self.in_shadow,
        )


def observe(scene: Scene, evidence: Evidence, *, is_looked_for: bool = False) -> Observation:
    """The observation of an object's window.

    Args:
        scene: the frame.
        evidence: the window.
        is_looked_for: whether the object is not where it was believed: a shadow there is none.
    """
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
    exposure = scene.exposures[view.lens]
    empty = expected = expose(small(plain), exposure, radius2=radius2)
    if evidence.layers:
        laid, alpha = with_layers(plain, evidence.layers, cut)
        empty = laid_over(empty, live, alpha=small(alpha))
        expected = expose(small(laid), exposure, radius2=radius2)
    return observation_of(
        live,
        empty,
        expected,
        evidence.foreground,
        hidden=evidence.hidden,
        range_m=small(scene.background.ranges_m[view.lens][cut]),
        camera=view.camera,
        world_from_camera=view.world_from_camera,
        lens_px=view.shrink,
        in_any_light=scene.is_first,
        in_shadow=is_looked_for,
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
    claimed: FloatArray | None = None,
    in_any_light: bool = False,
    in_shadow: bool = False,
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
        claimed: (H, W) 0..1, covered by the object at another pose; nothing by default.
        in_any_light: whether the room may be in another light than it is expected in: in the first
            frame, and where an object is looked for. A shade there is no object.
        in_shadow: whether shadows may have fallen on the room since it was learned.
    """
    sure = np.minimum(changed, SURE_FOREGROUND)
    room_misfit = -FOREGROUND_VARIANCE * np.log1p(-sure)
    foreground = changed
    if in_shadow or in_any_light:
        shadow_misfit = misfit_in_shadow(live, empty)
        room_misfit = np.minimum(room_misfit, shadow_misfit)
        if in_any_light:
            unshadowed = 1.0 - np.exp(-shadow_misfit / FOREGROUND_VARIANCE)
            foreground = np.minimum(changed, unshadowed).astype(np.float32)
    return Observation(
        live=live,
        empty=empty,
        expected=expected,
        changed=changed,
        foreground=foreground,
        room_misfit=np.minimum(room_misfit, MAX_MISFIT).astype(np.float32),
        foreign_misfit=misfit(live - blurred(live, SURROUNDINGS_PX)),
        hidden=hidden,
        claimed=np.zeros(changed.shape, np.float32) if claimed is None else claimed,
        range_m=range_m,
        camera=camera,
        world_from_camera=world_from_camera,
        lens_px=lens_px,
        in_any_light=in_any_light,
        in_shadow=in_shadow,
    )


def misfit_in_shadow(live: FloatArray, empty: FloatArray) -> FloatArray:
    """(H, W) nats, without a limit, of a picture as an empty room on which a shadow falls.

    A shadow darkens what is side by side by one factor: of least squares about every pixel.

    Args:
        live: (H, W, 3) the picture.
        empty: (H, W, 3) the room.
    """
    lit, unlit = (
        blurred(np.einsum("...c,...c->...", picture, empty), SHADOW_PX) for picture in (live, empty)
    )
    factor = np.clip(lit / np.maximum(unlit, DARK), DARKEST_SHADOW, 1.0)[..., None]
    apart = live - factor * empty
    squared = np.einsum("...c,...c->...", apart, apart)
    return np.asarray(squared / (2 * RESIDUAL_SIGMA**2) - math.log(SHADOWED), dtype=np.float32)


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
