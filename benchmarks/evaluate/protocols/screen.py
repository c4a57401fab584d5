"""A board that hides objects: its look, and its place for a given hidden share."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from scenes.mesh import PhysicalObject, TexturedMesh
from scenes.pose import Pose
from sim.bodies import UNIT_BOX_CORNERS, Body, BodyPart, Placement

SCREEN_ID = "screen"
WIDTH_M, HEIGHT_M, THICKNESS_M = 1.1, 1.9, 0.03

NEARNESS = 0.6
"""Where the board stands on the way from the camera to the object."""

CELL_RAD = math.radians(0.2)
"""Grid on which the object's picture is counted."""

MARGIN_RAD = math.radians(3.0)
"""How far the board reaches beyond an object that it hides altogether."""

COLOUR = (172, 138, 98)

_HALVES = ((0, 1, 2), (0, 2, 3))
"""A quad's two triangles."""


def screen_body() -> Body:
    """A cardboard board that stands on its lower edge; its broad sides face along y."""
    half = np.array([WIDTH_M, THICKNESS_M, HEIGHT_M]) / 2
    corners = UNIT_BOX_CORNERS * half + [0.0, 0.0, half[2]]
    quads = (
        (0, 4, 5, 1), (2, 3, 7, 6), (0, 1, 3, 2), (4, 6, 7, 5), (1, 5, 7, 3), (0, 2, 6, 4),
    )  # fmt: skip
    vertices = np.concatenate([corners[list(quad)] for quad in quads])
    faces = np.array([[4 * k + a, 4 * k + b, 4 * k + c] for k in range(6) for a, b, c in _HALVES])
    uv = np.tile(np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32), (6, 1))
    mesh = TexturedMesh(vertices, faces.astype(np.int32), uv, _cardboard())
    return Body(SCREEN_ID, (BodyPart((mesh,), (corners,)),))


def hiding(
    eye: NDArray[np.float64], item: PhysicalObject, world_from_object: Pose, share: float
) -> Placement | None:
    """The board so that it hides a share of an object, from its left; None to hide nothing.

    Args:
        eye: (3,) the camera, world metres.
        item: the object.
        world_from_object: where it is.
        share: 0..1 of its picture.
    """
    if share <= 0:
        return None
    azimuths = _azimuths_of_cells(eye, world_from_object @ surface_points(item))
    # Seen from above, left of the line of sight is the larger azimuth.
    whole = share >= 1
    edge = azimuths.min() - MARGIN_RAD if whole else float(np.quantile(azimuths, 1.0 - share))
    distance = float(np.linalg.norm(world_from_object.translation[:2] - eye[:2]))
    reach = NEARNESS * distance
    middle = edge + math.atan2(0.5 * WIDTH_M, reach)
    away = reach / math.cos(middle - edge)
    place = eye[:2] + away * np.array([math.cos(middle), math.sin(middle)])
    # Its normal looks at the camera along the edge's own line of sight: no side of it is seen.
    yaw = edge - 0.5 * math.pi
    return Placement((Pose.from_yaw(yaw, np.array([*place, 0.0])),), 0.0)


def surface_points(item: PhysicalObject) -> NDArray[np.float64]:
    """(N, 3) points spread evenly over an object's surface, in its frame, about 4 mm apart."""
    points = []
    for mesh in item.meshes:
        a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
        area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        count = np.maximum(1, np.ceil(area / 0.004**2)).astype(int)
        index = np.repeat(np.arange(len(area)), count)
        # A low-discrepancy sequence: no random numbers, no clumps.
        k = np.arange(len(index))
        u, v = (0.5 + k * 0.7548776662466927) % 1.0, (0.5 + k * 0.5698402909980532) % 1.0
        over = u + v > 1.0
        u, v = np.where(over, 1.0 - u, u), np.where(over, 1.0 - v, v)
        points.append(a[index] + u[:, None] * (b - a)[index] + v[:, None] * (c - a)[index])
    return np.concatenate(points)


def _azimuths_of_cells(
    eye: NDArray[np.float64], points: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Azimuth of every cell of the object's picture."""
    sight = points - eye
    azimuth = np.arctan2(sight[:, 1], sight[:, 0])
    elevation = np.arctan2(sight[:, 2], np.hypot(sight[:, 0], sight[:, 1]))
    cells = np.stack([azimuth // CELL_RAD, elevation // CELL_RAD], axis=1).astype(int)
    low, high = cells.min(axis=0), cells.max(axis=0)
    rows = int(high[1] - low[1]) + 1
    # One number a cell: rows of an array take ten times as long to be told apart.
    numbers = np.unique((cells[:, 0] - low[0]) * rows + cells[:, 1] - low[1])
    return (numbers // rows + low[0] + 0.5) * CELL_RAD


def _cardboard() -> NDArray[np.uint8]:
    """Brown board with a fine grain and a strip of tape."""
    rng = np.random.default_rng(31)
    grain = rng.normal(0.0, 5.0, (64, 1, 1)) + rng.normal(0.0, 2.5, (64, 64, 1))
    picture = np.asarray(COLOUR) + grain
    picture[30:34] += 26.0
    return np.clip(picture, 0, 255).astype(np.uint8)
