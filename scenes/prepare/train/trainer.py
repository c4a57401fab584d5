"""Trainer of splats from photos with poses: the protocol, its options and its result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from scenes.prepare.progress import Progress
from scenes.prepare.reconstruction import Reconstruction
from scenes.splats import SplatCloud

Stopwatch = Callable[[], float]
"""Seconds since any fixed moment."""

ShowPreview = Callable[["Preview"], None]


@dataclass(frozen=True, slots=True)
class TrainingOptions:
    """How long, and how large.

    Attributes:
        iterations: stop after this many steps; None leaves the end to `seconds`. Runs that end by
            steps alone give the same splats each time: a busy or slow machine takes longer, and
            leaves no blur.
        seconds: stop after this much time, whatever has been reached by then; None does not.
        budget: splats at most.
        sh_degree: of the splats' colour, 0 to 3.
        longest_px: photos with a longer side are made smaller before they are trained on and judged
            by: finer detail than the time allows for would only slow every step.
        stereo_px: the same for photos that are compared in pairs for depth;
            finer ones see small objects more exactly, and take longer.
        held_out_every: of so many views one is kept aside to judge the result; 0 keeps none.
        exposure: find a gain and a bias per view and channel and the lens's falloff, for photos of
            automatic exposure; the splats come out without them.
        background: RGB behind everything, 0..1.
        previews: pictures shown on the way.
        threads: worker threads; 0 means one per core. Never changes the result.

    Raises:
        ValueError: there is no end, or a number is out of range.
    """

    iterations: int | None = None
    seconds: float | None = None
    budget: int = 100_000
    sh_degree: int = 1
    longest_px: int = 640
    stereo_px: int = 480
    held_out_every: int = 8
    exposure: bool = True
    background: tuple[float, float, float] = (0.0, 0.0, 0.0)
    previews: int = 12
    threads: int = 0

    def __post_init__(self) -> None:
        if self.seconds is None and self.iterations is None:
            raise ValueError("TrainingOptions: neither seconds nor iterations, wanted an end")
        wanted = {
            "seconds": self.seconds is None or self.seconds > 0,
            "iterations": self.iterations is None or self.iterations > 0,
            "budget": self.budget > 0,
            "sh_degree": self.sh_degree in (0, 1, 2, 3),
            "longest_px": self.longest_px > 0,
            "stereo_px": self.stereo_px > 0,
            "held_out_every": self.held_out_every == 0 or self.held_out_every > 1,
            "previews": self.previews >= 0,
            "threads": self.threads >= 0,
        }
        for name, is_good in wanted.items():
            if not is_good:
                value = getattr(self, name)
                raise ValueError(f"TrainingOptions.{name}: {value} is out of range")


PRESETS = {
    "preview": TrainingOptions(
        iterations=900,
        budget=50_000,
        longest_px=480,
        stereo_px=240,
        previews=6,
    ),
    "default": TrainingOptions(iterations=3000, budget=100_000),
    "fine": TrainingOptions(
        iterations=6000,
        budget=250_000,
        sh_degree=2,
        longest_px=960,
        stereo_px=640,
        previews=24,
    ),
}
"""By name, what `nexus prepare --quality` offers: as many steps as two idle cores (Zen 4) take in
half a minute, two minutes and eight, stereo before them included, of some 90 photos."""


@dataclass(frozen=True, slots=True, eq=False)
class Preview:
    """How a view that is not trained on looks now.

    Attributes:
        view: its name.
        picture: (H, W, 3) uint8, as drawn.
        photo: (H, W, 3) uint8, as taken.
        psnr_db: between the two.
        done: 0..1 of the training.
        splats: how many there are.
    """

    view: str
    picture: NDArray[np.uint8]
    photo: NDArray[np.uint8]
    psnr_db: float
    done: float
    splats: int


@dataclass(frozen=True, slots=True)
class ViewScore:
    """How well a view is drawn: PSNR in dB and mean SSIM."""

    view: str
    psnr_db: float
    ssim: float


@dataclass(frozen=True, slots=True)
class Moment:
    """One point of a training's history.

    Attributes:
        iteration: steps taken.
        seconds: since the training began, pauses left out.
        splats: how many there are.
        loss: running mean over the views trained on.
        psnr_db: of the view shown, None without one.
    """

    iteration: int
    seconds: float
    splats: int
    loss: float
    psnr_db: float | None


@dataclass(frozen=True, slots=True, eq=False)
class TrainingResult:
    """Result of a training.

    Attributes:
        cloud: the splats, in the reconstruction's world.
        held_out: scores of the views that were kept aside.
        history: how it went.
        trainer: name and version of what trained.
        floating: share of the splats that hang off the surfaces that the photos themselves show;
            None if nobody has looked.
    """

    cloud: SplatCloud
    held_out: tuple[ViewScore, ...]
    history: tuple[Moment, ...]
    trainer: str
    floating: float | None = None

    @property
    def psnr_db(self) -> float:
        """Mean over the views kept aside; nan without any."""
        return float(np.mean([s.psnr_db for s in self.held_out])) if self.held_out else float("nan")

    @property
    def ssim(self) -> float:
        """Mean over the views kept aside; nan without any."""
        return float(np.mean([s.ssim for s in self.held_out])) if self.held_out else float("nan")


class Trainer(Protocol):
    """Anything that can train splats; the built-in one or an external program."""

    def train(
        self,
        reconstruction: Reconstruction,
        folder: Path,
        *,
        progress: Progress,
        show: ShowPreview | None = None,
    ) -> TrainingResult:
        """Train; called again with the same folder after an interruption, it goes on from there.

        Args:
            reconstruction: photos with poses, and points to start from.
            folder: where checkpoints and other files in between go.
            progress: called with the share done; its `Cancelled` is let through once a checkpoint
                is safe.
            show: given a picture now and then, if the trainer can.

        Raises:
            Cancelled: as raised by `progress`.
            ValueError: the reconstruction cannot be trained on, and why.
        """
        ...
