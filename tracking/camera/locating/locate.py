"""Finds where a 360° camera stands in a known room, from one picture of each lens and no marker.

The room is drawn from places all over its free space as small panoramas; the live picture is
compared with all of them at every turn, since a turn only shifts a panorama's columns. The
likeliest poses are refined by windows of the drawn room found in the live pictures, and weighed by
how many are found; the best is refined with the lenses, and refused where the picture speaks nearly
as much for another place, or for none. Then other places are drawn, a few times.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.messages import Frame
from scenes.cameras import Rig
from scenes.pose import Pose
from scenes.render.renderer import PosedSplats, Renderer
from scenes.splats import SplatCloud
from tracking.camera.lens_fit import calibrate_lenses
from tracking.camera.locating.hypotheses import Refined, hypotheses, is_apart, refined
from tracking.camera.locating.room_map import RoomMap, map_of

MIN_SHARE = 0.3
"""Least share of the room's textured windows found at the end."""

MIN_ODDS_NATS = 3.0 * math.log(1000.0)
"""Least log odds of the best place to the next: a thousand to one, if three neighbouring windows
that are hidden or look the same are so together."""

NEAR_NATS = 10.0 * MIN_ODDS_NATS
"""Log likelihood ratio from which the last known place is taken without looking elsewhere."""

ATTEMPTS = 3
"""Grids of places, each shifted against the others, that are compared before the camera is given
up: what one places half a metre from it, another places near."""

MAP_SHARE, HYPOTHESES_SHARE = 0.5, 0.8
"""Shares of an attempt's time after which the map is drawn, and hypotheses are refined."""


NOWHERE = Refined(Pose.identity(), 0, 0)
"""The hypothesis before any was refined."""


@dataclass(frozen=True, slots=True, eq=False)
class Located:
    """Pose of a camera in a known room, and how sure it is.

    Attributes:
        world_from_rig: the pose; not to be used if there is a refusal.
        sigma: (6,) standard deviations: rotation in radians, translation in metres, rig axes; what
            the windows leave open and what the scan's world may be off.
        odds_nats: log odds of this place to the next best one.
        found_share: 0..1, of the drawn room's textured windows those that are in the live pictures.
        rig: the lenses as they came out beside the pose.
        refusal: why the pose is not to be used; empty if it is.
    """

    world_from_rig: Pose
    sigma: NDArray[np.float64]
    odds_nats: float
    found_share: float
    rig: Rig
    refusal: str = ""

    @property
    def trusted(self) -> bool:
        """Whether the pose is to be used."""
        return not self.refusal

    def described(self) -> str:
        """One line for a report."""
        if self.refusal:
            return f"camera NOT located ({self.refusal})"
        x, y, z = self.world_from_rig.translation.tolist()
        degrees = np.degrees(float(np.linalg.norm(self.sigma[:3])))
        millimetres = 1000 * float(np.linalg.norm(self.sigma[3:]))
        return (
            f"camera located at x {x:.2f}, y {y:.2f}, z {z:.2f} m, to ±{degrees:.2f}°, "
            f"{millimetres:.0f} mm; {self.found_share:.0%} of the room's details found"
        )


Progress = Callable[[float, str], None]
"""Takes the share that is done, 0..1, and what is being done."""


