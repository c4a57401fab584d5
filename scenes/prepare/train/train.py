"""The built-in trainer: splats from photos with poses on the CPU, in minutes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from scenes.prepare.progress import Cancelled, Progress
from scenes.prepare.reconstruction import Reconstruction
from scenes.prepare.train import checkpoint
from scenes.prepare.train.checkpoint import Checkpoint
from scenes.prepare.train.coverage import MAX_PX, box_around, uncovered_splats
from scenes.prepare.train.depth.seen_surfaces import judge, surfaces_of
from scenes.prepare.train.depth.stereo import seen_depths
from scenes.prepare.train.held_out import draw_photo, psnr_db, score_photo
from scenes.prepare.train.optimiser import schedule
from scenes.prepare.train.optimiser.densify import densify, morton_order
from scenes.prepare.train.optimiser.exposure import Exposures, fitted
from scenes.prepare.train.optimiser.rows import MEAN, SH, TrainingRows, joined, rows_of_cloud
from scenes.prepare.train.seed import seed_rows
from scenes.prepare.train.trainer import (
    Moment,
    Preview,
    ShowPreview,
    Stopwatch,
    TrainingOptions,
    TrainingResult,
)
from scenes.prepare.train.training_photos import Photos, read_photo, typical_distance
from scenes.render.native import NativeRenderer
from scenes.render.renderer import RenderOptions
from scenes.render.training import Exposure, Trainee
from scenes.splats import SplatCloud

BUILT_IN_VERSION = "built-in 7"
"""Counted up with every change to what it makes of the same photos."""
REPORT_EVERY = 20
"""Steps between two reports."""
LOSS_MEMORY = 0.99
"""Weight of the past in the running mean of the loss."""
SAVE_EVERY_S = 60.0
"""Seconds between two checkpoints."""
STEREO_SHARE = 0.3
"""Of a training's time that passes before its first step, in depth from photos: 89 s of the
default's 290 s of processor time with 55 photos. Only what progress says depends on it."""


class BuiltInTrainer:
    """Trains with the native crate; see `scenes.prepare.train.trainer.Trainer`.

    L1 + SSIM, a price on light off the surfaces that stereo has seen, Adam for visible splats
    only, a ramp of picture sizes, a fixed budget of splats that are split where the error is.

    Args:
        options: how long and how large.
        rng: makes the generator that draws views and splats; called once per training.
        stopwatch: seconds; only a time budget, time left and the history depend on it.
    """

    def __init__(
        self,
        options: TrainingOptions,
        *,
        rng: Callable[[], np.random.Generator],
        stopwatch: Stopwatch,
    ) -> None:
        self._options = options
        self._rng = rng
        self._stopwatch = stopwatch

    def train(
        self,
        reconstruction: Reconstruction,
        folder: Path,
        *,
        progress: Progress,
        show: ShowPreview | None = None,
    ) -> TrainingResult:
        """See `scenes.prepare.train.trainer.Trainer.train`."""
        run = _Run(self._options, reconstruction, self._rng(), self._stopwatch, progress)
        before = checkpoint.load(folder, run.job)
        if before is not None:
            run.go_on_from(before)
        saved_at = run.seconds
        try:
            while run.done < 1:
                run.step()
                if run.iteration % REPORT_EVERY == 0:
                    progress(run.share, run.note())
                if run.preview_is_due:
                    run.preview(show)
                if run.seconds - saved_at > SAVE_EVERY_S:
                    checkpoint.save(run.checkpoint(), folder)
                    saved_at = run.seconds
        except Cancelled:
            checkpoint.save(run.checkpoint(), folder)
            raise
        return run.result()


