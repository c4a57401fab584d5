"""Posterior odds of an object's pose in a frame, and the decisions that follow from them.

One rule for all objects and sizes: log odds, in nats. What is not seen says nothing, so nothing
that is not seen is moved.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial

from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.state import TrackState
from tracking.evidence.evidence import Evidence, gather, view_of
from tracking.evidence.observation import Observation, observe
from tracking.follow.track import Task, Track
from tracking.hypotheses.hypothesis import CLEAR_NATS, Hypothesis, is_other
from tracking.hypotheses.prior import MOVED, STAYED, stayed_log_prior
from tracking.hypotheses.refinement import CLEAR_SHARE, fit_at, refine
from tracking.hypotheses.yaws import likeliest_yaws
from tracking.likelihood.drawn_object import claim
from tracking.likelihood.pixel_model import PoseSupport
from tracking.likelihood.pose_likelihood import pose_support
from tracking.model.object_model import TrackModel
from tracking.model.symmetry import ROUND
from tracking.solve.gauss_newton import Fit

STAYS_NATS = stayed_log_prior()
"""Log odds that what was followed up to now is still there, against its being nowhere in view."""

MOVED_NATS = math.log(STAYED / MOVED)
"""Log odds by which a pose elsewhere must be likelier than the scanned one before anything was
seen."""

MIN_SAMPLES = 3.0
"""Independent samples of a silhouette below which the picture cannot decide: one says at most
`tracking.evidence.observation.MAX_MISFIT` nats, and usually one."""

SHOWN = 0.3
"""Share of what the uncovered part of an object should speak for it, from which a measurement
beside a passer-by is the object. A pushed chair of which a fifth shows has 0.33 at least, chairs
that are covered altogether 0.27 at most in one scene and more in another: with 0.5 none of those
moves, and the pushed one is held until more of it shows."""

NEAR = 0.6
"""Distance in radii of an object within which its poses are compared with the same surroundings: a
chair that was followed wrongly by its shadow stood 0.3 to 0.5 from its place."""

OPEN = 0.2
"""Share of a place up to which something unknown may hide it without anybody standing before it:
an outline of a scan that is off looks like that."""

USUAL_SHARE = 0.5
"""Share of the nats a sample that an object usually shows from which a pose accounts for it. In
random rooms true poses have 0.8 to 2.0 nats a sample, moving and still, and poses that were
followed wrongly 0.4 at most."""

AS_USUAL = 0.8
"""Share of the nats a sample that an object usually shows from which its pose is in no doubt. Of
169 times that poses beside moving objects were compared in four random rooms, another one was
clearly likelier in 17, at 0.75 of that at most; 94 showed more than 0.9. Of what left its rest in
ten random rooms, right poses showed 0.82 at least, passers-by 0.71 at most."""

MIN_RATE = 0.6
"""Nats a sample from which a pose accounts for any object: half of what a sample says that looks
like nothing around it, -ln 0.3."""

SURE_RATE = 0.96
"""Nats a sample from which a pose shows all that an object shows: four fifths of what a sample says
that looks like nothing around it. Of what was followed in the sequences of rooms 100 to 105, 94 of
100 right answers had as much, and 39 of 100 wrong ones."""

CERTAIN_NATS = 60.0
"""Nats beyond which odds make no difference: 1e26 to one."""


@dataclass(frozen=True, slots=True, eq=False)
class Belief:
    """The support of a frame's measurement and of the pose before it.

    Attributes:
        observation: the object's window.
        fit: the measurement.
        found: support of its pose.
        weigh_before: weighs the pose that the object had until now; what moves on in plain sight
            is not compared with it.
    """

    observation: Observation
    fit: Fit
    found: PoseSupport
    weigh_before: Callable[[], PoseSupport]

    @property
    def before(self) -> PoseSupport:
        """Support of the pose that the object had until now."""
        return self.weigh_before()

    @property
    def is_unseen(self) -> bool:
        """Whether too little of the object is in view, where it was and where it was measured."""
        return self.found.samples < MIN_SAMPLES and self.before.samples < MIN_SAMPLES

    @property
    def has_left(self) -> bool:
        """Whether the empty room shows where the object was, and where it was measured."""
        return self.found.nats < -STAYS_NATS and self.before.nats < -STAYS_NATS


def accounts_for(track: Track, rate: float, *, share: float = 1.0) -> bool:
    """Whether a pose with so many nats a sample accounts for an object, or for such a share."""
    return rate >= share * min(MIN_RATE, USUAL_SHARE * _usual_rate(track))


def is_sure(rate: float) -> bool:
    """Whether a pose with so many nats a sample shows all that an object shows."""
    return rate >= SURE_RATE


def shows_as_usual(track: Track, rate: float) -> bool:
    """Whether a pose with so many nats a sample shows about as much as an object usually does."""
    return rate >= AS_USUAL * _usual_rate(track)


def was_shown(track: Track) -> bool:
    """Whether an object has clearly shown in this session, where it is believed to be."""
    return track.usual_nats > CLEAR_NATS


def _usual_rate(track: Track) -> float:
    return track.usual_rate or MIN_RATE / USUAL_SHARE


def support_at(task: Task, world_from_object: Pose) -> PoseSupport:
    """The support of a pose by a window of its own in the task's frame."""
    scene, model = task.scene, task.model
    evidence = gather(scene, model, view_of(scene, model, world_from_object), task.neighbours)
    return pose_support(observe(scene, evidence), model, world_from_object, scene.renderer)


