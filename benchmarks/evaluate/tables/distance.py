"""Error against how large the object is seen, beside the Cramér-Rao bound.

The room is small, so smaller pictures stand in for larger distances: the chair is 30 to 170 pixels
tall. The camera's pose is the true one here, because the bound knows it too.

The best that any estimator could do with an outline: the Cramér-Rao bound of an object's pose.

Along the outline, points sit at pixels `x_i` with unit normals `n_i` and come from 3D points `X_i`;
a pose parameter p moves the outline by `n_i · dπ/dX · dX/dp`. With errors of `SIGMA_PX` along the
normal that are independent every `CORRELATION_PX`, the information is `(1/(σ² L)) ∮ JᵀJ ds` and the
covariance at least its inverse.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.spatial import KDTree

from benchmarks.evaluate.filmed.asked import Asked
from benchmarks.evaluate.filmed.filming import FilmSet, Shot, standing
from benchmarks.evaluate.filmed.trial import Trial, performed
from benchmarks.evaluate.findings import TITLES, Drawing, Findings, aligned, row_name
from benchmarks.evaluate.protocols.screen import surface_points
from benchmarks.evaluate.protocols.stations import WARM_UP, carried
from scenes.cameras import Fisheye, Rig
from scenes.mesh import PhysicalObject
from scenes.opening import open_scene
from scenes.pose import Pose
from scenes.samples import sample_room
from sim.camera.camera360 import default_rig
from studio.console.rows import Row
from studio.evaluate.figures import OTHER, OWN

SCENE, OBJECT, KIND = "lab", "chair-1", "chair"

LENS_SIZES_PX = (1440, 960, 640, 480)

PLACES_M = ((-0.85, 0.6), (-1.2, 1.3), (-1.9, 1.85))

TURN_RAD = math.radians(35.0)
"""Between two places, so that no two show the same side."""

FRAME_NS = 200_000_000

MOVE_FRAMES, REST_FRAMES = 7, 3

SIGMA_PX = 0.3

CORRELATION_PX = 3.0

FINE = 6
"""Fine pixels to a camera pixel when the outline is drawn."""

STEP_PX = 0.5
"""Between two points of the outline, camera pixels."""

Points = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Point:
    """One place seen by one size of lens: errors of all seeds, and the least they could be.

    Attributes:
        height_px: of the object in the picture.
        world_cm: error of every seed.
        yaw_deg: likewise.
        bound_cm: root mean square of the bound, the floor known.
        bound_deg: likewise.
    """

    height_px: float
    world_cm: tuple[float, ...]
    yaw_deg: tuple[float, ...]
    bound_cm: float
    bound_deg: float


def evaluate(asked: Asked) -> Findings:
    """The chair at three distances through lenses of four sizes."""
    room = sample_room(SCENE)
    scanned = {item.object_id: item.world_from_object for item in room.objects}
    item = room.object_by_id(OBJECT)
    path, ends = _path(scanned[OBJECT])
    taken = [Shot(k * FRAME_NS, standing({**scanned, OBJECT: p})) for k, p in enumerate(path)]
    trial = Trial(open_scene(SCENE), asked.methods)
    points: dict[str, list[Point]] = {name: [] for name in trial.methods}
    with FilmSet(room, cache=asked.cache) as film_set:
        for size_px in LENS_SIZES_PX:
            conditions = replace(
                asked.conditions, lens_size_px=size_px, pose_error_deg=0.0, pose_error_cm=0.0
            )
            changed = replace(asked, conditions=conditions)
            errors: dict[tuple[str, int], list[tuple[float, float]]] = {}
            for seed in asked.seeds:
                what = f"the chair through {size_px} px lenses"
                for answers in performed(film_set, trial, taken, changed, seed=seed, what=what):
                    for name, answer in answers.items():
                        if answer.seq in ends:
                            error = answer.error(OBJECT, kind=KIND)
                            key = (name, answer.seq)
                            errors.setdefault(key, []).append((error.world_cm, error.yaw_deg))
            rig = default_rig(size_px)
            for (name, seq), seen in errors.items():
                pose = path[seq]
                bound = pose_bound(
                    rig.lenses[0],
                    room.world_from_rig @ rig.rig_from_lens[0],
                    item,
                    pose,
                    on_floor=True,
                )
                least_cm, least_deg = bound_in_words(bound)
                world, yaw = zip(*seen, strict=True)
                height = height_px(rig, room.world_from_rig, pose, item.box_m[2])
                points[name].append(Point(height, world, yaw, least_cm, least_deg))
    return _report(points)


def height_px(rig: Rig, world_from_rig: Pose, world_from_object: Pose, height_m: float) -> float:
    """How tall an upright object is in the front lens's picture."""
    ends = world_from_object @ np.array([[0.0, 0.0, 0.0], [0.0, 0.0, height_m]])
    pixels, _ = rig.lenses[0].project((world_from_rig @ rig.rig_from_lens[0]).inverse() @ ends)
    return float(np.linalg.norm(pixels[1] - pixels[0]))


