"""A room's surfaces that hide, as entries of a log."""

import numpy as np
import pytest

from devices.hub.protocol.mesh import pack_cell
from devices.sites.hidden import cell_name, read_cells
from devices.transport.followed import LogNews
from devices.transport.wire import Entry
from scenes.mesh import CollisionMesh

PLATE = CollisionMesh(np.array([[0.0, 0, 1], [0.2, 0, 1], [0, 0.2, 1]]), np.array([[0, 1, 2]]))


def news(*entries, is_whole=False):
    return LogNews(is_whole, tuple(Entry(n, *entry) for n, entry in enumerate(entries, start=1)))


def test_the_newest_of_each_cell_counts():
    far, near = (-3, 0, 32767), (0, 0, 0)
    found, refused = read_cells(
        news(
            (cell_name(near), pack_cell(near, PLATE)),
            (cell_name(far), pack_cell(far, PLATE)),
            (cell_name(near), b""),
        )
    )
    assert {cell: len(mesh.faces) for cell, mesh in found.items()} == {near: 0, far: 1}
    assert refused == 0


@pytest.mark.parametrize(
    "name", ["", "1 2", "1 2 3 4", "1 2 x", "01 2 3", " 1 2 3", "1 2 ٣", "9" * 300 + " 1 1"]
)
def test_what_names_no_cell_is_refused(name):
    found, refused = read_cells(news((name, pack_cell((1, 2, 3), PLATE)), ("1 2 3", b"")))
    assert list(found) == [(1, 2, 3)]
    assert refused == 1


def test_damaged_bytes_are_refused_and_the_others_count():
    data = pack_cell((1, 2, 3), PLATE)
    cut = [("1 2 3", data[:length]) for length in range(1, len(data))]
    found, refused = read_cells(news(("0 0 0", b""), *cut))
    assert (list(found), refused) == ([(0, 0, 0)], len(cut))
