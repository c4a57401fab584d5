"""How well views that were not trained on are drawn."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from scenes.prepare.train.optimiser.exposure import fitted
from scenes.prepare.train.trainer import ViewScore
from scenes.prepare.train.training_photos import Photo
from scenes.render.renderer import PosedSplats, Renderer, RenderOptions
from scenes.render.training import Exposure
from scenes.splats import SplatCloud

BEST_PSNR_DB = 99.0
"""Of equal pictures, whose PSNR has no end."""


def psnr_db(drawn: NDArray[np.float32], photo: NDArray[np.float32]) -> float:
    """Peak signal-to-noise ratio of two pictures with values 0..1, dB."""
    error = float(np.mean((drawn.astype(np.float64) - photo) ** 2))
    return BEST_PSNR_DB if error <= 10 ** (-BEST_PSNR_DB / 10) else -10 * np.log10(error)


def draw_photo(
    renderer: Renderer, cloud: SplatCloud, photo: Photo, options: RenderOptions
) -> NDArray[np.float32]:
    """(H, W, 3) picture of the splats, 0..1, from where a photo was taken."""
    posed = PosedSplats(cloud, Pose.identity())
    drawn = renderer.render([posed], photo.camera, photo.world_from_camera, options)
    return np.clip(drawn.rgb, 0, 1)


def score_photo(
    renderer: Renderer,
    cloud: SplatCloud,
    photo: Photo,
    options: RenderOptions,
    *,
    lens: Exposure | None,
) -> ViewScore:
    """PSNR and SSIM of the splats against a photo.

    Args:
        renderer: draws.
        cloud: splats in the photo's world.
        photo: at the size at which to compare.
        options: how to draw.
        lens: if given, its falloff darkens the drawn picture, which then gets the gain and bias
            that suit the photo best: nobody knows the exposure of a photo not trained on.
    """
    drawn = draw_photo(renderer, cloud, photo, options)
    if lens is not None:
        drawn = fitted(drawn, photo.colours, lens)
    distance, _ = photo.target().distance(drawn, Exposure())
    return ViewScore(photo.name, psnr_db(drawn, photo.colours), 1 - distance.dssim)
