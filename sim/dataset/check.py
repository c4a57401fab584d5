"""Reads a written data set back and says whether poses, masks, lengths and meshes agree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from sim.dataset.truth.agreement import RIGID, Agreement

Item = TypeVar("Item")

MIN_PX = 200
"""Pixels of a silhouette from which on its overlap says something: a border of half a pixel is a
tenth of a smaller one."""

MIN_IOU = 0.95
"""Median overlap of silhouettes and meshes."""

WORST_IOU = 0.80
"""Overlap of any of them."""

MAX_MM = 5.0
"""Median difference of lengths, mm: ten steps of what is written."""

MAX_FRACTION_OFF = 2e-6
"""Of the visible fraction that is written from that of the masks: six digits are written."""

SAMPLED = 12
"""Images of each camera whose pixels are compared, evenly over the sequence; poses are all read."""


@dataclass(frozen=True, slots=True)
class Checked:
    """What a reader found.

    Attributes:
        form: "room-c" or "bop".
        images: that are described.
        rigid_off: worst rotation's distance from one.
        iou_median: of silhouettes and meshes over `compared`.
        iou_worst: likewise.
        length_mm: median difference of range or depth, mm; nan if no object is seen.
        fraction_off: worst difference of a visible fraction from its masks'.
        outside_px: visible pixels outside of silhouettes.
        compared: silhouettes of at least `MIN_PX` that were held against their meshes.
    """

    form: str
    images: int
    rigid_off: float
    iou_median: float
    iou_worst: float
    length_mm: float
    fraction_off: float
    outside_px: int
    compared: int

    def require(self, folder: Path) -> None:
        """Refuse what cannot be right.

        Raises:
            ValueError: a figure is beyond its limit; names it, its value and the limit.
        """
        limits = (
            ("rotations are off by", self.rigid_off, self.rigid_off <= RIGID, RIGID),
            ("median overlap of masks and meshes is", self.iou_median,
             self.iou_median >= MIN_IOU, MIN_IOU),
            ("least overlap of masks and meshes is", self.iou_worst,
             self.iou_worst >= WORST_IOU, WORST_IOU),
            ("lengths are off by mm", self.length_mm, not self.length_mm > MAX_MM, MAX_MM),
            ("visible fractions are off by", self.fraction_off,
             self.fraction_off <= MAX_FRACTION_OFF, MAX_FRACTION_OFF),
            ("visible pixels outside of silhouettes:", self.outside_px, self.outside_px == 0, 0),
        )  # fmt: skip
        for what, value, is_right, limit in limits:
            if not is_right:
                raise ValueError(f"{folder}: {what} {value:.4g}, limit {limit:g}; do not use it")

    def line(self) -> str:
        """The figures in one line."""
        return (
            f"checked {self.images} images: overlap of masks and meshes {self.iou_median:.3f} "
            f"(worst {self.iou_worst:.3f}, {self.compared} silhouettes), "
            f"lengths within {self.length_mm:.1f} mm (median)"
        )


def check_dataset(folder: Path) -> Checked:
    """Read a data set of either form.

    Raises:
        ValueError: it is none, or a file is missing or damaged; names it.
    """
    from sim.dataset.bop.read_back import check_bop
    from sim.dataset.check_room_folder import check_room_folder

    if (folder / "models" / "models_info.json").is_file():
        return check_bop(folder)
    if (folder / "objects.json").is_file():
        return check_room_folder(folder)
    raise ValueError(
        f"{folder}: no data set: neither objects.json nor models/models_info.json is there"
    )


def sampled(items: Sequence[Item]) -> list[Item]:
    """At most `SAMPLED` of a sequence, evenly."""
    chosen = np.unique(np.linspace(0, len(items) - 1, min(len(items), SAMPLED)).round())
    return [items[int(index)] for index in chosen]


def summed_up(
    form: str,
    images: int,
    found: Sequence[Agreement],
    *,
    rigid_off: float,
    fraction_off: float,
) -> Checked:
    """The figures over all that was compared."""
    large = [a for a in found if a.pixels >= MIN_PX]
    ious: list[float] = [a.iou for a in large]
    lengths: Any = [a.length_mm for a in large if np.isfinite(a.length_mm)]
    return Checked(
        form,
        images,
        rigid_off,
        float(np.median(ious)) if ious else 1.0,
        min(ious, default=1.0),
        float(np.median(lengths)) if lengths else float("nan"),
        fraction_off,
        sum(a.visible_outside_px for a in found),
        len(large),
    )
