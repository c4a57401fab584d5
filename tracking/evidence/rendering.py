"""Reduced renderings: an object rendered once at a pose and reduced to measurable points.

The points are in the object's frame, so they stay valid while the object is seen from about the
same side at about the same size, and nothing has to be rendered again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye
from scenes.pose import Pose, rotation_angle
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, Renderer, Rendering
from tracking.evidence.appearance_memory import AppearanceMemory
from tracking.evidence.evidence import Evidence
from tracking.kernels.reduction import REDUCTION
from tracking.model.object_model import RENDER_OPTIONS, TrackModel
from tracking.window.contour import Contour, Texture
from tracking.window.extent import part_of
from tracking.window.reduction import looks_of, outlined_of
from tracking.window.window import Window

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

TURNED_RAD = np.deg2rad(2.0)
"""Turn in rad or change of direction up to which a reduced rendering is valid. Chosen on the rooms
lab and desk."""

TURNED_PX = 1.0
"""The same for a small object, as displacement in px of its silhouette."""

SCALED = 0.03
"""Relative change of range up to which it is valid. Chosen on the rooms lab and desk."""


ROUGHLY = 2.5
"""Factor on those limits in the coarse rounds of a solve."""


MIN_AREA_PX = 12
"""Silhouette area in px below which nothing is measured."""


DRAWN_RADIUS_PX = 120
"""Radius in px at which small objects are rendered: at few pixels the splats' low-pass widens the
silhouette by a pixel."""

MAX_FINER = 4
"""Largest supersampling of small objects, each way."""


@dataclass(frozen=True, slots=True, eq=False)
class ReducedRendering:
    """Measurable points of an object rendered at a pose.

    Attributes:
        camera_from_object: pose of the rendering.
        lens: index of the lens.
        shrink: of the window.
        finer: supersampling, rendered pixels per pixel of the window, each way.
        contour: silhouette points.
        texture: surface points with colour gradients.
        surface: (N, 3) points evenly over the silhouette, in the object's frame, m.
        colours: (N, 3) float32 rendered there, smoothed.
        area_px: area of the silhouette.
        appearance: the appearance memory applied to it, if any.
    """

    camera_from_object: Pose
    lens: int
    shrink: int
    finer: int
    contour: Contour
    texture: Texture
    surface: Points
    colours: FloatArray
    area_px: int
    appearance: AppearanceMemory | None

    def is_valid_for(self, view: Window, camera_from_object: Pose, tolerance: float = 1.0) -> bool:
        """Whether an object at this pose still looks like the rendering.

        Args:
            view: the window in which it is seen.
            camera_from_object: its pose.
            tolerance: factor on the limits.
        """
        if view.lens != self.lens or view.shrink != self.shrink:
            return False
        now, then = camera_from_object, self.camera_from_object
        range_now, range_then = math.hypot(*now.translation), math.hypot(*then.translation)
        if abs(range_now / range_then - 1.0) > tolerance * SCALED:
            return False
        aside = float(now.translation @ then.translation) / (range_now * range_then)
        turned = rotation_angle(now.rotation @ then.rotation.T)
        limit = tolerance * max(TURNED_RAD, TURNED_PX / math.sqrt(self.area_px / math.pi + 1.0))
        return turned < limit and aside > math.cos(limit)


class RenderingCache:
    """Reduced renderings of one object in one window; one made for a solve serves the next.

    Args:
        first: of the frame before, if there is one.
        appearance: appearance memory applied to every rendering.
        quickly: supersample moving objects less.
    """

    def __init__(
        self,
        first: ReducedRendering | None = None,
        appearance: AppearanceMemory | None = None,
        *,
        quickly: bool = False,
    ) -> None:
        has_same_appearance = first is not None and first.appearance is appearance
        self._renderings = [first] if first is not None and has_same_appearance else []
        self._appearance = appearance
        self._quickly = quickly

    def at(
        self,
        model: TrackModel,
        world_from_object: Pose,
        evidence: Evidence,
        renderer: NativeRenderer,
        *,
        tolerance: float = 1.0,
    ) -> ReducedRendering:
        """The latest reduced rendering valid for a pose; rendered if none is."""
        finer = _finer(model, evidence, quickly=self._quickly)
        camera_from_object = evidence.world_from_camera.inverse() @ world_from_object
        for reduced in reversed(self._renderings):
            if reduced.finer >= finer and reduced.is_valid_for(
                evidence.view, camera_from_object, tolerance
            ):
                return reduced
        drawn = reduced_rendering(
            model,
            world_from_object,
            evidence,
            renderer,
            appearance=self._appearance,
            quickly=self._quickly,
        )
        self._renderings.append(drawn)
        return drawn

    def drawn(
        self, model: TrackModel, world_from_object: Pose, evidence: Evidence, renderer: Renderer
    ) -> Rendering:
        """The object alone, as the window's camera would see it."""
        picture = draw(model, world_from_object, evidence, renderer)
        if self._appearance is None:
            return picture
        camera_from_object = evidence.world_from_camera.inverse() @ world_from_object
        return self._appearance.applied_to(picture, evidence.camera, camera_from_object)


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


