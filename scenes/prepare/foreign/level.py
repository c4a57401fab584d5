"""Up direction, floor and ceiling of a cloud of splats.

A room's splats are flat and lie on its surfaces, so that a splat's thinnest axis is the surface's
normal. Floor, ceiling and furniture share one normal; walls stand across it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose, rotation_from_quaternion, rotation_from_vector
from scenes.splats import SplatCloud

FloatArray = NDArray[np.float64]
Up = Literal["x", "-x", "y", "-y", "z", "-z"]

AXES: dict[Up, FloatArray] = {
    "x": np.array([1.0, 0.0, 0.0]),
    "-x": np.array([-1.0, 0.0, 0.0]),
    "y": np.array([0.0, 1.0, 0.0]),
    "-y": np.array([0.0, -1.0, 0.0]),
    "z": np.array([0.0, 0.0, 1.0]),
    "-z": np.array([0.0, 0.0, -1.0]),
}
"""Directions in the axes of a file."""

AXIS_NAMES: tuple[Up, ...] = ("x", "y", "z")
"""The axes without a sense."""

MIN_OPACITY = 0.3
"""Fainter splats are haze; they say nothing of a surface."""

FLAT_SHARE = 0.5
"""A splat is flat if its thinnest axis is at most this share of the next one."""

MAX_QUANTILE = 0.98
"""Areas above this quantile count as it: a few huge splats are background."""

NEAR_DEG = 20.0
"""How far a surface's normal may be off an axis to speak for it: captures are tilted a little."""

BEYOND_DOUBT = 1.4
"""So much more level surface another axis needs to overrule the file's convention; floor and
ceiling of the built-in rooms have 1.7 and 3.2 times the surface of either pair of walls."""

CONTENT_DOUBT = 0.62
"""Share of what stands between floor and ceiling that must lie in the upper half to turn a scene
over; it is 0.33 and 0.40 in the built-in rooms, as furniture stands on floors."""

CLEAR_TILT_DEG = 4.0
"""Tilt of the mean normal from which on it is believed, degrees; those of the level built-in scans
lean by 0.5 and 2.3."""

FIT_BANDS = (0.06, 0.04, 0.02, 0.015)
"""Half thickness of what counts as the floor round by round, as a share of the room's height: 15 cm
and 4 cm of 2.5 m."""

BINS = 200
"""Levels over the height of the scene: 1.5 cm of 3 m."""

PEAK_SHARE = 0.2
"""A level is large if it has so much of the largest level's area; a table top has less of a
floor's, a floor under furniture more of a ceiling's."""

MIN_FLOOR_SHARE = 0.04
"""Share of all flat area that a floor has at least."""


@dataclass(frozen=True, slots=True, eq=False)
class Level:
    """A scene's up, floor and ceiling, in the frame and unit of its file.

    Attributes:
        up: unit vector.
        floor: `up @ x` on the floor.
        ceiling: likewise on the ceiling, or on the highest level surface.
        found: whether a level floor was found; if not, `floor` is the lowest hundredth.
        evidence: in one line.
    """

    up: FloatArray
    floor: float
    ceiling: float
    found: bool
    evidence: str


@dataclass(frozen=True, slots=True, eq=False)
class _Flat:
    """Flat splats: where, along which normal, how much surface."""

    means: FloatArray
    normals: FloatArray
    areas: FloatArray


