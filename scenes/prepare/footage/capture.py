"""A capture: the pictures a room is made from, chosen, and what was wrong with the others."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

from scenes.cameras import Rig
from scenes.formats.storage.atomic import write_file
from scenes.prepare.footage.frame_choice import StepLimits
from scenes.prepare.footage.picture_files import HEIF_SUFFIXES, reads_heif
from scenes.prepare.footage.sharpness import QualityLimits, Reason

VIDEO_SUFFIXES = frozenset({".mp4", ".mov", ".m4v", ".mkv", ".avi", ".webm", ".insv"})
PICTURE_SUFFIXES = (
    frozenset({".jpg", ".jpeg", ".png", ".tif", ".tiff", ".webp", ".bmp"}) | HEIF_SUFFIXES
)
CAPTURE_FILE = "capture.json"
JPEG_QUALITY = 96
"""Quality of stored frames."""
NOT_READ = frozenset({Reason.UNREADABLE, Reason.FOREIGN, Reason.SPHERICAL})
MAX_NAMED = 5
"""Files that a message names; the others it counts."""


class CaptureError(ValueError):
    """The pictures cannot become a room; the message says why and what to film instead."""


class CaptureKind(StrEnum):
    """How the pictures were taken, which decides what is matched with what."""

    VIDEO = "video"
    PHOTOS = "photos"
    PANORAMA = "views of a 360° video"


@dataclass(frozen=True, slots=True)
class CaptureOptions:
    """How frames are chosen.

    Attributes:
        frames: how many a video should give; up to twice as many if the camera swept far.
        least_frames: fewer usable ones are refused.
        most_photos: photos beyond this many are left out evenly.
        longest_px: larger pictures are made smaller.
        quality: when a picture is refused.
        steps: how far the picture may move between neighbours of a video.
        rig: the 360° camera that took the video, lenses side by side in the picture.
    """

    frames: int = 80
    least_frames: int = 8
    most_photos: int = 400
    longest_px: int = 1600
    quality: QualityLimits = field(default_factory=QualityLimits)
    steps: StepLimits = field(default_factory=StepLimits)
    rig: Rig | None = None

    def __post_init__(self) -> None:
        if not 3 <= self.least_frames <= self.frames:
            raise ValueError(
                f"CaptureOptions: at least {self.least_frames} of {self.frames} frames, "
                "wanted 3 <= least_frames <= frames"
            )
        if self.longest_px < 320:
            raise ValueError(f"CaptureOptions.longest_px: {self.longest_px}, wanted at least 320")


@dataclass(frozen=True, slots=True)
class Frame:
    """A chosen picture.

    Attributes:
        name: its file name in the capture's folder.
        source: where it comes from, in words that its maker understands.
        blur: 0 crisp .. 1.
        lens: pictures of the same value share one camera's intrinsics.
        focal_px: focal length if the file has it, in pixels of the stored picture.
        t_s: seconds from the start of a video.
    """

    name: str
    source: str
    blur: float
    lens: str
    focal_px: float | None = None
    t_s: float | None = None


@dataclass(frozen=True, slots=True)
class Rejected:
    """A picture that is not used, and why."""

    source: str
    reason: Reason
    t_s: float | None = None


@dataclass(frozen=True, slots=True)
class Gap:
    """Neighbouring frames of a video that share little: film this passage more slowly.

    Attributes:
        before: name of the frame before it.
        after: name of the frame after it.
        moved: how far the picture moved between them, as a fraction of its width.
    """

    before: str
    after: str
    moved: float


@dataclass(frozen=True, slots=True)
class Capture:
    """Chosen pictures in one folder, RGB, upright, in the order they were taken.

    Attributes:
        kind: video or photos.
        source: the file or folder they come from.
        folder: where the chosen pictures are.
        frames: the chosen ones.
        rejected: the others that were looked at.
        gaps: passages of a video that are poorly covered.
        notes: what was done to the pictures, in whole sentences.
    """

    kind: CaptureKind
    source: str
    folder: Path
    frames: tuple[Frame, ...]
    rejected: tuple[Rejected, ...] = ()
    gaps: tuple[Gap, ...] = ()
    notes: tuple[str, ...] = ()

    def counts(self) -> dict[str, int]:
        """How many pictures were rejected for each reason, the most frequent first."""
        return dict(Counter(str(r.reason) for r in self.rejected).most_common())

    def not_read(self) -> str:
        """Files that were not read, in words, and what helps; empty if all were."""
        files = [r.source for r in self.rejected if r.reason in NOT_READ]
        if not files:
            return ""
        return f"{len(files)} files were not read: {some_of(files)}. {_remedy(files)}"

    def summary(self) -> str:
        """One line for people."""
        parts = [f"{count} {reason}" for reason, count in self.counts().items()]
        left_out = f"; left out: {', '.join(parts)}" if parts else ""
        gaps = f"; {len(self.gaps)} passages with little overlap" if self.gaps else ""
        return f"{len(self.frames)} frames of {self.source}{left_out}{gaps}"


def some_of(words: Sequence[str], separator: str = ", ") -> str:
    """The first of a list, and how many more there are."""
    more = len(words) - MAX_NAMED
    return separator.join(words[:MAX_NAMED]) + (f" and {more} more" if more > 0 else "")


def _remedy(files: Sequence[str]) -> str:
    """Return advice on files that were not read."""
    suffixes = {Path(name).suffix.lower() for name in files}
    if suffixes & HEIF_SUFFIXES:
        install = "" if reads_heif() else ", or install pi-heif, which reads HEIC"
        return (
            "Export them as JPEG (on an iPhone: Settings, Camera, Formats, Most Compatible; or "
            f"share them as JPEG){install}."
        )
    if suffixes & VIDEO_SUFFIXES:
        return "Prepare from the photos or from one video, not from both; others export as JPEG."
    return "Copy them again, or export them as JPEG or PNG."


def too_few(
    source: str, kept: int, rejected: Sequence[Rejected], *, wanted: int, advice: str = ""
) -> CaptureError:
    """The error for a capture that leaves too few pictures, with the reasons counted."""
    counts = Counter(r.reason for r in rejected)
    why = ", ".join(f"{count} {reason}" for reason, count in counts.most_common())
    advices = {
        Reason.MISSING: "copy them beside the others",
        Reason.SPHERICAL: "give a 360° film as one video, or export flat pictures",
        Reason.FOREIGN: "export the other files as JPEG",
        Reason.UNREADABLE: "copy the files again or export them as JPEG",
        Reason.DARK: "switch on the lights or take off the lens cap",
        Reason.EMPTY: "film furniture and corners, not a bare wall or an empty screen",
        Reason.BLURRED: "move more slowly, with more light",
        Reason.ALIKE: "walk through the room while filming, do not stand still",
    }
    worst = counts.most_common(1)
    todo = advice or (advices[worst[0][0]] if worst else "take more pictures")
    files = [r.source for r in rejected if r.reason in NOT_READ]
    if files:
        todo = f"not read are {some_of(files)}. {_remedy(files).rstrip('.')}; {todo}"
    return CaptureError(
        f"{source}: {kept} usable pictures{f' ({why})' if why else ''}, wanted at least {wanted}; "
        f"{todo}"
    )


def save_capture(capture: Capture, key: dict[str, Any]) -> None:
    """Write what was chosen beside the pictures; `key` says from what and how.

    Raises:
        OSError: the disk is full or the folder is not writable.
    """
    values = asdict(capture) | {"folder": ".", "key": key}
    write_file(capture.folder / CAPTURE_FILE, [json.dumps(values, indent=1).encode()])


def load_capture(folder: Path, key: dict[str, Any]) -> Capture | None:
    """The capture in `folder` if it is whole and was made with this key."""
    try:
        values = json.loads((folder / CAPTURE_FILE).read_text(encoding="utf-8"))
        if values["key"] != key:
            return None
        frames = tuple(Frame(**frame) for frame in values["frames"])
        rejected = tuple(
            Rejected(r["source"], Reason(r["reason"]), r["t_s"]) for r in values["rejected"]
        )
        gaps = tuple(Gap(**gap) for gap in values["gaps"])
        kind = CaptureKind(values["kind"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
    if not all((folder / frame.name).is_file() for frame in frames):
        return None
    notes = tuple(str(note) for note in values.get("notes", ()))
    return Capture(kind, values["source"], folder, frames, rejected, gaps, notes)
