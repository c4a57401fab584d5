"""The built-in rooms, as physical meshes made by code."""

from __future__ import annotations

from scenes.mesh import PhysicalRoom
from scenes.samples import lab

SAMPLE_NAMES = ("lab", "desk")


def sample_room(name: str) -> PhysicalRoom:
    """A built-in room.

    Raises:
        ValueError: no such room; the message lists those there are.
    """
    if name == "lab":
        return lab.build()
    raise ValueError(f"sample room {name!r}: there is none; wanted one of {', '.join(SAMPLE_NAMES)}")
