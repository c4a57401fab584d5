"""The last line that was measured in a view, kept after the tool is put down."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class MeasuredLine:
    """The length of a line that was clicked in a view.

    Attributes:
        scene: name or path of the scene that it was measured in.
        length_m: in metres of that scene, which may be wrong, or units that nobody knows.
    """

    scene: str
    length_m: float

    def scale_for(self, true_m: float) -> float:
        """Factor that makes the line as long as it really is.

        Raises:
            ValueError: the true length is not positive, or the line has none; one line.
        """
        if not true_m > 0:
            raise ValueError(f"the true length is {true_m:g} m, wanted more than 0")
        if not self.length_m > 0:
            raise ValueError("the measured line has no length: click two places apart (key 4)")
        return true_m / self.length_m


def free_place(scene: Path) -> Path:
    """A folder beside a scene or splat file that is not there yet, for the scene made of it."""
    return free_name(scene, scene.stem if scene.is_file() else f"{scene.stem}-scaled")


def free_name(source: Path, stem: str) -> Path:
    """A folder `STEM.gnx` beside something, or `STEM-2.gnx` and so on, that is not there yet."""
    place, number = source.with_name(f"{stem}.gnx"), 1
    while place.exists():
        number += 1
        place = source.with_name(f"{stem}-{number}.gnx")
    return place
