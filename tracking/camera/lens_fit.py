"""Finds the lenses of a 360° camera together with its pose, from live pictures of a known room.

As in the refinement of the pose alone, the room is drawn as the camera is believed to see it, and
windows of the drawing are looked for in the live pictures; here they also determine each lens's
focal length, principal point and distortion. The room is the target: nothing printed is
held before the camera.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from devices.messages import Frame
from scenes.cameras import Rig
from scenes.pose import Pose, rotation_from_vector
from scenes.render.renderer import PosedSplats, Renderer
from scenes.splats import SplatCloud
from tracking.camera.calibration import MIN_SHARE, SCAN_SHIFT_M, SCAN_TURN_RAD
from tracking.camera.displacements import Displacements
from tracking.camera.lens_shape import NAMES, SHAPE, TERMS, by_shape, reshaped, shape_of, sigma_px
from tracking.camera.lens_view import Sight
from tracking.camera.rigid_fit import rigid_fit
from tracking.camera.window_search import search_windows
from tracking.camera.window_slopes import by_slopes

Points = NDArray[np.float64]

SEARCHES = ((8.0, 120.0, 1), (5.0, 185.0, 3), (3.0, 185.0, TERMS))
"""Rounds of search: how far in degrees, px per radian of the picture that is searched, and how many
terms of the radius are fitted. A focal length off by 5 % moves the rim by 5°, a turn all by 2°."""

BLURS_PX = (1.5, 1.0, 1.0, 0.8)
"""Gaussian blur in px of the rounds after the search."""

PRIOR_TURN_RAD = np.deg2rad(3.0) / np.sqrt(3.0)
"""Standard deviation about each axis of the pose to start from."""

PRIOR_SHIFT_M = 0.10 / np.sqrt(3.0)
"""Likewise along each axis."""

PRIOR_SHAPE_RAD = np.array([0.08, 0.03, 0.015, 0.006, 0.001, 0.02, 0.02])
"""Standard deviation of the lens's numbers at the start, radians: 6 % of the focal length, of the
distortion twice what a lens that is sold has, 1° of the centre."""

LENSES_ALIKE_RAD = np.array([0.006, 0.001, 0.0005, 0.0003, 0.0001])
"""Standard deviation between two lenses of one camera of the terms of their radius, radians: twice
by which those of a camera that is sold differ."""

UNSEEN_SHARE = 0.5
"""Of its deviation at the start, what must go for a number of the lens to count as seen."""

AGREEING = 3.0
"""Times the median displacement left over, within which a window agrees with the lens."""

LARGEST_RESIDUAL_RAD = np.deg2rad(0.25)
"""Displacement left over in the median window beyond which the fit is refused."""


@dataclass(frozen=True, slots=True, eq=False)
class LensCalibration:
    """Lenses and pose of a camera, and how well they are known.

    Attributes:
        rig: the lenses as found; where they sit on the camera is taken as known.
        world_from_rig: the pose.
        sigma: (6,) standard deviations of the pose: rotation in radians, translation in metres, rig
            axes; what the windows leave open and what the scan's world may be off.
        lens_sigma_px: of each lens, root mean square standard deviation over its circle.
        residual_px: of each lens, displacement that the median window keeps.
        seen_to_rad: of each lens, the angle off axis up to which windows agree with it.
        covariance: (6 + 6 L, 6 + 6 L) of the pose and of `lens_shape.NAMES` of each lens in turn.
        found_share: 0..1, of the drawn room's textured windows those that are in the live pictures.
        unseen: in words, what these pictures do not tell.
        refusal: why the result is not to be used; empty if it is.
    """

    rig: Rig
    world_from_rig: Pose
    sigma: Points
    lens_sigma_px: tuple[float, ...]
    residual_px: tuple[float, ...]
    seen_to_rad: tuple[float, ...]
    covariance: Points
    found_share: float
    unseen: tuple[str, ...] = ()
    refusal: str = ""

    @property
    def trusted(self) -> bool:
        """Whether the result is to be used."""
        return not self.refusal

    def described(self) -> str:
        """One line for a report."""
        if self.refusal:
            return f"lenses NOT found ({self.refusal})"
        degrees = np.degrees(float(np.linalg.norm(self.sigma[:3])))
        millimetres = 1000 * float(np.linalg.norm(self.sigma[3:]))
        pixels = max(self.lens_sigma_px)
        but = f"; not seen: {', '.join(self.unseen)}" if self.unseen else ""
        return (
            f"lenses found to ±{pixels:.2f} px, pose to ±{degrees:.2f}°, {millimetres:.0f} mm{but}"
        )


def calibrate_lenses(
    frames: Sequence[Frame],
    nominal_world_from_rig: Pose,
    room: SplatCloud,
    renderer: Renderer,
    *,
    objects: tuple[PosedSplats, ...] = (),
) -> LensCalibration:
    """Find lenses that are known to some 5 % and a pose that is known to some 2°.

    Args:
        frames: at least one picture of each lens, all from the same place; several are averaged.
        nominal_world_from_rig: `world_from_rig` to start from.
        room: splats of what stands still.
        renderer: draws splats.
        objects: movable objects at their expected poses; drawn with the room.

    Raises:
        ValueError: there is no frame.
    """
    if not frames:
        raise ValueError("calibrate_lenses: no frame, wanted at least one")
    rig, images = frames[0].rig, averaged([frame.images for frame in frames])
    posed = (PosedSplats(room, Pose.identity()), *objects)
    state = _State(rig, nominal_world_from_rig)
    start = _State(rig, nominal_world_from_rig)

    def sights() -> list[Sight]:
        lenses = zip(state.rig.lenses, state.rig.rig_from_lens, images, strict=True)
        return [Sight(lens, pose, image, posed, renderer) for lens, pose, image in lenses]

    information = np.eye(6 + SHAPE * len(images))
    seen: list[Displacements] = []
    for reach_deg, f_px, terms in SEARCHES:
        seen = [
            search_windows(sight, state.world_from_rig, reach_rad=np.deg2rad(reach_deg), f_px=f_px)
            for sight in sights()
        ]
        state, information, _ = _moved(state, seen, start, terms=terms)
    left: list[Points] = []
    for blur_px in BLURS_PX:
        seen = [by_slopes(sight, state.world_from_rig, blur_px=blur_px) for sight in sights()]
        state, information, left = _moved(state, seen, start, terms=TERMS)
    return _judge(state, seen, information, left)


def averaged(pictures: Sequence[Sequence[NDArray[np.uint8]]]) -> list[NDArray[np.uint8]]:
    """One picture a lens: the mean, or of three or more the median, which forgets who walks by."""
    if len(pictures) == 1:
        return list(pictures[0])
    middle = np.median if len(pictures) > 2 else np.mean
    stacks = zip(*pictures, strict=True)
    return [np.rint(middle(np.stack(stack), axis=0)).astype(np.uint8) for stack in stacks]


@dataclass(frozen=True, slots=True, eq=False)
class _State:
    """Estimate of the camera's pose and lenses."""

    rig: Rig
    world_from_rig: Pose

    def apart(self, other: _State) -> Points:
        """(6 + SHAPE L,) what takes this to the other, to first order."""
        step = self.world_from_rig.inverse() @ other.world_from_rig
        skew = 0.5 * (step.rotation - step.rotation.T)
        pose = [skew[2, 1], skew[0, 2], skew[1, 0], *step.translation]
        shapes = [
            shape_of(b, a.f_px) - shape_of(a, a.f_px)
            for a, b in zip(self.rig.lenses, other.rig.lenses, strict=True)
        ]
        return np.concatenate([pose, *shapes])


