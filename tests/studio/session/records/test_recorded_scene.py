"""`studio.session.records.recorded_scene`: the camera stands where the scenario put it."""

from types import SimpleNamespace

import numpy as np

from studio.session.records.recorded_scene import recorded_scene

HEAD = 'room = "desk"\nduration_s = 1.0\n'


def scene(scenario):
    return recorded_scene(SimpleNamespace(scene="desk", scenario=scenario, scenario_name="x"))


def test_without_a_word_it_stands_where_the_scene_has_it():
    assert scene("").world_from_rig.translation[2] == scene(HEAD).world_from_rig.translation[2]


def test_a_scenario_moves_it():
    placed = scene(HEAD + "[camera]\nposition = [0.1, 0.2, 1.4]\n").world_from_rig
    assert np.allclose(placed.translation, (0.1, 0.2, 1.4))


def test_a_scenario_that_cannot_be_read_any_more_is_no_hindrance():
    assert np.isfinite(scene("no = toml = here").world_from_rig.translation).all()
