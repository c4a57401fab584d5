"""Two small rooms as the product prepares them, small enough for the default tests.

A chair on a star of five castors, on a rug; a book and a mug on a desk. Photos from an arc with a
phone's noise and exposure, and the splats that the built-in trainer makes of them, lie in
`tests/data/captures`; the rooms themselves are made of meshes, which are the truth.

`python -m tests.small_captures` makes the files anew (a minute a room).
"""

import math
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from benchmarks.evaluate.cuts.captures import Capture, TrueObject
from benchmarks.evaluate.cuts.truth import surface_points
from benchmarks.evaluate.true_labels import object_triangles, parts_of, static_triangles
from benchmarks.random_rooms.packed import book
from benchmarks.random_rooms.seats import swivel_chair
from benchmarks.random_rooms.turned import mug
from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.mesh import PhysicalObject, PhysicalRoom
from scenes.package import ScenePackage
from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.prepare.reconstruction import Reconstruction, View, read_picture
from scenes.prepare.train.train import BuiltInTrainer
from scenes.prepare.train.trainer import TrainingOptions
from scenes.samples.furniture import RoomSet, table
from scenes.samples.pictures.atlas import mesh_from_surfaces
from scenes.samples.pictures.textures import parquet, picture, wood
from scenes.samples.pictures.wall_art import rug, shapes_poster
from scenes.samples.shapes import quad
from scenes.samples.shell import Shell, floor_with_rug, shell
from scenes.splats import SplatCloud
from sim.phone.light import still_scene
from sim.phone.raster import PinholeRasteriser

DATA = Path(__file__).parent / "data" / "captures"
INSIDE = Shell(np.array([-1.9, -1.9, 0.0]), np.array([1.9, 1.9, 2.4]))
CAMERA = Pinhole.from_fov(400, 300, math.radians(62))
SAMPLES_PX = ((-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25))
NOISE, EXPOSURE, JPEG_QUALITY = 2.0, 0.03, 88
SPARSE, SPARSE_NOISE_M = 3000, 0.005
TRAINING = TrainingOptions(iterations=1500, budget=20_000, sh_degree=0, stereo_px=300, previews=0)


@dataclass(frozen=True)
class SmallRoom:
    """A room, the families of its objects, and the arc that it is filmed from."""

    physical: PhysicalRoom
    families: dict[str, str]
    around: tuple[float, float, float]
    radius_m: float
    heights_m: tuple[float, ...]
    arc_rad: tuple[float, float]

    def poses(self) -> list[Pose]:
        middle = np.array(self.around)
        low, high = self.arc_rad
        poses = []
        for height in self.heights_m:
            for k in range(14):
                turn = low + (high - low) * (k + 0.5 * (height > middle[2] + 0.5)) / 14
                along = np.array([math.cos(turn), math.sin(turn), 0.0])
                eye = middle * (1, 1, 0) + self.radius_m * along + np.array([0, 0, height])
                poses.append(look_at(eye, middle))
        return poses


def chair_on_a_rug() -> SmallRoom:
    rng = np.random.default_rng(3)
    item = swivel_chair(np.random.default_rng(5))
    floor = floor_with_rug(INSIDE, parquet(rng, (176, 138, 96)), (-0.9, -0.7), (0.9, 0.7), rug, rng)
    physical = _physical("chair", _shell(rng, floor), [("chair", item, Pose.from_yaw(0.7))])
    return SmallRoom(
        physical, {"chair": item.family}, (0, 0, 0.4), 1.55, (0.75, 1.55), (0.0, 6.283)
    )


def book_and_mug() -> SmallRoom:
    rng = np.random.default_rng(4)
    parts = _shell(rng, parquet(rng, (150, 120, 90))(3.8, 3.8))
    light = wood(rng, (190, 150, 105))
    table(parts, (-1.85, -0.7, 0.0), (-1.1, 0.7, 0.74), top=light, legs=light)
    items = [
        ("book", book(np.random.default_rng(8)), Pose.from_yaw(0.5, (-1.42, -0.18, 0.74))),
        ("mug", mug(np.random.default_rng(9)), Pose.from_yaw(1.0, (-1.4, 0.22, 0.74))),
    ]
    physical = _physical("desk", parts, items)
    families = {name: item.family for name, item, _ in items}
    return SmallRoom(physical, families, (-1.42, 0, 0.76), 0.95, (1.1, 1.5), (-1.5, 1.5))


ROOMS = {"chair": chair_on_a_rug, "desk": book_and_mug}


def small_capture(name: str, folder: Path) -> Capture:
    """The capture of a small room; its photos are written to a folder."""
    room = ROOMS[name]()
    views = _written(np.load(DATA / f"{name}.npz")["photos"], room, folder)
    with np.load(DATA / f"{name}.npz") as kept:
        cloud = _unpacked(kept)
    physical = room.physical
    package = ScenePackage(
        name,
        cloud,
        (),
        (),
        Pose.identity(),
        physical.footprint_m,
        None,
        views=tuple(ViewPoint(v.name, v.camera, v.world_from_camera) for v in views),
    )
    objects = tuple(
        TrueObject(
            item.object_id,
            room.families[item.object_id],
            "",
            np.array(item.box_m),
            object_triangles(item),
        )
        for item in physical.objects
    )
    return Capture(folder, package, views, static_triangles(physical), objects, 0.0)


