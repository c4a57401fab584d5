"""Surfaces that hide, by cell: what is packed, what changed, what there is at most."""

import numpy as np
import pytest

from devices.hub.channels import BodyChannel, StateChannel
from devices.hub.outbox import Outbox, Sent
from devices.hub.protocol import mesh as module
from devices.hub.protocol.mesh import MeshChannel, MeshError, pack_cell, unpack_cell
from scenes.frames import WORLD_FROM_GLTF
from scenes.mesh import CollisionMesh

NOTHING = CollisionMesh(np.zeros((0, 3)), np.zeros((0, 3)))


def square(x=0.0, *, side=0.2, times=1):
    """A level square, times as many triangles as two."""
    corners = np.array([x, 1.0, 0.7]) + side * np.array(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    )
    return CollisionMesh(corners, np.tile([[0, 1, 2], [0, 2, 3]], (times, 1)))


def unpacked(message):
    """Cells of a message, corners in world metres: as a page reads them."""
    assert message[:2] == bytes([1, 7])
    found, at = {}, 4
    for _ in range(int.from_bytes(message[2:4], "little")):
        cell = tuple(np.frombuffer(message, "<i2", 3, at).tolist())
        corners, triangles = np.frombuffer(message, "<u2", 2, at + 6).tolist()
        first = np.frombuffer(message, "<f4", 3, at + 10).astype(float)
        at += 22
        steps = np.frombuffer(message, "<i2", 3 * corners, at).reshape(-1, 3)
        faces = np.frombuffer(message, "<u2", 3 * triangles, at + 6 * corners).reshape(-1, 3)
        at += 6 * corners + 6 * triangles
        found[cell] = (WORLD_FROM_GLTF @ (first + steps * 1e-4), faces)
    assert at == len(message)
    return found


def test_a_cell_comes_as_it_is():
    channel = MeshChannel()
    channel.take({(1, -2, 3): square()})
    number, message = channel.next_after(0)
    (corners, faces) = unpacked(message)[1, -2, 3]
    assert np.allclose(corners[faces], square().vertices[square().faces], atol=1e-4)
    assert channel.next_after(number) is None


def test_only_what_changed_follows_and_what_is_gone_is_said():
    channel = MeshChannel()
    channel.take({(0, 0, 0): square(), (1, 0, 0): square(0.25)})
    number, _ = channel.next_after(0)
    channel.take({(1, 0, 0): NOTHING, (2, 0, 0): square(0.5)})
    _, message = channel.next_after(number)
    cells = unpacked(message)
    assert set(cells) == {(1, 0, 0), (2, 0, 0)}
    assert not len(cells[1, 0, 0][1])
    _, message = channel.next_after(0)
    assert set(unpacked(message)) == {(0, 0, 0), (2, 0, 0)}, "who comes later gets what is there"


def test_messages_are_short(monkeypatch):
    monkeypatch.setattr(module, "MAX_MESSAGE_BYTES", 200)
    channel = MeshChannel()
    channel.take({(i, 0, 0): square(0.25 * i) for i in range(10)})
    number, cells = 0, []
    while (found := channel.next_after(number)) is not None:
        number, message = found
        assert len(message) <= 200
        cells += unpacked(message)
    assert cells == [(i, 0, 0) for i in range(10)]


def test_cells_and_triangles_are_limited(monkeypatch):
    monkeypatch.setattr(module, "MAX_CELLS", 3)
    monkeypatch.setattr(module, "MAX_TRIANGLES", 6)
    channel = MeshChannel()
    channel.take({(i, 0, 0): square(0.25 * i) for i in range(3)})
    channel.take({(9, 0, 0): square()})
    assert channel.left_out == 1
    channel.take({(0, 0, 0): NOTHING, (5, 0, 0): square()})
    assert set(unpacked(channel.next_after(0)[1])) == {(1, 0, 0), (2, 0, 0), (5, 0, 0)}


@pytest.mark.parametrize(
    "mesh", [square(times=501), square(side=4.0), square(1000.0)], ids=["fine", "large", "far"]
)
def test_a_cell_that_cannot_be_sent_is_left_out(mesh):
    with pytest.raises(MeshError):
        pack_cell((0, 0, 0), mesh)
    channel = MeshChannel()
    channel.take({(0, 0, 0): mesh})
    assert channel.left_out == 1
    assert not unpacked(channel.next_after(0)[1])


def test_they_wait_for_all_but_pictures():
    outbox, states, bodies, mesh = Outbox(1, Sent()), StateChannel(), BodyChannel(), MeshChannel()
    mesh.take({(0, 0, 0): square()})
    outbox.put("text")
    text, state, cells, nothing = (
        outbox.take(states, bodies, now_ns=0, mesh=mesh) for _ in range(4)
    )
    assert text == "text"
    assert state.startswith('{"kind":"state"')
    assert set(unpacked(cells)) == {(0, 0, 0)}
    assert nothing is None


def test_a_cell_is_unpacked_as_it_was_and_packs_to_the_same_bytes():
    mesh = square(90.0, side=0.2, times=3)
    data = pack_cell((1, -2, 3), mesh)
    again = unpack_cell((1, -2, 3), data)
    np.testing.assert_allclose(again.vertices, mesh.vertices, atol=1e-4)
    assert np.array_equal(again.faces, mesh.faces)
    assert pack_cell((1, -2, 3), again) == data
    assert not len(unpack_cell((0, 0, 0), b"").faces)


def test_bytes_that_are_no_cell_are_refused():
    data = pack_cell((1, 2, 3), square())
    for length in range(1, len(data)):
        with pytest.raises(MeshError):
            unpack_cell((1, 2, 3), data[:length])
    with pytest.raises(MeshError, match="wanted"):
        unpack_cell((1, 2, 3), data + b"\0")
    with pytest.raises(MeshError, match=r"in cell \(1, 2, 3\)"):
        unpack_cell((1, 2, 4), data)
    far, wrong, lost = bytearray(data), bytearray(data), bytearray(data)
    far[10:14] = np.float32(1e9).tobytes()
    lost[10:14] = np.float32(np.nan).tobytes()
    wrong[-2:] = (77).to_bytes(2, "little")
    for bad in (far, lost):
        with pytest.raises(MeshError, match="farther"):
            unpack_cell((1, 2, 3), bytes(bad))
    with pytest.raises(MeshError, match="index"):
        unpack_cell((1, 2, 3), bytes(wrong))