def _moved(
    state: _State, seen: Sequence[Displacements], start: _State, *, terms: int
) -> tuple[_State, Points, list[Points]]:
    """The camera that the displacements ask for, its information, and what each window keeps.

    Args:
        state: from which the room was drawn.
        seen: what the windows of each lens say.
        start: what was believed beforehand.
        terms: of the radius that are fitted; the others stay as they are.
    """
    lenses = state.rig.lenses
    count = 6 + SHAPE * len(lenses)
    widened: list[Displacements] = []
    for index, (lens, windows) in enumerate(zip(lenses, seen, strict=True)):
        columns = np.zeros((len(windows.pixels), 2, count))
        columns[:, :, :6] = windows.by_twist
        first = 6 + SHAPE * index
        scaled = lens.resized(round(lens.width_px * windows.f_px / lens.f_px), 1)
        columns[:, :, first : first + SHAPE] = by_shape(scaled, windows.pixels)
        widened.append(replace(windows, by_twist=columns))
    fit = rigid_fit(widened, *_prior(state, start, terms))
    step = Pose(rotation_from_vector(fit.twist[:3]), fit.twist[3:6])
    changes = fit.twist[6:].reshape(len(lenses), SHAPE)
    changed = tuple(reshaped(lens, change) for lens, change in zip(lenses, changes, strict=True))
    left = [
        np.linalg.norm(windows.shift - np.einsum("nia,a->ni", windows.by_twist, fit.twist), axis=1)
        for windows in widened
    ]
    rig = Rig(changed, state.rig.rig_from_lens)
    return _State(rig, state.world_from_rig @ step), fit.information, left


