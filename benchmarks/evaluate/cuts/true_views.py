"""True pictures of a random room: with an object, without it, and of the object alone.

They are drawn from the meshes that the simulated phone filmed, without its blur, noise and
exposure, from anywhere in the prepared world.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.evaluate.cuts.captures import Capture
from benchmarks.evaluate.cuts.capturing import filmed_movables
from benchmarks.evaluate.cuts.truth import seen_in
from benchmarks.evaluate.dataset.preparing import rigid_from_cameras
from scenes.cameras import Pinhole, pixel_centres
from scenes.frames import look_at
from scenes.mesh import PhysicalRoom
from scenes.pose import Pose
from scenes.prepare.reconstruction import View
from scenes.rays import RayScene
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.splats import SplatCloud
from sim.phone.capture import read_truth
from sim.phone.light import still_scene
from sim.phone.raster import PinholeRasteriser

BoolArray = NDArray[np.bool_]
FloatArray = NDArray[np.float64]

SAMPLES_PX = ((-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25))
"""Samples of a pixel, from its centre: edges are as soft as a photo's."""

GREY = 0.5
"""Behind an object alone: a hole in it shows, be it dark or light."""

AWAY = Pose(np.eye(3), np.array([0.0, 0.0, -1e3]))
"""Pose of meshes that are not to be seen: beyond all that is drawn."""

MIN_SHOWN_PX = 150
"""Of an object in a picture that judges it; the refinement asks as much of its photos."""

UNSEEN_DEG = 60.0
"""Least angle between a view of a side that nobody filmed and every photo, seen from the object."""

DIRECTIONS = 400
"""Over the upper half of the sphere, 7° apart."""

UNSEEN_VIEWS = 6
"""Of an object, at most, as far from each other as they can be."""

UNSEEN_PX = 240
"""Of an object's diagonal in them: of each pixel all photos are asked whether they saw it."""

SHOWING, ASKED = 0.05, 200
"""Share of an object's seen surface from which on a photo shows it, and points that are asked."""

REFITS, OUTLIER = 3, 2.5
"""Fits of the room's colours, and how many medians off a pixel is left out of the next: it shows
what was trained wrongly."""


@dataclass(frozen=True, slots=True, eq=False)
class TrueView:
    """A true picture that shows an object.

    Attributes:
        camera: that would take it.
        world_from_camera: from where, in the package's world.
        rgb: (H, W, 3), 0..1.
        behind: (H, W, 3), the same without the object.
        shown: (H, W) pixels by which the object is judged.
    """

    camera: Pinhole
    world_from_camera: Pose
    rgb: FloatArray
    behind: FloatArray
    shown: BoolArray


def true_room(seed: int, capture: Capture, *, aside: Sequence[View]) -> TrueRoom:
    """The random room of a seed, ready to be drawn as the phone filmed it; to be closed.

    Args:
        seed: of the room.
        capture: of it.
        aside: photos that no training saw.

    Raises:
        ValueError: the capture's photos are of another room.
    """
    room, _ = filmed_movables(seed)
    truth = {shot.name: shot.world_from_camera for shot in read_truth(capture.folder).shots}
    moved = rigid_from_cameras(capture.photos, truth, where=str(capture.folder))
    return TrueRoom(room, capture, aside=aside, true_from_package=moved)


