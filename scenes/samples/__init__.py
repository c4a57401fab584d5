"""The built-in rooms, as physical meshes made by code.

`lab.py` `desk.py` `tangram.py` and what they are built of.
"""

from __future__ import annotations

from types import ModuleType

from scenes.mesh import PhysicalRoom
from scenes.samples import desk, lab, tangram
from scenes.samples.light import UnlitRoom

_ROOMS = {"lab": lab, "desk": desk, "tangram": tangram}

SAMPLE_NAMES = tuple(_ROOMS)
"""Names that `sample_room` knows."""


def sample_room(name: str) -> PhysicalRoom:
    """A built-in room, the same one each time.

    The first call after a change draws the room's pictures (some seconds); later ones read them
    from the user's cache folder.

    Raises:
        ValueError: no such room; the message lists those there are.
    """
    return _module(name).build()


def unlit_room(name: str) -> UnlitRoom:
    """Return the fixed part of a built-in room, before there is light.

    Raises:
        ValueError: no such room; the message lists those there are.
    """
    return _module(name).unlit()


def _module(name: str) -> ModuleType:
    if name not in _ROOMS:
        raise ValueError(
            f"sample room {name!r}: there is none; wanted one of {', '.join(SAMPLE_NAMES)}"
        )
    return _ROOMS[name]
