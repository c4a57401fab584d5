"""The room's origin in a headset's world, from the codes that its video shows.

The headset's world drifts slowly, and is another one where the headset has found itself again; the
room's codes stay. The code on the 360° camera stands until somebody moves the camera.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.pose import Pose
from scenes.quad import QrCode
from tracking.headset.codes import SeenCode
from tracking.headset.corner_fit import (
    Belief,
    SeenPoints,
    code_corners,
    poses_of_square,
    spread_px2,
)
from tracking.headset.followed import Followed, Wander, follow
from tracking.headset.glide import Glide, glided

Floats = NDArray[np.float64]

ANCHOR_WANDER = Wander(math.radians(0.02), 0.001)
"""Drift of a headset's world in the room in a second: a centimetre in 100 s, as its makers say of
walking around in one room."""

CARRIED_WANDER = Wander(math.radians(0.005), 0.0002)
"""Movement of a camera's stand by itself in a second: a floor that gives way under people."""

FIRST_TILT_RAD, FIRST_YAW_RAD, FIRST_SHIFT_M = math.radians(0.5), math.radians(20.0), 1.0
"""Standard deviations of the first pose about level axes, about the vertical, and of its place: a
headset knows what is level, and of the rest only what its first picture of one code shows."""

MIN_TURN_RAD, MIN_SHIFT_M = math.radians(0.03), 0.001
"""Standard deviations about and along each axis below which no origin is known: what the codes'
own poses in a scan are off by."""

MOVED_AFTER = 12
"""Pictures in a row in which a code contradicts others that agree, after which it is left out: it
was moved since the scan."""

PICTURE_MARGIN = 0.02
"""Margin of a picture, of its width, in which a code is not expected: it may be cut off."""

MAX_LEAN_RAD = math.radians(8.0)
"""Tilt of a headset's world in the room beyond which a code's pose is the other one of two."""


@dataclass(frozen=True, slots=True)
class OriginPlan:
    """Codes of a room.

    Attributes:
        codes: those that stand still, with their poses.
        carried: payload of the one on the 360° camera; empty for none.
        carried_side_m: its printed side.
    """

    codes: tuple[QrCode, ...]
    carried: str = ""
    carried_side_m: float = 0.1

    @property
    def payloads(self) -> frozenset[str]:
        """Texts of all of them."""
        return frozenset(code.payload for code in self.codes) | ({self.carried} - {""})

    @property
    def middle(self) -> Floats:
        """(3,) mean place of the codes, world metres."""
        places = [code.world_from_code.translation for code in self.codes]
        return np.mean(places, axis=0) if places else np.zeros(3)


