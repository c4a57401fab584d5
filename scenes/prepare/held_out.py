"""How well views that were not trained on are drawn."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from scenes.prepare.exposure import fitted
from scenes.prepare.reconstruction import View, read_picture
from scenes.prepare.trainer import ViewScore
from scenes.prepare.training_photos import as_floats
from scenes.render.renderer import PosedSplats, Renderer, RenderOptions
from scenes.render.training import Exposure, TrainingTarget
from scenes.splats import SplatCloud

BEST_PSNR_DB = 99.0
"""Of equal pictures, whose PSNR has no end."""


def psnr_db(drawn: NDArray[np.float32], photo: NDArray[np.float32]) -> float:
    """Peak signal-to-noise ratio of two pictures with values 0..1, dB."""
    error = float(np.mean((drawn.astype(np.float64) - photo) ** 2))
    return BEST_PSNR_DB if error <= 10 ** (-BEST_PSNR_DB / 10) else -10 * np.log10(error)


def draw_view(
    renderer: Renderer, cloud: SplatCloud, view: View, options: RenderOptions
) -> NDArray[np.float32]:
    """(H, W, 3) picture of the splats, 0..1, from where a view's photo was taken."""
    posed = PosedSplats(cloud, Pose.identity())
    drawn = renderer.render([posed], view.camera, view.world_from_camera, options)
    return np.clip(drawn.rgb, 0, 1)


def score_view(
    renderer: Renderer,
    cloud: SplatCloud,
    view: View,
    options: RenderOptions,
    *,
    lens: Exposure | None,
) -> ViewScore:
    """PSNR and SSIM of a view.

    Args:
        renderer: draws.
        cloud: splats in the view's world.
        view: whose photo to compare with.
        options: how to draw.
        lens: if given, its falloff darkens the drawn picture, which then gets the gain and bias
            that suit the photo best: nobody knows the exposure of a photo not trained on.
    """
    photo = read_picture(view)
    drawn = draw_view(renderer, cloud, view, options)
    if lens is not None:
        drawn = fitted(drawn, as_floats(photo), lens)
    target = TrainingTarget(photo, view.camera, view.world_from_camera)
    distance, _ = target.distance(drawn, Exposure())
    return ViewScore(view.name, psnr_db(drawn, as_floats(photo)), 1 - distance.dssim)