def _path(start: Pose) -> tuple[list[Pose], Sequence[int]]:
    path, ends = [start] * WARM_UP, []
    before = start
    for place in PLACES_M:
        after = Pose.from_yaw(before.yaw() + TURN_RAD, np.array([*place, 0.0]))
        path += [*carried(before, after, MOVE_FRAMES), *[after] * REST_FRAMES]
        ends.append(len(path) - 1)
        before = after
    return path, ends


def _report(points: Mapping[str, Sequence[Point]]) -> Findings:
    findings = Findings()
    for method, seen in points.items():
        lines = [["px tall", "world cm", "bound cm", "ratio", "yaw deg", "bound deg", "ratio"]]
        for point in sorted(seen, key=lambda p: -p.height_px):
            world, yaw = (math.sqrt(np.mean(np.square(v))) for v in (point.world_cm, point.yaw_deg))
            lines.append(
                [
                    f"{point.height_px:.0f}",
                    f"{world:.2f}",
                    f"{point.bound_cm:.3f}",
                    f"{world / point.bound_cm:.1f}",
                    f"{yaw:.2f}",
                    f"{point.bound_deg:.3f}",
                    f"{yaw / point.bound_deg:.1f}",
                ]
            )
            name = f"distance.{point.height_px:.0f}px"
            findings.rows.append(Row(row_name(method, f"{name}.world_cm.rms"), world, "cm"))
        ratios = [math.sqrt(np.mean(np.square(p.world_cm))) / p.bound_cm for p in seen]
        name = row_name(method, "distance.over_bound.median")
        findings.rows.append(Row(name, float(np.median(ratios)), ""))
        findings.text.append(
            f"distance: {TITLES[method]} (rms; bound for 0.3 px along the outline, floor known)\n"
            + aligned(lines)
        )
    findings.drawings.append(Drawing("distance", lambda figure: _draw(figure, points)))
    return findings


def _draw(figure: Figure, points: Mapping[str, Sequence[Point]]) -> None:
    axes = figure.add_subplot()
    for method, seen in points.items():
        heights = [point.height_px for point in seen for _ in point.world_cm]
        errors = [max(error, 1e-3) for point in seen for error in point.world_cm]
        colour = OWN if method == "own" else OTHER
        axes.plot(heights, errors, "o", color=colour, alpha=0.7, label=TITLES[method])
    every = sorted(next(iter(points.values())), key=lambda p: p.height_px)
    axes.plot(
        [p.height_px for p in every],
        [p.bound_cm for p in every],
        "k.-",
        lw=1,
        label="Cramér-Rao bound, 0.3 px",
    )
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("height of the chair in the picture, px")
    axes.set_ylabel("world error, cm")
    axes.legend()


