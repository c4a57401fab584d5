"""Poses at which a camera may stand: places of a map, turned and tilted as the picture fits.

Each is refined from half a metre off to a centimetre by windows of the drawn room that are found in
small live pictures, and weighed by how many are found.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.messages import Frame
from scenes.frames import WORLD_FROM_FORWARD_CAMERA
from scenes.pose import Pose, rotation_angle, rotation_from_vector
from scenes.render.renderer import PosedSplats, Renderer
from tracking.camera.displacements import Displacements
from tracking.camera.lens_view import Sight
from tracking.camera.locating.panorama import live_panorama
from tracking.camera.locating.room_map import RoomMap, scores, turned
from tracking.camera.rigid_fit import rigid_fit
from tracking.camera.window_search import search_windows

TILTS = ((0.0, 1), (5.0, 6), (10.0, 12))
"""Tilts that are compared: degrees, and how many directions of them. Neighbours are 5° apart; a
panorama is smoothed by 3°."""

HYPOTHESES = 6
"""How many are refined. In 27 of 28 pictures of six rooms the right one was the first or second, in
one the third; each takes about a tenth of the whole time."""

APART_M = 0.8
"""Distance in metres between two hypotheses with nearly the same turn: more than one and a half
steps of the map's grid."""

APART_RAD = math.radians(30.0)
"""Turn between two hypotheses at nearly the same place; refinement reaches 14°."""

MAX_COMPARED = 20_000
"""Scores, best first, among which hypotheses are looked for: about one in a thousand."""


def hypotheses(room_map: RoomMap, frame: Frame) -> list[Pose]:
    """`world_from_rig` of the likeliest poses that differ, best first.

    Args:
        room_map: what is seen from places in the room.
        frame: pictures of all lenses.
    """
    upright = [Pose(tilt @ WORLD_FROM_FORWARD_CAMERA.rotation, np.zeros(3)) for tilt in _tilts()]
    score = scores(room_map, [live_panorama(frame, pose) for pose in upright])
    count = min(MAX_COMPARED, score.size)
    best = np.argpartition(score.ravel(), -count)[-count:]
    best = best[np.argsort(score.ravel()[best])[::-1]]
    chosen: list[Pose] = []
    which = np.stack(np.unravel_index(best, score.shape), axis=1)
    for place, tilt, column in which:
        turn = turned(int(column))
        pose = Pose(turn.rotation @ upright[int(tilt)].rotation, room_map.places[int(place)])
        if all(is_apart(pose, other) for other in chosen):
            chosen.append(pose)
        if len(chosen) == HYPOTHESES:
            break
    return chosen


def is_apart(world_from_rig: Pose, world_from_other: Pose) -> bool:
    """Whether two poses are different places to stand, and not one seen with an error."""
    step = world_from_rig.inverse() @ world_from_other
    return (
        float(np.linalg.norm(step.translation)) > APART_M
        or rotation_angle(step.rotation) > APART_RAD
    )


def _tilts() -> list[NDArray[np.float64]]:
    """Rotations of a level camera about horizontal axes."""
    return [
        rotation_from_vector(math.radians(degrees) * np.array([math.cos(at), math.sin(at), 0.0]))
        for degrees, count in TILTS
        for at in 2.0 * math.pi * np.arange(count) / count
    ]


ROUNDS = ((14.0, 45.0, 6.0, 0.3), (12.0, 60.0, 6.0, 0.2), (8.0, 90.0, 3.0, 0.1))
"""Rounds: how far in degrees a window is looked for, px per radian of the searched pictures, and
the standard deviations about and along each axis, degrees and metres, of the pose from which it is
drawn: those of the map's grid and tilts, then of what the round before leaves."""

WEIGHED = (3.0, 90.0)
"""How far in degrees, and in which pictures, windows are looked for to weigh a refined pose."""

FOUND_BY_CHANCE = 0.1
"""Share of windows that are found at a wrong pose: the median of 60 in five rooms was 0.08."""


@dataclass(frozen=True, slots=True, eq=False)
class Refined:
    """A hypothesis, refined.

    Attributes:
        world_from_rig: the pose.
        found: windows of the drawn room that are in the live pictures.
        windows: all with texture.
    """

    world_from_rig: Pose
    found: int
    windows: int

    @property
    def nats(self) -> float:
        """Log likelihood ratio of the windows found, against a pose at which chance finds them."""
        if self.found <= FOUND_BY_CHANCE * self.windows:
            return 0.0
        share = self.found / self.windows
        missed = (1.0 - share) * math.log(max(1.0 - share, 1e-9) / (1.0 - FOUND_BY_CHANCE))
        return self.windows * (share * math.log(share / FOUND_BY_CHANCE) + missed)


def refined(
    frame: Frame, world_from_rig: Pose, posed: tuple[PosedSplats, ...], renderer: Renderer
) -> Refined:
    """Refine a pose that may be off by half a metre and ten degrees, and weigh it.

    Args:
        frame: live pictures of all lenses; their focal length may be off by a few per cent.
        world_from_rig: the pose to start from.
        posed: splats of the room and of what stands in it.
        renderer: draws splats.
    """
    sights = [
        Sight(camera, rig_from_lens, image, posed, renderer)
        for camera, rig_from_lens, image in zip(
            frame.rig.lenses, frame.rig.rig_from_lens, frame.images, strict=True
        )
    ]

    def seen(reach_deg: float, f_px: float) -> list[Displacements]:
        reach = math.radians(reach_deg)
        return [
            search_windows(sight, world_from_rig, reach_rad=reach, f_px=f_px) for sight in sights
        ]

    for reach_deg, f_px, turn_deg, shift_m in ROUNDS:
        sigma = np.repeat((math.radians(turn_deg), shift_m), 3)
        fit = rigid_fit(seen(reach_deg, f_px), np.zeros(6), np.diag(sigma**-2))
        world_from_rig = world_from_rig @ Pose(rotation_from_vector(fit.twist[:3]), fit.twist[3:])
    lenses = seen(*WEIGHED)
    windows = sum(round(len(lens.pixels) / lens.share) for lens in lenses if lens.share > 0)
    return Refined(world_from_rig, sum(len(lens.pixels) for lens in lenses), windows)
