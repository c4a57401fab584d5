"""Second reconstruction kept with a scan: the real room of its rehearsals.

Its splats are only named when a package is opened: trackers and viewers never read them.
"""

from __future__ import annotations

import shutil
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scenes.formats.ply import read_ply
from scenes.package.files import numbers, read_json, text, write_json
from scenes.splats import SplatCloud

REALITY, REALITY_ABOUT = "reality/room.ply", "reality/reality.json"
WORLD_NUMBERS = 7
"""A small change of the metric world: rotation vector, translation, logarithm of the scale."""


@dataclass(frozen=True, slots=True, eq=False)
class Reality:
    """A second reconstruction of a scanned room.

    Attributes:
        splats: a PLY file of it, in the scan's world, metres; movable objects are a part of it.
        trainer: name and version of what trained it.
        photos: how many it was trained on.
        shared: how many of those the scan was trained on, too.
        covariance: (7, 7) of the scan's metric world, see `WORLD_NUMBERS`: how far the real room
            may be from where the scan says.
        bend_per_metre: how far the reconstruction bends away besides, metres per metre from
            `centre_m` (standard deviation).
        centre_m: (3,) middle of where the world was measured, such as of the codes.

    Raises:
        ValueError: the covariance is not finite (7, 7), or the centre not finite (3,).
    """

    splats: Path
    trainer: str
    photos: int
    shared: int
    covariance: NDArray[np.float64]
    bend_per_metre: float = 0.0
    centre_m: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        centre_m = np.array(self.centre_m, dtype=np.float64)
        if centre_m.shape != (3,) or not np.isfinite(centre_m).all():
            raise ValueError(f"Reality.centre_m: {centre_m.tolist()}, wanted finite (3,)")
        object.__setattr__(self, "centre_m", centre_m)
        covariance = np.array(self.covariance, dtype=np.float64)
        if covariance.shape != (WORLD_NUMBERS,) * 2 or not np.isfinite(covariance).all():
            raise ValueError(f"Reality.covariance: shape {covariance.shape}, wanted finite (7, 7)")
        covariance.setflags(write=False)
        object.__setattr__(self, "covariance", covariance)

    def read(self) -> SplatCloud:
        """Its splats.

        Raises:
            FormatError: the file is damaged.
            OSError: it is gone.
        """
        return read_ply(self.splats)


def write_reality(folder: Path, reality: Reality) -> None:
    """Copy a second reconstruction into a package's folder."""
    target = folder / REALITY
    target.parent.mkdir()
    shutil.copyfile(reality.splats, target)
    write_json(
        folder / REALITY_ABOUT,
        {
            "trainer": reality.trainer,
            "photos": reality.photos,
            "shared": reality.shared,
            "covariance": reality.covariance.ravel().tolist(),
            "bend_per_metre": reality.bend_per_metre,
            "centre_m": reality.centre_m.tolist(),
        },
    )


def reality_of(folder: Path) -> Reality:
    """Read a package's record of its second reconstruction.

    Raises:
        PackageError, KeyError, TypeError, ValueError: a field is missing or wrong.
    """
    about = read_json(folder / REALITY_ABOUT)
    return Reality(
        splats=folder / REALITY,
        trainer=text(about["trainer"], "trainer"),
        photos=int(about["photos"]),
        shared=int(about["shared"]),
        covariance=np.array(numbers(about["covariance"], WORLD_NUMBERS**2, "covariance")).reshape(
            WORLD_NUMBERS, WORLD_NUMBERS
        ),
        bend_per_metre=numbers([about["bend_per_metre"]], 1, "bend_per_metre", least=0.0)[0],
        centre_m=np.array(numbers(about["centre_m"], 3, "centre_m")),
    )