def _prior(state: _State, start: _State, terms: int) -> tuple[Points, Points]:
    """The change expected beforehand and its information: the start, and equal lenses."""
    shape_sigma = PRIOR_SHAPE_RAD.copy()
    shape_sigma[terms:TERMS] = 1e-6
    count = len(state.rig.lenses)
    sigma = [*[PRIOR_TURN_RAD] * 3, *[PRIOR_SHIFT_M] * 3, *np.tile(shape_sigma, count)]
    information = np.diag(1.0 / np.square(sigma))
    pull = information @ state.apart(start)
    first = state.rig.lenses[0]
    for index, lens in enumerate(state.rig.lenses[1:], 1):
        unlike = np.zeros((TERMS, len(sigma)))
        unlike[:, 6 : 6 + TERMS] = -np.eye(TERMS)
        unlike[:, 6 + SHAPE * index : 6 + SHAPE * index + TERMS] = np.eye(TERMS)
        known = (shape_of(first, first.f_px) - shape_of(lens, first.f_px))[:TERMS]
        weighed = unlike.T / LENSES_ALIKE_RAD**2
        information = information + weighed @ unlike
        pull = pull + weighed @ known
    return np.asarray(np.linalg.solve(information, pull), dtype=np.float64), information


def _judge(
    state: _State, seen: Sequence[Displacements], information: Points, left: Sequence[Points]
) -> LensCalibration:
    covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
    deviation = np.sqrt(np.diag(covariance))
    of_scan = np.repeat((SCAN_TURN_RAD, SCAN_SHIFT_M), 3) ** 2
    share = float(np.mean([windows.share for windows in seen]))
    middle = np.array([np.median(kept) if len(kept) else np.inf for kept in left])
    sigmas: list[float] = []
    residuals: list[float] = []
    reaches: list[float] = []
    unseen: list[str] = []
    for index, (lens, windows) in enumerate(zip(state.rig.lenses, seen, strict=True)):
        own = slice(6 + SHAPE * index, 6 + SHAPE * (index + 1))
        sigmas.append(sigma_px(lens, covariance[own, own], max_angle=lens.max_angle))
        residuals.append(lens.f_px * float(middle[index]))
        apart = windows.pixels[left[index] < AGREEING * middle[index]] - (lens.cx, lens.cy)
        angles = lens.angles_at(np.hypot(apart[:, 0], apart[:, 1]))
        reaches.append(float(np.quantile(angles, 0.99)) if len(angles) else 0.0)
        vague = deviation[own] > UNSEEN_SHARE * PRIOR_SHAPE_RAD
        unseen += [f"lens {index}: {NAMES[k]}" for k in np.flatnonzero(vague)]
    return LensCalibration(
        state.rig,
        state.world_from_rig,
        np.sqrt(np.diag(covariance)[:6] + of_scan),
        tuple(sigmas),
        tuple(residuals),
        tuple(reaches),
        covariance,
        share,
        tuple(unseen),
        _refusal(share, middle),
    )


def _refusal(found_share: float, left: Points) -> str:
    if not found_share > MIN_SHARE:
        return (
            f"{found_share:.0%} of the room's details are in the picture, wanted "
            f"{MIN_SHARE:.0%}: is this the room, and is the start within 2° and 5 %?"
        )
    if not float(left.max()) < LARGEST_RESIDUAL_RAD:
        worst, limit = np.degrees(float(left.max())), np.degrees(LARGEST_RESIDUAL_RAD)
        return f"details stay {worst:.2f}° from where they should be, limit {limit:.2f}°"
    return ""
