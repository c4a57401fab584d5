"""A ball of flat splats, its photos, and a coarse room made of it: what a refinement mends."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.prepare.reconstruction import View
from scenes.render.native import NativeRenderer
from scenes.render.reduction import merged
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.splats import SH_C0, SplatCloud


def flat_ball(n=3000, seed=2):
    """Opaque discs along a ball of 1 m radius, in soft stripes."""
    rng = np.random.default_rng(seed)
    means = rng.normal(size=(n, 3))
    means /= np.linalg.norm(means, axis=1, keepdims=True)
    colours = 0.5 + 0.3 * np.sin(means @ rng.normal(0, 4, (3, 3)))
    # From z to the normal, about the axis across both.
    turns = np.column_stack([1 + means[:, 2], -means[:, 1], means[:, 0], np.zeros(n)])
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    return SplatCloud(
        means.astype(np.float32),
        np.tile(np.float32([0.05, 0.05, 0.002]), (n, 1)),
        turns.astype(np.float32),
        np.full(n, 0.98, np.float32),
        ((colours - 0.5) / SH_C0)[:, None].astype(np.float32),
    )


@pytest.fixture(scope="session")
def ball_views(tmp_path_factory):
    """Sixteen photos of the ball, 96 × 72 px, from all around."""
    folder, camera = tmp_path_factory.mktemp("ball"), Pinhole.from_fov(96, 72, np.radians(50))
    views = []
    for k in range(16):
        angle = 2 * np.pi * k / 16
        eye = np.array([3 * np.cos(angle), 3 * np.sin(angle), 0.8 + 0.8 * np.sin(3 * angle)])
        pose = look_at(eye, np.zeros(3))
        drawn = NativeRenderer().render(
            [PosedSplats(flat_ball(), Pose.identity())], camera, pose, RenderOptions()
        )
        path = folder / f"{k:02d}.png"
        cv2.imwrite(str(path), np.round(255 * np.clip(drawn.rgb, 0, 1))[..., ::-1])
        views.append(View(path.name, path, camera, pose))
    return tuple(views)


@pytest.fixture(scope="session")
def coarse_ball() -> SplatCloud:
    """The ball in a few hundred splats, each of several colours."""
    return merged(flat_ball(), 0.2)


@pytest.fixture(scope="session")
def is_upper(coarse_ball) -> np.ndarray:
    return coarse_ball.means[:, 2] > 0.0
