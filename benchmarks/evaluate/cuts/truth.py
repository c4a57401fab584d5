"""Owners of a capture's splats, and which of an object's surface its photos saw."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.evaluate.cuts.captures import Capture
from benchmarks.evaluate.cuts.marking import smaller
from benchmarks.evaluate.true_labels import between_two, labels_by_light, labels_by_mesh
from scenes.cameras import Fisheye, Pinhole
from scenes.prepare.reconstruction import View
from scenes.rays import RayScene
from scenes.render.native import NativeRenderer

FloatArray = NDArray[np.float64]

PER_M2 = 10_000.0
"""Points on a surface: one a square centimetre, a quarter of what a point judges (2 cm around)."""

POINTS = (400, 6000)
"""Fewest and most on an object: 400 tell 5 % within 1 %."""

ON_SURFACE_M = 2e-3
"""A ray that ends nearer to a point than this sees it: rays are cast in single precision, and a
point of a slanted face lies as far from where its neighbours' rays end."""

COARSER = 2
"""Times that pictures are smaller into which light falls: it takes a quarter as long."""

KEPT = "truth.npz"
"""Beside a capture: finding it takes a minute."""

SOURCES = ("truth.py", "captures.py", "../true_labels.py")
"""Code that decides what it says, relative to this file."""


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """The truth of a capture's splats and surfaces.

    Attributes:
        labels: (N,) index into the capture's objects, -1 for what never moves: whose pixels the
            splat paints in the photos, or where none shows it, whose mesh is nearest. A plain chair
            that few photos show is drawn by splats several centimetres off its surface, and they
            are the chair's all the same; what hangs beside a plant pot and paints the wall behind
            it is the wall's, though the pot's mesh is nearer.
        by_mesh: (N,) whose mesh is nearest, whatever they paint; of two that are equally near,
            whose pixels the splat paints; -2 for floaters, which are near to none.
        seen: by object, (K, 3) points spread evenly on that surface of it that some photo saw, in
            the package's world.
        seen_share: by object, how much of its surface that is.
    """

    labels: NDArray[np.int16]
    by_mesh: NDArray[np.int16]
    seen: tuple[FloatArray, ...]
    seen_share: FloatArray


def truth_of(capture: Capture, *, renderer: NativeRenderer) -> Truth:
    """The truth of a capture, from beside it where it was found before."""
    path, key = capture.folder / KEPT, _key(capture)
    if path.is_file():
        with np.load(path, allow_pickle=False) as kept:
            if str(kept["key"]) == key:
                seen = np.split(kept["points"], np.cumsum(kept["counts"])[:-1])
                return Truth(kept["labels"], kept["by_mesh"], tuple(seen), kept["seen_share"])
    room, parts = capture.package.room, capture.parts
    labels = labels_by_mesh(room, parts)
    views = [replace(v, camera=_smaller(v.camera)) for v in capture.photos]
    by_light = labels_by_light(room, parts, viewpoints=views, renderer=renderer)
    by_mesh = np.where(between_two(room, parts), by_light, labels).astype(np.int16)
    scene = RayScene(np.concatenate(parts))
    seen, shares = [], []
    for number, item in enumerate(capture.objects):
        points = surface_points(item.triangles, np.random.default_rng(number))
        is_seen = seen_in(points, scene, views=capture.photos)
        seen.append(points[is_seen])
        shares.append(float(is_seen.mean()))
    truth = Truth(by_light.astype(np.int16), by_mesh, tuple(seen), np.array(shares))
    _keep(truth, path, key=key)
    return truth


def surface_points(triangles: FloatArray, rng: np.random.Generator) -> FloatArray:
    """(K, 3) points spread evenly over triangles (T, 3, 3)."""
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = 0.5 * np.linalg.norm(across, axis=1)
    count = int(np.clip(PER_M2 * areas.sum(), *POINTS))
    # Evenly along the running area: fewer gaps than by chance.
    along = (np.arange(count) + rng.uniform()) / count * areas.sum()
    chosen = triangles[np.minimum(np.searchsorted(np.cumsum(areas), along), len(areas) - 1)]
    u, v = np.sqrt(rng.uniform(size=count)), rng.uniform(size=count)
    weights = np.stack([1 - u, u * (1 - v), u * v], axis=1)
    return np.einsum("kc,kcx->kx", weights, chosen)


def seen_in(points: FloatArray, scene: RayScene, *, views: Sequence[View]) -> NDArray[np.bool_]:
    """(K,) whether some photo sees points (K, 3) of a scene's surface."""
    seen = np.zeros(len(points), dtype=bool)
    for view in views:
        open_ = np.flatnonzero(~seen)
        _, valid = view.camera.project(view.world_from_camera.inverse() @ points[open_])
        within = open_[valid]
        if not len(within):
            continue
        eye = view.world_from_camera.translation
        towards = points[within] - eye
        distance = np.linalg.norm(towards, axis=1)
        origins = np.broadcast_to(eye, towards.shape)
        ends = scene.cast(origins, towards / distance[:, None]).distance
        seen[within[ends > distance - ON_SURFACE_M]] = True
    return seen


def _smaller(camera: Pinhole | Fisheye) -> Pinhole | Fisheye:
    return smaller(camera, COARSER) if isinstance(camera, Pinhole) else camera


def _key(capture: Capture) -> str:
    """Of the splats and of the code: another training's truth is another."""
    digest = hashlib.sha256(np.ascontiguousarray(capture.package.room.means).tobytes())
    for part in capture.parts:
        digest.update(np.round(part, 6).tobytes())
    for source in SOURCES:
        digest.update((Path(__file__).parent / source).read_bytes())
    return digest.hexdigest()


def _keep(truth: Truth, path: Path, *, key: str) -> None:
    np.savez_compressed(
        path,
        key=np.array(key),
        labels=truth.labels,
        by_mesh=truth.by_mesh,
        points=np.concatenate(truth.seen),
        counts=np.array([len(points) for points in truth.seen]),
        seen_share=truth.seen_share,
    )
