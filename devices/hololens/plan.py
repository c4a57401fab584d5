"""A headset's address, and what is wanted of it."""

from __future__ import annotations

from dataclasses import dataclass, field

from devices.hololens.values import StreamName

DEFAULT_TRIANGLES_PER_M3 = 1000.0
"""Density of meshes that is asked for: what the headset makes itself of walls and furniture."""


MAX_RETRY_S = 2.0
"""Longest wait between two attempts to connect, seconds: a headset that was put down and taken up
again is back within that, and one that is off is asked once in two seconds."""


@dataclass(frozen=True, slots=True)
class Ports:
    """TCP ports of the headset's program; others where a simulator listens elsewhere."""

    configuration: int = 3809
    video: int = 3810
    body: int = 3812
    surfaces: int = 3813
    display: int = 3816


@dataclass(frozen=True, slots=True)
class VideoOptions:
    """Size, rate and codec that are asked of the headset's camera.

    Attributes:
        width_px: of a size that it has.
        height_px: likewise.
        fps: likewise.
        codec: "h264", "hevc" or "raw".
    """

    width_px: int = 760
    height_px: int = 428
    fps: int = 30
    codec: str = "h264"


@dataclass(frozen=True, slots=True)
class MeshedBox:
    """A box in the headset's world that shall be meshed.

    Attributes:
        centre_m: x, y, z.
        size_m: whole lengths along x, y, z.
    """

    centre_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    size_m: tuple[float, float, float] = (12.0, 12.0, 6.0)


@dataclass(frozen=True, slots=True)
class HeadsetPlan:
    """A headset and what is wanted of it.

    Attributes:
        host: its address, as the operator entered it: the protocol has no password.
        ports: where it listens.
        streams: which are used; the clock always is.
        video: what its camera is asked for.
        boxes: where it shall mesh.
        triangles_per_m3: of its meshes, at most.
        retry_s: longest wait between two attempts to connect.
    """

    host: str
    ports: Ports = field(default_factory=Ports)
    streams: frozenset[StreamName] = frozenset(StreamName)
    video: VideoOptions = field(default_factory=VideoOptions)
    boxes: tuple[MeshedBox, ...] = (MeshedBox(),)
    triangles_per_m3: float = DEFAULT_TRIANGLES_PER_M3
    retry_s: float = MAX_RETRY_S
