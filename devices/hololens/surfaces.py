"""Surfaces of the room as the headset meshes them: polled, and only those that changed fetched."""

from __future__ import annotations

from collections.abc import Sequence

from devices.clock import Clock
from devices.hololens.axes import in_headset_m, surface_of
from devices.hololens.links.connection import Connection
from devices.hololens.links.fan_out import SurfaceFanOut
from devices.hololens.links.health import StreamHealth
from devices.hololens.links.link import Link
from devices.hololens.plan import MAX_RETRY_S, MeshedBox
from devices.hololens.values import StreamStatus, SurfaceGone
from devices.hololens.wire.spatial_mapping import (
    GetMeshes,
    ListSurfaces,
    ObservedSurface,
    SetVolumes,
    Volume,
    VolumeKind,
    encode_request,
    read_surfaces,
)
from devices.hololens.wire.surface_mesh import MeshRequest, MeshStatus, numbers_of, read_mesh
from devices.hololens.wire.taking import WireError

POLL_S = 0.1
"""How often the list is asked for, seconds: half of the 200 ms in which a change is to be there."""

AT_A_TIME = 16
"""Meshes of one request: the rest of a room waits while a change in it does not."""


class Surfaces:
    """Spatial mapping of one headset; starts at once.

    Args:
        address: of the port.
        clock: session time.
        boxes: where it shall mesh, in its own world.
        triangles_per_m3: at most.
        retry_s: longest wait between two attempts to connect.
    """

    def __init__(
        self,
        address: tuple[str, int],
        clock: Clock,
        *,
        boxes: Sequence[MeshedBox],
        triangles_per_m3: float,
        retry_s: float = MAX_RETRY_S,
    ) -> None:
        self.changes = SurfaceFanOut()
        self.health = StreamHealth("surfaces", clock)
        self._clock = clock
        self._density = triangles_per_m3
        self._boxes = tuple(boxes)
        self._sent: tuple[MeshedBox, ...] | None = None
        self._unreadable: dict[str, int] = {}
        self._link = Link(
            address,
            clock,
            health=self.health,
            talk=self._talk,
            name="hololens surfaces",
            retry_s=retry_s,
        )

    def set_boxes(self, boxes: Sequence[MeshedBox]) -> None:
        """Mesh there and nowhere else, from the next poll on."""
        self._boxes = tuple(boxes)

    def status(self) -> StreamStatus:
        """Return how it is doing."""
        return self.health.status()

    def close(self) -> None:
        """Hang up; waits for the thread."""
        self._link.close()
        self.changes.close()

    def _talk(self, connection: Connection) -> None:
        self._sent = None
        while True:
            self._poll(connection)
            connection.pause(POLL_S)

    def _poll(self, connection: Connection) -> None:
        boxes = self._boxes
        if boxes != self._sent:
            connection.send(encode_request(SetVolumes(tuple(map(_volume, boxes)))))
            self._sent = boxes
        connection.send(encode_request(ListSurfaces()))
        listed = read_surfaces(connection.take)
        self.health.came(4 + 24 * len(listed))
        known = self.changes.versions()
        there = {each.guid.hex() for each in listed}
        for gone in known.keys() - there:
            self.changes.put(SurfaceGone(gone, self._clock.now_ns()))
            self._unreadable.pop(gone, None)
        wanted = [each for each in listed if self._is_newer(each, known)]
        for first in range(0, len(wanted), AT_A_TIME):
            self._fetch(connection, wanted[first : first + AT_A_TIME])

    def _is_newer(self, listed: ObservedSurface, known: dict[str, int]) -> bool:
        name = listed.guid.hex()
        newest = max(known.get(name, -1), self._unreadable.get(name, -1))
        return listed.update_time > newest

    def _fetch(self, connection: Connection, wanted: Sequence[ObservedSurface]) -> None:
        requests = tuple(MeshRequest(each.guid, self._density) for each in wanted)
        connection.send(encode_request(GetMeshes(requests)))
        for listed, request in zip(wanted, requests, strict=True):
            reply = read_mesh(connection.take)
            now_ns = self._clock.now_ns()
            if reply.status is not MeshStatus.OK:
                continue  # it has gone meanwhile, or is asked for again
            try:
                numbers = numbers_of(reply, request)
                surface = surface_of(listed, numbers, pose=reply.pose, t_ns=now_ns)
            except WireError as error:
                self._unreadable[listed.guid.hex()] = listed.update_time
                self.health.damaged(str(error))
                continue
            self.changes.put(surface)


def _volume(box: MeshedBox) -> Volume:
    x, y, z = in_headset_m(box.centre_m).tolist()
    # Both worlds share the axis x; y and z change places, and a length has no direction.
    width, depth, height = box.size_m
    return Volume(VolumeKind.BOX, (x, y, z, width, height, depth))
