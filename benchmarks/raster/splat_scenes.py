"""Synthetic splat scenes for timing, with the statistics of scanned rooms and objects."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.frames import look_at
from scenes.pose import Pose, quaternion_from_rotation
from scenes.splats import SH_C0, SplatCloud

FloatArray = NDArray[np.float64]

COVERAGE = 9.0
"""Sum of the splats' areas (2πσ²) over the surface they lie on; about 50 blends a pixel."""
FLOATER_SHARE = 0.04
ROOM_SIZE_M = (6.0, 5.0, 2.7)


def bench_room(count: int, rng: np.random.Generator) -> SplatCloud:
    """A furnished room of `count` splats, 6 × 5 × 2.7 m about the origin, floor at z = 0."""
    size = np.array(ROOM_SIZE_M)
    boxes = [(np.array([0.0, 0.0, 0.5 * size[2]]), size)]
    for _ in range(24):
        extent = rng.uniform(0.2, 1.0, 3)
        place = rng.uniform(-0.45, 0.45, 2) * size[:2]
        boxes.append((np.array([*place, 0.5 * extent[2]]), extent))
    surface = _on_boxes(boxes, round(count * (1 - FLOATER_SHARE)), rng)
    return _with_floaters(surface, count, size, rng)


def bench_object(count: int, rng: np.random.Generator) -> SplatCloud:
    """A chair of `count` splats, about 0.9 m high, standing on the origin."""
    boxes = [
        (np.array([0.0, 0.0, 0.45]), np.array([0.45, 0.45, 0.06])),
        (np.array([0.0, 0.21, 0.7]), np.array([0.45, 0.04, 0.45])),
    ]
    boxes += [
        (np.array([x, y, 0.21]), np.array([0.05, 0.05, 0.42]))
        for x in (-0.19, 0.19)
        for y in (-0.19, 0.19)
    ]
    return _on_boxes(boxes, count, rng)


def shrunk(cloud: SplatCloud, factor: float) -> SplatCloud:
    """The cloud `factor` times as large about its origin."""
    return SplatCloud(
        cloud.means * np.float32(factor),
        cloud.scales * np.float32(factor),
        cloud.rotations,
        cloud.opacities,
        cloud.sh,
    )


def room_camera(width_px: int, height_px: int) -> tuple[Pinhole, Pose]:
    """A pinhole of 60° in the middle of the room; it sees about a fifth of the splats."""
    pose = _looking(from_m=(-0.3, -0.4, 1.5), at_m=(2.5, 1.0, 0.9))
    return Pinhole.from_fov(width_px, height_px, np.radians(60.0)), pose


def object_camera(size_px: int) -> tuple[Pinhole, Pose]:
    """A pinhole that sees the chair over most of the picture."""
    return Pinhole.from_fov(size_px, size_px, np.radians(38.0)), _looking(
        from_m=(0.9, -1.1, 0.9), at_m=(0.0, 0.0, 0.45)
    )


def dual_fisheye(size_px: int) -> tuple[tuple[Fisheye, Pose], ...]:
    """The two 200° lenses of a 360° camera in the middle of the room."""
    lens = Fisheye.from_fov(size_px, np.radians(200.0))
    front = _looking(from_m=(0.2, -0.1, 1.3), at_m=(1.2, -0.1, 1.3))
    back = _looking(from_m=(0.2, -0.1, 1.3), at_m=(-0.8, -0.1, 1.3))
    return (lens, front), (lens, back)


def random_cloud(
    count: int, rng: np.random.Generator, *, sh_degree: int = 3, spread_m: float = 1.0
) -> SplatCloud:
    """Splats of all sizes (1 mm to 1 m), shapes and opacities about the origin."""
    quaternions = rng.normal(size=(count, 4))
    coefficients = rng.normal(size=(count, (sh_degree + 1) ** 2, 3)) * 0.2
    return SplatCloud(
        (rng.normal(size=(count, 3)) * spread_m).astype(np.float32),
        np.exp(rng.uniform(np.log(1e-3), np.log(1.0), (count, 3))).astype(np.float32),
        (quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)).astype(np.float32),
        rng.uniform(0.02, 1.0, count).astype(np.float32),
        coefficients.astype(np.float32),
    )


def _looking(*, from_m: tuple[float, ...], at_m: tuple[float, ...]) -> Pose:
    return look_at(np.array(from_m), np.array(at_m))


def _on_boxes(
    boxes: list[tuple[FloatArray, FloatArray]], count: int, rng: np.random.Generator
) -> SplatCloud:
    """Flat splats spread evenly over the faces of boxes given by centre and extent."""
    faces = [
        (centre, extent, axis, side)
        for centre, extent in boxes
        for axis in range(3)
        for side in (-1, 1)
    ]
    areas = np.array([extent.prod() / extent[axis] for _, extent, axis, _ in faces])
    chosen = rng.choice(len(faces), size=count, p=areas / areas.sum())
    deviation = np.sqrt(COVERAGE * areas.sum() / (count * 2 * np.pi))

    centres = np.array([face[0] for face in faces])[chosen]
    extents = np.array([face[1] for face in faces])[chosen]
    axes = np.array([face[2] for face in faces])[chosen]
    sides = np.array([face[3] for face in faces])[chosen]
    offsets = rng.uniform(-0.5, 0.5, (count, 3))
    offsets[np.arange(count), axes] = 0.5 * sides
    means = centres + offsets * extents + rng.normal(size=(count, 3)) * 0.002

    scales = deviation * np.exp(rng.normal(size=(count, 3)) * 0.35)
    scales[np.arange(count), axes] *= 0.1
    half = rng.uniform(-np.pi, np.pi, count) / 2
    quaternions = np.zeros((count, 4))
    quaternions[:, 0] = np.cos(half)
    quaternions[np.arange(count), 1 + axes] = np.sin(half)
    colours = 0.5 + 0.35 * np.sin(5.0 * means + chosen[:, None] * np.array([1.0, 2.3, 3.1]))
    return _cloud(means, scales, quaternions, colours, rng)


def _with_floaters(
    surface: SplatCloud, count: int, size: FloatArray, rng: np.random.Generator
) -> SplatCloud:
    missing = count - len(surface)
    means = rng.uniform(-0.5, 0.5, (missing, 3)) * size + [0.0, 0.0, 0.5 * size[2]]
    scales = np.exp(rng.uniform(np.log(0.003), np.log(0.02), (missing, 3)))
    quaternions = np.tile(quaternion_from_rotation(np.eye(3)), (missing, 1))
    floaters = _cloud(means, scales, quaternions, rng.uniform(0, 1, (missing, 3)), rng)
    fields = ("means", "scales", "rotations", "opacities", "sh")
    return SplatCloud(
        *(np.concatenate([getattr(surface, name), getattr(floaters, name)]) for name in fields)
    )


def _cloud(
    means: FloatArray,
    scales: FloatArray,
    quaternions: FloatArray,
    colours: FloatArray,
    rng: np.random.Generator,
) -> SplatCloud:
    count = len(means)
    is_firm = rng.random(count) < 0.7
    opacities = np.where(is_firm, rng.uniform(0.6, 1.0, count), rng.uniform(0.03, 0.3, count))
    sh = rng.normal(size=(count, 16, 3)) * 0.03
    sh[:, 0] = (colours - 0.5) / SH_C0
    arrays = (means, scales, quaternions, opacities, sh)
    return SplatCloud(*(array.astype(np.float32) for array in arrays))
