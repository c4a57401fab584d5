"""Every axis flip of the project, by name. No other file writes a handedness or axis matrix.

World: right-handed, Z up, metres. Camera: OpenCV axes (x right, y down, z forward).
Each constant is a rotation `A_FROM_B` between the axes of two conventions with a shared origin.
"""

from __future__ import annotations

import numpy as np

from scenes.pose import Pose


def _axes(*rows: tuple[int, int, int]) -> Pose:
    return Pose(np.array(rows, dtype=np.float64), np.zeros(3))


OPENGL_FROM_OPENCV = _axes((1, 0, 0), (0, -1, 0), (0, 0, -1))
"""OpenGL, VTK and MuJoCo cameras look along -Z with Y up."""

WORLD_FROM_GLTF = _axes((1, 0, 0), (0, 0, -1), (0, 1, 0))
"""glTF, OpenXR, WebXR, three.js: right-handed, Y up, -Z forward; our world is Z up, +Y forward."""

RDF_FROM_RUB = _axes((1, 0, 0), (0, -1, 0), (0, 0, -1))
"""SPZ stores right-up-back; splat PLY files store right-down-forward."""

WORLD_FROM_FORWARD_CAMERA = _axes((1, 0, 0), (0, 0, 1), (0, -1, 0))
"""Orientation of a level camera that looks along world +Y with its x axis along world +X."""

CAMERA_FROM_AHEAD = _axes((0, -1, 0), (0, 0, -1), (1, 0, 0))
"""Axes of a camera from those of an observer with x ahead, y to its left, z up."""

WORLD_FROM_BOARD_FACING_X = _axes((0, 0, 1), (1, 0, 0), (0, 1, 0))
"""A board (x right, y up, z out of it) that stands upright and faces world +X."""

CAMERA_FROM_BOARD = _axes((-1, 0, 0), (0, -1, 0), (0, 0, 1))
"""A board (x right, y up, z out of it) upright on a camera, that faces where the camera looks."""

ARROW_FROM_CYLINDER = _axes((0, 0, 1), (0, 1, 0), (-1, 0, 0))
"""An arrow points along +X; the cylinder of its shaft and the cone of its head stand along +Z."""

UNITY_FROM_WORLD = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
"""Unity is left-handed, y up, z forward: a mirror, so a matrix (3, 3) and no pose. A rotation R
becomes U R Uᵀ."""

FRONT_FROM_BACK_LENS = _axes((-1, 0, 0), (0, 1, 0), (0, 0, -1))
"""The back lens of a 360° camera looks the other way: half a turn about the camera's y axis."""


def head_axes(forward: np.ndarray, up: np.ndarray) -> np.ndarray:
    """(3, 3) axes of an observer, OpenCV's, as columns: x right, y down, z ahead.

    Args:
        forward: (3,) to where the observer looks, of any length above 0.
        up: (3,) out of the top of the head; what of it is along `forward` does not count.

    Raises:
        ValueError: one has no length or is not finite, or they are parallel.
    """
    ahead = np.asarray(forward, dtype=np.float64)
    down = -np.asarray(up, dtype=np.float64)
    with np.errstate(all="ignore"):
        ahead = ahead / np.linalg.norm(ahead)
        down = down - (down @ ahead) * ahead
        length = float(np.linalg.norm(down))
    if not (np.isfinite(ahead).all() and np.isfinite(length) and length > 1e-6):
        raise ValueError(f"head: forward {forward} and up {up} give no axes")
    down = down / length
    return np.stack([np.cross(down, ahead), down, ahead], axis=1)


def look_at(eye: np.ndarray, target: np.ndarray) -> Pose:
    """`world_from_camera` of a level OpenCV camera at `eye` that looks at `target`, metres.

    Raises:
        ValueError: `eye` and `target` coincide.
    """
    forward = np.asarray(target, dtype=np.float64) - np.asarray(eye, dtype=np.float64)
    distance = float(np.linalg.norm(forward))
    if distance < 1e-9:
        raise ValueError(f"look_at: eye {eye} and target {target} coincide")
    forward /= distance
    x, y, z = forward.tolist()
    right = np.array([y, -x, 0.0])
    length = float(np.linalg.norm(right))
    right = right / length if length >= 1e-6 else np.array([1.0, 0.0, 0.0])
    # Forward × right, whose third is 0: one `np.cross` takes as long as all of this.
    down = np.array([-z * right[1], z * right[0], x * right[1] - y * right[0]])
    return Pose(np.stack([right, down, forward], axis=1), np.asarray(eye, dtype=np.float64))
