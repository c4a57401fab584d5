"""Finds objects that are not where they were: after they were lost, or moved between sessions.

Places are proposed where the live picture differs from the empty room in the object's colours,
compared with small pictures of all its yaws, and the best few are refined. Which object then gets
which place is decided for all that are looked for together (paper 4.4.2 "recovery between
sessions", done here without asking the user to select the objects again).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye
from scenes.pose import Pose, wrap_angle
from tracking.background import expose
from tracking.colours import BINS
from tracking.evidence import Evidence, Neighbour, Scene, gather, view_of
from tracking.explain import explained, resemblances
from tracking.kernels import KERNELS
from tracking.metrics import ROUND
from tracking.model import TrackModel
from tracking.observe import CONTOUR_CORRELATION, FOREIGN
from tracking.pictures import resized
from tracking.sketch import sketched
from tracking.smooth import pose_vector
from tracking.solve import Fit, Prior, judge, solve
from tracking.templates import YAWS, Cuts, compare, cut_out

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

SEARCH_SIZE_PX = 720
"""Lens pictures are shrunk to about this side for the proposals."""

FAINT, PLAIN = 0.07, 0.22
"""Distances of colours, of 0..1 channels: below the first a place may be relit, above it is not."""

LEAST_STEP_M = 0.06
STEP = 0.25
"""Places are tried this far apart, in radii of the object."""

REACH_M = 4.5
PLACES = 160
PLACES_NEARER = 32
PLACES_SMALL, YAWS_SMALL = 24, 12
REFINED = 10
REFINED_TURNED = 4
"""How many places are compared with all yaws, looked at more closely, and refined; how many yaws of
an object whose place is known."""

STARTS_A_PLACE = 3
"""At most so many yaws of one place are refined: there may be better places."""

NEARER = np.arange(-2, 3) * 0.2
"""Steps around a place of those that are looked at more closely, in radii."""

LEAST_DENSITY = 0.08
"""A place is proposed if at least this share of its box looks like the object."""

TEXTURED_SHARE = 0.6
PLAIN_SHARE = 0.5
"""How much of a yaw's score is likeness of colours, the rest being overlap."""

APART = 0.3
APART_RAD = math.radians(20)
"""Poses farther apart than this, in radii of the object or in yaw, are different ones."""

START_REACHES = (10.0, 5.0, 2.5)
"""Search distances in pixels from a start: templates find a place to a tenth of an object."""

START_SIGMA = (0.25, 0.25, 0.003, 0.6)
"""How far off a pose may be before it is refined: metres and radians."""

GOOD_SUPPORT, GOOD_VISIBLE = 0.8, 0.9
"""Wrong yaws reach three quarters."""

SMALL_M = 0.25
SMALL_PX = 40.0
SMALL_SIGMA = (0.01, 0.01, 0.003, 0.05)
"""Objects of a smaller radius are placed by their colours; how well: metres and radians."""

ACCEPTED_SMALL = 0.1
RECOGNISED_SMALL = 0.12
SMALL_QUALITY_SIGMA = 0.03
CLEAR_SIGMAS = 1.5
"""A pose must be better than another by this many standard deviations of a quality."""

ACCEPTED_AGREEMENT = 0.35
ACCEPTED_QUALITY = 0.3
ACCEPTED_LIKENESS = 0.25
"""What a refined pose must reach to be a guess."""


