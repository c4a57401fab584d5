"""One picture of the twin from somewhere: splats, meshes among them, outlines of states."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.pose import Pose
from scenes.render.renderer import PosedSplats
from scenes.state import SceneState, TrackState, lines_now
from studio.app.viewport.drawing.mesh_picture import MeshPicture
from studio.app.viewport.drawing.pacing import FULL, Grade
from studio.app.viewport.drawing.scene_drawing import SceneDrawing
from studio.app.viewport.drawing.shapes import Shape
from studio.app.viewport.drawing.view_memory import ViewMemory
from studio.evaluate.scores import SYMMETRY_OF_KIND
from studio.view.overlay import STATE_COLOURS, draw_avatar, draw_footprint, draw_line
from studio.view.shared_things import met_proposals, proposed_splats
from studio.view.surface_drawing import LivePicture

TIE_M = 0.02
"""A mesh that lies in a surface of splats is shown: a scan's surface is rough by about this."""


def composite(
    picture: NDArray[np.uint8], splat_depth: NDArray[np.float32], meshes: MeshPicture
) -> None:
    """Paint meshes over a picture of splats wherever they are nearer.

    Args:
        picture: (H, W, 3) RGB of the splats, painted on.
        splat_depth: (H, W) metres along z, 0 where there is no splat.
        meshes: of the same camera.
    """
    rows = np.flatnonzero(meshes.rgba[..., 3].any(axis=1))
    if not len(rows):
        return
    columns = np.flatnonzero(meshes.rgba[..., 3].any(axis=0))
    part = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
    before, depth = splat_depth[part], meshes.depth[part]
    alpha = meshes.rgba[part][..., 3]
    nearer = (alpha > 0) & ((before <= 0) | (depth < before + TIE_M))
    if not nearer.any():
        return
    share = np.where(nearer, alpha, 0).astype(np.uint16)[..., None]
    under, over = picture[part].astype(np.uint16), meshes.rgba[part][..., :3]
    picture[part] = ((under * (255 - share) + over * share + 127) // 255).astype(np.uint8)


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """The state to draw and the camera to draw it through.

    Attributes:
        state: of the room.
        camera: looked through.
        world_from_camera: from where.
        live: what live surfaces show.
        shapes: everything but splats and live pictures.
        seen_by: whose eyes they are; "" nobody's.
    """

    state: SceneState
    camera: Pinhole
    world_from_camera: Pose
    live: tuple[LivePicture, ...] = ()
    shapes: tuple[Shape, ...] = ()
    seen_by: str = ""

    def is_seen_from(self, other: View) -> bool:
        """Whether both are seen from the same place through the same camera."""
        return self.camera == other.camera and np.array_equal(
            self.world_from_camera.matrix(), other.world_from_camera.matrix()
        )


def draw_view(
    drawing: SceneDrawing, view: View, *, grade: Grade = FULL, memory: ViewMemory | None = None
) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Draw a view; may be called from any thread but the window's, which it would hold up.

    Args:
        drawing: of the scene.
        view: what to draw.
        grade: how finely.
        memory: of this view alone: only what changed is drawn again, to the same pixels.

    Returns:
        (H, W, 3) RGB of the grade's size, and (H, W) float32 metres along z of splats and meshes, 0
        where nothing is.
    """
    camera = scaled(view.camera, grade.scale)
    poses = {key: track.world_from_object for key, track in view.state.objects.items()}
    drawn = drawing.twin.drawn(
        poses,
        camera,
        view.world_from_camera,
        coarse=grade.thinned,
        live=view.live,
        things=_proposed(view, drawing, poses=poses),
        opens=True,
        resting=None if memory is None else memory.splats,
    )
    picture, depth = drawn.picture, drawn.depth
    thread = drawing.meshes
    meshes = None
    if thread is not None and view.shapes:
        meshes = (
            thread.draw(view.shapes, camera, view.world_from_camera)
            if memory is None
            else memory.meshes(
                thread, view.shapes, camera=camera, world_from_camera=view.world_from_camera
            )
        )
    if meshes is not None:
        composite(picture, depth, meshes)
        depth = np.where((depth <= 0) | (meshes.depth < depth), meshes.depth, depth)
        depth[~np.isfinite(depth)] = 0.0
    elif view.shapes:
        _outline(picture, depth, replace(view, camera=camera), drawing)
    _footprints(picture, replace(view, camera=camera), drawing)
    return picture, depth


def scaled(camera: Pinhole, scale: float) -> Pinhole:
    """The same view in a picture `scale` times as large, in whole pixels and at least one."""
    width = max(1, round(camera.width_px * scale))
    height = max(1, round(camera.height_px * scale))
    across, down = width / camera.width_px, height / camera.height_px
    return Pinhole(
        width, height, camera.fx * across, camera.fy * down, camera.cx * across, camera.cy * down
    )


def _proposed(view: View, drawing: SceneDrawing, *, poses: Mapping[str, Pose]) -> list[PosedSplats]:
    """Return copies of objects where they should go, of the proposals that are shown."""
    if not view.state.proposals:
        return []
    shown = {shape.key for shape in view.shapes}
    found = [p for key, p in view.state.proposals.items() if f"proposal {key}" in shown]
    models = {item.object_id: item for item in drawing.scene.objects}
    met = met_proposals(found, poses, models=models, symmetry_of_kind=SYMMETRY_OF_KIND)
    return proposed_splats(found, models, met=met)


def _footprints(picture: NDArray[np.uint8], view: View, drawing: SceneDrawing) -> None:
    """Draw the footprints of objects that do not rest, in the colours of their states."""
    boxes = {item.object_id: item.box_m for item in drawing.scene.objects}
    for key, track in view.state.objects.items():
        if track.state is not TrackState.STATIC and key in boxes:
            draw_footprint(
                picture,
                view.camera,
                view.world_from_camera,
                track.world_from_object,
                boxes[key],
                colour=STATE_COLOURS[track.state],
                dashed=track.state is TrackState.OCCLUDED,
            )


def _outline(
    picture: NDArray[np.uint8], depth: NDArray[np.float32], view: View, drawing: SceneDrawing
) -> None:
    """Everything as strokes over the picture: where there is no OpenGL."""
    others = [shape for shape in view.shapes if not shape.key.startswith(("avatar ", "note "))]
    drawing.outlines.draw(picture, depth, others, view.camera, view.world_from_camera)
    drawn: Iterable[str] = {shape.key for shape in view.shapes}
    for avatar in view.state.avatars.values():
        # Nobody sees their own face, and who is not among the shapes is hidden by the user.
        if avatar.user_id != view.seen_by and f"avatar {avatar.user_id} body" in drawn:
            draw_avatar(picture, view.camera, view.world_from_camera, avatar)
    for line in lines_now(view.state):
        if f"note {line.annotation_id}" in drawn:
            draw_line(picture, view.camera, view.world_from_camera, line)
