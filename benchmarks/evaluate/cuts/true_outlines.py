"""Outlines of an object in the photos that show it, and how far what was cut draws them.

Whose a splat is can be argued about: one that hangs a centimetre beside an object and paints the
wall is near to its mesh, and is carried about as a shred of wall if it is cut out with it. What is
drawn of the object alone cannot: it fills its outline, or it does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.evaluate.cuts.captures import Capture
from scenes.cameras import Pinhole, pixel_centres
from scenes.pose import Pose
from scenes.prepare.cutout.votes.cropped_views import cropped
from scenes.rays import RayScene
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats
from scenes.splats import SplatCloud

BoolArray = NDArray[np.bool_]

MAX_VIEWS = 12
"""Photos by which an object is judged, evenly out of those that show it."""

MIN_SHOWN = 0.4
"""Share of the outline that a photo has to show, as of a photo that is marked."""

MIN_PX = 100
"""Of the outline in a crop: a smaller one is mostly edge."""


@dataclass(frozen=True, slots=True, eq=False)
class TrueOutline:
    """An object in one photo, cropped to it.

    Attributes:
        camera: of the crop.
        world_from_camera: its pose in the package's world.
        whole: (H, W) where it would be seen if it were alone.
        shown: (H, W) where it is seen.
    """

    camera: Pinhole
    world_from_camera: Pose
    whole: BoolArray
    shown: BoolArray


def true_outlines(capture: Capture, number: int, *, room: RayScene) -> tuple[TrueOutline, ...]:
    """Outlines of one of a capture's objects; none where no photo shows it whole.

    Args:
        capture: of the room.
        number: of the object.
        room: the capture's parts, all together.
    """
    parts = capture.parts
    owner = np.repeat(np.arange(len(parts)) - 1, [len(part) for part in parts])
    triangles = capture.objects[number].triangles
    alone = RayScene(triangles)
    found: list[TrueOutline] = []
    for view in capture.photos:
        if not isinstance(view.camera, Pinhole):
            continue
        pose = view.world_from_camera
        camera = cropped(view.camera, pose, triangles.reshape(-1, 3))
        if camera is None:
            continue
        rays = camera.unproject(pixel_centres(camera)) @ pose.rotation.T
        eyes = np.broadcast_to(pose.translation, rays.shape)
        shape = camera.height_px, camera.width_px
        whole = (alone.cast(eyes, rays).triangle >= 0).reshape(shape)
        hit = room.cast(eyes, rays).triangle
        shown = ((hit >= 0) & (owner[np.maximum(hit, 0)] == number)).reshape(shape)
        if shown.sum() >= max(MIN_SHOWN * whole.sum(), MIN_PX):
            found.append(TrueOutline(camera, pose, whole, shown))
    picks = np.linspace(0, len(found) - 1, min(MAX_VIEWS, len(found))).round().astype(int)
    return tuple(found[pick] for pick in picks)


def outline_overlap(
    outlines: Sequence[TrueOutline], splats: SplatCloud, *, renderer: NativeRenderer
) -> float:
    """How far an object's splats, drawn alone, fill its outline and nothing else; NaN without one.

    Opacity inside over all of it and what is missing of the outline; what something hides of the
    object counts for nothing.
    """
    filled, missing, beside = 0.0, 0.0, 0.0
    for outline in outlines:
        alpha = np.zeros(outline.whole.shape)
        if len(splats):
            posed = [PosedSplats(splats, Pose.identity())]
            alpha = renderer.render(posed, outline.camera, outline.world_from_camera).alpha
        filled += float(alpha[outline.shown].sum())
        missing += float((1.0 - alpha[outline.shown]).sum())
        beside += float(alpha[~outline.whole].sum())
    return filled / (filled + missing + beside) if outlines else float("nan")
