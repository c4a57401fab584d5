"""A prepared capture beside its truth, in the scene package's world."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.evaluate.cuts.capturing import PHOTOS, SCENE, filmed_movables
from benchmarks.evaluate.dataset.layout import Dataset
from benchmarks.evaluate.dataset.preparing import rigid_from_cameras, true_parts
from benchmarks.evaluate.true_labels import object_triangles, static_triangles
from scenes.package import ScenePackage, load_package
from scenes.pose import Pose
from scenes.prepare.reconstruction import View, load_reconstruction
from sim.phone.capture import read_truth

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class TrueObject:
    """A movable object as it truly is.

    Attributes:
        object_id: unique in its room.
        family: what it is, such as "swivel-chair".
        kind: what it shares with its twins.
        box_m: (3,) extents of its upright box.
        triangles: (T, 3, 3) its surface, in the package's world.
    """

    object_id: str
    family: str
    kind: str
    box_m: FloatArray
    triangles: FloatArray

    @property
    def middle(self) -> FloatArray:
        """(3,) of its bounding box, in the package's world."""
        corners = self.triangles.reshape(-1, 3)
        return 0.5 * (corners.min(axis=0) + corners.max(axis=0))


@dataclass(frozen=True, slots=True, eq=False)
class Capture:
    """A room as the product prepared it, and what is truly there.

    Attributes:
        folder: where it is kept.
        package: as prepared, nothing cut.
        photos: with their poses in the package's world.
        static: (T, 3, 3) what never moves, in the package's world.
        objects: what may be moved.
        off_m: how far the package's world is from the true one, at the object where it is most.
    """

    folder: Path
    package: ScenePackage
    photos: tuple[View, ...]
    static: FloatArray
    objects: tuple[TrueObject, ...]
    off_m: float

    @property
    def parts(self) -> list[FloatArray]:
        """(T, 3, 3) triangles of what never moves, then of each object."""
        return [self.static, *(item.triangles for item in self.objects)]


def read_room(seed: int, folder: Path) -> Capture:
    """The finished capture of a random room.

    Raises:
        ValueError, PackageError: it is not finished, or damaged.
    """
    room, families = filmed_movables(seed)
    truth = {shot.name: shot.world_from_camera for shot in read_truth(folder).shots}
    items = [
        TrueObject(
            item.object_id,
            families[item.object_id],
            item.kind,
            np.array(item.box_m),
            object_triangles(item),
        )
        for item in room.objects
    ]
    return _capture(folder, world_from_camera=truth, static=static_triangles(room), items=items)


def read_dataset_room(dataset: Dataset, folder: Path) -> Capture:
    """The finished capture of a dataset's photos; raises as `read_room`."""
    static, *surfaces = true_parts(dataset, Pose.identity())
    items = [
        TrueObject(item.object_id, item.kind, item.kind, item.box_m, surface)
        for item, surface in zip(dataset.objects.values(), surfaces, strict=True)
    ]
    return _capture(folder, world_from_camera=dataset.world_from_camera, static=static, items=items)


def _capture(
    folder: Path,
    *,
    world_from_camera: Mapping[str, Pose],
    static: FloatArray,
    items: list[TrueObject],
) -> Capture:
    """The capture of a folder, with the truth moved into its package's world."""
    photos = load_reconstruction(folder / PHOTOS).views
    moved = rigid_from_cameras(photos, world_from_camera, where=str(folder)).inverse()
    off_m = max(float(np.linalg.norm(moved @ item.middle - item.middle)) for item in items)
    objects = tuple(
        TrueObject(i.object_id, i.family, i.kind, i.box_m, moved @ i.triangles) for i in items
    )
    return Capture(folder, load_package(folder / SCENE), photos, moved @ static, objects, off_m)
