"""Figures and events in words, with names in place of ids."""

import pytest

from studio.console.spoken import spoken, with_names

NAMES = {"chair-1": "Chair 1", "chair-10": "Tall chair"}


def called(object_id):
    return NAMES.get(object_id, object_id)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("rehearse.chairs.world_cm.mean", "chairs, place, mean"),
        ("rehearse.object.chair-1.world_cm.p95", "Chair 1, place, 95 %"),
        (
            "rehearse.paper.object.chair-1.yaw_deg.mean",
            "the paper's method, Chair 1, heading, mean",
        ),
        ("stage.track.ms.p50", "step, track, time, usual"),
        ("live.camera.gaps", "camera, gaps"),
    ],
)
def test_a_figure_in_words(name, words):
    assert spoken(name, called) == words


def test_ids_in_a_sentence_become_names():
    assert with_names("pushes chair-1, chair-10", NAMES, called) == "pushes Chair 1, Tall chair"
    assert with_names("my-chair-1 stays", NAMES, called) == "my-chair-1 stays"
    assert with_names("pushes chair-1", (), called) == "pushes chair-1"