def reduced_rendering(
    model: TrackModel,
    world_from_object: Pose,
    evidence: Evidence,
    renderer: NativeRenderer,
    *,
    appearance: AppearanceMemory | None = None,
    quickly: bool = False,
) -> ReducedRendering:
    """Render an object at a pose, apply its remembered appearance, and reduce it to points.

    Args:
        model: the object.
        world_from_object: its pose.
        evidence: its window.
        renderer: renders it.
        appearance: its remembered appearance, where known.
        quickly: supersample a moving object less.
    """
    view = evidence.view
    object_from_camera = world_from_object.inverse() @ view.world_from_camera
    finer = _finer(model, evidence, quickly=quickly)
    posed = model.splats_at(world_from_object)
    window = part_of(view.camera, _reach(posed, view, renderer, finer=finer))
    fine = _finely(window, finer)
    drawing = renderer.render((posed,), fine, view.world_from_camera, RENDER_OPTIONS)
    outline = outlined_of(drawing, fine, object_from_camera, finer=finer)
    drawn = outline.drawn
    if appearance is not None:
        seen_by = part_of(window, outline.part)
        drawn = appearance.applied_to(drawn, seen_by, object_from_camera.inverse())
    looks = looks_of(outline, drawn, window, object_from_camera)
    return ReducedRendering(
        camera_from_object=object_from_camera.inverse(),
        lens=view.lens,
        shrink=view.shrink,
        finer=finer,
        contour=looks.contour,
        texture=looks.texture,
        surface=looks.surface,
        colours=looks.colours,
        area_px=looks.area_px,
        appearance=appearance,
    )


def _reach(
    posed: PosedSplats, view: Window, renderer: NativeRenderer, *, finer: int
) -> tuple[slice, slice]:
    """Rows and columns of a window that show an object, with the margin that is kept around it."""
    camera, margin_px = _finely(view.camera, finer), REDUCTION.trim_px + 1
    found = renderer.reach((posed,), camera, view.world_from_camera, RENDER_OPTIONS)
    rows, columns = found or (slice(0, 1), slice(0, 1))

    def within(side: slice, size_px: int) -> slice:
        low, high = side.start // finer - margin_px, -(-side.stop // finer) + margin_px
        return slice(max(low, 0), min(high, size_px))

    return within(rows, view.camera.height_px), within(columns, view.camera.width_px)


def _finely(camera: Fisheye, finer: int) -> Fisheye:
    """A camera with so many pixels each way per pixel."""
    return camera.resized(camera.width_px * finer, camera.height_px * finer)


def _finer(model: TrackModel, evidence: Evidence, *, quickly: bool) -> int:
    """How many pixels are drawn each way per pixel of the window."""
    distance_m = max(evidence.view.target_range_m, model.radius_m)
    wanted = DRAWN_RADIUS_PX * distance_m / (evidence.camera.f_px * model.radius_m)
    return min(max(round(wanted) if quickly else math.ceil(wanted), 1), MAX_FINER)