def pose_bound(
    lens: Fisheye,
    world_from_lens: Pose,
    item: PhysicalObject,
    world_from_object: Pose,
    *,
    on_floor: bool,
) -> NDArray[np.float64]:
    """(4, 4) least covariance of x, y, z (metres) and yaw (radians).

    Args:
        lens: the camera; the object is seen by it alone.
        world_from_lens: where it is.
        item: the object.
        world_from_object: where that is.
        on_floor: whether its height is known; the row and column of z are 0 then.

    Raises:
        ValueError: the object is outside the lens.
    """
    in_object = surface_points(item)
    pixels, valid = lens.project(world_from_lens.inverse() @ (world_from_object @ in_object))
    if not valid.all():
        raise ValueError(f"{item.object_id}: partly outside the lens, its outline is not whole")
    middles, normals, lengths = _outline(pixels)
    nearest = KDTree(pixels).query(middles)[1]
    at_outline = in_object[nearest]
    jacobian = np.empty((len(middles), 4))
    small = 1e-5
    for axis in range(4):
        moved = _nudged(world_from_object, axis, small)
        ahead, _ = lens.project(world_from_lens.inverse() @ (moved @ at_outline))
        jacobian[:, axis] = ((ahead - pixels[nearest]) * normals).sum(axis=1) / small
    weights = lengths / (SIGMA_PX**2 * CORRELATION_PX)
    information = (jacobian * weights[:, None]).T @ jacobian
    known = [0, 1, 3] if on_floor else [0, 1, 2, 3]
    covariance = np.zeros((4, 4))
    covariance[np.ix_(known, known)] = np.linalg.inv(information[np.ix_(known, known)])
    return covariance


def bound_in_words(covariance: NDArray[np.float64]) -> tuple[float, float]:
    """Root mean square world error (cm) and yaw error (degrees) of the bound."""
    world_cm = 100.0 * math.sqrt(float(np.trace(covariance[:3, :3])))
    return world_cm, math.degrees(math.sqrt(float(covariance[3, 3])))


def _nudged(pose: Pose, axis: int, step: float) -> Pose:
    if axis == 3:
        return Pose.from_yaw(pose.yaw() + step, pose.translation)
    shift = np.zeros(3)
    shift[axis] = step
    return Pose(pose.rotation, pose.translation + shift)


def _outline(pixels: Points) -> tuple[Points, Points, NDArray[np.float64]]:
    """Middles, unit normals and lengths (camera pixels) of pieces of the silhouette's outline.

    The silhouette is the union of dots: surface points are less than a fine pixel's dot apart.
    """
    low = np.floor(pixels.min(axis=0)) - 2
    size = np.ceil((pixels.max(axis=0) + 2 - low) * FINE).astype(int)
    mask = np.zeros((size[1], size[0]), np.uint8)
    fine = ((pixels - low) * FINE).astype(int)
    mask[fine[:, 1], fine[:, 0]] = 255
    mask = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8))
    contours, _ = cv2.findContours(mask, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    middles, normals, lengths = [], [], []
    for contour in contours:
        points = np.asarray(contour, dtype=np.float64).reshape(-1, 2)
        if len(points) < 6 * FINE:
            continue
        # Steps of whole fine pixels are jagged: take longer chords of a smoothed line.
        padded = np.concatenate([points[-FINE:], points, points[:FINE]])
        kernel = np.ones(2 * FINE + 1) / (2 * FINE + 1)
        line = np.stack([np.convolve(padded[:, k], kernel, "valid") for k in (0, 1)], axis=1)
        stride = max(1, round(STEP_PX * FINE))
        corners = line[::stride]
        chords = np.roll(corners, -1, axis=0) - corners
        length = np.linalg.norm(chords, axis=1)
        keep = length > 1e-6
        normal = np.stack([chords[:, 1], -chords[:, 0]], axis=1)[keep] / length[keep, None]
        middles.append((corners + 0.5 * chords)[keep] / FINE + low + 0.5 / FINE)
        normals.append(normal)
        lengths.append(length[keep] / FINE)
    return np.concatenate(middles), np.concatenate(normals), np.concatenate(lengths)