@dataclass(frozen=True, slots=True, eq=False)
class CodePicture:
    """Codes in one picture of a headset.

    Attributes:
        t_ns: when it was taken.
        camera: of the picture.
        device_from_camera: where it was taken from, in the headset's world.
        codes: what was found.
    """

    t_ns: int
    camera: Pinhole
    device_from_camera: Pose
    codes: tuple[SeenCode, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Origin:
    """The origin as it is known; begin with `Origin()`.

    Attributes:
        anchor: device from world.
        carried: world from the code on the camera.
        glide: what is shown of the anchor.
        contradicted: pictures in a row in which a code contradicted others, by payload.
        seen: codes that agreed in the last picture.
    """

    anchor: Followed = field(default_factory=Followed)
    carried: Followed = field(default_factory=Followed)
    glide: Glide | None = None
    contradicted: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    seen: tuple[str, ...] = ()

    @property
    def world_from_device(self) -> Pose | None:
        """The newest estimate; None before the first code."""
        belief = self.anchor.belief
        return None if belief is None else belief.a_from_b.inverse()

    @property
    def sigma_m(self) -> float:
        """Standard deviation of its place at the codes; infinite before the first."""
        belief = self.anchor.belief
        floor = math.sqrt(3.0) * MIN_SHIFT_M
        return math.inf if belief is None else math.hypot(belief.sigma_shift_m, floor)

    @property
    def sigma_rad(self) -> float:
        """Standard deviation of its direction; infinite before the first."""
        belief = self.anchor.belief
        floor = math.sqrt(3.0) * MIN_TURN_RAD
        return math.inf if belief is None else math.hypot(belief.sigma_turn_rad, floor)

    @property
    def moved(self) -> tuple[str, ...]:
        """Codes that are left out: they contradict the others."""
        return tuple(k for k, count in self.contradicted.items() if count >= MOVED_AFTER)


def expected_corners(
    known: Origin, plan: OriginPlan, *, camera: Pinhole, device_from_camera: Pose
) -> dict[str, Floats]:
    """Return (4, 2) px by payload of the codes that a picture should show."""
    belief = known.anchor.belief
    if belief is None:
        return {}
    camera_from_world = device_from_camera.inverse() @ belief.a_from_b
    places = {c.payload: (c.world_from_code, c.side_m) for c in plan.codes}
    if plan.carried and known.carried.belief is not None:
        places[plan.carried] = (known.carried.belief.a_from_b, plan.carried_side_m)
    found: dict[str, Floats] = {}
    margin = PICTURE_MARGIN * camera.width_px
    for payload, (world_from_code, side_m) in places.items():
        camera_from_code = camera_from_world @ world_from_code
        if float(camera_from_code.rotation[:, 2] @ camera_from_code.translation) >= 0.0:
            continue  # it is seen from behind
        pixels, is_in = camera.project(camera_from_code @ code_corners(side_m))
        size = np.array([camera.width_px, camera.height_px])
        if is_in.all() and (pixels > margin).all() and (pixels < size - margin).all():
            found[payload] = pixels
    return found


def origin_after(known: Origin, picture: CodePicture, *, plan: OriginPlan) -> Origin:
    """Return the origin after one more picture.

    Args:
        known: the origin so far.
        picture: the codes that it shows.
        plan: which codes there are.
    """
    known = _anchored(known, picture, plan=plan)
    return _carried(known, picture, plan=plan) if plan.carried else known


def shown_at(known: Origin, t_ns: int, *, plan: OriginPlan) -> Origin:
    """Return the origin with what is shown of it at a later time."""
    belief = known.anchor.belief
    if belief is None:
        return known
    return replace(known, glide=glided(known.glide, belief.a_from_b, t_ns=t_ns, about=plan.middle))


def _anchored(known: Origin, picture: CodePicture, *, plan: OriginPlan) -> Origin:
    by_payload = {code.payload: code for code in plan.codes}
    left_out = set(known.moved)
    codes = [code for code in picture.codes if code.payload in by_payload]
    used = [code for code in codes if code.payload not in left_out]
    seen = [_in_world(code, by_payload[code.payload], picture=picture) for code in codes]
    camera_from_device = picture.device_from_camera.inverse()
    points = [replace(one, camera_from_a=camera_from_device) for one in seen]
    kept = [k for k, code in enumerate(codes) if code in used]
    first = _first_anchor(
        [(codes[k], by_payload[codes[k].payload]) for k in kept], picture, plan=plan
    )
    anchor, agreed = follow(
        known.anchor,
        [points[k] for k in kept],
        t_ns=picture.t_ns,
        first=first,
        wander=ANCHOR_WANDER,
    )
    contradicted = dict(known.contradicted)
    if any(agreed):
        for k, is_in in zip(kept, agreed, strict=True):
            payload = codes[k].payload
            contradicted[payload] = 0 if is_in else contradicted.get(payload, 0) + 1
    names = tuple(codes[k].payload for k, is_in in zip(kept, agreed, strict=True) if is_in)
    contradicted = {payload: count for payload, count in contradicted.items() if count}
    return replace(known, anchor=anchor, contradicted=MappingProxyType(contradicted), seen=names)


def _in_world(seen: SeenCode, code: QrCode, *, picture: CodePicture) -> SeenPoints:
    corners = code.world_from_code @ code_corners(code.side_m)
    nowhere = Pose.identity()
    return SeenPoints(picture.camera, nowhere, corners, seen.corners_px, seen.sigma_px)


def _first_anchor(
    codes: Sequence[tuple[SeenCode, QrCode]], picture: CodePicture, *, plan: OriginPlan
) -> Belief | None:
    """Return a level pose from the largest code of one picture."""
    if not codes:
        return None
    seen, code = max(codes, key=lambda pair: float(np.ptp(pair[0].corners_px, axis=0).sum()))
    best: tuple[float, Pose] | None = None
    for camera_from_code in poses_of_square(picture.camera, seen.corners_px, side_m=code.side_m):
        device_from_code = picture.device_from_camera @ camera_from_code
        device_from_world = device_from_code @ code.world_from_code.inverse()
        lean = math.acos(float(np.clip(device_from_world.rotation[2, 2], -1.0, 1.0)))
        if best is None or lean < best[0]:
            best = (lean, device_from_world)
    if best is None or best[0] > MAX_LEAN_RAD:
        return None
    place = code.world_from_code.translation
    level = Pose.from_yaw(best[1].yaw())
    device_from_world = Pose(level.rotation, best[1] @ place - level.rotation @ place)
    turn = (FIRST_TILT_RAD, FIRST_TILT_RAD, FIRST_YAW_RAD)
    sigmas = np.array([*turn, FIRST_SHIFT_M, FIRST_SHIFT_M, FIRST_SHIFT_M])
    return Belief(device_from_world, np.diag(sigmas**2), plan.middle, picture.t_ns)


def _carried(known: Origin, picture: CodePicture, *, plan: OriginPlan) -> Origin:
    anchor = known.anchor.belief
    seen = next((code for code in picture.codes if code.payload == plan.carried), None)
    if anchor is None or seen is None:
        return known
    camera_from_world = picture.device_from_camera.inverse() @ anchor.a_from_b
    poses = poses_of_square(picture.camera, seen.corners_px, side_m=plan.carried_side_m)
    if not poses:
        return known
    first = poses[0]
    if known.carried.belief is not None and len(poses) > 1:
        # Of the two ways in which it may lean, the one that it leaned before.
        before = (camera_from_world @ known.carried.belief.a_from_b).rotation
        first = max(poses, key=lambda pose: float(np.trace(before.T @ pose.rotation)))
    world_from_code = camera_from_world.inverse() @ first
    corners = code_corners(plan.carried_side_m)
    camera_from_device = picture.device_from_camera.inverse()
    in_world = SeenPoints(
        picture.camera,
        camera_from_device,
        world_from_code @ corners,
        seen.corners_px,
        seen.sigma_px,
    )
    more = spread_px2(anchor, in_world)
    points = replace(in_world, camera_from_a=camera_from_world, points=corners, more_px2=more)
    sigmas = np.repeat((FIRST_YAW_RAD, FIRST_SHIFT_M), 3)
    belief = Belief(world_from_code, np.diag(sigmas**2), np.zeros(3), picture.t_ns)
    carried, _agreed = follow(
        known.carried, [points], t_ns=picture.t_ns, first=belief, wander=CARRIED_WANDER
    )
    return replace(known, carried=carried)
