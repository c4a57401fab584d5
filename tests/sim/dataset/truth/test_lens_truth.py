"""`sim.dataset.truth.lens_truth`: range, ids, silhouettes against rays and against the camera."""

from contextlib import closing

import numpy as np
import pytest

from scenes.cameras import pixel_centres
from sim.bodies import Placement, body_of_object
from sim.camera.camera360 import Camera360, default_rig
from sim.dataset.truth.lens_truth import ROOM, LensTruthPass

RIG = default_rig(240)


@pytest.fixture(scope="module")
def truths(small_room):
    places = {item.object_id: item.world_from_object for item in small_room.objects}
    with closing(LensTruthPass(small_room, RIG)) as truth_pass:
        return truth_pass.frame(small_room.world_from_rig, places, {})


def test_range_of_the_floor_follows_its_plane(truths):
    truth = truths[0]
    rays = truth.lens.unproject(pixel_centres(truth.lens)) @ truth.world_from_lens.rotation.T
    eye = truth.world_from_lens.translation
    range_m = truth.range_m.ravel()
    with np.errstate(divide="ignore"):
        expected = -eye[2] / rays[:, 2]
    hit = eye + range_m[:, None] * rays
    on_floor = (truth.ids.ravel() == ROOM) & (rays[:, 2] < -0.2) & (np.abs(hit[:, 2]) < 0.01)
    on_floor &= (np.abs(hit[:, :2]) < 1.9).all(axis=1)
    on_floor &= np.linalg.norm(hit[:, :2] - eye[:2], axis=1) > 0.4  # beyond the camera's feet
    assert on_floor.sum() > 2000
    # The lowest centimetre of the table's sides counts as floor here: a few pixels.
    assert np.quantile(np.abs(range_m - expected)[on_floor], 0.995) < 0.004


def test_ids_agree_with_the_camera(small_room, truths):
    camera = Camera360(
        small_room, RIG, small_room.world_from_rig, [body_of_object(o) for o in small_room.objects]
    )
    with closing(camera):
        view = camera.view(
            {
                item.object_id: Placement((item.world_from_object,), 0.0)
                for item in small_room.objects
            }
        )
    for truth, lens in zip(truths, view.lenses, strict=True):
        # The camera samples a quarter of a pixel beside the centre: borders may differ.
        assert (truth.ids != lens.ids).mean() < 0.003
        for number in (1, 2):
            ours = np.count_nonzero(truth.ids == number)
            assert abs(ours - np.count_nonzero(lens.ids == number)) <= 0.1 * ours + 2


def test_a_silhouette_holds_what_is_visible(truths):
    for number, name in ((1, "chair-1"), (2, "book-1")):
        alone = truths[0].silhouettes[name]
        visible = truths[0].ids == number
        whole = np.zeros_like(visible)
        whole[alone.rect.rows_columns] = alone.mask
        assert alone.mask.any()
        assert not (visible & ~whole).any()
