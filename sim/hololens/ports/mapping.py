"""Port 3813 of a simulated HoloLens: surfaces of the room, as it finds them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devices.hololens.wire.spatial_mapping import (
    GetMeshes,
    ListSurfaces,
    ObservedSurface,
    SetVolumes,
    Volume,
    VolumeKind,
    encode_surfaces,
    read_request,
)
from devices.hololens.wire.surface_mesh import (
    MeshReply,
    MeshRequest,
    MeshStatus,
    encode_mesh,
    reply_with,
)
from scenes.frames import WORLD_FROM_GLTF
from scenes.pose import Pose, rotation_from_quaternion
from sim.hololens.axes import surface_rows
from sim.hololens.faults import HoloLensFaultKind
from sim.hololens.meshing import MeshedSurface, Meshing, numbers_at
from sim.hololens.ports.serving import Guest, HeadsetPort
from sim.hololens.world import Counts, HeadsetWorld

SEEN_M, FINDS_M_S = 2.0, 1.0
"""How far the headset has meshed when it begins, and by how much that grows every second."""

BOX = "box"
"""Name of the box that a fault puts into the room."""


class MappingPort:
    """Spatial mapping.

    Args:
        place: host and port.
        world: what all ports share.
        meshing: the room's surfaces.
        box_m: (3,) where the box of a fault stands, in the room.

    Raises:
        OSError: the port is taken.
    """

    def __init__(
        self,
        place: tuple[str, int],
        world: HeadsetWorld,
        *,
        meshing: Meshing,
        box_m: NDArray[np.float64],
    ) -> None:
        self._world, self._meshing, self._box_m = world, meshing, box_m
        self.counts = Counts()
        self._port = HeadsetPort(
            place, world, serve=self._serve, name="hololens mapping port", counts=self.counts
        )

    @property
    def number(self) -> int:
        """The real number of the port."""
        return self._port.number

    def close(self) -> None:
        """Stop; waits for the thread."""
        self._port.close()

    def _serve(self, guest: Guest) -> None:
        volumes: tuple[Volume, ...] = ()
        while True:
            guest.message_ended()
            request = read_request(guest.take)
            guest.delay()
            match request:
                case SetVolumes():
                    volumes = request.volumes
                case ListSurfaces():
                    found = [
                        ObservedSurface(each.guid, each.update_time)
                        for each in self._observed(volumes)
                    ]
                    guest.send(encode_surfaces(found))
                case GetMeshes():
                    self._send_meshes(guest, request)
            self.counts.messages += 1

    def _observed(self, volumes: tuple[Volume, ...]) -> list[MeshedSurface]:
        """The surfaces that the headset has found, within the volumes."""
        world, t_s = self._world, self._world.now_s()
        size_m = world.faults.size_of(HoloLensFaultKind.BOX, t_s)
        if size_m and BOX not in self._meshing.names():
            middle = self._box_m + np.array([0.0, 0.0, 0.5 * size_m])
            self._meshing.put_box(BOX, middle, size_m=np.full(3, size_m))
        elif not size_m:
            self._meshing.remove(BOX)
        here = world.wearer.at(0.0).world_from_head.translation
        turn = WORLD_FROM_GLTF.inverse() @ world.room_from_world(t_s).inverse()
        found: list[MeshedSurface] = []
        for surface in self._meshing.surfaces():
            middle = surface.room_from_surface.translation
            if float(np.linalg.norm(middle - here)) > SEEN_M + FINDS_M_S * t_s:
                continue
            if any(_touches(v, turn @ middle, radius_m=surface.radius_m) for v in volumes):
                found.append(surface)
        return found

    def _send_meshes(self, guest: Guest, request: GetMeshes) -> None:
        surfaces = {each.guid: each for each in self._meshing.surfaces()}
        for index, each in enumerate(request.requests):
            guest.send(encode_mesh(self._mesh(surfaces.get(each.guid), each, index=index)))

    def _mesh(
        self, surface: MeshedSurface | None, request: MeshRequest, *, index: int
    ) -> MeshReply:
        if surface is None:
            return MeshReply(index, MeshStatus.UNKNOWN_ID)
        numbers = numbers_at(surface, request.triangles_per_m3)
        if not len(numbers.triangles):
            return MeshReply(index, MeshStatus.FAILED)
        world_from_room = self._world.room_from_world(self._world.now_s()).inverse()
        rows = surface_rows(world_from_room @ surface.room_from_surface)
        return reply_with(numbers, request, index=index, pose=rows)


def _touches(volume: Volume, middle: NDArray[np.float64], *, radius_m: float) -> bool:
    """Whether a ball, in the headset's own axes, reaches into a volume."""
    numbers = np.array(volume.numbers, dtype=np.float64)
    if not np.isfinite(numbers).all():
        return False
    match volume.kind:
        case VolumeKind.SPHERE:
            return float(np.linalg.norm(middle - numbers[:3])) <= abs(numbers[3]) + radius_m
        case VolumeKind.BOX:
            return bool((np.abs(middle - numbers[:3]) <= 0.5 * numbers[3:6] + radius_m).all())
        case VolumeKind.ORIENTED_BOX:
            quaternion = numbers[[9, 6, 7, 8]]
            if not 0.5 < float(np.linalg.norm(quaternion)) < 2.0:
                return False
            box = Pose(rotation_from_quaternion(quaternion), numbers[:3])
            aside = np.abs(box.inverse() @ middle)
            return bool((aside <= 0.5 * numbers[3:6] + radius_m).all())
        case VolumeKind.FRUSTUM:
            planes = numbers.reshape(6, 4)
            # Planes face outwards.
            return bool((planes[:, :3] @ middle + planes[:, 3] <= radius_m).all())
