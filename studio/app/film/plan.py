"""Plan of a film of a view: whose view, how large, of which time, into which file."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from scenes.pose import Pose

MIN_PX, MAX_PX = 64, 3840
"""Sides of a film, pixels: H.264 of every player takes 4K."""

MIN_FPS, MAX_FPS = 1.0, 60.0
"""Pictures a second of a film."""

MAX_S = 4 * 3600.0
"""Length of a film, seconds: a session of half a day."""


@dataclass(frozen=True, slots=True)
class FilmPlan:
    """A film that is to be made.

    Attributes:
        path: of the MP4 file.
        width_px, height_px: of its pictures, even.
        fps: pictures a second.
        source: whose view, see `insets.sources`; "" one that stands still or is moved by hand.
        world_from_camera: of that one; None for a source.
        from_s, to_s: part of a recording, seconds of the session; None its start or end.
        title: what is filmed, in words.

    Raises:
        ValueError: a figure is out of its bounds.
    """

    path: Path
    width_px: int = 1280
    height_px: int = 720
    fps: float = 10.0
    source: str = ""
    world_from_camera: Pose | None = None
    from_s: float | None = None
    to_s: float | None = None
    title: str = "view"

    def __post_init__(self) -> None:
        for name, side in (("width", self.width_px), ("height", self.height_px)):
            if not MIN_PX <= side <= MAX_PX or side % 2:
                raise ValueError(
                    f"film {name} = {side} px, wanted an even number of {MIN_PX} to {MAX_PX}"
                )
        if not MIN_FPS <= self.fps <= MAX_FPS:
            raise ValueError(
                f"film fps = {self.fps:g}, wanted {MIN_FPS:g} to {MAX_FPS:g} pictures a second"
            )
        if self.path.suffix.lower() != ".mp4":
            raise ValueError(f"film path = {str(self.path)!r}, wanted a name such as film.mp4")

    def times_ns(self, start_ns: int, end_ns: int, *, origin_ns: int = 0) -> range:
        """Instants of its pictures in a recording from `start_ns` to `end_ns`, at least one.

        Args:
            start_ns: of the recording.
            end_ns: of the recording.
            origin_ns: the instant that is called 0 s.

        Raises:
            ValueError: nothing of the recording is between `from_s` and `to_s`, or too much.
        """
        first, last = start_ns, end_ns
        if self.from_s is not None:
            first = max(start_ns, origin_ns + round(1e9 * self.from_s))
        if self.to_s is not None:
            last = min(end_ns, origin_ns + round(1e9 * self.to_s))
        if last < first:
            raise ValueError(
                f"film from {(first - origin_ns) / 1e9:g} s to {(last - origin_ns) / 1e9:g} s: "
                f"wanted a part of {(start_ns - origin_ns) / 1e9:g} to "
                f"{(end_ns - origin_ns) / 1e9:g} s"
            )
        if (last - first) / 1e9 > MAX_S:
            raise ValueError(
                f"film of {(last - first) / 1e9:.0f} s, limit {MAX_S:.0f} s: name a part of it "
                "with from_s and to_s"
            )
        step = max(1, math.floor(1e9 / self.fps))
        return range(first, last + 1, step)
