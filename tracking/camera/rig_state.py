"""Pose of the 360° camera, and whether it still holds: standing, moved, or blind."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from devices.messages import Frame
from scenes.pose import Pose, rotation_angle
from tracking.background.images import BackgroundImages
from tracking.camera.calibration import Calibration
from tracking.camera.common_motion import CommonMotion, can_watch, common_motion
from tracking.camera.glance import Glance, glance_at, is_suspect, renew
from tracking.camera.watch import Watch, begin_watch
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
