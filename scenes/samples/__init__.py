"""The built-in rooms, as physical meshes made by code."""

from __future__ import annotations

from scenes.mesh import PhysicalRoom
from scenes.samples import desk, lab

_BUILDERS = {"lab": lab.build, "desk": desk.build}

SAMPLE_NAMES = tuple(_BUILDERS)
"""Names that `sample_room` knows."""


def sample_room(name: str) -> PhysicalRoom:
    """A built-in room, the same one each time.

    The first call after a change lights the room (some 10 s); later ones read it from the user's
    cache folder.

    Raises:
        ValueError: no such room; the message lists those there are.
    """
    if name not in _BUILDERS:
        raise ValueError(
            f"sample room {name!r}: there is none; wanted one of {', '.join(SAMPLE_NAMES)}"
        )
    return _BUILDERS[name]()
