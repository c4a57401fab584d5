"""Furniture of built-in and of scanned rooms."""

from dataclasses import replace

import numpy as np

from scenes.opening import open_scene
from studio.view.furniture import furniture_of


def test_a_built_in_room_has_its_boxes_and_its_objects_parts():
    scene = open_scene("desk")
    furniture = furniture_of(scene)
    assert set(furniture.parts) == {item.object_id for item in scene.objects if item.parts}
    table = np.array([[0.0, 0.3, 0.72]])
    assert furniture.at({}).depths(table)[0] > 0.01


def test_a_scanned_room_has_the_level_parts_of_its_mesh():
    scene = replace(open_scene("desk"), physical=None)
    furniture = furniture_of(scene)
    assert len(furniture.fixed.centres) > 0
    on_table = np.array([[x, 0.3, z] for x in (-0.5, 0.5) for z in np.arange(0.68, 0.80, 0.01)])
    assert furniture.fixed.depths(on_table).max() > 0.005
    assert furniture.fixed.depths(np.array([[-1.5, 0.0, 0.9]])).max() == 0.0
    bare = furniture_of(replace(scene, collision=None))
    assert len(bare.fixed.centres) == 0