class TrueRoom:
    """Draws a room with meshes as it truly is; to be closed.

    Args:
        room: its meshes.
        capture: of it, with the same objects in the same order.
        aside: photos that no training saw; pinholes.
        true_from_package: from the package's world to the room's.
    """

    def __init__(
        self,
        room: PhysicalRoom,
        capture: Capture,
        *,
        aside: Sequence[View],
        true_from_package: Pose,
    ) -> None:
        self._true_from_package = true_from_package
        self._capture, self._scene = capture, RayScene(np.concatenate(capture.parts))
        counts = [len(part) for part in capture.parts]
        self._owner = np.repeat(np.arange(len(counts)) - 1, counts)
        meshes = [-1] * len(room.static)
        for number, item in enumerate(room.objects):
            meshes += [number] * len(item.meshes)
        self._mesh_owner = np.array(meshes)
        self._camera = _pinhole(capture.photos[0])
        size = self._camera.width_px, self._camera.height_px
        self._rasteriser = PinholeRasteriser(still_scene(room), *size)
        self._aside = [view for view in aside if _size(view) == size]
        self._whole = [self._drawn(_pinhole(v), v.world_from_camera) for v in self._aside]
        self._owners = [self._owners_in(view) for view in self._aside]

    def __enter__(self) -> TrueRoom:
        return self

    def __exit__(self, *reason: object) -> None:
        self._rasteriser.close()

    def colours(self, room: SplatCloud, renderer: NativeRenderer) -> FloatArray:
        """(3, 2) gain and bias from the colours of a trained room to the true ones.

        The exposure of a room's photos is known up to one of all of them; it is found once, over
        all views kept aside.
        """
        drawn: list[FloatArray] = []
        for view in self._aside:
            posed = [PosedSplats(room, Pose.identity())]
            pose = view.world_from_camera
            picture = renderer.render(posed, view.camera, pose, RenderOptions())
            drawn.append(picture.rgb.astype(np.float64))
        if not drawn:
            return np.array([[1.0, 0.0]] * 3)
        shown, true = (
            np.concatenate([picture[::4, ::4].reshape(-1, 3) for picture in pictures])
            for pictures in (drawn, self._whole)
        )
        return np.stack([_line(shown[:, k], true[:, k]) for k in range(3)])

    def aside_views(self, number: int) -> list[TrueView]:
        """True pictures from where photos were kept aside, of those that show an object."""
        views = []
        for view, whole, owners in zip(self._aside, self._whole, self._owners, strict=True):
            shown = owners == number
            if shown.sum() < MIN_SHOWN_PX:
                continue
            camera, pose = _pinhole(view), view.world_from_camera
            behind = self._drawn(camera, pose, hidden=self._mesh_owner == number)
            views.append(_cropped(TrueView(camera, pose, whole, behind, shown)))
        return views

    def unseen_views(self, number: int, seen: FloatArray) -> list[TrueView]:
        """Pictures of an object alone, far from every photo, judged where a photo saw its surface.

        Args:
            number: of the object.
            seen: (K, 3) points of its surface that photos saw.
        """
        item = self._capture.objects[number]
        asked = seen[:: max(1, len(seen) // ASKED)]
        photos = [
            view
            for view in self._capture.photos
            if seen_in(asked, self._scene, views=[view]).sum() > SHOWING * len(asked)
        ]
        if not photos:
            return []
        rays = np.stack([v.world_from_camera.translation for v in photos]) - item.middle
        distance = float(np.median(np.linalg.norm(rays, axis=1)))
        corners = item.triangles.reshape(-1, 3)
        diagonal = float(np.linalg.norm(np.ptp(corners, axis=0)))
        camera = self._camera
        focal_px = min(camera.fx, UNSEEN_PX * distance / diagonal)
        camera = replace(camera, fx=focal_px, fy=focal_px)
        found = [
            self._alone(
                number,
                camera,
                pose=look_at(item.middle + distance * direction, item.middle),
                photos=photos,
            )
            for direction in _far_directions(rays)
        ]
        return [_cropped(view) for view in found if view.shown.sum() >= MIN_SHOWN_PX]

    def _alone(
        self, number: int, camera: Pinhole, *, pose: Pose, photos: Sequence[View]
    ) -> TrueView:
        triangles = self._capture.objects[number].triangles
        alone = RayScene(triangles)
        rgb = self._drawn(camera, pose, hidden=self._mesh_owner != number)
        part, around = _box_around(camera, pose, triangles=triangles)
        shape = around.height_px, around.width_px
        covered = np.zeros(shape)
        for shift in SAMPLES_PX:
            covered += (_ends(around, pose, scene=alone, shift_px=shift)[1] >= 0).reshape(shape)
        behind = np.full((*shape, 3), GREY)
        whole = rgb[part] + (1 - covered[..., None] / len(SAMPLES_PX)) * behind
        ends, triangle = _ends(around, pose, scene=alone)
        shown = triangle >= 0
        shown[shown] = seen_in(ends[shown], self._scene, views=photos)
        return TrueView(around, pose, whole, behind, shown.reshape(shape))

    def _drawn(
        self, camera: Pinhole, world_from_camera: Pose, *, hidden: BoolArray | None = None
    ) -> FloatArray:
        moved = {} if hidden is None else {int(k): AWAY for k in np.flatnonzero(hidden)}
        pose = self._true_from_package @ world_from_camera
        pictures = [
            self._rasteriser.draw(camera, pose, shift_px=shift, moved=moved).astype(np.float64)
            for shift in SAMPLES_PX
        ]
        return np.asarray(np.mean(pictures, axis=0) / 255, dtype=np.float64)

    def _owners_in(self, view: View) -> NDArray[np.intp]:
        camera = _pinhole(view)
        _, triangle = _ends(camera, view.world_from_camera, scene=self._scene)
        owners = np.where(triangle >= 0, self._owner[np.maximum(triangle, 0)], -1)
        return owners.reshape(camera.height_px, camera.width_px)


def _far_directions(rays: FloatArray) -> list[FloatArray]:
    """Unit vectors from an object far from those to its photos, and from each other."""
    k = np.arange(DIRECTIONS) + 0.5
    up = k / DIRECTIONS
    turn = np.pi * (1 + 5**0.5) * k
    across = np.sqrt(1 - up**2)
    sphere = np.stack([across * np.cos(turn), across * np.sin(turn), up], axis=1)
    towards = rays / np.linalg.norm(rays, axis=1, keepdims=True)
    nearest = (sphere @ towards.T).max(axis=1)
    free = sphere[nearest <= np.cos(np.radians(UNSEEN_DEG))]
    chosen: list[FloatArray] = []
    while len(chosen) < min(UNSEEN_VIEWS, len(free)):
        others = np.stack(chosen) if chosen else towards
        chosen.append(free[int(np.argmin((free @ others.T).max(axis=1)))])
    return chosen


def _ends(
    camera: Pinhole,
    world_from_camera: Pose,
    *,
    scene: RayScene,
    shift_px: tuple[float, float] = (0.0, 0.0),
) -> tuple[FloatArray, NDArray[np.int64]]:
    """(H · W, 3) where the pixels' rays end, and (H · W,) on which triangle, -1 for none."""
    rays = camera.unproject(pixel_centres(camera) + shift_px) @ world_from_camera.rotation.T
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    eyes = np.broadcast_to(world_from_camera.translation, rays.shape)
    hits = scene.cast(eyes, rays)
    hit = hits.triangle >= 0
    distance = np.where(hit, hits.distance, 0.0)
    return eyes + distance[:, None] * rays, np.asarray(hits.triangle, dtype=np.int64)


def _box_around(
    camera: Pinhole, world_from_camera: Pose, *, triangles: FloatArray
) -> tuple[tuple[slice, slice], Pinhole]:
    """Rows and columns of a picture that triangles (T, 3, 3) are in, and the camera of them."""
    pixels, valid = camera.project(world_from_camera.inverse() @ triangles.reshape(-1, 3))
    size = np.array([camera.width_px, camera.height_px])
    low = np.clip(np.floor(pixels[valid].min(axis=0)) - 1, 0, size - 1).astype(int)
    high = np.clip(np.ceil(pixels[valid].max(axis=0)) + 1, low + 1, size).astype(int)
    part = (slice(low[1], high[1]), slice(low[0], high[0]))
    return part, _part_of(camera, part)


def _cropped(view: TrueView) -> TrueView:
    """The part of a picture by which the object is judged."""
    rows, columns = (np.flatnonzero(view.shown.any(axis=axis)) for axis in (1, 0))
    part = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1))
    camera = _part_of(view.camera, part)
    pose = view.world_from_camera
    return TrueView(camera, pose, view.rgb[part], view.behind[part], view.shown[part])


