"""Pose of the 360° camera, and whether it still holds: standing, moved, or blind.

Every frame of a camera that stands gets a cheap look at a few hundred patches of all lenses; what
seems to move is looked at closely (`tracking.camera.common_motion`). So a moved camera is noticed
in the first picture that it takes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from devices.messages import Frame
from scenes.pose import Pose, rotation_angle
from tracking.background.images import BackgroundImages
from tracking.camera.calibration import Calibration
from tracking.camera.common_motion import CommonMotion, can_watch, common_motion
from tracking.camera.watch import DARK, Details, Watch, begin_watch
from tracking.kernels import native
from tracking.output import CameraMoment, CameraNotice

RIG_MOVED_M = 0.02
"""Marker displacement in m from which the camera was moved."""

RIG_TURNED_RAD = np.deg2rad(0.6)
"""Marker turn in rad from which the camera was moved."""

BLIND_LOOKS = 3
"""Consecutive frames that show nothing of what was seen before the camera is looked for: a flash or
a hand before the lens is over by then."""

RETRY_NS = 2_000_000_000
"""Between two attempts to find a camera in the room again, ns: one takes half a second of work."""

FloatArray = NDArray[np.float32]

Points = NDArray[np.float64]

PATCH_PX = 5
"""Side in px of the patches, in the lens's own picture."""

CELLS = 14
"""The steepest point of each of so many by so many cells of a lens is looked at."""

MIN_NOISE = 0.01
"""Least scale of the patches' residuals, log grey."""

SUSPECT_RAD = math.radians(0.03)
"""Turn of a lens that is looked at closely: half of what is noticed, six times its scatter while
people walk about a 480-px lens."""

SUSPECT_SHARE = 0.5
"""Share of a lens's patches that another light, somebody close by or a large turn has changed."""

ITERATIONS = 4
"""Of reweighting."""


@dataclass(frozen=True, slots=True)
class Blind:
    """Since when a camera shows nothing of what it saw: moved far, covered, or without light.

    Attributes:
        since_ns: frame time of the first such picture.
        looks: how many there were in a row.
        tried_ns: frame time of the last attempt to find the camera in the room; None before.
    """

    since_ns: int
    looks: int = 1
    tried_ns: int | None = None

    def is_due(self, now_ns: int) -> bool:
        """Whether the camera is to be looked for in the room."""
        if self.tried_ns is None:
            return self.looks >= BLIND_LOOKS
        return now_ns - self.tried_ns >= RETRY_NS


@dataclass(frozen=True, slots=True, eq=False)
class RigState:
    """Pose of the camera and what depends on it.

    Attributes:
        marker_world_from_rig: the marker's pose of the camera at the last refinement.
        calibration: the refined pose.
        background: the empty room from there.
        watches: what each lens saw there.
        glances: the patches of each that every frame is compared with.
        blind: since it shows nothing of what it saw; None while it does.
        motion: by which it was found to have moved in the last frame; None if it stood.
    """

    marker_world_from_rig: Pose
    calibration: Calibration
    background: BackgroundImages
    watches: tuple[Watch, ...]
    glances: tuple[Glance, ...]
    blind: Blind | None = None
    motion: CommonMotion | None = None

    def is_unmoved(self, marker_world_from_rig: Pose) -> bool:
        """Whether the marker's pose is unchanged but for its jitter."""
        moved = self.marker_world_from_rig.inverse() @ marker_world_from_rig
        return (
            float(np.linalg.norm(moved.translation)) < RIG_MOVED_M
            and rotation_angle(moved.rotation) < RIG_TURNED_RAD
        )


def rig_state(
    frame: Frame,
    marker_world_from_rig: Pose,
    calibration: Calibration,
    background: BackgroundImages,
    *,
    ranges_m: tuple[NDArray[np.float32], ...],
) -> RigState:
    """A camera whose pose has just been found.

    Args:
        frame: its live pictures.
        marker_world_from_rig: the marker's pose of it.
        calibration: its pose.
        background: the empty room from there.
        ranges_m: (H, W) distance of the room in each lens; 0 where it is unknown.
    """
    rig = frame.rig
    lenses = zip(frame.images, rig.lenses, rig.rig_from_lens, ranges_m, strict=True)
    watches = tuple(begin_watch(*lens) for lens in lenses)
    glances = tuple(map(glance_at, watches, frame.images))
    return RigState(marker_world_from_rig, calibration, background, watches, glances)


def look_through(known: RigState, frame: Frame) -> RigState:
    """The rig's state after a look at all lenses: a cheap one, and a close one where that differs.

    Args:
        known: the state so far.
        frame: the live pictures.
    """
    looks = tuple(zip(known.glances, frame.images, strict=True))
    if known.blind is None and not any(is_suspect(*look) for look in looks):
        return known
    if not can_watch(known.watches):
        return known
    motion = common_motion(known.watches, frame.images)
    if motion is None or not (motion.is_small or motion.is_common):
        before = known.blind
        blind = Blind(frame.t_ns) if before is None else replace(before, looks=before.looks + 1)
        return replace(known, blind=blind)
    if motion.is_small:
        return replace(known, glances=tuple(renew(*look) for look in looks), blind=None)
    return replace(known, blind=None, motion=motion)


