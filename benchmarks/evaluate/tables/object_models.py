"""The tracker's model of an object against the physical one: size, outline, surface.

Each scanned object is drawn alone from all around, as the tracker draws it, and compared with its
mesh at the same pose. Its scale is the one at which its outlines would fit the real ones best; that
splats reach past the surface they stand for is a part of it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from benchmarks.evaluate.filmed.asked import Asked
from benchmarks.evaluate.findings import Findings, aligned
from scenes.cameras import Pinhole, pixel_centres
from scenes.frames import look_at
from scenes.mesh import PhysicalObject
from scenes.opening import open_scene
from scenes.pose import Pose
from scenes.rays import RayScene
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, Renderer
from scenes.samples import sample_room
from studio.console.rows import Row, at_most
from tracking.model.object_model import RENDER_OPTIONS, TrackModel, make_model
from tracking.window.contour import REACH_PX, lift
from tracking.window.reduction import contour_of

SCENES = ("lab", "desk")
YAWS, ELEVATIONS_RAD = 12, (0.25, 0.7)
DISTANCE = 6.0
"""Of the camera, in radii of the object."""

SIDE_PX, FINER = 200, 3
FIELD_RAD = 2.0 * math.atan(1.25 / DISTANCE)
CONTOUR_POINTS = 400
SMOOTH_PX = 3.0
OPAQUE = 0.9
MIN_FACING = 0.3
FAR_M = 0.05
"""What is drawn farther than this from what is there shows another part of it."""

HARDLY_OFF_M = 0.003
"""What is farther off than this counts less and less: something is missing, or too much."""

SCALE_BAR_PERCENT, SURFACE_BAR_MM = 0.5, 2.0

Points = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Similarity:
    """How far a scanned object is from the physical one.

    Attributes:
        scale: of the scan's outlines about its middle, less 1.
        outline_m: how far its outline lies outside the real one (median).
        surface_m: mean distance of its drawn surface outside the real one.
        surface_rms_m: root mean square of that.
        elsewhere: share of what is drawn that shows another part than what is there, or nothing.
    """

    scale: float
    outline_m: float
    surface_m: float
    surface_rms_m: float
    elsewhere: float


def evaluate(asked: Asked) -> Findings:
    """All objects of the built-in rooms; nothing is left to chance, so seeds do not matter."""
    findings, renderer = Findings(), NativeRenderer()
    lines = [["object", "scale %", "outline mm", "surface mm", "rms mm", "elsewhere %"]]
    scales, surfaces = [], []
    for scene in SCENES:
        room = sample_room(scene)
        asked.progress.begin(f"comparing the objects of {scene}")
        for source in open_scene(scene).objects:
            model = make_model(source, renderer)
            seen = compared(model, room.object_by_id(source.object_id), renderer)
            name = f"{scene}.{source.object_id}"
            scales.append(100 * abs(seen.scale))
            surfaces.append(1000 * abs(seen.surface_m))
            metres = (seen.outline_m, seen.surface_m, seen.surface_rms_m)
            in_mm = (f"{1000 * metre:+.1f}" for metre in metres)
            elsewhere = f"{100 * seen.elsewhere:.1f}"
            lines.append([name, f"{100 * seen.scale:+.2f}", *in_mm, elsewhere])
            findings.rows.append(Row(f"model.{name}.scale_percent", 100 * seen.scale, "%"))
            findings.rows.append(Row(f"model.{name}.surface_mm", 1000 * seen.surface_m, "mm"))
        asked.progress.finish()
    for name, values, unit, bar in (
        ("model.scale_percent.max", scales, "%", SCALE_BAR_PERCENT),
        ("model.surface_mm.max", surfaces, "mm", SURFACE_BAR_MM),
    ):
        findings.rows.append(at_most(name, max(values), unit, bar=bar))
    findings.text.append(f"scanned objects against the physical ones\n{aligned(lines)}")
    return findings


def compared(
    model: TrackModel,
    item: PhysicalObject,
    renderer: Renderer,
    *,
    views: Sequence[Pose] | None = None,
) -> Similarity:
    """A scanned object against the physical one.

    Args:
        model: in the same frame as the physical object.
        item: with meshes in its own frame.
        renderer: draws splats.
        views: `object_from_camera` of each camera; those of `views_around` if not given.
    """
    truth = RayScene(np.concatenate([mesh.vertices[mesh.faces] for mesh in item.meshes]))
    camera = Pinhole.from_fov(SIDE_PX, SIDE_PX, FIELD_RAD)
    outlines: list[Points] = []
    surfaces: list[Points] = []
    drawn_px = 0
    for object_from_camera in views_around(model) if views is None else views:
        posed = (PosedSplats(model.source.splats, Pose.identity()),)
        drawn = renderer.render(posed, camera, object_from_camera, RENDER_OPTIONS)
        contour = contour_of(
            drawn, camera, object_from_camera, limit=CONTOUR_POINTS, reach_px=REACH_PX
        )
        outlines.append(_outline_off(truth, object_from_camera, model.centre_m, contour.points))
        rows, columns = np.nonzero(drawn.alpha > OPAQUE)
        pixels = np.stack([columns, rows], axis=1).astype(np.float64) + 0.5
        depth = drawn.depth[rows, columns].astype(np.float64)
        surface = object_from_camera @ lift(camera, pixels, depth)
        surfaces.append(_surface_off(truth, object_from_camera.translation, surface))
        drawn_px += len(surface)
    lever_m, outside_m = np.concatenate(outlines, axis=1)

    def residuals(scale: Points) -> Points:
        return outside_m - scale[0] * lever_m

    fit = least_squares(residuals, np.zeros(1), loss="soft_l1", f_scale=HARDLY_OFF_M)
    surface_m = np.concatenate(surfaces)
    return Similarity(
        scale=float(fit.x[0]),
        outline_m=float(np.median(outside_m)),
        surface_m=float(surface_m.mean()),
        surface_rms_m=float(np.sqrt((surface_m**2).mean())),
        elsewhere=1.0 - len(surface_m) / drawn_px,
    )


def views_around(model: TrackModel) -> Sequence[Pose]:
    """`object_from_camera` of cameras on two rings around an object."""
    poses = []
    for elevation in ELEVATIONS_RAD:
        for k in range(YAWS):
            yaw = 2 * math.pi * k / YAWS
            level = math.cos(elevation)
            ahead = np.array([math.cos(yaw) * level, math.sin(yaw) * level, math.sin(elevation)])
            eye = model.centre_m + DISTANCE * model.radius_m * ahead
            poses.append(look_at(eye, model.centre_m))
    return poses


def _outline_off(
    truth: RayScene, object_from_camera: Pose, middle: Points, points: Points
) -> Points:
    """(2, N) metres: lever of the real outline, how far outside it points lie."""
    fine = Pinhole.from_fov(FINER * SIDE_PX, FINER * SIDE_PX, FIELD_RAD)
    rays = fine.unproject(pixel_centres(fine)) @ object_from_camera.rotation.T
    eyes = np.broadcast_to(object_from_camera.translation, rays.shape)
    inside = (truth.cast(eyes, rays).triangle >= 0).reshape(fine.height_px, fine.width_px)
    outside_px = cv2.distanceTransform((~inside).astype(np.uint8), cv2.DIST_L2, 5)
    inside_px = cv2.distanceTransform(inside.astype(np.uint8), cv2.DIST_L2, 5)
    # Both count from pixel centres: the outline is half a pixel before the first of the others.
    signed_px = np.where(inside, 0.5 - inside_px, outside_px - 0.5).astype(np.float32)
    along_y, along_x = np.gradient(cv2.GaussianBlur(signed_px, (0, 0), SMOOTH_PX))
    field = np.dstack([signed_px, along_x, along_y]).astype(np.float32)
    in_camera = object_from_camera.inverse() @ np.vstack([middle, points])
    pixels, _ = fine.project(in_camera)
    at = (pixels[1:] - 0.5).astype(np.float32)
    found = cv2.remap(field, at[:, None, 0], at[:, None, 1], cv2.INTER_LINEAR).reshape(-1, 3)
    normals = found[:, 1:] / np.maximum(np.linalg.norm(found[:, 1:], axis=1), 1e-6)[:, None]
    lever_px = np.einsum("ni,ni->n", pixels[1:] - pixels[0], normals)
    return np.stack([lever_px - found[:, 0], found[:, 0]]) * in_camera[1:, 2] / fine.fx


def _surface_off(truth: RayScene, eye: Points, surface: Points) -> Points:
    """(M,) how far (m) drawn points lie outside the real surface.

    Only of points that show the part that is there, and that are not seen along the surface.
    """
    sight = surface - eye
    range_m = np.linalg.norm(sight, axis=1)
    sight /= range_m[:, None]
    hits = truth.cast(np.broadcast_to(eye, sight.shape), sight)
    facing = np.abs(np.einsum("ni,ni->n", hits.normals, sight))
    off_m = np.where(hits.triangle >= 0, hits.distance - range_m, np.inf)
    off_m *= np.maximum(facing, MIN_FACING)
    return off_m[(np.abs(off_m) < FAR_M) & (facing > MIN_FACING)]