@dataclass(frozen=True, slots=True, eq=False)
class Guess:
    """Where an object may be.

    Attributes:
        fit: the pose and what its outline says.
        explained: of a small object, how much it resembles the picture there, at most 1.
    """

    fit: Fit
    explained: float | None

    @property
    def world_from_object(self) -> Pose:
        """Of the fit."""
        return self.fit.world_from_object

    @property
    def quality(self) -> float:
        """0..1: ranks guesses of one object."""
        if self.explained is None:
            return self.fit.quality
        return max(self.explained, 0.0)

    @property
    def quality_sigma(self) -> float:
        """Standard deviation of the quality.

        It is about a share of the contour, of which neighbouring points count as one.
        """
        if self.explained is not None:
            return SMALL_QUALITY_SIGMA
        count = max(len(self.fit.sketch.contour) / CONTOUR_CORRELATION, 1.0)
        share = min(max(self.quality, 0.1), 0.9)
        return math.sqrt(share * (1.0 - share) / count)

    def is_clearly_better(self, other: Guess) -> bool:
        """Whether this guess's quality is higher than can be by chance."""
        margin = CLEAR_SIGMAS * math.hypot(self.quality_sigma, other.quality_sigma)
        return self.quality > other.quality + margin


@dataclass(frozen=True, slots=True, eq=False)
class Overview:
    """Small lens pictures compared with the empty room, shared by all searches of a frame.

    Attributes:
        cameras: shrunk lenses.
        images: (H, W, 3) float32 0..1 shrunk live pictures.
        foreground: (H, W) float32 per lens.
    """

    cameras: tuple[Fisheye, ...]
    images: tuple[FloatArray, ...]
    foreground: tuple[FloatArray, ...]


def overview(scene: Scene) -> Overview:
    """Shrink a frame and compare it with the empty room."""
    cameras, images, foregrounds = [], [], []
    for index, lens in enumerate(scene.frame.rig.lenses):
        shrink = max(1, round(lens.width_px / SEARCH_SIZE_PX))
        width, height = lens.width_px // shrink, lens.height_px // shrink
        part = (slice(0, height * shrink), slice(0, width * shrink))
        live, foreground, _, _ = KERNELS.change(
            np.ascontiguousarray(scene.frame.images[index][part]),
            np.ascontiguousarray(scene.plates.images[index][part]),
            np.ascontiguousarray(scene.plates.noise[index][part]),
            lens_size=(lens.width_px, lens.height_px),
            window=(0, 0, width, height),
            shrink=shrink,
            exposure=scene.exposures[index].rows(),
            layers=[],
            table=np.ones((BINS, BINS, BINS), np.float32),
        )
        camera = lens.resized(width, height)
        x = ((np.arange(width) + 0.5 - camera.cx) / width).astype(np.float32)
        y = ((np.arange(height) + 0.5 - camera.cy) / height).astype(np.float32)
        radius2 = np.asarray(x[None, :] ** 2 + y[:, None] ** 2, dtype=np.float32)
        seen = radius2 <= (lens.circle_px / lens.width_px) ** 2
        live = live.reshape(height, width, 3)
        plate = resized(scene.plates.images[index][part], (width, height))
        expected = expose(plate, scene.exposures[index], radius2=4.0 * radius2)
        apart = np.linalg.norm(live - expected, axis=2)
        clear = np.clip((apart - FAINT) / (PLAIN - FAINT), 0.0, 1.0)
        cameras.append(camera)
        images.append(live)
        foregrounds.append((foreground.reshape(height, width) * clear * seen).astype(np.float32))
    return Overview(tuple(cameras), tuple(images), tuple(foregrounds))


