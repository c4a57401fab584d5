"""The stages of a picture: the same work for every kernel, and counts that add up."""

import numpy as np
import pytest

from benchmarks.raster.stages import stages_of
from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.splats import SH_C0, SplatCloud

PIXELS = 32


def one_splat(*, sigma_m: float, opacity: float = 0.5) -> PosedSplats:
    cloud = SplatCloud(
        np.array([[0.0, 0.0, 1.0]], np.float32),
        np.full((1, 3), sigma_m, np.float32),
        np.array([[1.0, 0.0, 0.0, 0.0]], np.float32),
        np.array([opacity], np.float32),
        np.full((1, 1, 3), 0.3 / SH_C0, np.float32),
    )
    return PosedSplats(cloud, Pose.identity())


def drawn(objects, camera):
    """Stages ready for blending, and the picture."""
    native = NativeRenderer()
    stages = stages_of(native, objects, camera, Pose.identity(), RenderOptions(threads=1))
    stages.project()
    stages.sort()
    stages.bin()
    return stages, native.render(objects, camera, Pose.identity())


PINHOLE = Pinhole.from_fov(PIXELS, PIXELS, np.radians(60.0))


def test_a_sample_is_useful_where_the_picture_has_alpha():
    stages, rendering = drawn([one_splat(sigma_m=0.05)], PINHOLE)
    covered = int((rendering.alpha > 0).sum())
    assert 0 < covered < PIXELS * PIXELS
    for name in NativeRenderer().available_instructions():
        count = stages.count_lanes(name)
        assert count.useful == covered
        lanes = 16 if name == "avx512" else 8
        assert count.processed % lanes == 0
        assert count.useful < count.processed < 3 * covered


def test_a_splat_that_covers_everything_wastes_no_lane():
    stages, _ = drawn([one_splat(sigma_m=50.0)], PINHOLE)
    for name in NativeRenderer().available_instructions():
        count = stages.count_lanes(name)
        assert count.useful == count.processed == PIXELS * PIXELS


def test_nothing_is_useful_outside_the_lens_circle():
    camera = Fisheye.from_fov(PIXELS, np.radians(120.0))
    stages, rendering = drawn([one_splat(sigma_m=50.0)], camera)
    covered = int((rendering.alpha > 0).sum())
    assert covered < PIXELS * PIXELS
    assert stages.count_lanes("scalar").useful == covered


def test_saturated_pixels_take_no_more():
    wall = [one_splat(sigma_m=50.0, opacity=1.0)] * 40
    stages, _ = drawn(wall, PINHOLE)
    # Each takes all but a hundredth of the light: after the second, less than the stop is left.
    assert stages.count_lanes("scalar").useful in (2 * PIXELS * PIXELS, 3 * PIXELS * PIXELS)


def test_stages_can_be_repeated():
    stages, _ = drawn([one_splat(sigma_m=0.05)], PINHOLE)
    before = stages.count_lanes("scalar")
    for _ in range(2):
        stages.project()
        stages.sort()
        stages.bin()
        stages.draw()
        for name in NativeRenderer().available_instructions():
            stages.blend(name)
    assert stages.count_lanes("scalar") == before


def test_the_inner_loop_counts_whole_tiles():
    stages, _ = drawn([], PINHOLE)
    for name in NativeRenderer().available_instructions():
        once = stages.blend_everywhere(name, 1)
        assert stages.blend_everywhere(name, 3) == 3 * once
        assert once % 256 == 0
        assert (once > 0) is (name != "scalar")


def test_unknown_instructions_are_refused():
    stages, _ = drawn([one_splat(sigma_m=0.05)], PINHOLE)
    with pytest.raises(ValueError, match='instructions: got "abacus"'):
        stages.blend("abacus")
    with pytest.raises(ValueError, match='instructions: got "abacus"'):
        stages.blend_everywhere("abacus", 1)


def test_gradients_of_the_wrong_size_are_refused():
    stages, _ = drawn([one_splat(sigma_m=0.05)], PINHOLE)
    with pytest.raises(ValueError, match="wanted 3072"):
        stages.blend_back(np.zeros((4, 4, 3), np.float32), np.zeros((4, 4), np.float32))
