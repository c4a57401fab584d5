from __future__ import annotations

import cv2
import numpy as np
import pytest

from scenes.prepare.footage.sharpness import QualityLimits, Reason, displacement, judge, verdict


@pytest.fixture(scope="module")
def grey(speckled) -> np.ndarray:
    return cv2.cvtColor(speckled(np.random.default_rng(0)), cv2.COLOR_BGR2GRAY)


def test_blur_grows_with_the_blur_of_a_picture(grey):
    blurs = [judge(cv2.GaussianBlur(grey, (0, 0), s)).blur for s in (0.5, 1.5, 3.0, 6.0)]
    assert judge(grey).blur < blurs[0] < blurs[1] < blurs[2] < blurs[3] <= 1.0


@pytest.mark.parametrize("shape", [(1, 25), (25, 1)])
def test_a_camera_that_swept_one_way_is_found_out(grey, shape):
    swept = cv2.blur(grey, shape[::-1])
    assert verdict(judge(swept), judge(grey).blur, QualityLimits()) is Reason.BLURRED
    assert verdict(judge(grey), judge(grey).blur, QualityLimits()) is None


def test_blur_hardly_depends_on_contrast(grey):
    faint = (grey * 0.3 + 90).astype(np.uint8)
    assert judge(faint).blur == pytest.approx(judge(grey).blur, abs=0.05)


def test_dark_and_empty_pictures_are_called_that(grey):
    limits = QualityLimits()
    assert verdict(judge(grey // 20), 0.3, limits) is Reason.DARK
    assert verdict(judge(np.full_like(grey, 130)), 0.3, limits) is Reason.EMPTY
    noise = np.random.default_rng(1).normal(130, 1.5, grey.shape).astype(np.uint8)
    assert verdict(judge(noise), 0.3, limits) is Reason.EMPTY


def test_a_small_sign_on_a_bare_wall_is_enough(grey):
    wall = np.full((512, 512), 180, dtype=np.uint8)
    wall[200:270, 300:370] = grey[:70, :70]
    assert verdict(judge(wall), judge(wall).blur, QualityLimits()) is None


@pytest.mark.parametrize("shift", [0, 12, 40])
def test_displacement_is_the_shift_over_the_width(grey, shift):
    a, b = grey[:, : 512 - shift], grey[:, shift:]
    assert displacement(a, b) == pytest.approx(shift / a.shape[1], abs=0.004)


def test_another_scene_counts_as_far_away(grey, speckled):
    black = np.zeros_like(grey)
    assert displacement(grey, black) == 1.0
    assert displacement(black, grey) == 1.0
    assert displacement(grey, grey[:300]) == 1.0
