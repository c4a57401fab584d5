"""Surfaces that hide in a room hide at its sites: changed cells, all of them for latecomers."""

import numpy as np

from devices.hub.protocol.mesh import MAX_MESSAGE_BYTES
from devices.transport import source
from scenes.mesh import CollisionMesh

NOTHING = CollisionMesh(np.zeros((0, 3)), np.zeros((0, 3)))


def plate(x, *, times=1):
    corners = np.array([[x, 0, 1], [x + 0.2, 0, 1], [x, 0.2, 1]])
    return CollisionMesh(corners, np.tile([[0, 1, 2]], (times, 1)))


def at(hub, cell):
    """Bytes of a cell as a hub sends it; None where it has none."""
    return hub._session.mesh._cells.get(cell, (0, 0, None))[2]


def has(hub, cell):
    return hub._session.mesh.has(cell)


def test_cells_reach_the_site_change_there_and_go(building):
    cells = {(0, 0, 0): plate(0.0), (1, 0, 0): plate(0.25)}
    building.room_hub.hide_behind(cells)
    building.room.hide_behind(cells)
    building.until(lambda: has(building.site_hub, (1, 0, 0)))
    for cell in cells:
        assert at(building.site_hub, cell) == at(building.room_hub, cell), "to the bit"
    before = building.site_hub._session.mesh.counter
    building.room.hide_behind({(1, 0, 0): NOTHING})
    building.until(lambda: not has(building.site_hub, (1, 0, 0)))
    assert has(building.site_hub, (0, 0, 0))
    assert building.site_hub._session.mesh.counter == before + 1, "no more than has changed"
    assert building.said == ["the room is reached"]


def test_many_cells_take_turns(building, monkeypatch):
    sent = []
    append = building.room._source.append

    def counted(log, item, *, data):
        sent[-1] += len(data)
        append(log, item, data=data)

    monkeypatch.setattr(building.room._source, "append", counted)
    building.room.hide_behind({(n, 0, 0): plate(0.2 * n, times=100) for n in range(200)})
    for _ in range(10):
        sent.append(0)
        building.turn()
    assert max(sent) <= MAX_MESSAGE_BYTES
    building.until(lambda: has(building.site_hub, (199, 0, 0)))


def test_a_room_that_starts_again_has_what_it_has_then(building):
    building.room.hide_behind({(0, 0, 0): plate(0.0), (1, 0, 0): plate(0.25)})
    building.until(lambda: has(building.site_hub, (1, 0, 0)))
    old = building.room._source
    old.close()
    # The same room, begun anew, knows one cell.
    building.room._source = source.Source(
        old._transport, old.member, logs=("drawn", "hidden"), epoch=2
    )
    building.room._told_cells = 0
    building.room._mesh = type(building.room._mesh)()
    building.room.hide_behind({(1, 0, 0): plate(0.25)})
    building.until(lambda: not has(building.site_hub, (0, 0, 0)))
    assert has(building.site_hub, (1, 0, 0))


def test_more_than_a_log_holds_is_left_out_and_said_once(building, monkeypatch):
    monkeypatch.setattr(source, "MAX_ITEMS", 2)
    building.room.hide_behind({(n, 0, 0): plate(0.2 * n) for n in range(5)})
    building.until(lambda: has(building.site_hub, (1, 0, 0)))
    assert not has(building.site_hub, (2, 0, 0))
    (line,) = [each for each in building.said if "reached" not in each]
    assert "some are not shared" in line


def test_a_damaged_cell_is_refused_at_the_site(building):
    building.until(lambda: building.site.status().is_reached)
    building.room._source.append("hidden", "0 0 0", data=b"x")
    building.room.hide_behind({(1, 0, 0): plate(0.25)})
    building.until(lambda: has(building.site_hub, (1, 0, 0)))
    assert building.site.status().refused == 1
