"""Codes on the free walls of a random room, hung without changing the room."""

import numpy as np
import pytest

from benchmarks.evaluate.cuts.captures import filmed_movables
from benchmarks.evaluate.cuts.printed_codes import SIDE_M, with_codes
from benchmarks.random_rooms.room import random_room
from scenes.rays import RayScene


@pytest.fixture(scope="module")
def room():
    return random_room(101).scanned


def test_codes_hang_flat_on_free_walls_of_their_own(room):
    coded = with_codes(room)
    assert 2 <= len(coded.codes) <= 3
    assert len({code.payload for code in coded.codes}) == len(coded.codes)
    normals = {tuple(np.round(code.world_from_code.rotation[:, 2])) for code in coded.codes}
    assert len(normals) == len(coded.codes)
    walls = RayScene(np.concatenate([m.vertices[m.faces] for m in room.static]))
    for code in coded.codes:
        half = SIDE_M / 2
        corners = code.world_from_code @ np.array(
            [[x, y, 0.0] for x in (-half, half) for y in (-half, half)]
        )
        assert (walls.distance(corners) < 0.01).all()
        assert code.side_m == SIDE_M


def test_nothing_else_of_the_room_changes(room):
    coded = with_codes(room)
    assert coded.static[: len(room.static)] == room.static
    assert coded.objects == room.objects
    again = with_codes(random_room(101).scanned)
    assert [c.payload for c in again.codes] == [c.payload for c in coded.codes]
    for a, b in zip(again.codes, coded.codes, strict=True):
        np.testing.assert_array_equal(a.world_from_code.matrix(), b.world_from_code.matrix())


def test_families_come_with_the_room():
    room, families = filmed_movables(101)
    assert set(families) == {item.object_id for item in room.objects}
    assert families["cereal-box-1"] == "cereal-box"