def prepare_map(
    room: SplatCloud,
    renderer: Renderer,
    *,
    objects: tuple[PosedSplats, ...] = (),
    rng: np.random.Generator,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> RoomMap | None:
    """Draw a room from places all over it, ahead of `locate_camera`; None if that was cancelled.

    It serves as long as the room stays the same; an object that was moved hardly matters.

    Args:
        room: splats of what stands still; world metres, Z up, the floor at 0.
        renderer: draws splats.
        objects: movable objects at their last known poses.
        rng: shifts the grid of places.
        progress: is called with the share that is drawn.
        cancelled: says whether to stop.

    Raises:
        ValueError: the room is too small to stand in, or nothing in it is free.
    """

    def advance(share: float) -> bool:
        if progress is not None:
            progress(share, "drawing the room from everywhere")
        return cancelled is None or not cancelled()

    return map_of(room, renderer, objects=objects, rng=rng, advance=advance)


def locate_camera(
    frame: Frame,
    room: SplatCloud,
    renderer: Renderer,
    *,
    objects: tuple[PosedSplats, ...] = (),
    near_world_from_rig: Pose | None = None,
    rng: np.random.Generator,
    room_map: RoomMap | None = None,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> Located:
    """Find where a camera stands: anywhere in the room, turned anyhow, tilted by up to some 12°.

    Args:
        frame: live pictures of all lenses, known to about 1 %; upright, its y axes down.
        room: splats of what stands still; world metres, Z up, the floor at 0.
        renderer: draws splats.
        objects: movable objects at their last known poses; some may be elsewhere.
        near_world_from_rig: `world_from_rig` where it last stood, tried first.
        rng: shifts the grid of places that are compared: another attempt sees other ones.
        room_map: of `prepare_map`, where there is one.
        progress: is called with the share that is done, and what is being done.
        cancelled: says whether to stop; the result is then refused.

    Raises:
        ValueError: the room is too small to stand in, or nothing in it is free.
    """
    search = _Search(frame, room, renderer, objects)
    is_cancelled = cancelled or _never
    if near_world_from_rig is not None:
        if progress is not None:
            progress(0.0, "looking where it stood")
        search.refine(near_world_from_rig)
        if search.found[0].nats > NEAR_NATS and (located := search.judged()).trusted:
            return located
    located = search.refused("nothing was looked at")
    for attempt in range(ATTEMPTS):

        def report(share: float, what: str, attempt: int = attempt) -> None:
            if progress is not None:
                progress((attempt + share) / ATTEMPTS, what)

        if room_map is None or attempt:
            room_map = prepare_map(
                room,
                renderer,
                objects=objects,
                rng=rng,
                progress=lambda share, what, report=report: report(MAP_SHARE * share, what),
                cancelled=is_cancelled,
            )
        if room_map is not None:
            search.refine_all(hypotheses(room_map, frame), report, is_cancelled)
        if is_cancelled():
            return search.refused("it was cancelled")
        report(HYPOTHESES_SHARE, "refining")
        if (located := search.judged()).trusted:
            break
    return located


def _never() -> bool:
    return False


def best_of(found: Sequence[Refined]) -> tuple[Refined, float]:
    """The likeliest of some refined hypotheses, and its log odds to the next best place, nats."""
    best, *others = sorted(found, key=lambda each: each.nats, reverse=True)
    rivals = [o.nats for o in others if is_apart(o.world_from_rig, best.world_from_rig)]
    return best, best.nats - max(rivals, default=0.0)


class _Search:
    """Everything that has been found of where one picture was taken."""

    def __init__(
        self,
        frame: Frame,
        room: SplatCloud,
        renderer: Renderer,
        objects: tuple[PosedSplats, ...],
    ) -> None:
        self._frame, self._room, self._renderer, self._objects = frame, room, renderer, objects
        self._posed = (PosedSplats(room, Pose.identity()), *objects)
        self.found: list[Refined] = []

    def refine(self, world_from_rig: Pose) -> None:
        """Refine a hypothesis and weigh it."""
        self.found.append(refined(self._frame, world_from_rig, self._posed, self._renderer))

    def refine_all(
        self, poses: Sequence[Pose], report: Progress, is_cancelled: Callable[[], bool]
    ) -> None:
        """Refine and weigh hypotheses until that is cancelled, and report the share of them."""
        for number, world_from_rig in enumerate(poses):
            if is_cancelled():
                return
            done = number / len(poses)
            report(MAP_SHARE + (HYPOTHESES_SHARE - MAP_SHARE) * done, "comparing places")
            self.refine(world_from_rig)

    def judged(self) -> Located:
        """The best hypothesis, refined with the lenses, and whether it holds."""
        best, odds = best_of(self.found)
        if best.nats < MIN_ODDS_NATS:
            return self.refused(
                "no place in the room accounts for the picture: is this the room, is it lit, and "
                "is nobody right before the camera?"
            )
        if odds < MIN_ODDS_NATS:
            return self.refused(
                f"another place looks nearly the same (log odds {odds:.0f}, wanted "
                f"{MIN_ODDS_NATS:.0f}): move the camera, or say where it stands",
                odds,
            )
        fit = calibrate_lenses(
            [self._frame], best.world_from_rig, self._room, self._renderer, objects=self._objects
        )
        refusal = fit.refusal
        if not fit.found_share > MIN_SHARE:
            refusal = (
                f"{fit.found_share:.0%} of the room's details are in the picture, wanted "
                f"{MIN_SHARE:.0%}: is this the room, is it lit, and is nobody before the camera?"
            )
        return Located(fit.world_from_rig, fit.sigma, odds, fit.found_share, fit.rig, refusal)

    def refused(self, why: str, odds: float = 0.0) -> Located:
        """Nothing found; the pose is the likeliest one all the same."""
        best = max(self.found, key=lambda each: each.nats, default=NOWHERE)
        share = best.found / max(best.windows, 1)
        unknown = np.full(6, math.inf)
        return Located(best.world_from_rig, unknown, odds, share, self._frame.rig, why)