def candidates(
    scene: Scene,
    look: Overview,
    model: TrackModel,
    neighbours: Sequence[Neighbour],
    *,
    supports_m: Sequence[float],
    last: Points,
    enough: int,
    reach_m: float = REACH_M,
) -> list[Guess]:
    """Poses an object may have anywhere on the given heights, the best first.

    Args:
        scene: the frame.
        look: its overview.
        model: the object.
        neighbours: other objects, whose places are taken.
        supports_m: heights of the planes it may stand on.
        last: (3,) where it was seen last; tried as well.
        enough: the search ends with so many poses that leave no doubt.
        reach_m: how far from the camera to search.
    """
    pictures = [
        _claimed(scene, look, index, model, neighbours) for index in range(len(look.cameras))
    ]
    places = np.concatenate(
        [
            _on_support(last, supports_m)[None],
            proposed(scene, look, model, pictures, supports_m=supports_m, reach_m=reach_m),
        ]
    )
    places = places[scene.stands.hold(places)]
    _, scores = _scored(scene, look, model, pictures, places)
    chosen = places[np.argsort(-scores.max(axis=1), kind="stable")[:PLACES_NEARER]]
    nearer = (chosen[:, None] + _around(model)).reshape(-1, 3)
    nearer = nearer[scene.stands.hold(nearer)]
    yaws, scores = _scored(scene, look, model, pictures, nearer)
    starts = (
        (start, gather(scene, model, view_of(scene, model, start), neighbours))
        for start in _distinct_starts(model, nearer, yaws, scores, limit=REFINED)
    )
    if model.radius_m < SMALL_M:
        places = _spread_out(nearer, scores.max(axis=1), apart=model.radius_m, limit=PLACES_SMALL)
        starts = _small_starts(scene, model, neighbours, places)
    guesses: list[Guess] = []
    for start, evidence in starts:
        guesses.append(_refined(scene, model, start, evidence))
        if len(_distinct(model, [g for g in guesses if leaves_no_doubt(g.fit)])) >= enough:
            break
    accepted = [g for g in guesses if _is_acceptable(g) and _can_be(scene, g.world_from_object)]
    return _distinct(model, accepted)


def _small_starts(
    scene: Scene, model: TrackModel, neighbours: Sequence[Neighbour], places: Points
) -> list[tuple[Pose, Evidence]]:
    """Poses at some places that look most like the picture, with their windows, the best first."""
    found: list[tuple[float, Pose, Evidence]] = []
    for place in places:
        poses = [Pose.from_yaw(2 * math.pi * k / YAWS_SMALL, place) for k in range(YAWS_SMALL)]
        evidence = gather(scene, model, view_of(scene, model, poses[0]), neighbours)
        alike = resemblances(scene, model, evidence, poses)
        peaks = np.flatnonzero((alike >= np.roll(alike, 1)) & (alike > np.roll(alike, -1)))
        best = peaks[np.argsort(-alike[peaks], kind="stable")][:STARTS_A_PLACE]
        found += [(float(alike[k]), poses[k], evidence) for k in best]
    found.sort(key=lambda item: -item[0])
    return [(pose, evidence) for _, pose, evidence in found[:REFINED]]


def turned(
    scene: Scene, model: TrackModel, evidence: Evidence, world_from_belief: Pose
) -> list[Guess]:
    """Poses of an object about where it is believed to be, at whatever yaw, the best first.

    That of a small object is among them, as its colours have it.
    """
    free = np.maximum(evidence.foreground, evidence.hidden)
    own = evidence.own * (1.0 - evidence.hidden)
    picture = np.dstack([evidence.live, own, free]).astype(np.float32)
    places = world_from_belief.translation + _around(model)
    centres = places + model.centre_m
    camera, pose = evidence.camera, evidence.world_from_camera
    cuts = cut_out(picture, camera, pose, centres, model.radius_m)
    yaws = np.arange(YAWS) * (2 * math.pi / YAWS) + cuts.azimuth_rad[:, None]
    starts = _distinct_starts(
        model, places, yaws, _template_scores(cuts, model), limit=REFINED_TURNED
    )
    if _is_small(model, evidence):
        starts.insert(0, world_from_belief)
    guesses = [_refined(scene, model, start, evidence) for start in starts]
    return _distinct(model, [g for g in guesses if scene.holds(g.world_from_object)])


def _around(model: TrackModel) -> Points:
    """(N, 3) steps to the places around a place that are looked at more closely."""
    x, y = np.meshgrid(NEARER, NEARER)
    steps = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    return np.asarray(model.radius_m * steps, dtype=np.float64)


