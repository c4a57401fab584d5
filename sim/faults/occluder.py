"""Something stands between the camera and an object, and hides a part of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Rig
from scenes.frames import look_at
from scenes.mesh import PhysicalObject, TexturedMesh
from scenes.pose import Pose
from sim.bodies import Body, BodyPart, Placement
from sim.faults.fault import Fault, Span, Stage, misfit_of_object, read_span
from sim.tables import Table

MAX_SHARE = 0.9
"""Of the silhouette; a tenth stays in sight."""

GAP_M = 0.05
"""From the panel to the nearest point of the object, metres: beside it, not in it."""

NEAREST_M = 0.15
"""From the lens to the panel, metres; nearer ones would fill the picture."""

PANEL_SCALE = 1.5
"""Side of the panel over the object's diagonal: it covers all of it from wherever it stands."""

SILHOUETTE_PX = 256
"""About how many pixels across the silhouette is drawn: shares to half a percent."""

SUBPIXEL_BITS = 4
"""Binary digits behind the point of the corners that are drawn."""

SUBPIXELS = float(1 << SUBPIXEL_BITS)

THICKNESS_M = 0.01
COLOURS = ((176, 140, 98), (150, 116, 80))
"""Cardboard with darker stripes, sRGB: in neither of the built-in rooms."""


@dataclass(frozen=True, slots=True)
class Occluder(Fault):
    """A sheet of cardboard that goes along with an object, between it and the camera.

    Attributes:
        object: what it hides.
        share: of the object's silhouette, 0..0.9, from the left.
        span: when.
    """

    name: ClassVar[str] = "occluder"
    sizes: ClassVar[Mapping[str, str]] = {"share": "share"}

    object: str
    share: float
    span: Span = field(default_factory=Span)

    @classmethod
    def read(cls, table: Table) -> Self:
        """See `Fault.read`."""
        fault = cls(
            table.text("object"),
            table.number("share", low=0.0, high=MAX_SHARE),
            read_span(table),
        )
        table.done()
        return fault

    def size_at(self, t_s: float) -> float:
        """See `Fault.size_at`."""
        return self.share if self.span.holds(t_s) else 0.0

    def described(self) -> str:
        """See `Fault.described`."""
        return f"something hides {self.share:.0%} of {self.object}"

    def misfit(self, stage: Stage) -> tuple[str, object, str] | None:
        """See `Fault.misfit`."""
        return misfit_of_object("object", self.object, stage)


def panel_body(body_id: str, item: PhysicalObject) -> Body:
    """The sheet, large enough for an object: x right, y down, z away from the lens, metres."""
    half_m = 0.5 * panel_side_m(item)
    sides = (-half_m, half_m)
    corners = np.array([[x, y, z] for z in (0.0, THICKNESS_M) for y in sides for x in sides])
    faces = np.array(
        [
            [0, 1, 2], [1, 3, 2], [4, 6, 5], [5, 6, 7], [0, 2, 4], [2, 6, 4],
            [1, 5, 3], [3, 5, 7], [0, 4, 1], [1, 4, 5], [2, 3, 6], [3, 7, 6],
        ],
        dtype=np.int32,
    )  # fmt: skip
    uv = np.array([[x, 1.0 - y] for _ in (0, 1) for y in (0.0, 1.0) for x in (0.0, 1.0)])
    stripes = np.arange(64) // 8 % 2
    texture = np.array(COLOURS, dtype=np.uint8)[np.broadcast_to(stripes[:, None], (64, 64))]
    # Counter-clockwise seen from outside, with z away from the viewer.
    mesh = TexturedMesh(corners, faces[:, ::-1], uv.astype(np.float32), texture)
    return Body(body_id, (BodyPart((mesh,), (corners,)),))


def panel_side_m(item: PhysicalObject) -> float:
    """Side of the sheet for an object, metres."""
    return PANEL_SCALE * float(np.linalg.norm(item.box_m))


def panel_placement(
    item: PhysicalObject,
    world_from_object: Pose,
    rig: Rig,
    world_from_rig: Pose,
    *,
    share: float,
) -> Placement:
    """Place the sheet to hide a share of an object's silhouette from the lens that sees it best.

    Args:
        item: the object.
        world_from_object: where it is now.
        rig: the camera.
        world_from_rig: its true pose.
        share: of the silhouette's pixels, 0..1, from the left.
    """
    centre = world_from_object @ np.array([0.0, 0.0, 0.5 * item.box_m[2]])
    lens, world_from_lens = _best_lens(rig, world_from_rig, centre)
    aimed = look_at(world_from_lens.translation, centre)
    aimed_from_object = aimed.inverse() @ world_from_object
    vertices = [aimed_from_object @ mesh.vertices for mesh in item.meshes]
    nearest_m = min(float(v[:, 2].min()) for v in vertices)
    distance_m = max(nearest_m - GAP_M, NEAREST_M, 0.5 * nearest_m)
    slope = _edge_slope(item, vertices, lens, world_from_lens.inverse() @ aimed, share=share)
    shift_m = slope * distance_m - 0.5 * panel_side_m(item)
    place = aimed @ np.array([shift_m, 0.0, distance_m - THICKNESS_M])
    return Placement((Pose(aimed.rotation, place),), float(world_from_object.translation[2]))


def _best_lens(rig: Rig, world_from_rig: Pose, point: NDArray[np.float64]) -> tuple[Fisheye, Pose]:
    """The lens to whose axis a point (3,) in the world is nearest, and `world_from_lens`."""
    found: list[tuple[float, int]] = []
    for index, rig_from_lens in enumerate(rig.rig_from_lens):
        x, y, z = (world_from_rig @ rig_from_lens).inverse() @ point
        found.append((float(np.arctan2(np.hypot(x, y), z)), index))
    _, best = min(found)
    return rig.lenses[best], world_from_rig @ rig.rig_from_lens[best]


def _edge_slope(
    item: PhysicalObject,
    vertices: list[NDArray[np.float64]],
    lens: Fisheye,
    lens_from_aimed: Pose,
    *,
    share: float,
) -> float:
    """x/z in the aimed frame to the left of which a share of the silhouette's pixels lies."""
    pixels = [lens.project(lens_from_aimed @ v)[0] for v in vertices]
    low = np.min([p.min(axis=0) for p in pixels], axis=0) - 1.0
    high = np.max([p.max(axis=0) for p in pixels], axis=0) + 1.0
    scale = SILHOUETTE_PX / float((high - low).max())
    columns, rows = np.ceil(scale * (high - low)).astype(int) + 1
    drawn = np.zeros((rows, columns), np.uint8)
    for mesh, at_px in zip(item.meshes, pixels, strict=True):
        corners = np.asarray(np.round(SUBPIXELS * scale * (at_px - low)), np.int32)
        for a, b, c in mesh.faces.tolist():
            cv2.fillConvexPoly(drawn, corners[[a, b, c]], 1, cv2.LINE_8, SUBPIXEL_BITS)
    y, x = np.nonzero(drawn)
    rays = (
        lens_from_aimed.inverse().rotation
        @ lens.unproject(np.stack([x, y], axis=1) / scale + low).T
    )
    return float(np.quantile(rays[0] / rays[2], share))


def panel_id(object_id: str) -> str:
    """Id of the body that hides an object."""
    return f"occluder:{object_id}"
