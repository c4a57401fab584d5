# pyright: standard
"""A headset's mesh of the room, laid on the room's surface by iterated closest points."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial import KDTree

from scenes.frames import WORLD_FROM_GLTF
from scenes.mesh import CollisionMesh
from scenes.pose import Pose
from scenes.prepare.progress import Progress, silent

ICP_POINTS = 40_000
"""Points of each surface in the last registration."""
ICP_REACHES_M = (0.30, 0.10, 0.04)
"""Distances within which points are matched, from one fit to the next, metres."""
MIN_OVERLAP = 0.2
"""Share of the mesh that has to find a partner."""

SEARCH_POINTS = 1_500
"""Points of each surface in the search."""
COMPARED_POINTS = 20_000
"""Points by which the results of the search are compared."""
THINNED = 20
"""Of the compared points of another placement, every twentieth decides whether it is the same."""
SEARCH_REACHES_M = (0.6, 0.25)
"""Distances within which points are matched in the search, metres."""
SEARCH_STEP_DEG = 20.0
"""Yaws between the starts of the search, degrees."""
AGREE_M = 0.10
"""A point of one surface this near to the other agrees with it: what splats leave of a wall is
rough by some centimetres."""
ENOUGH_EXPLAINED = 0.5
"""Of the room's surface: from here on the mesh is one of this room, however much more it shows."""
SAME_SHARE = 0.98
"""Two placements whose surfaces agree so far put the mesh in the same place."""
MIN_LEAD = 0.06
"""How much more of the room the best placement must explain than any other, relatively. A headset's
mesh of the built-in lab leads its mirror image by 0.14 on a room of fourteen photos; where two
headings of a symmetric room are as good, the lead is below 0.02."""
HEIGHTS = (0.02, 0.98)
"""Of a room's points: where its floor and its ceiling are taken to be, whatever hangs out."""


@dataclass(frozen=True, slots=True, eq=False)
class Registration:
    """How a headset's mesh lies in the room.

    Attributes:
        world_from_mesh: its pose.
        rms_m: distance of its vertices to the splats' surface, where they overlap.
        overlap: share of its vertices that have a partner there.
        is_mirrored: it was mirrored in its file, and was turned back before it was laid.
    """

    world_from_mesh: Pose
    rms_m: float
    overlap: float
    is_mirrored: bool = False

    def summary(self) -> str:
        """One line for people."""
        turned = "mirrored in its file and turned back, " if self.is_mirrored else ""
        fit = f"{self.overlap:.0%} of it within {1000 * self.rms_m:.0f} mm of the splats' surface"
        return turned + fit


@dataclass(frozen=True, slots=True, eq=False)
class _Placement:
    """A try: how much of the room the mesh explains there, and its points there."""

    explained: float
    world_from_mesh: Pose
    is_mirrored: bool
    points: np.ndarray


def place_mesh(
    mesh: CollisionMesh, room: CollisionMesh, *, progress: Progress = silent
) -> tuple[CollisionMesh, Registration]:
    """A headset's mesh in the world, wherever its own origin is.

    Every heading is tried, with Z up and with Y up (as glTF says), and each also mirrored, as
    programs with left-handed axes write meshes. The placement that explains most of the room's
    surface is then registered finely; it must be clearly better than any that lies elsewhere.

    Args:
        mesh: metres, upright, in the headset's frame.
        room: the room's surface, world.
        progress: called after every heading.

    Raises:
        ValueError: either is empty, less than a fifth of the mesh finds a partner, or two
            placements fit alike.
    """
    for what, given in (("the headset's mesh", mesh), ("the room's surface", room)):
        if not len(given.faces):
            raise ValueError(f"{what} has no triangles, so neither can be laid on the other")
    tries = sorted(_placements(mesh, room, progress), key=lambda place: -place.explained)
    best = tries[0]
    if best.explained < MIN_OVERLAP:
        raise _foreign(best.explained, "the room's surfaces lie on the headset's mesh")
    _require_lead(best, tries[1:])
    chosen = mirrored(mesh) if best.is_mirrored else mesh
    # A room that few photos show is small beside the mesh, which then need not lie on much of it.
    least = MIN_OVERLAP if best.explained < ENOUGH_EXPLAINED else 0.0
    registration = register_mesh(chosen, room, best.world_from_mesh, min_overlap=least)
    registration = replace(registration, is_mirrored=best.is_mirrored)
    vertices = registration.world_from_mesh @ chosen.vertices.astype(np.float64)
    return CollisionMesh(vertices.astype(np.float32), chosen.faces), registration


def mirrored(mesh: CollisionMesh) -> CollisionMesh:
    """The mesh with its X turned round, its triangles seen from the same side as before."""
    vertices = mesh.vertices * np.array([-1, 1, 1], dtype=np.float32)
    return CollisionMesh(vertices, mesh.faces[:, ::-1])


