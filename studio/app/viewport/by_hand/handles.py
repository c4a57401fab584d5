"""Handles in a view: the selected item's gizmo, a live surface's corners."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from scenes.cameras import Pinhole
from scenes.pose import Pose
from studio.app.model.workbench import Workbench
from studio.app.twin.edits import TILTABLE, TURNABLE, heading_rad, kind_of
from studio.app.twin.items import scanned_poses
from studio.app.twin.sizes import size_of
from studio.app.viewport.by_hand.corners import CornerHandles
from studio.app.viewport.by_hand.dragging import CornerDrag, Drag, HandleDrag, SizeDrag
from studio.app.viewport.by_hand.gizmo import Gizmo, Handle
from studio.app.viewport.by_hand.items import is_held_by_hand, pose_of
from studio.app.viewport.by_hand.picking import Pick
from studio.app.viewport.by_hand.tools import HOLDING, Tool


@dataclass(frozen=True, slots=True, eq=False)
class Handles:
    """The handles of what is selected.

    Attributes:
        gizmo: of an item that is moved or turned by hand, or None.
        corners: of a live surface of the document, or None.
    """

    gizmo: Gizmo | None
    corners: CornerHandles | None


@dataclass(frozen=True, slots=True)
class Hover:
    """The item or handle under the mouse while no button is held.

    Attributes:
        item_id: of an object or anything else that can be selected; "" if there is none.
        handle: of the gizmo, which is in front of items.
    """

    item_id: str = ""
    handle: Handle | None = None

    @classmethod
    def over(
        cls,
        handles: Handles,
        pick_at: Callable[[float, float], Pick | None],
        *,
        at_px: tuple[float, float],
    ) -> Hover:
        """The handle or item that a press at a pixel would take, or a click select."""
        handle = None if handles.gizmo is None else handles.gizmo.hit(*at_px)
        if handle is not None:
            return cls(handle=handle)
        found = pick_at(*at_px)
        return cls("" if found is None else found.item_id)


def handles_of(
    bench: Workbench, tool: Tool, *, camera: Pinhole, world_from_camera: Pose
) -> Handles:
    """The handles that the selected item has in a view while a tool is in hand.

    Args:
        bench: whose selection.
        tool: in hand.
        camera: of the view, in the widget's pixels.
        world_from_camera: where the view is seen from.
    """
    chosen, gizmo, corners = bench.selection, None, None
    pose = pose_of(bench, chosen)
    if tool in HOLDING and pose is not None and is_held_by_hand(bench, chosen):
        kind = kind_of(bench.document, scanned_poses(bench.scene), chosen)
        is_sized = size_of(bench.document, chosen) is not None
        gizmo = Gizmo(
            pose,
            camera,
            world_from_camera,
            moves=tool in (Tool.SELECT, Tool.MOVE),
            turns=tool in (Tool.SELECT, Tool.TURN) and kind in TURNABLE,
            tilts=tool is Tool.TURN and kind in TILTABLE,
            sizes=tool is Tool.SELECT and is_sized,
            sides=tool is Tool.SCALE and is_sized,
            heading_rad=heading_rad(kind, pose),
        )
    surface = bench.document.twin.surfaces.get(chosen)
    # A session or a recording may show another surface of that name.
    is_shown = surface is not None and bench.state.surfaces.get(chosen) is surface
    if surface is not None and is_shown and tool in HOLDING:
        corners = CornerHandles(surface, camera, world_from_camera)
    return Handles(gizmo, corners)


def taken(
    bench: Workbench, handles: Handles, *, at_px: tuple[float, float], merge: str
) -> Drag | None:
    """Return the drag that a press of the left button begins: of a corner, a handle, or none.

    Args:
        bench: whose item it is.
        handles: of what is selected.
        at_px: where the press was, pixels of the widget.
        merge: makes all of the drag one step of undo.
    """
    gizmo, corners = handles.gizmo, handles.corners
    corner = None if corners is None else corners.hit(*at_px)
    if corners is not None and corner is not None:
        return CornerDrag(bench, corners, corner=corner, merge=merge)
    handle = None if gizmo is None else gizmo.hit(*at_px)
    if gizmo is None or handle is None:
        return None
    size = size_of(bench.document, bench.selection)
    if handle.startswith("size") and size is not None:
        return SizeDrag(bench, gizmo, size, handle=handle, start_px=at_px, merge=merge)
    return HandleDrag(bench, gizmo, handle=handle, start_px=at_px, merge=merge)