def find_level(cloud: SplatCloud, *, convention: Up, up: Up | None = None) -> Level:
    """Up, floor and ceiling of a scene.

    Args:
        cloud: in the file's axes and unit.
        convention: which axis the file's format usually has up; only clear evidence overrules it.
        up: which axis is said to be up; None to look for it.

    Raises:
        ValueError: the cloud has no opaque splat.
    """
    flat = _flat_splats(cloud)
    if up is not None:
        chosen, evidence, direction = up, f"up is {up} as said", _refine(flat, AXES[up])
    else:
        chosen, across = _axis(flat, convention)
        direction = _refine(flat, AXES[chosen])
        upper = _upper_share(flat, direction)
        if upper > CONTENT_DOUBT:
            chosen = _opposite(chosen)
            direction, upper = _refine(flat, AXES[chosen]), 1.0 - upper
        evidence = (
            f"up is {chosen} of the file: {across}, {100 * (1 - upper):.0f} % of what stands "
            "between floor and ceiling lies in the lower half"
        )
    floor, ceiling, found = _levels(flat, direction)
    if not found:
        # Nothing to level it by: an axis is a better guess than an object's slant.
        direction = AXES[chosen]
        floor, ceiling, _ = _levels(flat, direction)
    tilt_deg = math.degrees(math.acos(float(np.clip(direction @ AXES[chosen], -1.0, 1.0))))
    tilted = f", tilted by {tilt_deg:.1f}°" if tilt_deg >= 0.1 else ""
    return Level(direction, floor, ceiling, found, evidence + tilted)


def upright(level: Level) -> Pose:
    """`world_from_file` before scaling: up along z and the floor at 0, by the smallest turn."""
    z = np.array([0.0, 0.0, 1.0])
    axis = np.cross(level.up, z)
    sine, cosine = float(np.linalg.norm(axis)), float(level.up @ z)
    if sine < 1e-9:
        # Upside down there are many smallest turns; half a turn about x is one.
        rotation = rotation_from_vector(np.array([0.0 if cosine > 0 else math.pi, 0.0, 0.0]))
    else:
        rotation = rotation_from_vector(axis / sine * math.atan2(sine, cosine))
    return Pose(rotation, np.array([0.0, 0.0, -level.floor]))


def _flat_splats(cloud: SplatCloud) -> _Flat:
    scales = np.sort(cloud.scales.astype(np.float64), axis=1)
    flat = (cloud.opacities >= MIN_OPACITY) & (scales[:, 0] <= FLAT_SHARE * scales[:, 1])
    if not flat.any():
        flat = cloud.opacities >= MIN_OPACITY
    if not flat.any():
        raise ValueError(f"{len(cloud)} splats, none with an opacity of {MIN_OPACITY} or more")
    thinnest = np.argmin(cloud.scales[flat], axis=1)
    turned = rotation_from_quaternion(cloud.rotations[flat].astype(np.float64))
    normals = np.take_along_axis(turned, thinnest[:, None, None], axis=2)[:, :, 0]
    areas = scales[flat, 1] * scales[flat, 2] * cloud.opacities[flat]
    areas = np.minimum(areas, np.quantile(areas, MAX_QUANTILE))
    return _Flat(cloud.means[flat].astype(np.float64), normals, areas)


def _axis(flat: _Flat, convention: Up) -> tuple[Up, str]:
    """The axis that most surface is level to, the convention where in doubt; and how much."""
    facing = np.abs(flat.normals) > math.cos(math.radians(NEAR_DEG))
    shares = (facing * flat.areas[:, None]).sum(axis=0) / flat.areas.sum()
    own = AXIS_NAMES.index(_plain(convention))
    best = int(np.argmax(shares))
    is_clear = bool(shares[best] > BEYOND_DOUBT * shares[own])
    chosen: Up = AXIS_NAMES[best] if is_clear else convention
    of = {name: f"{100 * share:.0f} %" for name, share in zip(AXIS_NAMES, shares, strict=True)}
    mine = of.pop(_plain(chosen))
    others = ", ".join(f"{name} {share}" for name, share in of.items())
    return chosen, f"{mine} of the surface lies across it ({others})"


def _opposite(up: Up) -> Up:
    return next(name for name, axis in AXES.items() if np.array_equal(axis, -AXES[up]))


def _plain(up: Up) -> Up:
    return next(name for name in AXIS_NAMES if name in up)


