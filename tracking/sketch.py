"""An object drawn once at a pose, reduced to the points it can be measured at.

The points live in the object's frame, so that they serve while the object is seen from about the
same side, at about the same size: then nothing has to be drawn.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose, rotation_angle
from scenes.render.renderer import Renderer, Rendering
from tracking.contour import Contour, Texture, lift, texture_points
from tracking.evidence import Evidence
from tracking.kernels import contour_of
from tracking.model import RENDER_OPTIONS, TrackModel
from tracking.pictures import bell_blurred

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

CONTOUR_POINTS = 260
TEXTURE_POINTS = 400
SURFACE_POINTS = 360
LEAST_SLOPE = 0.012
TEXTURE_BLUR_PX = 0.8

TURNED_RAD = np.deg2rad(1.5)
SCALED = 0.03
"""A sketch serves until the object is seen turned, aside or nearer by more than this."""

LEAST_AREA_PX = 12


@dataclass(frozen=True, slots=True, eq=False)
class Sketch:
    """What a drawn object offers to be measured at.

    Attributes:
        camera_from_object: from where it was drawn.
        lens: index of the lens it was drawn for.
        shrink: of the window it was drawn in.
        contour: silhouette points.
        texture: surface points with structure.
        surface: (N, 3) points evenly over the silhouette, in the object's frame.
        colours: (N, 3) float32 drawn there, smoothed.
        area_px: pixels of the silhouette.
    """

    camera_from_object: Pose
    lens: int
    shrink: int
    contour: Contour
    texture: Texture
    surface: Points
    colours: FloatArray
    area_px: int

    def serves(self, evidence: Evidence, world_from_object: Pose) -> bool:
        """Whether an object at a pose still looks like this."""
        view = evidence.view
        if view.lens != self.lens or view.shrink != self.shrink:
            return False
        now = view.world_from_camera.inverse() @ world_from_object
        then = self.camera_from_object
        range_now = float(np.linalg.norm(now.translation))
        range_then = float(np.linalg.norm(then.translation))
        if abs(range_now / range_then - 1.0) > SCALED:
            return False
        aside = float(now.translation @ then.translation) / (range_now * range_then)
        turned = rotation_angle(now.rotation @ then.rotation.T)
        return turned < TURNED_RAD and aside > np.cos(TURNED_RAD)


def draw(
    model: TrackModel, world_from_object: Pose, evidence: Evidence, renderer: Renderer
) -> Rendering:
    """The object alone, as the window's camera would see it."""
    return renderer.render(
        (model.splats_at(world_from_object),),
        evidence.camera,
        evidence.world_from_camera,
        RENDER_OPTIONS,
    )


def sketched(
    model: TrackModel, world_from_object: Pose, evidence: Evidence, renderer: Renderer
) -> Sketch:
    """Draw an object at a pose and pick its points."""
    drawn = draw(model, world_from_object, evidence, renderer)
    camera = evidence.camera
    object_from_camera = world_from_object.inverse() @ evidence.world_from_camera
    picture = bell_blurred(drawn.rgb, TEXTURE_BLUR_PX, 3)
    texture = texture_points(
        drawn,
        picture,
        camera,
        object_from_camera,
        limit=TEXTURE_POINTS,
        least_slope=LEAST_SLOPE,
    )
    rows, columns = np.nonzero(drawn.alpha > 0.5)
    area = len(rows)
    if area > SURFACE_POINTS:
        chosen = np.linspace(0, area - 1, SURFACE_POINTS).astype(int)
        rows, columns = rows[chosen], columns[chosen]
    pixels = np.stack([columns, rows], axis=1) + 0.5
    depth = drawn.depth[rows, columns].astype(np.float64)
    return Sketch(
        camera_from_object=object_from_camera.inverse(),
        lens=evidence.view.lens,
        shrink=evidence.view.shrink,
        contour=contour_of(drawn, camera, object_from_camera, limit=CONTOUR_POINTS),
        texture=texture,
        surface=object_from_camera @ lift(camera, pixels, depth),
        colours=picture[rows, columns] / drawn.alpha[rows, columns, None],
        area_px=area,
    )
