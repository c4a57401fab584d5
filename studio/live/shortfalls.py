"""Shortfalls of a live session, with their causes: pictures not tracked, objects lost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from scenes.package import ScenePackage
from scenes.state import TrackedObject, TrackState

FEW_SHARE = 0.1
"""Share of pictures that may be left out without a word: one in ten is no loss for what moves at
walking pace before a camera of 10 pictures a second or more."""

MIN_HZ = 5.0
"""Pictures tracked a second below which an object carried at walking pace, 1.2 m/s, moves by more
than its own width between two of them: it is lost."""

LONG_GAP_S = 0.4
"""Time without a tracked picture after which what moves is looked for elsewhere: two pictures at
`MIN_HZ`."""

HIDDEN = 0.4
"""Visible share of an object below which something stood before it: its outline is mostly gone."""


def drop_words(*, came_hz: float, tracked_hz: float, is_simulated: bool = False) -> str:
    """Why pictures are left out, and what to do; empty while nearly all are tracked.

    Args:
        came_hz: pictures a second that the camera sent.
        tracked_hz: of these, how many were tracked.
        is_simulated: whether this computer plays the camera, too.
    """
    if came_hz <= 0 or tracked_hz >= (1.0 - FEW_SHARE) * came_hz:
        return ""
    why = f"This computer is too slow for {came_hz:.0f} pictures a second: it tracks"
    found = f"{why} {tracked_hz:.0f}." if tracked_hz >= 1.0 else f"{why} {tracked_hz:.1f}."
    if is_simulated:
        return f"{found} It plays the simulated camera, too: a real one leaves it more."
    return f"{found} Set the camera to fewer or smaller pictures, or close other programs."


def loss_words(
    before: TrackedObject | None, *, gap_s: float, is_camera_lost: bool, is_dropped: bool
) -> str:
    """Why an object is lost, as far as its last pictures say.

    Args:
        before: what was known of it in the picture before; None if this is the first one.
        gap_s: time between the two pictures.
        is_camera_lost: whether it is not known where the camera is.
        is_dropped: whether pictures came in between, and were not tracked.
    """
    if is_camera_lost:
        return "the camera was moved or its view is blocked"
    if before is None:
        return "it is not where the scan has it, or something hides it"
    if gap_s > LONG_GAP_S:
        why = "this computer was too slow" if is_dropped else "no pictures came"
        return f"it moved within {gap_s:.1f} s in which {why}"
    if before.state is TrackState.OCCLUDED or before.visible_fraction < HIDDEN:
        return "something hid it while it was moved"
    if before.state is TrackState.TRACKED:
        return "it moved too fast, or was turned over"
    return "it was taken away, or the light changed on it"


class Losses:
    """Lost objects: since when, and why.

    Args:
        scene: whose objects have names.
    """

    def __init__(self, scene: ScenePackage) -> None:
        self._scene = scene
        self._before: dict[str, TrackedObject] = {}
        self._dropped = 0
        self.lost: Mapping[str, str] = {}
        """The reason by object id; replaced, never changed."""

    def notice(
        self, tracks: Sequence[TrackedObject], *, dropped: int, is_camera_lost: bool
    ) -> list[str]:
        """Take what is known at a picture; gives a sentence for each object lost since the last.

        Args:
            tracks: of all objects.
            dropped: pictures that were left out so far.
            is_camera_lost: whether it is not known where the camera is.
        """
        names = {item.object_id: item.name for item in self._scene.objects}
        lost: dict[str, str] = {}
        said: list[str] = []
        for track in tracks:
            if track.state is not TrackState.LOST:
                continue
            known = self.lost.get(track.object_id)
            if known is None:
                before = self._before.get(track.object_id)
                known = loss_words(
                    before,
                    gap_s=0.0 if before is None else (track.t_ns - before.t_ns) / 1e9,
                    is_camera_lost=is_camera_lost,
                    is_dropped=dropped > self._dropped,
                )
                name = names.get(track.object_id, track.object_id)
                said.append(f"{name} is lost: {known}; it stays where it was and is looked for")
            lost[track.object_id] = known
        self.lost, self._dropped = lost, dropped
        self._before = {track.object_id: track for track in tracks}
        return said
