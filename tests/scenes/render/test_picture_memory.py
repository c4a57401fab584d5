import threading

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.render.picture_memory import MAX_BYTES, PictureMemory, rendering_of
from scenes.render.renderer import PosedSplats, RenderOptions

CAMERA = Pinhole.from_fov(40, 30, 1.0)


def where(arrays):
    return [array.ctypes.data for array in arrays]


def test_memory_is_used_again_once_nobody_holds_the_picture():
    memory = PictureMemory()
    arrays = memory.take(1200)
    first = where(arrays)
    picture = rendering_of(arrays, 30, 40)
    memory.give(arrays)
    del arrays
    held = memory.take(1200)
    assert where(held) != first
    corner = picture.depth[:2, :3]
    del picture
    assert where(memory.take(1200)) != first
    del corner
    assert where(memory.take(1200)) == first


def test_other_sizes_get_other_memory():
    memory = PictureMemory()
    arrays = memory.take(100)
    memory.give(arrays)
    del arrays
    assert [len(array) for array in memory.take(50)] == [150, 50, 50, 50]


def test_what_is_kept_is_bounded():
    memory = PictureMemory()
    pixels = MAX_BYTES // 24 // 3
    for _ in range(10):
        memory.give(memory.take(pixels))
    for smaller in range(1, 6):
        memory.give(memory.take(pixels >> smaller))
    kept = [arrays for same in memory._kept.values() for arrays in same]
    assert sum(24 * len(arrays[1]) for arrays in kept) <= MAX_BYTES


def test_the_size_used_longest_ago_goes_first():
    memory = PictureMemory()
    pixels = MAX_BYTES // 24 // 3
    memory.give(memory.take(pixels))
    held = [memory.take(pixels // 4) for _ in range(14)]
    for arrays in held:
        memory.give(arrays)
    kept = [arrays for same in memory._kept.values() for arrays in same]
    assert kept
    assert max(len(arrays[1]) for arrays in kept) < pixels


@pytest.mark.parametrize(
    ("pixels", "most"),
    [(0, 1), (1, 1), (7, 8), (8, 8), (9, 16), (131_072, 131_072), (1_000_003, 1_048_576)],
)
def test_memory_is_a_little_roomier_than_asked(pixels, most):
    memory = PictureMemory()
    memory.give(memory.take(pixels))
    ((arrays,),) = memory._kept.values()
    assert pixels <= len(arrays[1]) <= most


def test_pictures_of_nearly_one_size_share_memory():
    memory = PictureMemory()
    arrays = memory.take(1190)
    first = where(arrays)
    memory.give(arrays)
    del arrays
    assert where(memory.take(1200)) == first


def test_a_picture_that_is_kept_never_changes(random_cloud):
    renderer = NativeRenderer()
    world_from_camera = Pose(np.eye(3), np.array([0.0, 0.0, -4.0]))
    kept = []
    for seed in range(6):
        posed = [PosedSplats(random_cloud(200, 0, seed), Pose.identity())]
        drawn = renderer.render(posed, CAMERA, world_from_camera)
        if seed % 2:
            kept.append((posed, drawn))
    for posed, drawn in kept:
        again = NativeRenderer().render(posed, CAMERA, world_from_camera)
        np.testing.assert_array_equal(drawn.rgb, again.rgb)
        np.testing.assert_array_equal(drawn.ids, again.ids)


def test_what_was_drawn_before_never_shows(random_cloud):
    renderer = NativeRenderer()
    world_from_camera = Pose(np.eye(3), np.array([0.0, 0.0, -4.0]))
    posed = [PosedSplats(random_cloud(300, 0, 1), Pose.identity())]
    options = RenderOptions(region=(4, 5, 17, 9), background=(0.1, 0.2, 0.3))
    clean = NativeRenderer().render(posed, CAMERA, world_from_camera, options)
    for _ in range(3):
        renderer.render(posed, CAMERA, world_from_camera)
    drawn = renderer.render(posed, CAMERA, world_from_camera, options)
    for name in ("rgb", "alpha", "depth", "ids"):
        np.testing.assert_array_equal(getattr(drawn, name), getattr(clean, name))
    empty = renderer.render([], CAMERA, world_from_camera)
    assert not empty.alpha.any()
    assert not empty.rgb.any()
    assert (empty.ids == -1).all()


def test_threads_get_memory_of_their_own(random_cloud):
    renderer = NativeRenderer()
    world_from_camera = Pose(np.eye(3), np.array([0.0, 0.0, -4.0]))
    clouds = [random_cloud(200, 0, seed) for seed in range(4)]
    alone = [
        NativeRenderer().render([PosedSplats(c, Pose.identity())], CAMERA, world_from_camera).rgb
        for c in clouds
    ]
    wrong = []

    def draw(index):
        posed = [PosedSplats(clouds[index], Pose.identity())]
        for _ in range(40):
            drawn = renderer.render(posed, CAMERA, world_from_camera)
            if not np.array_equal(drawn.rgb, alone[index]):
                wrong.append(index)

    threads = [threading.Thread(target=draw, args=(index,)) for index in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong
