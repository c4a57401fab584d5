"""Refines the 360° camera's pose against the room's splats.

A marker's estimate is off by tenths of a degree, which alone costs centimetres on the floor. The
room is drawn where the marker says; windows of the drawing are looked for in the live pictures, and
the rig's turn and shift are fitted to their displacements, through all lenses at once; then again
from there, ever finer. People and moved objects are outliers.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from devices.messages import Frame
from scenes.pose import Pose, rotation_angle, rotation_from_vector
from scenes.render.renderer import PosedSplats, Renderer
from scenes.splats import SplatCloud
from tracking.camera.displacements import Displacements
from tracking.camera.lens_view import Sight
from tracking.camera.rigid_fit import rigid_fit
from tracking.camera.window_search import SEARCH_RAD, search_windows
from tracking.camera.window_slopes import by_slopes

BLURS_PX = (1.5, 1.0, 0.8)
"""Gaussian blur in px of the rounds after the search, which leaves up to 0.3°. At the end 0.5 px
instead of 0.8, or a fourth round, changes what is left in five rooms by 0.02° at most."""

SEARCHED_TURN_RAD, SEARCHED_SHIFT_M = np.deg2rad(0.07), 0.004
"""Turn and shift that a search leaves of a pose: from 33 of 36 starts in six random rooms up to
0.063° and 3.3 mm, from three, 0.5° off in lenses of 640 px, up to 0.089°."""

SETTLED_TURN_RAD, SETTLED_SHIFT_M = np.deg2rad(0.03), 0.002
"""Motion of a finest round up to which it was enough. From starts 0.02° to 0.1° off in the room lab
one leaves 0.004° to 0.017° and 0.4 to 0.7 mm; the last of all rounds still moves by 0.001° to
0.010° and up to 0.6 mm in those six rooms."""

LARGEST_TURN_RAD = np.deg2rad(4.0)
LARGEST_SHIFT_M = 0.15
"""A refinement beyond this is rejected."""

MIN_SHARE = 0.1
"""Share of the room's textured windows that must be found in the live pictures. At 28 wrong poses
in seven views of five rooms 0 to 0.04 were found by chance, at the right ones 0.45 to 0.97, and
0.23 where a person stands before a 640-px lens."""

PRIOR_TURN_RAD = np.deg2rad(0.5) / np.sqrt(3.0)
"""Standard deviation about each axis of a marker's estimate, which is off by 0.5° in all."""

PRIOR_SHIFT_M = 0.01 / np.sqrt(3.0)
"""Standard deviation along each axis of a marker's estimate, which is off by 1 cm in all."""

NEAR_INFORMATION = np.diag(np.repeat((PRIOR_TURN_RAD, PRIOR_SHIFT_M), 3) ** -2.0)
"""(6, 6) inverse covariance of a marker's estimate."""

FAR_INFORMATION = np.diag(np.repeat((LARGEST_TURN_RAD, LARGEST_SHIFT_M), 3) ** -2.0)
"""(6, 6) likewise of a camera that is somewhere near."""

SCAN_TURN_RAD = np.deg2rad(0.03)
"""Standard deviation about each axis by which a scan's world is turned, as a whole, where a camera
looks: no window shows it. `desk` is turned by 0.024°, of six other scans the worst by 0.13°."""

SCAN_SHIFT_M = 0.0015
"""Likewise its shift along each axis. A scan whose scale is off by 0.2 % shifts a camera that
stands 1.5 m from the origin by 3 mm in all; from 0.5 to 6.3 mm were left in eight scans."""


CARRIED_TURN_RAD = np.deg2rad(0.01)
CARRIED_SHIFT_M = 0.0005
"""Standard deviations about and along each axis of a motion that the pictures alone gave: after
bumps of 0.4° to 3° and up to 5 cm 0.002° to 0.008° and 0.1 to 0.4 mm were left."""

MAX_CARRIED = 4
"""Motions in a row that a pose is carried along before it is refined again: by then they add 0.02°,
less than what a scan's world may be off by."""


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """A refined camera pose.

    Attributes:
        world_from_rig: the pose.
        sigma: (6,) standard deviations: rotation in radians, translation in metres, rig axes; what
            the windows leave open and what the scan's world may be off.
        found_share: 0..1, of the drawn room's textured windows those that are in the live pictures.
        turn_rad: by which the refinement turned the marker's pose, used or not.
        shift_m: by which it shifted it.
        refusal: why the refined pose is not used; empty if it is.
        carried: motions of the camera since, along which the pose was carried.
    """

    world_from_rig: Pose
    sigma: NDArray[np.float64]
    found_share: float
    turn_rad: float
    shift_m: float
    refusal: str = ""
    carried: int = 0

    def carried_along(self, then_from_now: Pose) -> Calibration:
        """The pose of the camera once it has moved by what its own pictures say."""
        of_motion = np.repeat((CARRIED_TURN_RAD, CARRIED_SHIFT_M), 3) ** 2
        return replace(
            self,
            world_from_rig=self.world_from_rig @ then_from_now,
            sigma=np.sqrt(self.sigma**2 + of_motion),
            carried=self.carried + 1,
        )

    @property
    def trusted(self) -> bool:
        """Whether the refined pose is used."""
        return not self.refusal

    @staticmethod
    def unrefined(world_from_rig: Pose) -> Calibration:
        """A pose that is taken as it is, right to a milliradian and a millimetre."""
        return Calibration(world_from_rig, np.full(6, 1e-3), 1.0, 0.0, 0.0)

    def described(self) -> str:
        """One line for a report."""
        moved = f"{np.degrees(self.turn_rad):.2f}°, {1000 * self.shift_m:.0f} mm"
        if self.refusal:
            return f"camera NOT refined ({self.refusal}); poses carry the marker's error"
        degrees = np.degrees(float(np.linalg.norm(self.sigma[:3])))
        millimetres = 1000 * float(np.linalg.norm(self.sigma[3:]))
        return f"camera refined by {moved}, to ±{degrees:.2f}°, {millimetres:.0f} mm"


def calibrate(
    frame: Frame,
    nominal_world_from_rig: Pose,
    room: SplatCloud,
    renderer: Renderer,
    *,
    objects: tuple[PosedSplats, ...] = (),
    is_near: bool = True,
) -> Calibration:
    """Refine a camera pose that is right to about half a degree and a centimetre.

    Args:
        frame: live pictures of all lenses.
        nominal_world_from_rig: `world_from_rig` to start from.
        room: splats of what stands still.
        renderer: draws splats.
        objects: movable objects at their expected poses; drawn with the room.
        is_near: whether the pose is as right as that; otherwise it is looked for in all
            `LARGEST_TURN_RAD` and `LARGEST_SHIFT_M` around.
    """
    nominal, posed = nominal_world_from_rig, (PosedSplats(room, Pose.identity()), *objects)
    sights = [
        Sight(camera, rig_from_lens, image, posed, renderer)
        for camera, rig_from_lens, image in zip(
            frame.rig.lenses, frame.rig.rig_from_lens, frame.images, strict=True
        )
    ]
    reach_rad = SEARCH_RAD if is_near else LARGEST_TURN_RAD
    prior = NEAR_INFORMATION if is_near else FAR_INFORMATION
    found = [search_windows(sight, nominal, reach_rad=reach_rad) for sight in sights]
    searched, _ = _move(nominal, found, nominal, prior)

    def fitted(
        world_from_rig: Pose, blurs_px: tuple[float, ...]
    ) -> tuple[Pose, NDArray[np.float64], list[Displacements]]:
        information, seen = prior, found
        for blur_px in blurs_px:
            seen = [by_slopes(sight, world_from_rig, blur_px=blur_px) for sight in sights]
            world_from_rig, information = _move(world_from_rig, seen, nominal, prior)
        return world_from_rig, information, seen

    if _is_within(nominal, searched, turn_rad=SEARCHED_TURN_RAD, shift_m=SEARCHED_SHIFT_M):
        # As right as a search can tell, as where lenses were just fitted: the finest round first.
        pose, information, seen = fitted(nominal, BLURS_PX[-1:])
        if not _is_within(nominal, pose, turn_rad=SETTLED_TURN_RAD, shift_m=SETTLED_SHIFT_M):
            pose, information, seen = fitted(pose, BLURS_PX)
    else:
        pose, information, seen = fitted(searched, BLURS_PX)
    share = float(np.mean([lens.share for lens in seen]))
    moved = nominal.inverse() @ pose
    turn, shift = rotation_angle(moved.rotation), float(np.linalg.norm(moved.translation))
    refusal = _refusal(turn, shift, share)
    of_scan = np.repeat((SCAN_TURN_RAD, SCAN_SHIFT_M), 3) ** 2
    sigma = np.sqrt(np.diag(np.linalg.inv(information)) + of_scan)
    used = nominal if refusal else pose
    return Calibration(used, sigma, share, turn, shift, refusal)


def _move(
    world_from_rig: Pose,
    seen: list[Displacements],
    nominal_world_from_rig: Pose,
    prior: NDArray[np.float64],
) -> tuple[Pose, NDArray[np.float64]]:
    """The pose that the displacements ask for, and its (6, 6) information in the rig's axes."""
    apart = world_from_rig.inverse() @ nominal_world_from_rig
    skew = 0.5 * (apart.rotation - apart.rotation.T)
    expected = np.array([skew[2, 1], skew[0, 2], skew[1, 0], *apart.translation])
    fit = rigid_fit(seen, expected, prior)
    step = Pose(rotation_from_vector(fit.twist[:3]), fit.twist[3:])
    return world_from_rig @ step, fit.information


def _is_within(
    world_from_one: Pose, world_from_other: Pose, *, turn_rad: float, shift_m: float
) -> bool:
    """Whether two poses of the rig are no farther apart than that."""
    apart = world_from_one.inverse() @ world_from_other
    is_turned_less = rotation_angle(apart.rotation) <= turn_rad
    return is_turned_less and float(np.linalg.norm(apart.translation)) <= shift_m


def _refusal(turn_rad: float, shift_m: float, found_share: float) -> str:
    """Why a refined pose is not used; empty if it is."""
    if not turn_rad < LARGEST_TURN_RAD:
        limit = np.degrees(LARGEST_TURN_RAD)
        return f"it turned by {np.degrees(turn_rad):.1f}°, limit {limit:.0f}°: check the marker"
    if not shift_m < LARGEST_SHIFT_M:
        return f"it moved by {shift_m:.2f} m, limit {LARGEST_SHIFT_M:g} m: check the marker"
    if not found_share > MIN_SHARE:
        return (
            f"{found_share:.0%} of the room's details are in the picture, wanted "
            f"{MIN_SHARE:.0%}: is this the room, and is it lit?"
        )
    return ""
