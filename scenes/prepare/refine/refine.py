"""Splats of a region, trained further on crops of the photos that show it; all others stand still.

The region's splats are split where the error is, up to one for a few pixels of the photo that shows
most of it, and are put on one surface again and again (`surface.py`). The room around them is drawn
as it is: an infinite second moment leaves Adam's steps without length.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from scenes.prepare.cells import nearest
from scenes.prepare.progress import Progress, silent
from scenes.prepare.reconstruction import View
from scenes.prepare.refine.crops import MIN_CROPS, Crop, crops_of
from scenes.prepare.refine.surface import SurfaceTerms, put_on_surface
from scenes.prepare.train.held_out import draw_photo
from scenes.prepare.train.optimiser import schedule
from scenes.prepare.train.optimiser.densify import densify, morton_order
from scenes.prepare.train.optimiser.rows import LOGIT, MEAN, SH, TrainingRows, joined, rows_of_cloud
from scenes.prepare.train.training_photos import Photo
from scenes.render.gradients import record
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.render.training import FARTHEST, DepthBounds, Exposure, Trainee
from scenes.splats import SH_C0, SplatCloud, concatenate

BoolArray = NDArray[np.bool_]

HELD_OUT_EVERY = 8
"""Of the photos one is kept aside, the same that the room's training keeps aside."""
MIN_SPLATS, MAX_SPLATS = 3_000, 10_000
"""Splats that a region is split into, at least and at most: fewer blur print, more take longer."""
PX_PER_SPLAT = 5
"""Pixels of the photo that shows most of the region for each of its splats."""
TERMS_EVERY = 20
"""Steps between two times that splats are split and put on the surface: the quickest that the
room's own training densifies, too."""
BEGIN_AT = 0.15
"""Share of the room's schedule at which a refinement begins: splats have found their places, and
pictures are of full size from there on."""
LAYER_PRICE = schedule.DEPTH_PRICE
"""Of light off the depth that is drawn; as the room's training charges it off stereo's depth."""
LAYER_SLACK = 0.004
"""Share of its depth by which a splat's centre may lie off the depth that is drawn: about what a
splat of 1 cm on a slope does at 2 m."""
LAYER_EVERY = 100
"""Steps between two drawings of the depth that splats are held to."""
SURFACE_FROM = 0.2
"""Share done from which on they are, and are put on a surface: before, they are too few to have
one."""
FADE, FADE_UNTIL = 0.3, schedule.FULL_BUDGET_AT
"""Taken off every logit each time, until that share is done: what photos need comes back at once,
what only hangs before a wall of its own colour goes (+0.4 to +2.2 dB from sides that no photo took,
six objects of three rooms)."""
SURE_ALPHA = 0.9
"""Opacity of a pixel from which on it has a depth."""
STRAY_M, STRAY_SCALES = 0.01, 3.0
"""A splat farther than this, plus so many deviations of the splat that was nearest before, from all
that the region was is none of it: it paints what lies behind."""
HIDDEN_PX = 0.5
"""Blend weight in all crops, pixels, below which no photo shows a splat."""


@dataclass(frozen=True, slots=True)
class RefineOptions:
    """How long, and what holds splats to a surface.

    Attributes:
        steps: of training; 400 already bring most of the gain.
        terms: how strongly splats are put on one surface.
        layer_price: of light off the depth that is drawn; 0 takes any depth.
        threads: worker threads; 0 means one per core. Never changes the result.

    Raises:
        ValueError: a number is out of range.
    """

    steps: int = 800
    terms: SurfaceTerms = field(default_factory=SurfaceTerms)
    layer_price: float = LAYER_PRICE
    threads: int = 0

    def __post_init__(self) -> None:
        if self.steps < 1:
            raise ValueError(f"RefineOptions.steps: {self.steps}, wanted at least 1")
        if not (math.isfinite(self.layer_price) and self.layer_price >= 0):
            raise ValueError(f"RefineOptions.layer_price: {self.layer_price}, wanted 0 or more")
        if self.threads < 0:
            raise ValueError(f"RefineOptions.threads: {self.threads}, wanted 0 or more")


@dataclass(frozen=True, slots=True, eq=False)
class Refined:
    """Splats of a region, refined.

    Attributes:
        splats: in the room's world; those that were given if photos kept aside show that they
            were better.
        photos: that were trained on.
        before_db: PSNR of the region in photos kept aside before; nan if none of them shows it.
        after_db: and with the splats that training ended with.
    """

    splats: SplatCloud
    photos: int
    before_db: float
    after_db: float

    @property
    def is_better(self) -> bool:
        """Whether the splats are new ones."""
        return not self.after_db < self.before_db

    def summary(self) -> str:
        """In words, for a scene's history."""
        words = f"{len(self.splats)} splats of {self.photos} photos"
        if math.isnan(self.after_db):
            return words
        gain = f"{self.before_db:.1f} -> {self.after_db:.1f} dB on photos kept aside"
        return f"{words}, {gain}" if self.is_better else f"{words}, kept as they were: {gain}"


