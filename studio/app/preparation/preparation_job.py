"""A preparation in a process of its own: what was asked for, how far it is, what came out."""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scenes.prepare.room_splats import PREVIEWS
from studio.app.model.documents.dropped import SPLATS, photos_of, poses_in
from studio.app.model.measured_line import MeasuredLine, free_name, free_place
from studio.app.preparation.child import Child
from studio.app.preparation.stage_lines import StageLine, stages_of
from studio.evaluate.verdict import OUTCOME

Pick = tuple[str, float, float]
"""A photo's name and a pixel in it."""

UNKNOWN_SCALE = (
    "Scale unknown: this file does not say how long its unit is. Give metres per unit, or the "
    "height from floor to ceiling, or measure something in the view that you know the length of."
)


@dataclass(frozen=True, slots=True)
class Scale:
    """Known lengths that give a room its metres; empty where these are estimated.

    Attributes:
        code_side_m: printed side of the codes.
        length_m: a measured length between two ends.
        ends: picks of both ends (a, b), two photos or more each.
        metres_per_unit: of a splat file of elsewhere.
        height_m: of its ceiling over its floor.
    """

    code_side_m: float | None = None
    length_m: float | None = None
    ends: Mapping[str, tuple[Pick, ...]] | None = None
    metres_per_unit: float | None = None
    height_m: float | None = None

    @property
    def is_known(self) -> bool:
        """Whether a splat file of elsewhere can be laid out in metres with it."""
        return self.metres_per_unit is not None or self.height_m is not None

    def flags(self) -> list[str]:
        """Words of the command line."""
        words: list[str] = []
        for flag, value in (
            ("--qr-size", self.code_side_m),
            ("--length", self.length_m),
            ("--metres-per-unit", self.metres_per_unit),
            ("--height", self.height_m),
        ):
            words += [] if value is None else [flag, f"{value:g}"]
        for which, picks in (self.ends or {}).items():
            for photo, x, y in picks:
                words += ["--end", which, photo, f"{x:.1f}", f"{y:.1f}"]
        return words


def place_of_room(source: Path) -> Path:
    """The folder of the room that is made of a source.

    A room that was made of photos before is made again in its place, from the stages that are kept;
    but not one of which objects were cut out since, nor one of a splat file.
    """
    place = source.with_name(f"{source.stem}.gnx")
    if source.is_file() and source.suffix.lower() in SPLATS:
        return free_name(source, source.stem)
    try:
        objects = json.loads((place / "scene.json").read_text(encoding="utf-8")).get("objects")
    except (OSError, ValueError):
        return place
    return free_name(source, source.stem) if objects else place


def preparation_words(
    source: Path, out: Path, scale: Scale, *, quality: str = "default", seed: int = 0
) -> list[str]:
    """The command line that prepares a video or a folder of photos, with its poses if any."""
    poses = poses_in(source) if source.is_dir() else None
    photos = photos_of(source) if source.is_dir() else source
    words = ["prepare", str(photos), "--out", str(out), "--quality", quality]
    words += [] if poses is None else ["--poses", str(poses)]
    return [*words, "--seed", str(seed), "--json", *scale.flags()]


def splat_file_words(source: Path, out: Path, scale: Scale) -> list[str]:
    """The command line that makes a scene of a splat file of elsewhere.

    Raises:
        ValueError: nothing says how long its unit is.
    """
    if not scale.is_known:
        raise ValueError(UNKNOWN_SCALE)
    return ["convert", str(source), str(out), "--json", *scale.flags()]


def rescaling_words(line: MeasuredLine, true_m: float) -> tuple[list[str], Path]:
    """The command line that makes a scene in which a measured line has its true length.

    Args:
        line: as it was measured, in a splat file or a scene package.
        true_m: how long it is really, metres.

    Returns:
        Its words, and the scene that it makes; what was measured in stays as it is.

    Raises:
        ValueError: a built-in room was measured in, or one of the lengths is not positive.
    """
    source = Path(line.scene)
    if not source.exists():
        raise ValueError(f"{line.scene} is a built-in room, whose scale is exact")
    out = free_place(source)
    factor = f"{line.scale_for(true_m):.6g}"
    return ["convert", str(source), str(out), "--json", "--metres-per-unit", factor], out


class PreparationJob:
    """One preparation. Started at once; polled by the window.

    Args:
        words: its command line.
        out: the scene that it makes.
    """

    def __init__(self, words: list[str], out: Path) -> None:
        self.out = out
        self.work = out.with_name(f"{out.name}.prepare")
        with suppress(OSError):  # what an earlier run came to is not what this one comes to
            (self.work / OUTCOME).unlink()
        self._child = Child(words)

    @property
    def is_running(self) -> bool:
        """Whether it is at work."""
        return self._child.is_running

    @property
    def is_done(self) -> bool:
        """Whether it has ended and the scene is there."""
        return not self.is_running and self._child.code in (0, 1) and not self.problem

    @property
    def stages(self) -> tuple[StageLine, ...]:
        """How far each stage is."""
        return stages_of(self._child.said(), has_failed=bool(self.problem))

    @property
    def problem(self) -> str:
        """Why it ended, with what to do; empty while it runs and after it went well."""
        if self._child.is_running or self._child.code == 0:
            return ""
        if self._child.is_cancelled:
            return "cancelled; finished stages are kept: prepare again to go on"
        lines = [line for line in self._child.said() if line]
        if self._child.code == 1 and self.outcome:
            return ""
        return lines[-1] if lines else f"ended with status {self._child.code}; prepare again"

    @property
    def preview(self) -> Path | None:
        """The newest picture of the training, or None."""
        pictures = sorted((self.work / "training" / PREVIEWS).glob("*.jpg"))
        return pictures[-1] if pictures else None

    @property
    def outcome(self) -> dict[str, Any]:
        """Outcome, see `studio.evaluate.verdict`; empty before the end."""
        try:
            values = json.loads((self.work / OUTCOME).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}
        return values if isinstance(values, dict) else {}

    def cancel(self) -> None:
        """Ask it to end."""
        self._child.cancel()

    def wait(self, limit_s: float) -> bool:
        """Whether it has ended within a time."""
        return self._child.wait(limit_s)