def _distinct(model: TrackModel, guesses: Sequence[Guess]) -> list[Guess]:
    """The best of those that say the same, the best first."""
    distinct: list[Guess] = []
    for guess in sorted(guesses, key=lambda guess: -guess.quality):
        pose = guess.world_from_object
        if all(is_other(model, pose, other.world_from_object) for other in distinct):
            distinct.append(guess)
    return distinct


def leaves_no_doubt(fit: Fit) -> bool:
    """Whether a pose's outline and surface are better than those of any wrong one."""
    return not fit.textured and fit.support >= GOOD_SUPPORT and fit.visible_fraction >= GOOD_VISIBLE


def is_recognised(scene: Scene, model: TrackModel, evidence: Evidence, fit: Fit) -> bool:
    """Whether what is at a pose looks like the object: outlines of small things are all alike."""
    if not _is_small(model, evidence):
        return True
    return _refined(scene, model, fit.world_from_object, evidence).quality >= RECOGNISED_SMALL


def _can_be(scene: Scene, world_from_object: Pose) -> bool:
    """Whether something at a pose is inside the room, and stands on something."""
    stands = bool(scene.stands.hold(world_from_object.translation[None])[0])
    return stands and scene.holds(world_from_object)


def _is_acceptable(guess: Guess) -> bool:
    """Whether a refined pose is worth being told."""
    fit = guess.fit
    if guess.explained is not None:
        return guess.quality >= ACCEPTED_SMALL
    alike = not fit.textured or fit.likeness >= ACCEPTED_LIKENESS
    return alike and fit.agreement >= ACCEPTED_AGREEMENT and fit.quality >= ACCEPTED_QUALITY


def is_other(model: TrackModel, world_from_a: Pose, world_from_b: Pose) -> bool:
    """Whether two poses of an object differ by more than a refinement would even out."""
    if _apart(world_from_a, world_from_b) > APART * model.radius_m:
        return True
    return _is_other_turn(model, world_from_a, world_from_b, least=APART_RAD)


def _is_other_turn(model: TrackModel, first: Pose, second: Pose, *, least: float) -> bool:
    """Whether an object looks different at two yaws that are at least so far apart."""
    turn = _turn_between(model, first, second)
    return turn > least and not model.templates.are_alike(turn)


def _turn_between(model: TrackModel, first: Pose, second: Pose) -> float:
    """Radians between two yaws, up to the turn after which the object repeats."""
    if model.symmetry == ROUND:
        return 0.0
    turn = 2 * math.pi / model.symmetry
    return abs(wrap_angle((first.yaw() - second.yaw()) * model.symmetry)) / (2 * math.pi) * turn


def _on_support(last: Points, supports_m: Sequence[float]) -> Points:
    """A place on the nearest support."""
    return np.array([last[0], last[1], min(supports_m, key=lambda z: abs(z - last[2]))])


def proposed(
    scene: Scene,
    look: Overview,
    model: TrackModel,
    pictures: Sequence[FloatArray],
    *,
    supports_m: Sequence[float],
    reach_m: float,
) -> Points:
    """(P, 3) at most `PLACES` positions whose box is full of the object's colours, best first."""
    around = scene.world_from_rig.translation[:2]
    step = max(LEAST_STEP_M, STEP * model.radius_m)
    steps = np.arange(-reach_m, reach_m + 1e-9, step)
    x, y = np.meshgrid(around[0] + steps, around[1] + steps)
    flat = np.stack([x.ravel(), y.ravel()], axis=1)
    low, high = scene.bounds_m[:, :2]
    inside = (flat > low).all(axis=1) & (flat < high).all(axis=1)
    flat = flat[inside & (np.hypot(*(flat - around).T) <= reach_m)]
    places = np.concatenate(
        [np.column_stack([flat, np.full(len(flat), z)]) for z in supports_m]
    )
    places = places[scene.stands.hold(places)]
    scores = np.full(len(places), -np.inf)
    for index, camera in enumerate(look.cameras):
        world_from_lens = scene.world_from_rig @ scene.frame.rig.rig_from_lens[index]
        own = np.ascontiguousarray(pictures[index][..., 3])
        scores = np.maximum(scores, _box_density(own, camera, world_from_lens, model, places))
    scores = np.where(scores > LEAST_DENSITY, scores, -np.inf)
    return _spread_out(places, scores, apart=0.5 * max(model.source.box_m[:2]), limit=PLACES)