def weigh_measurement(task: Task, observation: Observation, fit: Fit) -> Belief:
    """Weigh a measurement and the pose before it by its window."""
    model, renderer = task.model, task.scene.renderer
    before, found = (
        partial(pose_support, observation, model, pose, renderer)
        for pose in (task.track.world_from_object, fit.world_from_object)
    )
    return Belief(observation, fit, found(), cache(before))


def among_near_poses(task: Task, belief: Belief) -> Belief:
    """The belief by which its pose is compared with others near it: with the same surroundings.

    Who stands before something that rests or is hidden is no shadow: that belief stays.
    """
    if task.track.state is not TrackState.TRACKED:
        return belief
    model, pose, renderer = task.model, belief.fit.world_from_object, task.scene.renderer
    observation = near(belief.observation, model, world_from_object=pose, renderer=renderer)
    found = pose_support(observation, model, pose, renderer)
    return Belief(observation, belief.fit, found, belief.weigh_before)


def near(
    observation: Observation,
    model: TrackModel,
    *,
    world_from_object: Pose,
    renderer: NativeRenderer,
) -> Observation:
    """The observation in which poses near one are compared.

    What is beside one of two poses is a part of the object at the other, and its shadow, which may
    pass for something unknown that goes on over it, is the room's.
    """
    return claim(
        observation.shadowed(),
        model,
        world_from_object=world_from_object,
        renderer=renderer,
        reach_m=NEAR * model.radius_m,
    )


def is_at_rest_still(task: Task, belief: Belief, *, is_doubtful: bool) -> bool:
    """Whether a resting object is likelier to be where it was than where it was measured.

    A move where nothing has changed, or that does not account for it, needs clear odds.

    Args:
        task: the object, at rest until now.
        belief: its measurement.
        is_doubtful: whether the move needs clear odds anyway.
    """
    has_changed = belief.before.nats + CLEAR_NATS < task.track.usual_nats
    is_explained = has_changed and accounts_for_change(task, belief)
    margin = CLEAR_NATS if is_doubtful or not is_explained else 0.0
    if not is_explained:
        # What a model is off by has a share of its nats, and the more pixels the more of them.
        margin = max(margin, CLEAR_SHARE * belief.found.nats)
    return belief.before.nats + margin >= belief.found.nats


