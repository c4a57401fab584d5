"""Models in the BOP form: one per kind of object, in millimetres, with size and symmetries."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError  # pyright: ignore[reportMissingTypeStubs]

from scenes.mesh import PhysicalObject
from scenes.pose import Pose
from sim.dataset.json_stream import write_json
from sim.dataset.truth.surfaces import MILLIMETRES, joined, meshes_of_object, write_model_ply
from sim.dataset.truth.symmetry import ROUND, yaw_symmetry


def model_numbers(objects: Sequence[PhysicalObject]) -> dict[str, int]:
    """Model of each object, from 1; twins, whose meshes and textures are the same, share one."""
    numbers: dict[str, int] = {}
    found: dict[str, int] = {}
    for item in objects:
        digest = hashlib.sha256(item.kind.encode())
        for mesh in meshes_of_object(item):
            for part in (mesh.vertices, mesh.faces, mesh.uv, mesh.texture):
                digest.update(part.tobytes())
        numbers[item.object_id] = found.setdefault(digest.hexdigest(), len(found) + 1)
    return numbers


def write_models(
    folder: Path, objects: Sequence[PhysicalObject], model_of: Mapping[str, int]
) -> None:
    """`obj_NNNNNN.ply`, `models_info.json`, and `names.json` (which object is which model).

    Raises:
        WriteError: the disk is full.
    """
    folder.mkdir(parents=True)
    infos: dict[str, Any] = {}
    for item in objects:
        number = model_of[item.object_id]
        if str(number) in infos:
            continue
        meshes = meshes_of_object(item)
        surface = joined(meshes)
        write_model_ply(folder / f"obj_{number:06d}.ply", surface)
        infos[str(number)] = _info(MILLIMETRES * surface.vertices, yaw_symmetry(meshes))
    write_json(folder / "models_info.json", infos)
    names = [
        {"object": i.object_id, "kind": i.kind, "obj_id": model_of[i.object_id]} for i in objects
    ]
    write_json(folder / "names.json", names)


def _info(vertices_mm: NDArray[np.float64], symmetry: int) -> dict[str, Any]:
    low, high = vertices_mm.min(axis=0), vertices_mm.max(axis=0)
    info: dict[str, Any] = {"diameter": round(_diameter(vertices_mm), 4)}
    info |= {f"min_{a}": round(float(v), 4) for a, v in zip("xyz", low, strict=True)}
    info |= {f"size_{a}": round(float(v), 4) for a, v in zip("xyz", high - low, strict=True)}
    if symmetry == ROUND:
        info["symmetries_continuous"] = [{"axis": [0, 0, 1], "offset": [0, 0, 0]}]
    elif symmetry > 1:
        info["symmetries_discrete"] = [
            Pose.from_yaw(2 * math.pi * k / symmetry).matrix().round(12).ravel().tolist()
            for k in range(1, symmetry)
        ]
    return info


def _diameter(points: NDArray[np.float64]) -> float:
    """Largest distance between two points, in their unit."""
    try:
        hull: Any = ConvexHull(points)
        points = points[hull.vertices]
    except QhullError:  # a flat object has no hull
        points = np.unique(points, axis=0)
    return max(float(np.linalg.norm(points - point, axis=1).max()) for point in points)