def _placements(
    mesh: CollisionMesh, room: CollisionMesh, progress: Progress
) -> Iterator[_Placement]:
    fixed = _as_points(room, SEARCH_POINTS)
    of_room = np.asarray(fixed.points)
    for is_mirrored, given in ((False, mesh), (True, mirrored(mesh))):
        moving = _as_points(given, SEARCH_POINTS)
        dense = np.asarray(_as_points(given, COMPARED_POINTS).points)
        guesses = list(_guesses(given, room))
        for number, guess in enumerate(guesses):
            fit = _fit(moving, fixed, guess, SEARCH_REACHES_M)
            pose = Pose.from_matrix(fit.transformation)
            points = pose @ dense
            yield _Placement(_agreement(of_room, points), pose, is_mirrored, points)
            done = (number + 1) / len(guesses)
            progress(0.5 * (is_mirrored + done), f"heading {number + 1} of {len(guesses)}")


def _agreement(points: np.ndarray, others: np.ndarray) -> float:
    """Share of points that have one of the others near them."""
    near, _ = KDTree(others).query(points, distance_upper_bound=AGREE_M)
    return float(np.isfinite(near).mean())


def _require_lead(best: _Placement, others: Sequence[_Placement]) -> None:
    """Refuse a placement that another one, with the mesh elsewhere, fits as well.

    Raises:
        ValueError: there is one.
    """
    floor = (1 - MIN_LEAD) * best.explained
    for other in others:
        if other.explained <= floor:
            return
        if _agreement(other.points[::THINNED], best.points) < SAME_SHARE:
            how = " (one of them mirrored)" if best.is_mirrored != other.is_mirrored else ""
            raise ValueError(
                f"the headset's mesh fits the room in two places alike{how}: it explains "
                f"{best.explained:.0%} and {other.explained:.0%} of the room's surface there, "
                f"wanted a lead of {MIN_LEAD:.0%}; scan more of the room with the headset, "
                "furniture above all, or prepare without the mesh"
            )


def register_mesh(
    mesh: CollisionMesh,
    room: CollisionMesh,
    world_from_guess: Pose,
    *,
    min_overlap: float = MIN_OVERLAP,
) -> Registration:
    """Fit a headset's mesh to the room's by point-to-plane ICP from a first guess.

    Args:
        mesh: the headset's, in its own frame, metres.
        room: the room's, world.
        world_from_guess: roughly the mesh's pose, within some 30 cm and 10°: from the shared code.
        min_overlap: share of the mesh that must find a partner.

    Raises:
        ValueError: less of it does.
    """
    fit = _fit(
        _as_points(mesh, ICP_POINTS), _as_points(room, ICP_POINTS), world_from_guess, ICP_REACHES_M
    )
    if fit.fitness < min_overlap:
        raise _foreign(fit.fitness, "the headset's mesh lies on the room's surfaces")
    return Registration(
        Pose.from_matrix(fit.transformation), float(fit.inlier_rmse), float(fit.fitness)
    )


def _foreign(share: float, what: str) -> ValueError:
    return ValueError(
        f"only {share:.0%} of {what}, wanted {MIN_OVERLAP:.0%}; is it a mesh of this room, in "
        "metres, and is the room's own scale measured (by a code or a length)?"
    )


def _guesses(mesh: CollisionMesh, room: CollisionMesh) -> Iterator[Pose]:
    """Every heading, the meshes' middles and floors on each other."""
    there = _middle_of_floor(room.vertices.astype(np.float64))
    for upright in (np.eye(3), WORLD_FROM_GLTF.rotation):
        here = _middle_of_floor(mesh.vertices @ upright.T)
        for turn in np.arange(0.0, 360.0, SEARCH_STEP_DEG):
            turned = Pose.from_yaw(math.radians(turn), (0.0, 0.0, 0.0)).rotation
            yield Pose(turned @ upright, there - turned @ here)


def _middle_of_floor(points: np.ndarray) -> np.ndarray:
    low, high = np.quantile(points, HEIGHTS, axis=0)
    return np.array([0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), low[2]])


def _fit(moving: Any, fixed: Any, world_from_guess: Pose, reaches_m: tuple[float, ...]) -> Any:
    import open3d as o3d

    matrix = world_from_guess.matrix()
    fit = None
    for reach_m in reaches_m:
        fit = o3d.pipelines.registration.registration_icp(
            moving,
            fixed,
            reach_m,
            matrix,
            o3d.pipelines.registration.TransformationEstimationPointToPlane(),
        )
        matrix = fit.transformation
    return fit


def _as_points(mesh: CollisionMesh, count: int) -> Any:
    import open3d as o3d

    surface = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(mesh.vertices.astype(np.float64)),
        o3d.utility.Vector3iVector(mesh.faces.copy()),
    )
    surface.compute_vertex_normals()
    # Open3D samples with its own generator; the same meshes shall give the same pose.
    o3d.utility.random.seed(0)
    return surface.sample_points_uniformly(count)
