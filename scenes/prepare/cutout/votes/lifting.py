"""From masks in pictures to votes of splats: how much of a splat's light lies inside them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.prepare.cutout.marks.masked_view import MaskedView
from scenes.render.gradients import record
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.splats import SH_C0, SplatCloud

FloatArray = NDArray[np.float32]

FULL_SIGHT = 0.5
"""Blend weight, in pixels, from which on a vote counts half."""


@dataclass(frozen=True, slots=True, eq=False)
class Vote:
    """Vote of one view on every splat.

    Attributes:
        inside: (N,) float32, blend weight that falls into the mask, summed over pixels.
        seen: (N,) float32, all blend weight.
        depth: (H, W) float32, of what is drawn there; as `Rendering.depth`.
    """

    inside: FloatArray
    seen: FloatArray
    depth: FloatArray


def lift(cloud: SplatCloud, view: MaskedView, *, renderer: NativeRenderer) -> Vote:
    """The blend weights of every splat inside the view's mask, and all of them.

    The sum of a splat's blend weights over pixels is the gradient of the picture's sum by the
    splat's colour, which the renderer gives at the cost of one drawing.
    """
    grey = _grey(cloud)
    d_rgb = np.zeros((*view.mask.shape, 3), dtype=np.float32)
    d_rgb[..., 0] = view.mask
    d_rgb[..., 1] = 1.0
    recording = record(
        renderer, [PosedSplats(grey, Pose.identity())], view.camera, view.world_from_camera
    )
    by_colour = recording.gradients(d_rgb=d_rgb).objects[0].sh[:, 0, :] / SH_C0
    return Vote(by_colour[:, 0].copy(), by_colour[:, 1].copy(), recording.rendering.depth)


def inside_share(votes: Sequence[Vote]) -> NDArray[np.float64]:
    """(N,) share of a splat's light inside the masks, where each view that sees it has one voice.

    Summed over pixels, a near view's mask that holds too much would outvote two from farther away.
    """
    inside = np.stack([vote.inside for vote in votes]).astype(np.float64)
    seen = np.stack([vote.seen for vote in votes]).astype(np.float64)
    voice = seen / (seen + FULL_SIGHT)
    said = (voice * inside / np.maximum(seen, 1e-6)).sum(axis=0)
    return said / np.maximum(voice.sum(axis=0), FULL_SIGHT)


def share(
    cloud: SplatCloud,
    labels: NDArray[np.bool_],
    camera: Pinhole | Fisheye,
    world_from_camera: Pose,
    *,
    renderer: NativeRenderer,
) -> FloatArray:
    """(H, W) share of each pixel's light that comes from the labelled splats, 0..1."""
    marks = np.where(labels, 0.5, -0.5) / SH_C0
    sh = np.repeat(marks[:, None, None], 3, axis=2).astype(np.float32)
    marked = SplatCloud(cloud.means, cloud.scales, cloud.rotations, cloud.opacities, sh)
    drawn = renderer.render(
        [PosedSplats(marked, Pose.identity())], camera, world_from_camera, RenderOptions()
    )
    return drawn.rgb[..., 0]


def _grey(cloud: SplatCloud) -> SplatCloud:
    """The same cloud in mid grey: a colour at its limit lets no gradient through."""
    sh = np.zeros((len(cloud), 1, 3), dtype=np.float32)
    return SplatCloud(cloud.means, cloud.scales, cloud.rotations, cloud.opacities, sh)
