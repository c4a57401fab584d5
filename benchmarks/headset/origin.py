"""The shared origin along walks: how far off it is, and how far off it says that it may be."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.headset.walks import walk
from scenes.pose import rotation_angle
from scenes.samples import sample_room
from studio.console.rows import Row, at_most
from tracking.headset.codes import CodeReader
from tracking.headset.origin import (
    CodePicture,
    Origin,
    OriginPlan,
    expected_corners,
    origin_after,
    shown_at,
)

MM_BAR, DEG_BAR = 5.0, 0.2
"""Largest error of the origin that is promised, millimetres and degrees."""

HEIGHT_M = 1.0
"""Height above the middle of the floor at which the origin's error is said: among what people see
and point at."""


@dataclass(frozen=True, slots=True)
class WalkResult:
    """One walk, from the moment at which both codes have been seen.

    Attributes:
        room: its name.
        seed: of the walk.
        pictures: that were looked at.
        seen: pictures with a code.
        mm: median error of the origin, in the middle of the room.
        mm_p95: 95th percentile of it.
        deg: median error of its direction.
        deg_p95: 95th percentile of it.
        sigma_mm: median of what it says of itself.
        first_s: time of the first code; NaN for never.
        ms: median time that a picture takes.
    """

    room: str
    seed: int
    pictures: int
    seen: int
    mm: float
    mm_p95: float
    deg: float
    deg_p95: float
    sigma_mm: float
    first_s: float
    ms: float


def measure_walk(
    name: str, seed: int, *, seconds: float, now_ns: Callable[[], int], codes: int = 2
) -> WalkResult:
    """Walk about a built-in room, some of its codes known, and hold the origin to the truth.

    Args:
        name: of the room.
        seed: of the walk; which of its codes are known changes with it.
        seconds: how long it takes.
        now_ns: clock for what a picture takes.
        codes: how many are known.
    """
    room = sample_room(name)
    turned: list[int] = np.roll(np.arange(len(room.codes)), seed)[:codes].tolist()
    plan = OriginPlan(tuple(room.codes[k] for k in sorted(turned)))
    reader, origin = CodeReader(plan.payloads), Origin()
    middle = np.append(room.footprint_m.mean(axis=0), HEIGHT_M)
    errors: list[tuple[float, float, float]] = []
    took: list[float] = []
    ever: set[str] = set()
    pictures = seen = 0
    first_s = math.nan
    for picture in walk(room, seed=seed, seconds=seconds):
        pictures += 1
        begun = now_ns()
        pose = picture.device_from_camera
        expected = expected_corners(origin, plan, camera=picture.camera, device_from_camera=pose)
        found = tuple(reader.find(picture.grey, expected))
        origin = origin_after(
            origin, CodePicture(picture.t_ns, picture.camera, pose, found), plan=plan
        )
        origin = shown_at(origin, picture.t_ns, plan=plan)
        took.append((now_ns() - begun) / 1e6)
        seen += bool(found)
        ever |= set(origin.seen)
        if origin.glide is None:
            continue
        first_s = picture.t_ns / 1e9 if math.isnan(first_s) else first_s
        if len(ever) >= codes:
            off = origin.glide.b_from_a.inverse() @ picture.device_from_world
            way = 1e3 * float(np.linalg.norm(off @ middle - middle))
            errors.append((way, math.degrees(rotation_angle(off.rotation)), 1e3 * origin.sigma_m))
    table = np.array(errors) if errors else np.full((1, 3), np.nan)
    mm, deg, sigma = np.median(table, axis=0).tolist()
    mm95, deg95, _ = np.percentile(table, 95.0, axis=0).tolist()
    ms = float(np.median(took)) if took else math.nan
    return WalkResult(name, seed, pictures, seen, mm, mm95, deg, deg95, sigma, first_s, ms)


def walk_rows(results: Sequence[WalkResult]) -> list[Row]:
    """Return the figures of walks: every one's median, and the worst of them."""
    rows: list[Row] = []
    for result in results:
        name = f"headset.origin.{result.room}.{result.seed}"
        rows.append(at_most(f"{name}.mm", result.mm, "mm", bar=MM_BAR))
        rows.append(at_most(f"{name}.deg", result.deg, "deg", bar=DEG_BAR))
        rows.append(Row(f"{name}.mm.p95", result.mm_p95, "mm"))
        rows.append(Row(f"{name}.deg.p95", result.deg_p95, "deg"))
        rows.append(Row(f"{name}.sigma_mm", result.sigma_mm, "mm"))
        rows.append(Row(f"{name}.seen_percent", 100.0 * result.seen / result.pictures, "%"))
        rows.append(Row(f"{name}.picture_ms", result.ms, "ms"))
    mm, deg = [r.mm for r in results], [r.deg for r in results]
    rows.append(at_most("headset.origin.median_mm", float(np.median(mm)), "mm", bar=MM_BAR))
    rows.append(at_most("headset.origin.worst_mm", max(mm), "mm", bar=MM_BAR))
    rows.append(at_most("headset.origin.median_deg", float(np.median(deg)), "deg", bar=DEG_BAR))
    rows.append(at_most("headset.origin.worst_deg", max(deg), "deg", bar=DEG_BAR))
    return rows