def _upper_share(flat: _Flat, up: FloatArray) -> float:
    """Share of the surface between floor and ceiling, walls aside, that is in the upper half."""
    low, high, _ = _levels(flat, up)
    heights = (flat.means @ up - low) / max(high - low, 1e-9)
    level = np.abs(flat.normals @ up) > math.cos(math.radians(NEAR_DEG))
    between = level & (heights > 0.08) & (heights < 0.92)
    total = float(flat.areas[between].sum())
    if total <= 0.01 * float(flat.areas.sum()):
        return 0.5
    return float(flat.areas[between & (heights > 0.5)].sum()) / total


def _refine(flat: _Flat, up: FloatArray) -> FloatArray:
    """The normal of the floor's own plane, fitted in bands that get thinner.

    Single normals of a scan lean by a few degrees to the side that was seen; places do not.
    """
    up = _tilt(flat, up)
    for band in FIT_BANDS:
        floor, ceiling, _ = _levels(flat, up)
        reach = band * (ceiling - floor)
        level = np.abs(flat.normals @ up) > math.cos(math.radians(NEAR_DEG))
        near = level & (np.abs(flat.means @ up - floor) <= reach)
        if np.count_nonzero(near) < 20 or reach <= 0:
            break
        weights = flat.areas[near] / flat.areas[near].sum()
        offset = flat.means[near] - weights @ flat.means[near]
        _, axes = np.linalg.eigh((offset * weights[:, None]).T @ offset)
        normal = axes[:, 0] * np.sign(axes[:, 0] @ up)
        if float(normal @ up) < math.cos(math.radians(NEAR_DEG)):
            break
        up = normal
    return up


def _tilt(flat: _Flat, up: FloatArray) -> FloatArray:
    """The mean normal of level surfaces where it is clearly off `up`; else `up`."""
    start = up
    for near_deg in (NEAR_DEG, 12.0, 8.0):
        along = flat.normals @ up
        near = np.abs(along) > math.cos(math.radians(near_deg))
        if np.count_nonzero(near) < 20:
            break
        signed = np.sign(along[near])[:, None] * flat.normals[near]
        mean = (signed * flat.areas[near, None]).sum(axis=0)
        up = mean / np.linalg.norm(mean)
    return up if float(up @ start) < math.cos(math.radians(CLEAR_TILT_DEG)) else start


def _levels(flat: _Flat, up: FloatArray) -> tuple[float, float, bool]:
    """Heights of floor and ceiling, and whether the floor is a large level surface."""
    heights = flat.means @ up
    level = np.abs(flat.normals @ up) > math.cos(math.radians(NEAR_DEG))
    low, high = float(np.quantile(heights, 0.005)), float(np.quantile(heights, 0.995))
    if np.count_nonzero(level) < 20 or high - low < 1e-9:
        return float(np.quantile(heights, 0.01)), float(high), False
    margin = 0.05 * (high - low)
    edges: FloatArray = np.linspace(low - margin, high + margin, BINS + 1)
    area, _ = np.histogram(heights[level], bins=edges, weights=flat.areas[level])
    area = np.convolve(area, np.ones(3), mode="same")
    large = np.flatnonzero(area >= PEAK_SHARE * area.max())
    found = bool(area[large[0]] >= MIN_FLOOR_SHARE * flat.areas.sum())
    step = float(edges[1] - edges[0])
    floor, ceiling = (
        _median_near(heights[level], flat.areas[level], _peak(area, int(bin_), edges), 2 * step)
        for bin_ in (large[0], large[-1])
    )
    return floor, ceiling, found


def _peak(area: FloatArray, first: int, edges: FloatArray) -> float:
    """Middle of the fullest bin within two of one."""
    low = max(0, first - 2)
    best = low + int(np.argmax(area[low : first + 3]))
    return float(0.5 * (edges[best] + edges[best + 1]))


def _median_near(heights: FloatArray, areas: FloatArray, middle: float, reach: float) -> float:
    """The height that halves the area within `reach` of `middle`."""
    near = np.abs(heights - middle) <= reach
    order = np.argsort(heights[near])
    filled = np.cumsum(areas[near][order])
    middle_rank = int(np.count_nonzero(filled < 0.5 * float(filled[-1])))
    return float(heights[near][order][middle_rank])
