"""360° pictures: recognised by what they show, and cut into flat views."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from scenes.prepare.footage.equirectangular import (
    cut,
    flat_views,
    has_spherical_metadata,
    is_dual_fisheye,
    is_equirectangular,
)


def directions(width, height):
    """(H, W, 3) right, down and forward of every pixel of an equirectangular picture."""
    yaw = ((np.arange(width) + 0.5) / width - 0.5) * 2 * np.pi
    down = ((np.arange(height) + 0.5) / height - 0.5) * np.pi
    yaw, down = np.meshgrid(yaw, down)
    return np.stack([np.sin(yaw) * np.cos(down), np.sin(down), np.cos(yaw) * np.cos(down)], -1)


def painted(d):
    """A colour for every direction."""
    return 127 + 100 * np.stack([np.sin(7 * d[..., 0]), np.sin(9 * d[..., 1]), d[..., 2]], -1)


@pytest.fixture(scope="module")
def sphere():
    return painted(directions(1024, 512)).astype(np.uint8)


def test_a_sphere_is_recognised_and_flat_pictures_are_not(sphere, speckled):
    grey = cv2.cvtColor(sphere, cv2.COLOR_BGR2GRAY)
    assert is_equirectangular([grey])
    assert not is_equirectangular([grey[:, :900]])
    assert not is_equirectangular([])
    rng = np.random.default_rng(2)
    wide = np.hstack([speckled(rng), speckled(rng)])
    assert not is_equirectangular([cv2.cvtColor(wide, cv2.COLOR_BGR2GRAY)])
    assert not is_equirectangular([np.full((100, 200), 90, np.uint8)])


def test_flat_views_show_what_lies_in_their_direction(sphere):
    views = flat_views(1024, 512)
    assert len(views) == 6
    for number, view in enumerate(views):
        flat = cut(sphere, view).astype(float)
        size = len(flat)
        at = (np.arange(size) + 0.5 - size / 2) / view.focal_px
        x, y = np.meshgrid(at, at)
        turn = 2 * np.pi * number / 6
        d = np.stack([x * np.cos(turn) + np.sin(turn), y, np.cos(turn) - x * np.sin(turn)], -1)
        d /= np.linalg.norm(d, axis=-1, keepdims=True)
        assert np.abs(flat - painted(d)).mean() < 1.5


def test_two_fisheye_circles_are_recognised(sphere):
    circles = np.zeros((256, 512), np.uint8)
    for x in (128, 384):
        cv2.circle(circles, (x, 128), 126, 150, -1)
    assert is_dual_fisheye([circles])
    assert not is_equirectangular([circles])
    assert not is_dual_fisheye([cv2.cvtColor(sphere, cv2.COLOR_BGR2GRAY)])


def test_metadata_are_found_at_either_end(tmp_path):
    for name, data in (("a", b"x" * 99 + b"sv3d"), ("b", b"GSpherical:Spherical" + b"x" * 99)):
        (tmp_path / name).write_bytes(data)
        assert has_spherical_metadata(tmp_path / name)
    (tmp_path / "c").write_bytes(b"x" * 99)
    assert not has_spherical_metadata(tmp_path / "c")