def refine(
    room: SplatCloud,
    is_region: BoolArray,
    *,
    views: Sequence[View],
    options: RefineOptions,
    rng: np.random.Generator,
    progress: Progress = silent,
) -> Refined:
    """Train the splats of a region further; the others are only drawn.

    Args:
        room: world frame; left as it is.
        is_region: (N,) bool.
        views: photos of the room, in the order of its preparation.
        options: how long, and what holds splats to a surface.
        rng: draws photos and splats.
        progress: called with the share done.

    Raises:
        ValueError: the region is empty, too few photos show it, or a photo is missing.
        Cancelled: as raised by `progress`.
    """
    if is_region.shape != (len(room),):
        raise ValueError(f"refine: a mask of {is_region.shape}, wanted ({len(room)},)")
    if not is_region.any():
        raise ValueError("refine: no splat is in the region; choose a place on a surface")
    renderer, drawing = NativeRenderer(), RenderOptions(threads=options.threads)
    progress(0.0, "photos")
    crops = crops_of(room, is_region, views=views, renderer=renderer, options=drawing)
    aside = {view.name for view in views[HELD_OUT_EVERY - 1 :: HELD_OUT_EVERY]}
    shown = [crop for crop in crops if crop.name not in aside]
    if len(shown) < MIN_CROPS:
        raise ValueError(
            f"refine: {len(shown)} of {len(views)} photos show this region, wanted at least "
            f"{MIN_CROPS}; choose one that photos show, or film it from nearer"
        )
    run = _Run(room, is_region, crops=shown, options=options, rng=rng)
    while run.done < 1:
        run.step()
        if run.iteration % TERMS_EVERY == 0:
            progress(run.done, f"step {run.iteration:,}, {run.count:,} splats")
    before, after = room.select(is_region), run.result()
    judges = [crop for crop in crops if crop.name in aside]
    before_db, after_db = (run.quality_db(splats, judges) for splats in (before, after))
    is_worse = after_db < before_db
    return Refined(before if is_worse else after, len(shown), before_db, after_db)


