"""Tracked state of one object between frames, and its task in one frame."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from devices.messages import Frame
from scenes.pose import Pose
from scenes.state import TrackedObject, TrackState
from tracking.evidence.appearance_memory import AppearanceMemory
from tracking.evidence.evidence import Evidence, Neighbour, Scene
from tracking.evidence.observation import Observation
from tracking.evidence.rendering import ReducedRendering
from tracking.hypotheses.budget import NOMINAL_COSTS, StepCosts
from tracking.hypotheses.hypothesis import CLEAR_NATS, Hypothesis
from tracking.hypotheses.prior import stayed_log_prior
from tracking.likelihood.pixel_model import PoseSupport
from tracking.model.object_model import TrackModel
from tracking.solve.gauss_newton import SILHOUETTE_BIAS_M, SILHOUETTE_BIAS_SIGMA_M, Fit
from tracking.solve.motion import Motion

FloatArray = NDArray[np.float32]

RESTING_FRAMES = 6
"""Still frames after which an object is at rest. Chosen on the rooms lab and desk."""


SEARCH_PERIOD_NS = 800_000_000
"""Least time in ns between two searches for the same object. Chosen on the rooms lab and desk."""


@dataclass(frozen=True, slots=True, eq=False)
class Rest:
    """Patch colours of a resting object, which show cheaply whether anything changed.

    Attributes:
        lens: index of the lens.
        corners: (N, 2) int64 left and top of the patches in the lens picture.
        colours: (N, 3) float32 mean of each when the pose was last confirmed.
        inside: number of patches, the first ones, on the object; the others lie around it.
    """

    lens: int
    corners: NDArray[np.int64]
    colours: FloatArray
    inside: int


@dataclass(frozen=True, slots=True, eq=False)
class PendingReview:
    """A yaw review in progress: other yaws are refined in the frame in which it began.

    Attributes:
        scene: that frame.
        evidence: the object's window there.
        observation: of the same window.
        fit: the reviewed fit there.
        support: of that fit's pose.
        done: results of its steps so far, see `tracking.hypotheses.budget`.
    """

    scene: Scene
    evidence: Evidence
    observation: Observation
    fit: Fit
    support: PoseSupport
    done: tuple[object, ...]


@dataclass(frozen=True, slots=True)
class Review:
    """The last comparison of an object's yaw with all others.

    Attributes:
        t_ns: frame time at which it was last worked on.
        in_vain: consecutive reviews that changed nothing.
        rival_nats: log odds of the pose against the likeliest other yaw; inf without one, 0 while
            they are compared.
        known_nats: the same after the last comparison that was finished.
        pending: the rest of it; None once it is done.
    """

    t_ns: int
    in_vain: int
    rival_nats: float
    known_nats: float
    pending: PendingReview | None = None

    @property
    def is_clear(self) -> bool:
        """Whether no other yaw was about as likely."""
        return self.rival_nats > CLEAR_NATS


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """The state of one object between frames.

    Attributes:
        world_from_object: latest pose.
        motion: its velocity.
        state: see `TrackState`.
        covariance: (4, 4) of x, y, z (m) and yaw (rad).
        visible_fraction: 0..1.
        confidence: 0..1.
        usual_inlier_ratio: recent `Fit.unoccluded_inlier_ratio`; 0 before the first.
        usual_correlation: recent `Fit.colour_correlation`; 0 before the first.
        usual_nats: support of its pose when it last came to rest, unoccluded at best; 0 before.
        initial_correlation: colour correlation at the pose of the scan, when it was first
            recognised there; 1 if not measured.
        silhouette_bias_m: learned distance of the rendered silhouette outside the real one.
        silhouette_bias_sigma_m: standard deviation of that.
        was_at_rest: whether it was at rest when it was last seen.
        still_frames: consecutive frames with a step below `RESTING_STEP_M`.
        missed_frames: consecutive frames without an accepted measurement.
        usual_rate: `nats_a_sample` where it was last known; 0 before.
        rate: the same of its pose in this frame.
        world_from_known: latest pose that accounts for what is to be seen of it.
        known_ns: frame time of that.
        known_motion: its velocity then.
        sure_ns: frame time at which it last showed all that an object shows.
        rest: how it looks at rest; None while it is not known to rest.
        reduced: its last reduced rendering; None before.
        appearance: its appearance where it last rested unoccluded; None before.
        world_from_stood: the pose at which it last rested in plain sight; None before.
        stays_nats: log odds that it is where it is believed, against being nowhere in view, before
            a picture; until it is seen, by how many other objects are where the scan has them.
        seen_ns: frame time of the last accepted measurement.
        missing_ns: frame time of the first without one after one in which it was known; of what
            has never clearly shown, the latest in which nothing moved around its place.
        around: what has never clearly shown: its surroundings in the last frame, in patches.
        compared_ns: frame time at which its pose was last compared with those beside it.
        looked_ns: frame time of the last search around its last place; when it was seen, before.
        searched_ns: frame time of the last search over the whole scene.
        searches_in_vain: consecutive searches that did not find it.
        hypotheses: result of the last search, the best first.
        review: the last comparison of its yaw with others; None before.
    """

    world_from_object: Pose
    motion: Motion
    state: TrackState
    covariance: NDArray[np.float64]
    visible_fraction: float
    confidence: float
    usual_inlier_ratio: float
    usual_correlation: float
    usual_nats: float
    initial_correlation: float
    silhouette_bias_m: float
    silhouette_bias_sigma_m: float
    was_at_rest: bool
    still_frames: int
    missed_frames: int
    usual_rate: float
    rate: float
    world_from_known: Pose
    known_ns: int
    known_motion: Motion
    sure_ns: int
    rest: Rest | None
    reduced: ReducedRendering | None
    appearance: AppearanceMemory | None
    world_from_stood: Pose | None
    stays_nats: float
    seen_ns: int
    missing_ns: int
    around: NDArray[np.float32] | None
    compared_ns: int
    looked_ns: int
    searched_ns: int
    searches_in_vain: int
    hypotheses: tuple[Hypothesis, ...]
    review: Review | None

    @property
    def rival_nats(self) -> float:
        """Log odds of its pose against the likeliest other yaw when they were last compared."""
        return math.inf if self.review is None else self.review.rival_nats

    @property
    def known_nats(self) -> float:
        """Those odds after the last comparison that was finished."""
        return math.inf if self.review is None else self.review.known_nats

    @property
    def moves_on(self) -> bool:
        """Whether it moved in the last frame."""
        return self.state is TrackState.TRACKED and self.still_frames == 0


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """One object in one frame.

    Attributes:
        scene: the frame.
        model: the object.
        track: its state.
        neighbours: the other objects.
        support_heights_m: heights in m of the support planes.
        is_turn: whether this resting object is measured in this frame.
        is_first: whether this is the first frame of the session.
        may_search: whether a search over the whole scene is allowed in this frame.
        may_compare: whether its pose may be compared with those beside it in this frame.
        use_texture: whether inner colours take part.
        interval_ns: time from a frame of the stream to the next, dropped ones counted.
        costs: of the steps of searches.
    """

    scene: Scene
    model: TrackModel
    track: Track
    neighbours: tuple[Neighbour, ...]
    support_heights_m: tuple[float, ...]
    is_turn: bool
    is_first: bool
    may_search: bool
    may_compare: bool
    use_texture: bool
    interval_ns: int
    costs: StepCosts = NOMINAL_COSTS


def new_track(model: TrackModel) -> Track:
    """The track of an object at the scene's pose, not yet seen."""
    return Track(
        world_from_object=model.source.world_from_object,
        motion=Motion.rest(0),
        state=TrackState.STATIC,
        covariance=np.diag([0.02**2, 0.02**2, 0.01**2, math.radians(2) ** 2]),
        visible_fraction=0.0,
        confidence=0.0,
        usual_inlier_ratio=0.0,
        usual_correlation=0.0,
        usual_nats=0.0,
        initial_correlation=1.0,
        silhouette_bias_m=SILHOUETTE_BIAS_M,
        silhouette_bias_sigma_m=SILHOUETTE_BIAS_SIGMA_M,
        was_at_rest=True,
        still_frames=RESTING_FRAMES,
        missed_frames=0,
        usual_rate=0.0,
        rate=0.0,
        world_from_known=model.source.world_from_object,
        known_ns=0,
        known_motion=Motion.rest(0),
        sure_ns=0,
        rest=None,
        reduced=None,
        appearance=None,
        world_from_stood=None,
        stays_nats=stayed_log_prior(),
        seen_ns=0,
        missing_ns=0,
        around=None,
        compared_ns=0,
        looked_ns=0,
        searched_ns=-SEARCH_PERIOD_NS,
        searches_in_vain=0,
        hypotheses=(),
        review=None,
    )


def portable(task: Task) -> Task:
    """The task without what its track remembers of pictures: what is left can leave the process."""
    track = replace(
        task.track,
        rest=None,
        around=None,
        reduced=None,
        appearance=None,
        hypotheses=(),
        review=None,
    )
    return replace(task, track=track)


def report(model: TrackModel, track: Track, frame: Frame) -> TrackedObject:
    """The public result of a track in one frame."""
    return TrackedObject(
        object_id=model.object_id,
        t_ns=frame.t_ns,
        world_from_object=track.world_from_object,
        covariance=track.covariance,
        visible_fraction=track.visible_fraction,
        state=track.state,
        confidence=track.confidence,
        source_seq=frame.seq,
    )
