"""Spatial mapping, port 3813: where to mesh, which surfaces there are, and their meshes."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

from devices.hololens.wire.surface_mesh import (
    MeshRequest,
    encode_mesh_request,
    read_mesh_request,
)
from devices.hololens.wire.taking import Take, WireError, checked_count, taken

SET_VOLUMES, LIST_SURFACES, GET_MESHES = 0, 1, 2
"""First byte of a request."""

COUNT = struct.Struct("<I")
"""Number of surfaces or of meshes."""

SURFACE = struct.Struct("<16sq")
"""A surface: its id, and when it changed last, 100 ns since 1601."""

MAX_SURFACES = 4096
"""Most surfaces that are listed or asked for at a time: a flat of 20 rooms has some hundred."""


class VolumeKind(IntEnum):
    """Shapes of volumes."""

    BOX = 0
    FRUSTUM = 1
    ORIENTED_BOX = 2
    SPHERE = 3


VOLUME_FLOATS = {
    VolumeKind.BOX: 6,
    VolumeKind.FRUSTUM: 24,
    VolumeKind.ORIENTED_BOX: 10,
    VolumeKind.SPHERE: 4,
}
"""Numbers of a volume: centre and extents; planes near, far, right, left, top, bottom; centre,
extents and quaternion x y z w; centre and radius."""


@dataclass(frozen=True, slots=True)
class Volume:
    """A volume that is to be meshed.

    Attributes:
        kind: its shape.
        numbers: as many as `VOLUME_FLOATS` says; extents are whole lengths.
    """

    kind: VolumeKind
    numbers: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class SetVolumes:
    """Request to mesh there and nowhere else; it gets no answer."""

    volumes: tuple[Volume, ...]


@dataclass(frozen=True, slots=True)
class ListSurfaces:
    """Question which surfaces there are."""


@dataclass(frozen=True, slots=True)
class GetMeshes:
    """Request for meshes; there is one answer for each."""

    requests: tuple[MeshRequest, ...]


MappingRequest = SetVolumes | ListSurfaces | GetMeshes
"""All that a client may ask."""


@dataclass(frozen=True, slots=True)
class ObservedSurface:
    """A surface that the headset has.

    Attributes:
        guid: 16 bytes.
        update_time: 100 ns since 1601.
    """

    guid: bytes
    update_time: int


def encode_request(request: MappingRequest) -> bytes:
    """Return a request's bytes."""
    match request:
        case SetVolumes():
            parts = [
                struct.pack(f"<I{VOLUME_FLOATS[v.kind]}f", v.kind, *v.numbers)
                for v in request.volumes
            ]
            return bytes([SET_VOLUMES, len(parts)]) + b"".join(parts)
        case ListSurfaces():
            return bytes([LIST_SURFACES])
        case GetMeshes():
            parts = [encode_mesh_request(each) for each in request.requests]
            return bytes([GET_MESHES]) + COUNT.pack(len(parts)) + b"".join(parts)


def read_request(take: Take) -> MappingRequest:
    """Read a request.

    Raises:
        WireError: the command or a volume is none, or too many meshes are asked for.
    """
    command = take(1)[0]
    if command == SET_VOLUMES:
        return SetVolumes(tuple(_read_volume(take) for _ in range(take(1)[0])))
    if command == LIST_SURFACES:
        return ListSurfaces()
    if command == GET_MESHES:
        count = checked_count("spatial mapping: meshes", taken(take, COUNT)[0], most=MAX_SURFACES)
        return GetMeshes(tuple(read_mesh_request(take) for _ in range(count)))
    raise WireError(f"spatial mapping: command {command}, wanted 0..2")


def _read_volume(take: Take) -> Volume:
    kind = taken(take, COUNT)[0]
    try:
        known = VolumeKind(kind)
    except ValueError:
        raise WireError(f"spatial mapping: volume of kind {kind}, wanted 0..3") from None
    return Volume(known, taken(take, struct.Struct(f"<{VOLUME_FLOATS[known]}f")))


def encode_surfaces(surfaces: Sequence[ObservedSurface]) -> bytes:
    """Return the answer to `ListSurfaces`."""
    parts = [SURFACE.pack(each.guid, each.update_time) for each in surfaces]
    return COUNT.pack(len(parts)) + b"".join(parts)


def read_surfaces(take: Take) -> tuple[ObservedSurface, ...]:
    """Read the answer to `ListSurfaces`.

    Raises:
        WireError: there are more than `MAX_SURFACES`.
    """
    count = checked_count("spatial mapping: surfaces", taken(take, COUNT)[0], most=MAX_SURFACES)
    return tuple(ObservedSurface(*each) for each in SURFACE.iter_unpack(take(SURFACE.size * count)))