def _spread_out(places: Points, scores: Points, *, apart: float, limit: int) -> Points:
    """(P, 3) at most so many of the places, the best of each neighbourhood, best first."""
    order = np.argsort(-scores, kind="stable")
    order = order[scores[order] > 0.0]
    left = places[order]
    chosen: list[Points] = []
    while len(chosen) < limit and len(left):
        chosen.append(left[0])
        left = left[((left - left[0]) ** 2).sum(axis=1) >= apart**2]
    return np.array(chosen).reshape(-1, 3)


def _scored(
    scene: Scene,
    look: Overview,
    model: TrackModel,
    pictures: Sequence[FloatArray],
    places: Points,
) -> tuple[Points, Points]:
    """(P, Y) world yaws that the templates stand for at each place, and how well each fits."""
    centres = places + model.centre_m
    poses = [scene.world_from_rig @ local for local in scene.frame.rig.rig_from_lens]
    ahead = np.stack(
        [
            (centres - pose.translation)
            / np.linalg.norm(centres - pose.translation, axis=1, keepdims=True)
            @ pose.rotation[:, 2]
            for pose in poses
        ]
    )
    lens_of_place = ahead.argmax(axis=0)
    scores, yaws = np.zeros((2, len(places), YAWS))
    for index, pose in enumerate(poses):
        chosen = lens_of_place == index
        if chosen.any():
            cuts = cut_out(
                pictures[index], look.cameras[index], pose, centres[chosen], model.radius_m
            )
            scores[chosen] = _template_scores(cuts, model)
            turns = np.arange(YAWS) * (2 * math.pi / YAWS)
            yaws[chosen] = turns + cuts.azimuth_rad[:, None]
    return yaws, scores


def _template_scores(cuts: Cuts, model: TrackModel) -> FloatArray:
    overlap, likeness = compare(cuts, model.templates)
    share = TEXTURED_SHARE if model.textured else PLAIN_SHARE
    scores = overlap * (1.0 - share + share * np.maximum(likeness, 0.0))
    return scores.astype(np.float32)


def _distinct_starts(
    model: TrackModel, places: Points, yaws: Points, scores: Points | FloatArray, *, limit: int
) -> list[Pose]:
    """The best-scored poses that differ from each other."""
    starts: list[Pose] = []
    for index in np.argsort(-scores, axis=None, kind="stable"):
        row, column = np.unravel_index(index, scores.shape)
        start = Pose.from_yaw(float(yaws[row, column]), places[row])
        if len(starts) == limit or scores[row, column] <= 0.0:
            break
        beside = [other for other in starts if _apart(start, other) < model.radius_m]
        is_new = all(_is_other_turn(model, start, other, least=1.5 * APART_RAD) for other in beside)
        if is_new and len(beside) < STARTS_A_PLACE:
            starts.append(start)
    return starts


def _apart(first: Pose, second: Pose) -> float:
    return float(np.linalg.norm(first.translation - second.translation))


def _refined(scene: Scene, model: TrackModel, start: Pose, evidence: Evidence) -> Guess:
    if _is_small(model, evidence):
        found, share = explained(scene, model, evidence, start)
        sketch = sketched(model, found, evidence, scene.renderer)
        prior = Prior(pose_vector(found), np.array(START_SIGMA))
        information = np.diag(1.0 / Prior(prior.mean, np.array(SMALL_SIGMA)).seven() ** 2)
        return Guess(judge(evidence, model, found, information, prior, sketch), share)
    prior = Prior(pose_vector(start), np.array(START_SIGMA))
    fit = solve(evidence, model, start, prior, scene.renderer, reaches_px=START_REACHES)
    return Guess(fit, None)