class _Run:
    """One refinement under way."""

    def __init__(
        self,
        room: SplatCloud,
        is_region: BoolArray,
        *,
        crops: Sequence[Crop],
        options: RefineOptions,
        rng: np.random.Generator,
    ) -> None:
        self.iteration = 0
        self._options, self._rng, self._crops = options, rng, crops
        self._renderer = NativeRenderer()
        self._drawing = RenderOptions(threads=options.threads)
        region = room.select(is_region)
        self._around = room.select(_in_crops(room, crops) & ~is_region)
        self._still = _standing_still(self._around, room.sh.shape[1])
        self._targets = [crop.target() for crop in crops]
        self._distance = _distance(region, crops)
        self._before = region.means
        self._reach = STRAY_M + STRAY_SCALES * region.scales.max(axis=1)
        most_px = max(crop.shown_px for crop in crops)
        wanted = int(np.clip(most_px // PX_PER_SPLAT, MIN_SPLATS, MAX_SPLATS))
        self._first, self._budget = len(region), max(wanted, len(region))
        self._queue: list[int] = []
        self._take(rows_of_cloud(region, room.sh.shape[1]))

    @property
    def done(self) -> float:
        """0..1."""
        return self.iteration / self._options.steps

    def step(self) -> None:
        """Draw one crop and move the region's splats that it shows."""
        done, options = self.done, self._options
        if not self._queue:
            self._queue = self._rng.permutation(len(self._crops)).tolist()
        place = self._queue.pop()
        at = BEGIN_AT + (1 - BEGIN_AT) * done
        rates = schedule.rates(at, self._distance, self._width)
        self._trainee.step(
            self._targets[place], rates, Exposure(), self._drawing, options.layer_price
        )
        self.iteration += 1
        if self.iteration % TERMS_EVERY == 0:
            self._mend(done)
        if options.layer_price and done >= SURFACE_FROM and self.iteration % LAYER_EVERY == 0:
            self._bound()

    def result(self) -> SplatCloud:
        """The region's splats that photos show."""
        rows = self._rows()
        put_on_surface(rows.values, self._options.terms)
        cloud = rows.to_cloud()
        sound = np.isfinite(rows.values).all(axis=1) & ~self._is_stray(rows)
        shown = self._weights_px(cloud) >= HIDDEN_PX
        return cloud.select(sound & shown) if (sound & shown).any() else cloud.select(sound)

    def quality_db(self, splats: SplatCloud, crops: Sequence[Crop]) -> float:
        """PSNR of the region in crops; nan without any."""
        cloud = concatenate([splats, self._around])
        errors: list[float] = []
        for crop in crops:
            photo = Photo(crop.name, crop.photo, crop.camera, crop.world_from_camera)
            drawn = draw_photo(self._renderer, cloud, photo, self._drawing)
            errors.append(float(((drawn - photo.colours) ** 2)[crop.near].mean()))
        return -10 * math.log10(max(float(np.mean(errors)), 1e-9)) if errors else math.nan

    def _mend(self, done: float) -> None:
        """Drop strays, split where the error is, put on the surface."""
        rows = self._rows()
        if done < FADE_UNTIL:
            rows.values[:, LOGIT] -= np.float32(FADE)
        if done < schedule.DENSIFY_UNTIL:
            rows = rows.select(~self._is_stray(rows))
            wanted = schedule.splats_wanted(done, self._first, self._budget)
            rows = densify(rows, wanted, self._rng)
            rows = rows.select(morton_order(rows.values[:, MEAN]))
        if done >= SURFACE_FROM:
            put_on_surface(rows.values, self._options.terms)
        self._take(rows)

    def _bound(self) -> None:
        """Hold splats to the depth that each crop shows of them all."""
        cloud = TrainingRows(*self._trainee.arrays()).to_cloud()
        for place, crop in enumerate(self._crops):
            drawn = self._renderer.render(
                [PosedSplats(cloud, Pose.identity())],
                crop.camera,
                crop.world_from_camera,
                self._drawing,
            )
            sure = drawn.alpha > SURE_ALPHA
            near = np.where(sure, drawn.depth * (1 - LAYER_SLACK), 0.0)
            far = np.where(sure, drawn.depth * (1 + LAYER_SLACK), FARTHEST)
            bounds = DepthBounds(near.astype(np.float32), far.astype(np.float32))
            self._targets[place] = crop.target(bounds)

    def _is_stray(self, rows: TrainingRows) -> BoolArray:
        means = np.nan_to_num(rows.values[:, MEAN].astype(np.float64))
        away, which = nearest(means, self._before)
        return np.asarray(away[:, 0] > self._reach[which[:, 0]], dtype=np.bool_)

    def _weights_px(self, cloud: SplatCloud) -> NDArray[np.float64]:
        """(N,) blend weight of each splat in all crops, pixels."""
        both = concatenate([cloud, self._around])
        plain = SplatCloud(
            both.means,
            both.scales,
            both.rotations,
            both.opacities,
            np.zeros((len(both), 1, 3), np.float32),
        )
        total = np.zeros(len(cloud))
        for crop in self._crops:
            posed = [PosedSplats(plain, Pose.identity())]
            recording = record(
                self._renderer, posed, crop.camera, crop.world_from_camera, self._drawing
            )
            d_rgb = np.zeros((*crop.near.shape, 3), np.float32)
            d_rgb[..., 0] = 1.0
            slope = recording.gradients(d_rgb).objects[0].sh[: len(cloud), 0, 0]
            total += slope.astype(np.float64) / SH_C0
        return total

    def _rows(self) -> TrainingRows:
        return TrainingRows(*self._trainee.arrays()).select(np.arange(self.count))

    def _take(self, rows: TrainingRows) -> None:
        self.count = len(rows)
        self._width = SH.start + 3 * rows.sh_count
        both = joined([rows, self._still])
        self._trainee = Trainee((both.values, both.first, both.second, both.steps, both.error))


def _standing_still(cloud: SplatCloud, sh_count: int) -> TrainingRows:
    """Rows that no step of Adam moves."""
    rows = rows_of_cloud(cloud, sh_count)
    rows = rows.select(morton_order(rows.values[:, MEAN])) if len(rows) else rows
    rows.second[:] = np.inf
    return rows


def _distance(region: SplatCloud, crops: Sequence[Crop]) -> float:
    """Median distance of the region from where it was photographed."""
    middle = region.means.mean(axis=0, dtype=np.float64)
    eyes = np.stack([crop.world_from_camera.translation for crop in crops])
    return float(np.median(np.linalg.norm(eyes - middle, axis=1)))


def _in_crops(room: SplatCloud, crops: Sequence[Crop]) -> BoolArray:
    """(N,) bool, splats that some crop may show: within three deviations of its frame."""
    means = room.means.astype(np.float64)
    size = 3.0 * room.scales.max(axis=1).astype(np.float64)
    seen = np.zeros(len(room), dtype=np.bool_)
    for crop in crops:
        camera = crop.camera
        in_camera = crop.world_from_camera.inverse() @ means
        corners = np.array(
            [[x, y] for x in (0.0, camera.width_px) for y in (0.0, camera.height_px)]
        )
        rays = camera.unproject(corners)
        axis = rays.mean(axis=0) / np.linalg.norm(rays.mean(axis=0))
        spread = np.arccos(np.clip((rays @ axis) / np.linalg.norm(rays, axis=1), -1, 1)).max()
        distance = np.maximum(np.linalg.norm(in_camera, axis=1), 1e-9)
        off = np.arccos(np.clip(in_camera @ axis / distance, -1, 1))
        seen |= off < spread + np.arctan2(size, distance)
    return seen