def make(name: str) -> None:
    """Film and train a small room, and store what comes out."""
    room, rng = ROOMS[name](), np.random.default_rng(1)
    photos = _filmed(room, rng)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        views = _written(_joined(photos), room, folder)
        found = Reconstruction(views, *_sparse_points(room.physical, views, rng))
        trainer = BuiltInTrainer(
            TRAINING, rng=lambda: np.random.default_rng(0), stopwatch=time.perf_counter
        )
        (folder / "training").mkdir()
        result = trainer.train(found, folder / "training", progress=lambda done, note: None)
    DATA.mkdir(parents=True, exist_ok=True)
    path = DATA / f"{name}.npz"
    np.savez_compressed(path, photos=_joined(photos), **_packed(result.cloud))
    size = path.stat().st_size // 1000
    print(f"{name}: {len(result.cloud)} splats, {result.psnr_db:.1f} dB, {size} kB")


def _sparse_points(room: PhysicalRoom, views: tuple[View, ...], rng: np.random.Generator):
    """Points of the surfaces as structure from motion finds them, their colours and errors."""
    points = np.concatenate([surface_points(part, rng) for part in parts_of(room)])
    points = points[rng.permutation(len(points))[:SPARSE]]
    points = points + rng.normal(0, SPARSE_NOISE_M, points.shape)
    colours = np.full((len(points), 3), 128, np.uint8)
    for view in views:
        pixels, seen = view.camera.project(view.world_from_camera.inverse() @ points)
        column, row = np.floor(pixels[seen]).astype(int).T
        colours[seen] = read_picture(view)[row.clip(0, 299), column.clip(0, 399)]
    return points, colours, np.full(len(points), 0.5, np.float32)


def _shell(rng: np.random.Generator, floor: np.ndarray) -> RoomSet:
    parts = RoomSet()
    shell(parts, INSIDE, rng, floor=floor, walls={"-x": (150, 175, 185)})
    for side, along in (("+x", -0.6), ("-x", 0.5), ("+y", 0.4), ("-y", -0.3)):
        wall = INSIDE.wall(side, along, 1.5)
        corner = wall @ np.array([-0.3, 0.4, 0.01])
        right, up = 0.6 * wall.rotation[:, 0], 0.8 * wall.rotation[:, 1]
        parts.add(quad(corner, right, -up, material=picture(shapes_poster(rng, 240, 320))))
    return parts


def _physical(name: str, parts: RoomSet, items: list) -> PhysicalRoom:
    objects: list[PhysicalObject] = [
        item.physical(object_id, object_id, pose, item.mesh()) for object_id, item, pose in items
    ]
    return PhysicalRoom(
        name,
        (mesh_from_surfaces(parts.surfaces),),
        tuple(objects),
        tuple(parts.solids),
        np.array([0.48, 0.36, 0.8]),
        Pose.identity(),
        ambient=0.6,
        key=0.5,
        footprint_m=np.stack([INSIDE.low[:2], INSIDE.high[:2]]),
    )


def _filmed(room: SmallRoom, rng: np.random.Generator) -> list[np.ndarray]:
    """JPEG files, as bytes."""
    rasteriser = PinholeRasteriser(still_scene(room.physical), CAMERA.width_px, CAMERA.height_px)
    photos = []
    for pose in room.poses():
        drawn = [rasteriser.draw(CAMERA, pose, shift_px=s).astype(float) for s in SAMPLES_PX]
        shot = np.mean(drawn, axis=0) * rng.normal(1.0, EXPOSURE) + rng.normal(
            0, NOISE, (300, 400, 3)
        )
        bgr = np.clip(np.round(shot), 0, 255).astype(np.uint8)[..., ::-1]
        photos.append(cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1])
    rasteriser.close()
    return photos


def _joined(photos: list[np.ndarray]) -> np.ndarray:
    """One row of bytes; each file's length stands before it."""
    return np.concatenate(
        [np.concatenate([np.array([len(p)], np.uint32).view(np.uint8), p.ravel()]) for p in photos]
    )


def _written(photos: np.ndarray, room: SmallRoom, folder: Path) -> tuple[View, ...]:
    views, start = [], 0
    for number, pose in enumerate(room.poses()):
        count = int(photos[start : start + 4].view(np.uint32)[0])
        path = folder / f"{number:02d}.jpg"
        path.write_bytes(photos[start + 4 : start + 4 + count].tobytes())
        views.append(View(path.name, path, CAMERA, pose))
        start += 4 + count
    return tuple(views)


def _packed(cloud: SplatCloud) -> dict[str, np.ndarray]:
    """Splats in 17 bytes each: places to 0.1 mm."""
    unit = cloud.rotations / np.linalg.norm(cloud.rotations, axis=1, keepdims=True)
    return {
        "means": np.clip(np.round(cloud.means / 1e-4), -32767, 32767).astype(np.int16),
        "scales": np.clip(np.round(20 * np.log(cloud.scales / 1e-4)), 0, 255).astype(np.uint8),
        "rotations": np.round(127 * unit).astype(np.int8),
        "opacities": np.round(255 * cloud.opacities).astype(np.uint8),
        "colours": np.clip(np.round(64 * (cloud.sh[:, 0] + 2)), 0, 255).astype(np.uint8),
    }


def _unpacked(kept) -> SplatCloud:
    rotations = kept["rotations"].astype(np.float32)
    rotations /= np.linalg.norm(rotations, axis=1, keepdims=True)
    return SplatCloud(
        kept["means"].astype(np.float32) * np.float32(1e-4),
        (1e-4 * np.exp(kept["scales"].astype(np.float64) / 20)).astype(np.float32),
        rotations,
        kept["opacities"].astype(np.float32) / 255,
        (kept["colours"].astype(np.float32) / 64 - 2)[:, None],
    )


if __name__ == "__main__":
    for chosen in sys.argv[1:] or ROOMS:
        make(chosen)