def camera_notices(
    before: RigState | None, after: RigState, now_ns: int
) -> tuple[CameraNotice, ...]:
    """Notices about the camera after a frame, in order; none while it stands.

    Args:
        before: state before the frame.
        after: state after it.
        now_ns: frame time.
    """
    if before is None:
        return ()
    old, new = before.blind, after.blind
    was_tried = old is not None and old.tried_ns is not None
    if new is not None:
        is_lost = new.tried_ns is not None and not was_tried
        return (CameraNotice(CameraMoment.NOT_FOUND, since_s=_s(new, now_ns)),) if is_lost else ()
    then, now = before.calibration.world_from_rig, after.calibration.world_from_rig
    if after.calibration is before.calibration:
        return (CameraNotice(CameraMoment.FOUND, 0.0, 0.0, _s(old, now_ns)),) if was_tried else ()
    moved = then.inverse() @ now
    turned_deg = float(np.degrees(rotation_angle(moved.rotation)))
    shifted_cm = 100.0 * float(np.linalg.norm(moved.translation))
    return tuple(
        CameraNotice(moment, turned_deg, shifted_cm, _s(old, now_ns))
        for moment in (CameraMoment.BUMPED, CameraMoment.FOUND)
    )


def _s(since: Blind | None, now_ns: int) -> float:
    """Seconds since a camera has been blind; 0 if it never was."""
    return 0.0 if since is None else (now_ns - since.since_ns) / 1e9


@dataclass(frozen=True, slots=True, eq=False)
class Glance:
    """A few patches of one lens.

    Attributes:
        corners: (N, 2) int64 left and top of the patches.
        values: (N,) their log grey.
        model: (N, 4) its derivatives by a turn of the rig, per radian, and by all light.
    """

    corners: NDArray[np.int64]
    values: Points
    model: Points


def glance_at(watch: Watch, image: NDArray[np.uint8]) -> Glance:
    """The patches to look at, from what is watched closely.

    Args:
        watch: of the lens.
        image: (H, W, 3) uint8 of it, taken where the watch began.
    """
    details = watch.sizes[-1]
    height, width = image.shape[:2]
    steep = _steepest(details)
    small, _ = details.camera.project(details.rays[steep])
    pixels = small * (width / details.camera.width_px)
    limit = np.array([width, height]) - PATCH_PX - 1
    corners = np.clip(np.floor(pixels - 0.5 * PATCH_PX), 1, limit).astype(np.int64)
    x, y = np.array([1, 0]), np.array([0, 1])
    slope = np.stack(
        [0.5 * (_values(image, corners + d) - _values(image, corners - d)) for d in (x, y)], axis=1
    )
    f_px = details.camera.f_px * width / details.camera.width_px
    by_turn = np.einsum("nia,ni->na", details.flow_by_twist[steep][:, :, :3] * f_px, slope)
    model = np.concatenate([by_turn, np.ones((len(corners), 1))], axis=1)
    return Glance(corners, _values(image, corners), model)


def renew(glance: Glance, image: NDArray[np.uint8]) -> Glance:
    """The same patches as they look now: another light is there to stay, or somebody is."""
    return Glance(glance.corners, _values(image, glance.corners), glance.model)


def is_suspect(glance: Glance, image: NDArray[np.uint8]) -> bool:
    """Whether a lens has to be looked at closely."""
    if len(glance.corners) < 2 * glance.model.shape[1]:
        return True
    change = _values(image, glance.corners) - glance.values
    fit, noise = np.zeros(glance.model.shape[1]), MIN_NOISE
    fit[-1] = float(np.median(change))
    for _ in range(ITERATIONS):
        left = change - glance.model @ fit
        noise = max(1.5 * float(np.median(np.abs(left))), MIN_NOISE)
        agree = 1.0 / (1.0 + (left / noise) ** 2) ** 2
        weighted = glance.model * agree[:, None]
        stiff = 1e-9 * np.eye(len(fit))
        fit = np.linalg.solve(weighted.T @ glance.model + stiff, weighted.T @ change)
    left = np.abs(change - glance.model @ fit)
    changed = float((left > 4.0 * MIN_NOISE).mean())
    return float(np.linalg.norm(fit[:3])) > SUSPECT_RAD or changed > SUSPECT_SHARE


def _steepest(details: Details) -> NDArray[np.intp]:
    """Indices of the steepest point of each cell."""
    places, _ = details.camera.project(details.rays)
    cell = np.floor(places * CELLS / details.camera.width_px).astype(np.intp)
    number = cell[:, 1] * CELLS + cell[:, 0]
    steep = np.linalg.norm(details.by_twist[:, :3], axis=1)
    order = np.lexsort((-steep, number))
    _, first = np.unique(number[order], return_index=True)
    return np.asarray(order[first], dtype=np.intp)


def _values(image: NDArray[np.uint8], corners: NDArray[np.int64]) -> Points:
    """(N,) log grey of patches."""
    colours = native.patch_means(image, corners, PATCH_PX).reshape(-1, 3)
    return np.log(colours.mean(axis=1).astype(np.float64) + DARK)
