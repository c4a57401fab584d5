# pyright: standard
"""Placement of meshes by the nodes of a glTF scene."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.formats.containers.glb import Glb, item
from scenes.formats.storage.error import FormatError, refusal
from scenes.pose import Pose, rotation_from_quaternion

SHEAR_TOLERANCE = 1e-4
"""How much more a node's matrix may stretch along one direction than along another."""


FURTHEST = 1e12
"""Numbers in nodes are smaller than this, and so are those of nodes within nodes."""


@dataclass(frozen=True, slots=True)
class Placement:
    """A mesh in a scene: scaled, then turned and moved.

    Attributes:
        mesh: its number.
        scale: > 0.
        scene_from_node: in glTF's axes.
    """

    mesh: int
    scale: float
    scene_from_node: Pose

    def stays(self) -> bool:
        """Whether the mesh, once scaled, is neither turned nor moved."""
        here = self.scene_from_node
        return np.array_equal(here.rotation, np.eye(3)) and not here.translation.any()


def placements(glb: Glb) -> Iterator[Placement]:
    """Every mesh of the default scene, or of all root nodes' meshes if the file has no scene.

    Raises:
        FormatError: a node is missing, below itself or placed twice, or its transform is no
            rotation, translation and even, positive scale.
    """
    seen: set[int] = set()
    waiting = [(index, np.eye(4)) for index in reversed(_roots(glb))]
    while waiting:
        index, scene_from_parent = waiting.pop()
        node = item(glb, "nodes", index)
        if index in seen:
            raise _bad(glb, index, "is placed more than once")
        seen.add(index)
        scene_from_node = scene_from_parent @ _parent_from_node(glb, index, node)
        if "mesh" in node:
            yield _placement(glb, index, node["mesh"], scene_from_node)
        children = node.get("children", [])
        if not isinstance(children, list):
            raise _bad(glb, index, "has no list of children")
        waiting += [(child, scene_from_node) for child in reversed(children)]


def _roots(glb: Glb) -> list[Any]:
    if not glb.document.get("scenes"):
        nodes = glb.document.get("nodes")
        below = {
            child
            for node in (nodes if isinstance(nodes, list) else [])
            if isinstance(node, dict) and isinstance(node.get("children"), list)
            for child in node["children"]
            if isinstance(child, int)
        }
        return [i for i in range(len(nodes) if isinstance(nodes, list) else 0) if i not in below]
    roots = item(glb, "scenes", glb.document.get("scene", 0)).get("nodes", [])
    return roots if isinstance(roots, list) else []


def _parent_from_node(glb: Glb, index: int, node: dict[str, Any]) -> NDArray[np.float64]:
    matrix = np.eye(4)
    if "matrix" in node:
        return _numbers(glb, index, node, "matrix", np.eye(4).ravel()).reshape(4, 4).T
    xyzw = _numbers(glb, index, node, "rotation", np.array([0.0, 0.0, 0.0, 1.0]))
    norm = np.linalg.norm(xyzw)
    if not norm > SHEAR_TOLERANCE:
        raise _bad(glb, index, f"has a rotation of norm {norm:g}")
    rotation = rotation_from_quaternion(np.roll(xyzw / norm, 1)[None])[0]
    matrix[:3, :3] = rotation * _numbers(glb, index, node, "scale", np.ones(3))
    matrix[:3, 3] = _numbers(glb, index, node, "translation", np.zeros(3))
    return matrix


def _numbers(
    glb: Glb, index: int, node: dict[str, Any], name: str, default: NDArray[np.float64]
) -> NDArray[np.float64]:
    values = node.get(name, default.tolist())
    if (
        not isinstance(values, list)
        or len(values) != len(default)
        or not all(isinstance(v, (int, float)) and abs(v) < FURTHEST for v in values)
    ):
        raise _bad(glb, index, f"{name} is not {len(default)} numbers")
    return np.array(values, dtype=np.float64)


def _placement(glb: Glb, index: int, mesh: Any, scene_from_node: NDArray[np.float64]) -> Placement:
    if not np.abs(scene_from_node).max() < FURTHEST:
        raise _bad(glb, index, f"moves or scales by {FURTHEST:g} or more")
    linear = scene_from_node[:3, :3]
    u, stretch, v = np.linalg.svd(linear)
    if (
        not np.linalg.det(linear) > 0
        or not np.ptp(stretch) <= SHEAR_TOLERANCE * stretch[0]
        or not np.array_equal(scene_from_node[3], [0, 0, 0, 1])
    ):
        raise _bad(glb, index, "is mirrored or scaled unevenly, which splats cannot be")
    if np.array_equal(linear, np.eye(3)):
        return Placement(mesh, 1.0, Pose(linear, scene_from_node[:3, 3]))
    return Placement(mesh, float(stretch.mean()), Pose(u @ v, scene_from_node[:3, 3]))


def _bad(glb: Glb, index: int, what: str) -> FormatError:
    return refusal(glb.path, f"node {index}", what, "export it with the transform applied")
