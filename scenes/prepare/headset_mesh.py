# pyright: standard
"""A headset's mesh of the room, laid on the room's surface by iterated closest points."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from scenes.frames import WORLD_FROM_GLTF
from scenes.mesh import CollisionMesh
from scenes.pose import Pose
from scenes.prepare.progress import Progress, silent

ICP_POINTS = 40_000
ICP_REACHES_M = (0.30, 0.10, 0.04)
LEAST_OVERLAP = 0.2

SEARCH_POINTS = 1_500
SEARCH_REACHES_M = (0.6, 0.25)
SEARCH_STEP_DEG = 20.0
HEIGHTS = (0.02, 0.98)
"""Of a room's points: where its floor and its ceiling are taken to be, whatever hangs out."""


@dataclass(frozen=True, slots=True, eq=False)
class Registration:
    """How a headset's mesh lies in the room.

    Attributes:
        world_from_mesh: its pose.
        rms_m: distance of its vertices to the splats' surface, where they overlap.
        overlap: share of its vertices that have a partner there.
    """

    world_from_mesh: Pose
    rms_m: float
    overlap: float

    def summary(self) -> str:
        """One line for people."""
        return f"{self.overlap:.0%} of it within {1000 * self.rms_m:.0f} mm of the splats' surface"


def place_mesh(
    mesh: CollisionMesh, room: CollisionMesh, *, progress: Progress = silent
) -> tuple[CollisionMesh, Registration]:
    """A headset's mesh in the world, wherever its own origin is.

    Every heading is tried, with Z up and with Y up (as glTF says); the one with most overlap is
    then registered finely. A room that looks the same turned round may be found the wrong way.

    Args:
        mesh: metres, upright, in the headset's frame.
        room: the room's surface, world.
        progress: called after every heading.

    Raises:
        ValueError: either is empty, or less than a fifth of the mesh finds a partner.
    """
    for what, given in (("the headset's mesh", mesh), ("the room's surface", room)):
        if not len(given.faces):
            raise ValueError(f"{what} has no triangles, so neither can be laid on the other")
    guesses = list(_guesses(mesh, room))
    moving, fixed = _as_points(mesh, SEARCH_POINTS), _as_points(room, SEARCH_POINTS)
    best: tuple[float, Pose] = (-1.0, guesses[0])
    for number, world_from_guess in enumerate(guesses):
        fit = _fit(moving, fixed, world_from_guess, SEARCH_REACHES_M)
        if fit.fitness > best[0]:
            best = (float(fit.fitness), Pose.from_matrix(fit.transformation))
        progress((number + 1) / len(guesses), f"heading {number + 1} of {len(guesses)}")
    registration = register_mesh(mesh, room, best[1])
    vertices = registration.world_from_mesh @ mesh.vertices.astype(np.float64)
    return CollisionMesh(vertices.astype(np.float32), mesh.faces), registration


def register_mesh(mesh: CollisionMesh, room: CollisionMesh, world_from_guess: Pose) -> Registration:
    """Fit a headset's mesh to the room's by point-to-plane ICP from a first guess.

    Args:
        mesh: the headset's, in its own frame, metres.
        room: the room's, world.
        world_from_guess: roughly the mesh's pose, within some 30 cm and 10°: from the shared code.

    Raises:
        ValueError: less than a fifth of the mesh finds a partner.
    """
    fit = _fit(
        _as_points(mesh, ICP_POINTS), _as_points(room, ICP_POINTS), world_from_guess, ICP_REACHES_M
    )
    if fit.fitness < LEAST_OVERLAP:
        raise ValueError(
            f"only {fit.fitness:.0%} of the headset's mesh lies on the room's surfaces, "
            f"wanted {LEAST_OVERLAP:.0%}; is it a mesh of this room, in metres, and is the room's "
            "own scale measured (by a code or a length)?"
        )
    return Registration(
        Pose.from_matrix(fit.transformation), float(fit.inlier_rmse), float(fit.fitness)
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