class _Run:
    """One training under way."""

    def __init__(
        self,
        options: TrainingOptions,
        reconstruction: Reconstruction,
        rng: np.random.Generator,
        stopwatch: Stopwatch,
        progress: Progress,
    ) -> None:
        self._seconds_before = 0.0
        self._began = stopwatch()
        self.job = _describe(options, reconstruction)
        self.iteration = 0
        self._densified_at = 0
        self._options = options
        self._rng = rng
        self._stopwatch = stopwatch
        self._photos = Photos(
            reconstruction,
            held_out_every=options.held_out_every,
            longest_px=options.longest_px,
        )
        self._distance = typical_distance(reconstruction)
        # Views kept aside must not have a say in anything.
        shown = replace(reconstruction, views=self._photos.training)
        depths = seen_depths(
            shown,
            longest_px=options.stereo_px,
            progress=lambda done, note: progress(STEREO_SHARE * done, note),
        )
        self._surfaces = surfaces_of(depths)
        self._photos.surfaces = {surface.view: surface for surface in self._surfaces}
        self._small = [read_photo(view, MAX_PX) for view in self._photos.training]
        self._renderer = NativeRenderer()
        self._drawing = RenderOptions(
            background=options.background,
            sh_degree=options.sh_degree,
            near_m=0.01 * self._distance,
            threads=options.threads,
        )
        rows = seed_rows(
            reconstruction, self._surfaces, (options.sh_degree + 1) ** 2, options.budget, rng
        )
        self._box = box_around(rows.values[:, MEAN])
        rows = self._covering(rows)
        self._first_splats = len(rows)
        self._take(rows)
        self._exposures = Exposures(len(self._photos.training))
        self._queue: list[int] = []
        self._history: list[Moment] = []
        self._loss = float("nan")

    @property
    def seconds(self) -> float:
        """Time spent, pauses left out."""
        return self._seconds_before + self._stopwatch() - self._began

    @property
    def done(self) -> float:
        """0..1, of whichever end comes first."""
        options, shares = self._options, [0.0]
        if options.seconds is not None:
            shares.append(self.seconds / options.seconds)
        if options.iterations is not None:
            shares.append(self.iteration / options.iterations)
        return min(max(shares), 1.0)

    @property
    def share(self) -> float:
        """0..1 of the whole work, with what came before the first step."""
        return STEREO_SHARE + (1 - STEREO_SHARE) * self.done

    @property
    def preview_is_due(self) -> bool:
        """Whether as many previews are to be seen by now as were wanted."""
        shown = sum(moment.psnr_db is not None for moment in self._history)
        return self.done * self._options.previews > shown

    def step(self) -> None:
        """Draw one view and move the splats that it shows."""
        done = self.done
        if not self._queue:
            self._queue = self._rng.permutation(len(self._photos.training)).tolist()
        place = self._queue.pop()
        target = self._photos.target(self._photos.training[place], schedule.shrink(done))
        exposure = self._exposures.of(place) if self._options.exposure else Exposure()
        rates = schedule.rates(done, self._distance, self._width)
        depth_price = schedule.depth_price(done)
        distance = self._trainee.step(target, rates, exposure, self._drawing, depth_price)
        if self._options.exposure:
            self._exposures.step(place, distance)
        self.iteration += 1
        before = self._loss if np.isfinite(self._loss) else distance.loss
        self._loss = LOSS_MEMORY * before + (1 - LOSS_MEMORY) * distance.loss
        since = self.iteration - self._densified_at
        is_due = since >= schedule.densify_after(self.done, self.iteration)
        if is_due and done < schedule.PUT_BACK_UNTIL:
            self._densify(done)
            self._densified_at = self.iteration

    def _densify(self, done: float) -> None:
        """Put splats back on surfaces now and then; split where the error is, but for the end."""
        wanted = 0
        if done < schedule.DENSIFY_UNTIL:
            wanted = schedule.splats_wanted(done, self._first_splats, self._options.budget)
        rows = self._rows()
        if schedule.puts_back(self.iteration, self.iteration - self._densified_at):
            verdict = judge(rows.values[:, MEAN], self._surfaces)
            rows.values[:, MEAN] += verdict.offset
            rows = rows.select(~verdict.is_stray)
            rows = self._covering(rows)
        rows = densify(rows, wanted, self._rng)
        self._take(rows.select(morton_order(rows.values[:, :3])))

    def _covering(self, rows: TrainingRows) -> TrainingRows:
        """The splats, and as many as the budget allows where photos show what none of them does."""
        added = uncovered_splats(
            rows.to_cloud(),
            self._small,
            self._renderer,
            self._drawing,
            box=self._box,
            typical_distance=self._distance,
        )
        room = max(self._options.budget - len(rows), 0)
        if len(added) > room:
            added = added.select(np.sort(self._rng.choice(len(added), room, replace=False)))
        return joined([rows, rows_of_cloud(added, rows.sh_count)])

    def preview(self, show: ShowPreview | None) -> None:
        """Draw a view that is not trained on, note how good it is, and show it."""
        views = self._photos.held_out or self._photos.training
        shown = sum(moment.psnr_db is not None for moment in self._history)
        view = views[shown % len(views)]
        photo = self._photos.photo(view)
        drawn = draw_photo(self._renderer, self._rows().to_cloud(), photo, self._drawing)
        if self._options.exposure:
            drawn = fitted(drawn, photo.colours, self._exposures.lens())
        quality = psnr_db(drawn, photo.colours)
        self._history.append(self._moment(quality))
        if show is not None:
            picture = np.round(255 * drawn).astype(np.uint8)
            show(Preview(view.name, picture, photo.picture, quality, self.done, self._splats))

    def note(self) -> str:
        """How it is going, in words."""
        words = f"step {self.iteration:,}, {self._splats:,} splats, loss {self._loss:.4f}"
        done = self.done
        if done <= 0:
            return words
        left = self.seconds * (1 - self.share) / self.share
        return f"{words}, {left:.0f} s left" if left < 100 else f"{words}, {left / 60:.0f} min left"

    def checkpoint(self) -> Checkpoint:
        """Everything needed to go on."""
        return Checkpoint(
            job=self.job,
            rows=self._rows(),
            iteration=self.iteration,
            densified_at=self._densified_at,
            seconds=self.seconds,
            first_splats=self._first_splats,
            queue=tuple(self._queue),
            random=dict(self._rng.bit_generator.state),
            exposure=(self._exposures.values, self._exposures.moments, self._exposures.steps),
            history=tuple(self._history),
        )

    def go_on_from(self, before: Checkpoint) -> None:
        """Take over where another run was interrupted."""
        self._take(before.rows)
        self.iteration = before.iteration
        self._densified_at = before.densified_at
        self._seconds_before = before.seconds
        self._began = self._stopwatch()
        self._first_splats = before.first_splats
        self._queue = list(before.queue)
        self._rng.bit_generator.state = before.random
        exposures = self._exposures
        exposures.values, exposures.moments, exposures.steps = before.exposure
        self._history = list(before.history)

    def result(self) -> TrainingResult:
        """The splats and how good they are."""
        cloud = self._rows().to_cloud()
        self._history.append(self._moment(None))
        lens = self._exposures.lens() if self._options.exposure else None
        scores = tuple(
            score_photo(self._renderer, cloud, self._photos.photo(view), self._drawing, lens=lens)
            for view in self._photos.held_out
        )
        return TrainingResult(
            cloud, scores, tuple(self._history), BUILT_IN_VERSION, self._floating(cloud)
        )

    def _floating(self, cloud: SplatCloud) -> float | None:
        """Share of the splats that are not where the views see surfaces; None if they see none."""
        if not self._surfaces or not len(cloud):
            return None
        verdict = judge(cloud.means, self._surfaces)
        return float((verdict.is_stray | verdict.offset.any(axis=1)).mean())

    def _moment(self, quality: float | None) -> Moment:
        return Moment(self.iteration, self.seconds, self._splats, self._loss, quality)

    def _rows(self) -> TrainingRows:
        return TrainingRows(*self._trainee.arrays())

    def _take(self, rows: TrainingRows) -> None:
        self._splats = len(rows)
        self._width = SH.start + 3 * rows.sh_count
        self._trainee = Trainee((rows.values, rows.first, rows.second, rows.steps, rows.error))


def _describe(options: TrainingOptions, reconstruction: Reconstruction) -> str:
    """Describe what is trained and how; the end may be moved without starting again."""
    names = ",".join(view.name for view in reconstruction.views)
    poses = sum(float(view.world_from_camera.matrix().sum()) for view in reconstruction.views)
    return (
        f"{BUILT_IN_VERSION}; budget {options.budget}, degree {options.sh_degree}, "
        f"held out {options.held_out_every}, exposure {options.exposure}, "
        f"longest side {options.longest_px} px, stereo {options.stereo_px} px, "
        f"background {options.background}; {len(reconstruction.points)} points; "
        f"poses {poses!r}; {names}"
    )
