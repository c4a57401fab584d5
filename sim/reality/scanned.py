"""Stand-ins that a rehearsal in a scan is given: nothing here draws splats.

The rehearsal itself must not reach a splat renderer: in a built-in room its pictures are of meshes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from scenes.mesh import PhysicalRoom
from sim.camera.camera360 import ScannedLook
from sim.reality.world_error import WorldError


@dataclass(frozen=True, slots=True, eq=False)
class Scanned:
    """Stand-ins for the real room in a rehearsal where only a scan of it exists.

    Attributes:
        look: makes what draws the room and its objects.
        error: draws how far the real room is from the scan's metric world; None if the scan's world
            is taken for the real one.
    """

    look: Callable[[PhysicalRoom], ScannedLook]
    error: Callable[[np.random.Generator], WorldError] | None