def _part_of(camera: Pinhole, part: tuple[slice, slice]) -> Pinhole:
    (top, bottom), (left, right) = ((int(side.start), int(side.stop)) for side in part)
    return replace(
        camera,
        width_px=right - left,
        height_px=bottom - top,
        cx=camera.cx - left,
        cy=camera.cy - top,
    )


def _line(x: FloatArray, y: FloatArray) -> FloatArray:
    """(2,) slope and offset of y over x, robustly."""
    design, kept = np.column_stack([x, np.ones_like(x)]), np.ones(len(x), dtype=bool)
    found = np.array([1.0, 0.0])
    for _ in range(REFITS):
        found = np.linalg.lstsq(design[kept], y[kept], rcond=None)[0]
        off = np.abs(design @ found - y)
        kept = off <= OUTLIER * max(float(np.median(off)), 1 / 255)
    return np.asarray(found, dtype=np.float64)


def _pinhole(view: View) -> Pinhole:
    """The camera of a phone's photo.

    Raises:
        ValueError: it is none of a phone's.
    """
    if not isinstance(view.camera, Pinhole):
        raise ValueError(  # noqa: TRY004 - the view is of the right type, not of the right kind
            f"{view.name}: a lens without edges, wanted a pinhole's photo; film with the phone"
        )
    return view.camera


def _size(view: View) -> tuple[int, int]:
    return view.camera.width_px, view.camera.height_px
