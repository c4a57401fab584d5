"""Drags in a view: of a handle, a corner of a live surface, or an object."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.pose import Pose
from studio.app.model.grabbing import Grabbing
from studio.app.model.workbench import Workbench
from studio.app.twin.additions import corner_dragged
from studio.app.twin.edits import EditError, Stance, kind_of, placed
from studio.app.twin.items import scanned_poses
from studio.app.twin.sizes import resized
from studio.app.viewport.by_hand.corners import CornerHandles
from studio.app.viewport.by_hand.gizmo import Gizmo, Handle
from studio.app.viewport.by_hand.picking import met_plane, ray_of

MOVING: tuple[Handle, ...] = ("x", "y", "z", "floor")
"""Handles that move and do not turn."""


@dataclass(frozen=True, slots=True, eq=False)
class Aim:
    """Place of the mouse in a picture of the room.

    Attributes:
        x_px, y_px: in the picture.
        camera, world_from_camera: of the picture.
    """

    x_px: float
    y_px: float
    camera: Pinhole
    world_from_camera: Pose


class Drag(Protocol):
    """Something in hand, from the press of the button to its release."""

    def to(self, aim: Aim) -> None:
        """The mouse has moved."""
        ...

    def end(self) -> None:
        """The button was released."""
        ...


class HandleDrag:
    """Moves or turns an item by one of its handles.

    Args:
        bench: whose item it is.
        gizmo: as it was at the press.
        handle: which is held.
        start_px: where the press was.
        merge: makes all of it one step of undo.
    """

    def __init__(
        self,
        bench: Workbench,
        gizmo: Gizmo,
        *,
        handle: Handle,
        start_px: tuple[float, float],
        merge: str,
    ) -> None:
        self.handle: Handle = handle
        self._bench, self._gizmo = bench, gizmo
        self._item_id = bench.selection
        self._start_px, self._merge = start_px, merge
        self._stance: Stance | None = None

    def to(self, aim: Aim) -> None:
        """See `Drag`. It goes where numbers say, so that a script puts it there again exactly."""
        bench, item_id = self._bench, self._item_id
        scanned = scanned_poses(bench.scene)
        pose = self._gizmo.dragged(self.handle, self._start_px, (aim.x_px, aim.y_px))
        try:
            stance = Stance.of(kind_of(bench.document, scanned, item_id), pose)
            document = placed(bench.document, scanned, item_id, stance)
        except EditError:  # near the horizon a pixel is a kilometre: it stays at the last place
            return
        self._stance = stance
        verb = "Move" if self.handle in MOVING else "Turn"
        bench.change(f"{verb} {bench.name_of(item_id)}", document, merge=self._merge)

    def end(self) -> None:
        """Write the drag down as the line of a script that does the same."""
        if self._stance is not None:
            self._bench.note("twin.place", item=self._item_id, **self._stance.values())


class SizeDrag:
    """Sizes a body or mesh by one of its handles.

    Args:
        bench: whose item it is.
        gizmo: as it was at the press.
        size_m: its sides at the press, metres.
        handle: which is held.
        start_px: where the press was.
        merge: makes all of it one step of undo.
    """

    def __init__(
        self,
        bench: Workbench,
        gizmo: Gizmo,
        size_m: tuple[float, float, float],
        *,
        handle: Handle,
        start_px: tuple[float, float],
        merge: str,
    ) -> None:
        self.handle: Handle = handle
        self._bench, self._gizmo, self._before = bench, gizmo, size_m
        self._item_id = bench.selection
        self._start_px, self._merge = start_px, merge
        self._size: list[float] | None = None

    def to(self, aim: Aim) -> None:
        """See `Drag`. A size out of bounds is passed over."""
        bench, item_id = self._bench, self._item_id
        factors = self._gizmo.sized(self.handle, self._start_px, (aim.x_px, aim.y_px))
        size = [round(f * side, 4) for f, side in zip(factors, self._before, strict=True)]
        try:
            document = resized(bench.document, item_id, size)
        except EditError:
            return
        self._size = size
        bench.change(f"Resize {bench.name_of(item_id)}", document, merge=self._merge)

    def end(self) -> None:
        """Write the drag down as the line of a script that does the same."""
        if self._size is not None:
            self._bench.note("twin.resize", item=self._item_id, size=self._size)


class CornerDrag:
    """Moves one corner of a live surface on the surface's plane.

    A place that would leave no convex quad is passed over; the log says so once.

    Args:
        bench: whose surface it is.
        handles: as they were at the press.
        corner: 0 top left, clockwise.
        merge: makes all of it one step of undo.
    """

    def __init__(
        self, bench: Workbench, handles: CornerHandles, *, corner: int, merge: str
    ) -> None:
        self.corner = corner
        self._bench, self._handles, self._merge = bench, handles, merge
        self._has_moved = self._has_warned = False

    def to(self, aim: Aim) -> None:
        """See `Drag`."""
        place = self._handles.dragged(aim.x_px, aim.y_px)
        if place is None:
            return
        surface_id, bench = self._handles.surface.surface_id, self._bench
        try:
            document = corner_dragged(bench.document, surface_id, self.corner, place)
        except EditError:
            if not self._has_warned:
                bench.say(
                    "warning",
                    f"{surface_id}: corner {self.corner} cannot go there: the four would be no "
                    "convex quad; it stays at the last place that fits",
                )
            self._has_warned = True
            return
        self._has_moved = True
        bench.change(f"Drag a corner of {surface_id}", document, merge=self._merge)

    def end(self) -> None:
        """Write the drag down as the line of a script that does the same."""
        surface_id = self._handles.surface.surface_id
        surface = self._bench.document.twin.surfaces.get(surface_id)
        if surface is None or not self._has_moved:
            return
        place = [round(float(v), 4) for v in surface.corners_in_world[self.corner]]
        self._bench.note("twin.drag_corner", item=surface_id, corner=self.corner, place=place)


class GrabDrag:
    """Pulls an object by the running physics, on the upright plane that faces the viewer.

    Args:
        grabbing: the physics, which has gripped it.
        grip: (3,) where it was gripped, world metres.
    """

    def __init__(self, grabbing: Grabbing, grip: NDArray[np.float64]) -> None:
        self._grabbing, self._grip = grabbing, grip

    def to(self, aim: Aim) -> None:
        """See `Drag`."""
        eye, ray = ray_of(aim.camera, aim.world_from_camera, aim.x_px, aim.y_px)
        ahead = aim.world_from_camera.rotation[:, 2]
        target = met_plane(eye, ray, point=self._grip, normal=ahead)
        if target is not None:
            self._grabbing.drag(target)

    def end(self) -> None:
        """See `Drag`."""
        self._grabbing.release()
