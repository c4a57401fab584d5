"""The occluder hides the share that it says, as the camera itself counts it."""

from __future__ import annotations

import pytest

from scenes.pose import Pose
from sim.bodies import Placement, body_of_object
from sim.camera.camera360 import Camera360, default_rig
from sim.faults.occluder import panel_body, panel_placement


@pytest.fixture(scope="module")
def camera(small_room):
    bodies = [body_of_object(item) for item in small_room.objects]
    bodies += [panel_body(f"before-{o.object_id}", o) for o in small_room.objects]
    made = Camera360(small_room, default_rig(512), small_room.world_from_rig, bodies)
    yield made
    made.close()


def visible(camera, room, object_id, world_from_object, share):
    item = room.object_by_id(object_id)
    height = float(world_from_object.translation[2])
    placements = {object_id: Placement((world_from_object,), height)}
    if share is not None:
        placements[f"before-{object_id}"] = panel_placement(
            item, world_from_object, camera.rig, room.world_from_rig, share=share
        )
    return camera.view(placements).visible_fraction[object_id]


@pytest.mark.parametrize("share", [0.1, 0.3, 0.6, 0.9])
@pytest.mark.parametrize(
    "place",
    [
        Pose.from_yaw(0.3, (-0.6, 1.0, 0.0)),
        Pose.from_yaw(2.0, (0.3, 1.4, 0.0)),
        Pose.from_yaw(-1.0, (-1.3, -1.5, 0.0)),
    ],
)
def test_a_share_of_a_chair_is_hidden(camera, small_room, place, share):
    alone = visible(camera, small_room, "chair-1", place, None)
    seen = visible(camera, small_room, "chair-1", place, share)
    assert alone > 0.98
    assert seen == pytest.approx(1.0 - share, abs=0.04)


def test_a_book_on_the_table_is_hidden_in_part(camera, small_room):
    place = small_room.object_by_id("book-1").world_from_object
    alone = visible(camera, small_room, "book-1", place, None)
    seen = visible(camera, small_room, "book-1", place, 0.5)
    assert seen == pytest.approx(alone - 0.5, abs=0.08)
