"""`scenes.prepare.cutout.likewise`: another reconstruction is taken apart as the scan was."""

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.cut import Cut
from scenes.frames import look_at
from scenes.package import ScenePackage
from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.prepare.cutout.likewise import masks_of, taken_apart_like
from scenes.render.native import NativeRenderer
from scenes.splats import concatenate
from scenes.state import ObjectModel

SIZE = (0.3, 0.3, 0.3)


def views(count=8):
    camera = Pinhole(320, 240, 260.0, 260.0, 160.0, 120.0)
    found = []
    for k in range(count):
        turn = 2 * np.pi * k / count
        eye = np.array([1.5 * np.cos(turn), 1.5 * np.sin(turn), 1.1])
        found.append(ViewPoint(f"{k}.jpg", camera, look_at(eye, np.array([0, 0, 0.1]))))
    return tuple(found)


@pytest.fixture(scope="module")
def scan(box_on_floor):
    floor, box = box_on_floor(SIZE, floor_m=1.5, step_m=0.02)
    item = ObjectModel("box", "Box", "box", box, SIZE, 0.0, Pose.identity())
    places = np.arange(len(box), dtype=np.uint32)
    cut = Cut("box", places, box, np.ones(len(box), bool), 0)
    return ScenePackage(
        name="floor",
        room=floor,
        objects=(item,),
        codes=(),
        world_from_rig=Pose.identity(),
        footprint_m=np.array([[-1.5, -1.5], [1.5, 1.5]]),
        physical=None,
        views=views(),
        cuts=(cut,),
    )


@pytest.fixture(scope="module")
def second(box_on_floor):
    """Laid at other steps, so that no splat is the scan's."""
    floor, box = box_on_floor(SIZE, floor_m=1.5, step_m=0.023)
    return floor, box


def test_masks_are_the_object_from_different_sides(scan):
    masks = masks_of(scan, scan.objects[0], NativeRenderer())
    assert len(masks) == 3
    assert all(view.mask.sum() > 500 for view in masks)
    assert len({view.name for view in masks}) == 3


def test_an_object_that_no_view_shows_has_no_masks(scan):
    away = Pose.from_yaw(0.0, (8.0, 0.0, 0.0))
    item = ObjectModel("far", "Far", "box", scan.objects[0].splats, SIZE, 0.0, away)
    with pytest.raises(ValueError, match="far"):
        masks_of(scan, item, NativeRenderer())


def test_the_object_leaves_the_second_room_too(scan, second):
    floor, box = second
    parts = taken_apart_like(scan, concatenate([floor, box]), renderer=NativeRenderer())
    assert parts.missing == {}
    found = parts.objects["box"]
    seen = box.means[:, 2] > 0.0  # nobody saw what it stands on
    assert 0.95 * seen.sum() < len(found) < 1.1 * len(box)
    assert np.abs(found.means).max() < 0.33
    above = parts.room.means[:, 2] > 0.05
    assert above.sum() < 0.03 * len(box)


def test_what_cannot_be_found_stays_and_is_named(scan, second):
    floor, _ = second
    parts = taken_apart_like(scan, floor, renderer=NativeRenderer())
    assert list(parts.missing) == ["box"]
    assert parts.objects == {}
