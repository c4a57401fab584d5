"""From marks to masks."""

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.prepare.cutout.marks.masks import Prompt
from scenes.prepare.cutout.marks.prompted_views import PromptedView, drawn_picture, masked_views
from scenes.render.native import NativeRenderer

CAMERA = Pinhole(160, 120, 140.0, 140.0, 80.0, 60.0)
BOX = (40.0, 30.0, 100.0, 90.0)
HERE = look_at(np.array([1.2, 0.0, 0.7]), np.array([0.0, 0.0, 0.2]))


class Told:
    """Masks that keep the pictures they were asked about and answer what they were told to."""

    def __init__(self, answer):
        self.answer = answer
        self.pictures = []

    def mask(self, picture, prompt):
        self.pictures.append(picture)
        return self.answer


@pytest.fixture(scope="module")
def cloud(box_on_floor):
    floor, _ = box_on_floor((0.3, 0.2, 0.4), floor_m=1.0, step_m=0.05)
    return floor


def test_the_photo_is_looked_at_and_the_splats_where_there_is_none(cloud):
    photo = np.full((120, 160, 3), 77, dtype=np.uint8)
    mask = np.zeros((120, 160), dtype=bool)
    mask[40:80, 50:90] = True
    masks = Told(mask)
    views = [
        PromptedView("photo", CAMERA, HERE, Prompt(BOX), photo),
        PromptedView("drawn", CAMERA, HERE, Prompt(BOX)),
    ]
    masked = masked_views(cloud, views, masks=masks, renderer=NativeRenderer())
    assert masks.pictures[0] is photo
    drawn = drawn_picture(cloud, views[1], NativeRenderer())
    np.testing.assert_array_equal(masks.pictures[1], drawn)
    assert [view.name for view in masked] == ["photo", "drawn"]
    assert all((view.mask == mask).all() and view.box_px == BOX for view in masked)


def test_a_lost_mask_is_the_box(cloud):
    masks = Told(np.zeros((120, 160), dtype=bool))
    view = PromptedView("v", CAMERA, HERE, Prompt(BOX))
    (masked,) = masked_views(cloud, [view], masks=masks, renderer=NativeRenderer())
    rows, columns = np.nonzero(masked.mask)
    assert (columns.min(), columns.max() + 1, rows.min(), rows.max() + 1) == (40, 100, 30, 90)
    assert masked.mask.sum() == 60 * 60


def test_a_picture_of_another_size_is_refused():
    with pytest.raises(ValueError, match="view v: a picture of"):
        PromptedView("v", CAMERA, HERE, Prompt(BOX), np.zeros((4, 4, 3), dtype=np.uint8))
