"""Pose of the 360° camera, and whether it still holds: standing, bumped, found again or not."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from devices.messages import Frame
from scenes.pose import Pose, rotation_angle
from tracking.background.images import BackgroundImages
from tracking.camera.calibration import Calibration
from tracking.camera.common_motion import MOVED_RAD, CommonMotion, can_watch, common_motion
from tracking.camera.glance import Glance, glance_at, is_suspect, renewed
from tracking.camera.watch import Watch, watched
from tracking.output import CameraMoment, CameraNotice

RIG_MOVED_M = 0.02
"""Marker displacement in m from which the camera was moved."""

RIG_TURNED_RAD = np.deg2rad(0.6)
"""Marker turn in rad from which the camera was moved."""

LONGEST_SWING_NS = 2_000_000_000
"""How long a camera that still swings is waited for, ns; then its pose is taken as it is."""

BLIND_LOOKS = 3
"""Consecutive frames that show nothing of what was seen before the camera is looked for: a flash or
a hand before the lens is over by then."""

RETRY_NS = 2_000_000_000
"""Between two attempts to find a camera in the room again, ns: one takes half a second of work."""


@dataclass(frozen=True, slots=True, eq=False)
class Bump:
    """A camera that was moved and whose new pose is not taken over yet; objects are held.

    Attributes:
        noticed_ns: frame time at which it was noticed.
        then_from_now: the rig's pose in its axes before; None where the pictures do not tell.
        flow_rad: by which the picture moved.
        stands: whether it moved no more between the last two frames.
        tried_ns: frame time of the last attempt to find it in the room; None before.
    """

    noticed_ns: int
    then_from_now: Pose | None
    flow_rad: float = 0.0
    stands: bool = False
    tried_ns: int | None = None

    def is_due(self, now_ns: int) -> bool:
        """Whether its new pose can be taken over, or looked for."""
        if self.then_from_now is not None:
            return self.stands or now_ns - self.noticed_ns > LONGEST_SWING_NS
        return self.tried_ns is None or now_ns - self.tried_ns >= RETRY_NS


@dataclass(frozen=True, slots=True, eq=False)
class RigState:
    """Pose of the camera and what depends on it.

    Attributes:
        marker_world_from_rig: the marker's pose of the camera at the last refinement.
        calibration: the refined pose.
        background: the empty room from there.
        watches: what each lens saw there.
        glances: the patches of each that every frame is compared with.
        bump: since it was moved; None while it stands.
        blind_looks: consecutive frames, until the last, that showed nothing of what was seen.
    """

    marker_world_from_rig: Pose
    calibration: Calibration
    background: BackgroundImages
    watches: tuple[Watch, ...]
    glances: tuple[Glance, ...]
    bump: Bump | None = None
    blind_looks: int = 0

    def is_unmoved(self, marker_world_from_rig: Pose) -> bool:
        """Whether the marker's pose is unchanged but for its jitter."""
        moved = self.marker_world_from_rig.inverse() @ marker_world_from_rig
        return (
            float(np.linalg.norm(moved.translation)) < RIG_MOVED_M
            and rotation_angle(moved.rotation) < RIG_TURNED_RAD
        )

    @property
    def is_doubtful(self) -> bool:
        """Whether the camera may be elsewhere: then nothing that it sees says where objects are."""
        return self.bump is not None or self.blind_looks > 0


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
    watches = tuple(watched(*lens) for lens in lenses)
    glances = tuple(map(glance_at, watches, frame.images))
    return RigState(marker_world_from_rig, calibration, background, watches, glances)


def looked_through(known: RigState, frame: Frame) -> RigState:
    """The rig's state after a look at all lenses: a cheap one, and a close one where that differs.

    Args:
        known: the state so far.
        frame: the live pictures.
    """
    is_calm = not known.is_doubtful
    looks = zip(known.glances, frame.images, strict=True)
    if is_calm and not any(is_suspect(glance, image) for glance, image in looks):
        return known
    if not can_watch(known.watches):
        return known
    motion = common_motion(known.watches, frame.images)
    if motion is None or not (motion.is_small or motion.is_common):
        return _blind(known, frame)
    if motion.is_small:
        looks = zip(known.glances, frame.images, strict=True)
        glances = tuple(renewed(glance, image) for glance, image in looks)
        return replace(known, glances=glances, bump=None, blind_looks=0)
    return replace(known, bump=_moved(known.bump, motion, frame.t_ns), blind_looks=0)


def _moved(before: Bump | None, motion: CommonMotion, now_ns: int) -> Bump:
    """The bump of a motion that was measured."""
    now = motion.then_from_now
    if before is None:
        return Bump(now_ns, now, motion.flow_rad)
    if before.then_from_now is None:
        return replace(before, then_from_now=now, flow_rad=motion.flow_rad, stands=False)
    swung = before.then_from_now.inverse() @ now
    # What is seen is a few metres away: a shift looks like a turn by its size over those.
    swing = rotation_angle(swung.rotation) + float(np.linalg.norm(swung.translation)) / 2.0
    return replace(before, then_from_now=now, flow_rad=motion.flow_rad, stands=swing < MOVED_RAD)


def _blind(known: RigState, frame: Frame) -> RigState:
    """The state after a frame that shows nothing of what was seen."""
    looks = known.blind_looks + 1
    bump = known.bump
    if bump is not None:
        bump = replace(bump, then_from_now=None, stands=False)
    elif looks >= BLIND_LOOKS:
        bump = Bump(frame.t_ns, None)
    return replace(known, bump=bump, blind_looks=looks)


def camera_notice(before: RigState | None, after: RigState, now_ns: int) -> CameraNotice | None:
    """What is to be said of the camera after a frame; None while nothing changes.

    Args:
        before: state before the frame.
        after: state after it.
        now_ns: frame time.
    """
    if before is None:
        return None
    old, new = before.bump, after.bump
    if new is not None and new.tried_ns is not None and (old is None or old.tried_ns is None):
        return CameraNotice(CameraMoment.NOT_FOUND, since_s=_seconds(new.noticed_ns, now_ns))
    if new is not None and old is None:
        turn, shift = _size(new.then_from_now)
        return CameraNotice(CameraMoment.BUMPED, turn, shift, 0.0)
    if new is None and old is not None:
        then, now = before.calibration.world_from_rig, after.calibration.world_from_rig
        turn, shift = _size(then.inverse() @ now)
        return CameraNotice(CameraMoment.FOUND, turn, shift, _seconds(old.noticed_ns, now_ns))
    return None


def _size(then_from_now: Pose | None) -> tuple[float | None, float | None]:
    """Degrees and centimetres of a motion; None where it is not known."""
    if then_from_now is None:
        return None, None
    centimetres = 100.0 * float(np.linalg.norm(then_from_now.translation))
    return float(np.degrees(rotation_angle(then_from_now.rotation))), centimetres


def _seconds(since_ns: int, now_ns: int) -> float:
    return (now_ns - since_ns) / 1e9