def _is_small(model: TrackModel, evidence: Evidence) -> bool:
    radius_px = evidence.camera.f_px * model.radius_m / evidence.view.target_range_m
    return radius_px < SMALL_PX


def _claimed(
    scene: Scene,
    look: Overview,
    index: int,
    model: TrackModel,
    neighbours: Sequence[Neighbour],
) -> FloatArray:
    """(H, W, 5) a lens picture: colours, own and all foreground; neighbours are nobody's."""
    image, foreground = look.images[index], look.foreground[index].copy()
    bytes_ = np.clip(image * 255.0 + 0.5, 0, 255).astype(np.uint8)
    own = foreground * np.clip(model.colours.likeness(bytes_) * 3.0, 0.0, 1.0)
    height, width = foreground.shape
    shrink = scene.frame.rig.lenses[index].width_px // width
    for other, world_from_object in neighbours:
        layer = scene.layers.layer(
            other.source,
            world_from_object,
            scene.frame.rig,
            scene.world_from_rig,
            scene.renderer,
            lens=index,
        )
        rows, columns = np.nonzero(layer.alpha > FOREIGN)
        rows = np.minimum((rows + layer.top) // shrink, height - 1)
        columns = np.minimum((columns + layer.left) // shrink, width - 1)
        own[rows, columns] = 0.0
        foreground[rows, columns] = 1.0
    return np.dstack([image, own, foreground]).astype(np.float32)


def _box_density(
    own: FloatArray,
    camera: Fisheye,
    world_from_lens: Pose,
    model: TrackModel,
    places: Points,
) -> Points:
    """(N,) own share inside each place's box, less that in the frame around it."""
    low, high, seen = _boxes(camera, world_from_lens, model, places)
    total = np.asarray(cv2.integral(own), dtype=np.float64)
    margin = 0.4 * (high - low)
    inside, area = _sum(total, low, high)
    outside, whole = _sum(total, low - margin, high + margin)
    ring = (outside - inside) / np.maximum(whole - area, 1.0)
    density = inside / np.maximum(area, 1.0)
    # A small box inside a large blob is full too, but so are its surroundings.
    return np.where(seen & (area >= 6), density - ring, -np.inf)


def _boxes(
    camera: Fisheye, world_from_lens: Pose, model: TrackModel, places: Points
) -> tuple[Points, Points, NDArray[np.bool_]]:
    """Picture boxes (N, 2) low and high of the object standing at each place, and whether seen."""
    x, y, z = model.source.box_m
    half = 0.42 * max(x, y)
    corners = np.array(
        [(a * half, b * half, c * z) for a in (-1, 1) for b in (-1, 1) for c in (0.0, 1.0)]
    )
    points = (places[:, None, :] + corners[None]).reshape(-1, 3)
    pixels, valid = camera.project(world_from_lens.inverse() @ points)
    pixels = pixels.reshape(len(places), 8, 2)
    seen = np.asarray(valid.reshape(len(places), 8).all(axis=1), dtype=np.bool_)
    return pixels.min(axis=1), pixels.max(axis=1), seen


def _sum(total: NDArray[np.float64], low: Points, high: Points) -> tuple[Points, Points]:
    """Sums and areas of picture boxes from an integral picture."""
    limit = np.array([total.shape[1] - 1, total.shape[0] - 1])
    a = np.clip(np.round(low), 0, limit).astype(int)
    b = np.clip(np.round(high), 0, limit).astype(int)
    value = total[b[:, 1], b[:, 0]] - total[a[:, 1], b[:, 0]]
    value = value - total[b[:, 1], a[:, 0]] + total[a[:, 1], a[:, 0]]
    return value, ((b - a).prod(axis=1)).astype(np.float64)
