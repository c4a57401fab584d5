"""Panoramas drawn from all over a room, compared with live pictures at all turns at once."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from scenes.prepare.foreign.free_space import clearance
from scenes.render.reduction import merged
from scenes.render.renderer import PosedSplats, Renderer
from scenes.splats import SplatCloud
from tracking.camera.locating.panorama import (
    COLUMNS,
    STEP_RAD,
    Panorama,
    drawn_panorama,
)

Points = NDArray[np.float64]
Spectra = NDArray[np.complex64]

GRID_M = 0.4
"""Distance between places, metres. In 34 pictures of eight rooms the best score lay at the true
place in all at 0.4 and in 31 at 0.5, in the 68 pictures of their single lenses in 65 and in 59."""

HEIGHTS_M = (0.3, 2.2)
"""Least and most height of a camera over the floor, metres."""

MIN_CLEARANCE_M = 0.15
"""Least distance from a place to the nearest surface, metres."""

MERGE_M = 0.1
"""Side of the cubes in which splats are drawn as one, metres: 3° at 2 m. From 0.05 to 0.12 the
score at the true place is the same to 0.03, and 0.01 above that of all splats."""

MAX_PLACES = 3000
"""Places at most; in a hall they are farther apart."""


@dataclass(frozen=True, slots=True, eq=False)
class RoomMap:
    """Panoramas from places all over a room, as spectra along their rows.

    Attributes:
        posed: what was drawn, in few splats.
        places: (N, 3) world metres.
        details: (N, ROWS, COLUMNS // 2 + 1) of weight times details.
        power: likewise of weight times squared details.
        weight: likewise of the weight.
    """

    posed: tuple[PosedSplats, ...]
    places: Points
    details: Spectra
    power: Spectra
    weight: Spectra


def map_of(
    room: SplatCloud,
    renderer: Renderer,
    *,
    objects: tuple[PosedSplats, ...] = (),
    rng: np.random.Generator,
    advance: Callable[[float], bool],
) -> RoomMap | None:
    """Draw what is seen from places all over the free space of a room; None if that was ended.

    Args:
        room: splats of what stands still; world metres, Z up, the floor at 0.
        renderer: draws splats.
        objects: movable objects at their last known poses.
        rng: shifts the grid of places.
        advance: is called with the share that is drawn, 0..1; False ends it.

    Raises:
        ValueError: the room is too small to stand in, or nothing in it is free.
    """
    places = free_places(room, rng)
    posed = tuple(
        PosedSplats(merged(each.cloud, MERGE_M), each.world_from_object)
        for each in (PosedSplats(room, Pose.identity()), *objects)
    )
    seen: list[tuple[Spectra, Spectra, Spectra]] = []
    for number, place in enumerate(places):
        if not advance(number / len(places)):
            return None
        seen.append(_spectra(drawn_panorama(posed, renderer, place)))
    details, power, weight = (np.stack(kept) for kept in zip(*seen, strict=True))
    return RoomMap(posed, places, details, power, weight)


def free_places(room: SplatCloud, rng: np.random.Generator) -> Points:
    """(N, 3) places all over the free space of a room, world metres, on a grid.

    Args:
        room: splats of what stands still; world metres, Z up, the floor at 0.
        rng: shifts the grid.

    Raises:
        ValueError: the room is too small to stand in, or nothing in it is free.
    """
    around = clearance(room)
    count: int = around.distance_m.shape[2]
    steps = np.arange(count, dtype=np.float64) + 0.5
    levels = float(around.low_m[2]) + around.cell_m * steps
    free = (around.distance_m > MIN_CLEARANCE_M) & around.floor[:, :, None]
    free &= (levels > HEIGHTS_M[0]) & (levels < HEIGHTS_M[1])
    cells = np.argwhere(free)
    if not len(cells):
        raise ValueError(
            f"nowhere between {HEIGHTS_M[0]} and {HEIGHTS_M[1]} m above the floor are "
            f"{MIN_CLEARANCE_M} m free on all sides, so no camera can stand there; is the unit "
            "right?"
        )
    stride = max(1, round(GRID_M / around.cell_m))
    while True:
        on_grid = ((cells + rng.integers(stride, size=3)) % stride == 0).all(axis=1)
        if on_grid.any() and np.count_nonzero(on_grid) <= MAX_PLACES:
            return around.low_m + around.cell_m * (cells[on_grid] + 0.5)
        stride = stride + 1 if on_grid.any() else max(1, stride - 1)


def scores(room_map: RoomMap, live: list[Panorama]) -> NDArray[np.float32]:
    """(N, T, COLUMNS) weighted correlation of every place with each live panorama at every turn.

    Args:
        room_map: N places.
        live: T panoramas of one picture, tilted differently.
    """
    details, power, weight = (
        np.stack(spectra) for spectra in zip(*(_spectra(each) for each in live), strict=True)
    )
    product = _correlated(room_map.details, details)
    mine = _correlated(room_map.power, weight)
    its = _correlated(room_map.weight, power)
    scale = np.sqrt(np.maximum(mine, 1e-3) * np.maximum(its, 1e-3))
    return np.asarray(product / scale, dtype=np.float32)


def turned(column: int) -> Pose:
    """The turn about the vertical that a column of the scores stands for."""
    return Pose.from_yaw(math.remainder(column * STEP_RAD, 2.0 * math.pi))


def _spectra(panorama: Panorama) -> tuple[Spectra, Spectra, Spectra]:
    weighted = panorama.weight * panorama.details
    rows = (weighted, weighted * panorama.details, panorama.weight)
    details, power, weight = (np.fft.rfft(r, axis=1).astype(np.complex64) for r in rows)
    return details, power, weight


def _correlated(of_map: Spectra, of_live: Spectra) -> NDArray[np.float32]:
    """(N, T, COLUMNS) sums over rows and columns, for every shift of the columns."""
    by_frequency = np.matmul(
        of_map.transpose(2, 0, 1), of_live.conj().transpose(2, 1, 0)
    )  # (F, N, T)
    return np.fft.irfft(by_frequency.transpose(1, 2, 0), COLUMNS, axis=2).astype(np.float32)