def accounts_for_change(task: Task, belief: Belief) -> bool:
    """Whether a move of a resting object explains at least half of what its place lost.

    Where even the measured pose speaks much less for the object than its place did, something is in
    front of it: a passer-by in its colours may resemble it more than what is left to be seen of it.
    """
    lost_nats = task.track.usual_nats - belief.before.nats
    return belief.found.nats >= belief.before.nats + 0.5 * lost_nats


def is_shaken(track: Track, belief: Belief) -> bool:
    """Whether a resting object's place speaks clearly less for it than when it came to rest.

    It was turned on the spot: its yaw has to be compared with others. What a passer-by covers is
    not expected to speak for it.
    """
    open_share = 1.0 - belief.before.unknown_fraction
    return belief.before.nats < open_share * track.usual_nats - CLEAR_NATS


def is_on_a_passer_by(track: Track, belief: Belief) -> bool:
    """Whether a measurement shows too little of what is not covered there.

    Something unknown is in front of where the object was, and resembles it a little.
    """
    open_share = 1.0 - belief.found.unknown_fraction
    shows_enough = belief.found.nats >= SHOWN * open_share * track.usual_nats
    return not shows_enough and belief.before.unknown_fraction >= OPEN


def is_followed(track: Track, belief: Belief) -> bool:
    """Whether the measurement of an object that may move is to be followed.

    What shows at least half of what it showed before is followed; what shows less is hidden, or its
    prediction went astray, and has to be recognised.
    """
    if is_on_a_passer_by(track, belief):
        return False
    needed = min(CLEAR_NATS, 0.5 * track.usual_nats) if track.missed_frames == 0 else CLEAR_NATS
    return belief.found.nats > max(needed, 0.0)


def at_first(task: Task, evidence: Evidence, belief: Belief) -> Belief | None:
    """The belief about an object in a session's first frame; None if it has to be searched for.

    Args:
        task: the object, believed at the scene's pose.
        evidence: its window.
        belief: the measurement from that pose.
    """
    if belief.is_unseen:
        return belief
    needed = belief.before.nats + MOVED_NATS
    if belief.found.nats < needed:
        belief = at_pose(task, evidence, belief, task.track.world_from_object)
    if belief.found.nats < CLEAR_NATS:
        # Half hidden or hardly seen: neither there nor gone.
        return None if belief.has_left else belief
    if task.model.symmetry != ROUND:
        for start in likeliest_yaws(task.model, evidence, belief.fit.world_from_object):
            if not is_other(task.model, start, belief.fit.world_from_object):
                continue
            other = refine(task.scene, task.model, start, evidence, belief.observation)
            if other.support.nats > belief.found.nats + MOVED_NATS and is_other(
                task.model, other.world_from_object, belief.fit.world_from_object
            ):
                return None
    return belief


def at_pose(task: Task, evidence: Evidence, belief: Belief, world_from_object: Pose) -> Belief:
    """The belief with the measurement replaced by a pose that is believed instead."""
    fit = fit_at(task.scene, task.model, evidence, world_from_object)
    support = pose_support(belief.observation, task.model, world_from_object, task.scene.renderer)
    return Belief(belief.observation, fit, support, belief.weigh_before)


def confidence_of(
    support: PoseSupport, rival_nats: float, *, stays_nats: float = STAYS_NATS
) -> float:
    """Posterior, 0..1, of a followed pose against its likeliest rival and being out of sight.

    Args:
        support: of the pose.
        rival_nats: log odds of the pose against its rival when they were last compared.
        stays_nats: log odds of the pose against being out of sight before the picture.
    """
    return 1.0 / (1.0 + _odds_against(support.nats + stays_nats) + _odds_against(rival_nats))


def _odds_against(nats: float) -> float:
    """Odds against what some nats speak for, certain beyond `CERTAIN_NATS` either way."""
    return math.exp(-min(max(nats, -CERTAIN_NATS), CERTAIN_NATS))


def hypothesis_of(belief: Belief) -> Hypothesis:
    """The measurement as one hypothesis among others."""
    return Hypothesis(belief.fit, belief.found)
