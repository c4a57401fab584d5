"""The default tracker: contour and texture Gauss-Newton in a native-resolution crop per object.

Per frame: the camera's pose (refined against the room once the marker or the picture says that it
has moved), exposure of each lens that is looked through, a cheap look at every resting object, and
a solve for those that may have moved. The steps of one object are in `tracking.follow.follow`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from devices.messages import Frame
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud
from scenes.state import ObjectModel, TrackState
from tracking.background.images import LensExposures
from tracking.background.layers import Drawn, LayerCache, LayerKey
from tracking.camera.rig_state import RigState, camera_notices
from tracking.camera.rig_tracker import RigTracker, StandingObjects
from tracking.evidence.evidence import Neighbour, Scene
from tracking.follow.first_frame import settle_all
from tracking.follow.follow import follow
from tracking.follow.outcome import hold, see_anew
from tracking.follow.rebirth import awaiting_look, look_around
from tracking.follow.redetection import Search, is_missing, redetect
from tracking.follow.rest import first_look
from tracking.follow.track import Task, Track, new_track, report
from tracking.follow.yaw_review import is_under_review, was_reviewed
from tracking.hypotheses.budget import NOMINAL_COSTS, StepCosts
from tracking.hypotheses.search_runner import IN_FRAMES, SearchRunner
from tracking.model.object_model import TrackModel, make_model
from tracking.model.support_planes import FLOOR_M, support_planes_in
from tracking.options import TrackerOptions
from tracking.output import STAGES, CameraNotice, Stopwatch, TrackOutput, no_stopwatch
from tracking.schedule import Schedule, bands_to_learn, care_beside, most_certain_first

UNHURRIED_NS = 50_000_000
"""Frame interval in ns; faster frames review yaws only where nothing else is due, and compare one
object's pose with those beside it. Chosen on the rooms lab and desk."""


SEARCH_SHARE = 0.6
"""Share of a stream's frame interval that the search for lost objects may use. Dropped frames count
as frames, so that searches do not add to a delay. Chosen on the rooms lab and desk."""


@dataclass(frozen=True, slots=True, eq=False)
class TrackerState:
    """Immutable state of the tracker between frames.

    Attributes:
        tracks: by object id.
        rig: camera pose and background images; None before the first frame.
        schedule: of the last frame; None before the first.
        t_ns: time of the last frame.
        search: the pending search for a lost object; None if there is none.
        look: the pending look around where an object was known; None if there is none.
        layers: objects rendered into the lens pictures of recent frames.
        options: settings that hold for the next frame.
    """

    tracks: Mapping[str, Track]
    rig: RigState | None
    schedule: Schedule | None
    t_ns: int
    search: Search | None = None
    look: Search | None = None
    layers: Mapping[LayerKey, Drawn] = field(default_factory=lambda: MappingProxyType({}))
    options: TrackerOptions = field(default_factory=TrackerOptions)


class Tracker:
    """Tracks every object of a scene in one 360° video.

    Args:
        room: the room's splats without the movable objects.
        objects: the movable objects' splats and last known poses.
        renderer: renders splats.
        options: settings to begin with.
        stopwatch: measures the stages' durations, in ns.
        costs: of the steps of searches; nominal ones make every run the same.
        searches: computes the searches for lost objects.
        looks: computes the looks around where objects were known.

    Raises:
        ValueError: two objects share an id.
    """

    def __init__(
        self,
        room: SplatCloud,
        objects: Sequence[ObjectModel],
        renderer: NativeRenderer,
        options: TrackerOptions | None = None,
        *,
        stopwatch: Stopwatch = no_stopwatch,
        costs: StepCosts = NOMINAL_COSTS,
        searches: SearchRunner = IN_FRAMES,
        looks: SearchRunner = IN_FRAMES,
    ) -> None:
        ids = [o.object_id for o in objects]
        if len(set(ids)) != len(ids):
            raise ValueError(f"Tracker: object ids {ids}: wanted each once")
        self._renderer = renderer
        self._rig_tracker = RigTracker(room, renderer)
        self._options = options or TrackerOptions()
        self._stopwatch = stopwatch
        self._costs = costs
        self._searches = searches
        self._looks = looks
        self._models: tuple[TrackModel, ...] = tuple(make_model(o, renderer) for o in objects)
        # A few stray splats hang outside every scan.
        self._bounds_m = (
            np.percentile(room.means.astype(np.float64), [0.2, 99.8], axis=0)
            if len(room)
            else np.array([[-np.inf] * 3, [np.inf] * 3])
        )
        self._support_heights_m = tuple(sorted({FLOOR_M, *(o.support_z_m for o in objects)}))
        self._support_planes = support_planes_in(room, objects)

    def start(self) -> TrackerState:
        """The state before the first frame: objects at the scene's poses, the camera unknown."""
        tracks = {m.object_id: new_track(m) for m in self._models}
        return TrackerState(
            MappingProxyType(tracks), None, None, -UNHURRIED_NS, options=self._options
        )

    def adjusted(self, state: TrackerState, options: TrackerOptions) -> TrackerState:
        """Return the state with other settings, for the next frame on; nothing else changes.

        The camera's pose stays as it is until the camera moves.
        """
        return replace(state, options=options)

    def step(
        self, state: TrackerState, frame: Frame, now_ns: int
    ) -> tuple[TrackerState, TrackOutput]:
        """Locate the camera, measure the objects, search for lost ones, learn the background.

        A frame without a camera pose is taken from where the camera was last: its code is hidden,
        and whether it moves meanwhile is seen in the pictures.

        Raises:
            ValueError: neither the frame nor one before it has a camera pose.
        """
        del now_ns
        marker_world_from_rig = _marker_pose(state, frame)
        began = self._stopwatch()
        schedule = (
            Schedule(frame.seq) if state.schedule is None else state.schedule.following(frame.seq)
        )
        layers = LayerCache(state.layers)
        rig = self._rig_tracker.locate(
            state.rig,
            frame,
            marker_world_from_rig=marker_world_from_rig,
            standing=self._standing(state.tracks, layers, is_first=schedule.is_first),
            is_refined=state.options.calibrate,
        )
        notices = camera_notices(state.rig, rig, frame.t_ns)
        if rig.blind is not None:
            located = self._stopwatch()
            following = _hold_all(state, frame, rig, schedule)
            return following, self._output(following, frame, (began, located), notices)
        scene = self._scene(frame, rig, layers, is_first=schedule.is_first)
        located = self._stopwatch()
        state, tasks, looks = self._look(state, scene, rig, schedule)
        looked = self._stopwatch()
        tracks, is_time_left = self._measure(state, schedule, tasks, looks)
        tracks, search, look = self._search(state, tasks, tracks, is_time_left=is_time_left)
        measured = self._stopwatch()
        is_seen_anew = state.rig is None or rig.background is not state.rig.background
        rig = self._learn(rig, scene, tracks, schedule, is_seen_anew=is_seen_anew)
        following = TrackerState(
            MappingProxyType(tracks),
            rig,
            schedule,
            frame.t_ns,
            search,
            look,
            layers.kept(),
            state.options,
        )
        times = began, located, looked, measured
        return following, self._output(following, frame, times, notices)

    def _look(
        self, state: TrackerState, scene: Scene, rig: RigState, schedule: Schedule
    ) -> tuple[TrackerState, Mapping[str, Task], Mapping[str, bool]]:
        """The state as seen from the camera's pose, the tasks of all objects, and looks at them.

        A look says of an object whether it is unchanged; one at each is cheap.
        """
        has_moved = state.rig is not None and rig.background is not state.rig.background
        if has_moved:
            anew = {name: see_anew(track) for name, track in state.tracks.items()}
            state = replace(state, tracks=MappingProxyType(anew))
        tasks = {m.object_id: self._task(scene, m, state, schedule) for m in self._models}
        if has_moved:
            # What rested rests still, unless a measurement clearly says no.
            tasks = {name: replace(task, is_turn=True) for name, task in tasks.items()}
            looks = {name: t.state is TrackState.STATIC for name, t in state.tracks.items()}
        else:
            looks = {name: first_look(task) for name, task in tasks.items()}
        return state, tasks, looks

    def _measure(
        self,
        state: TrackerState,
        schedule: Schedule,
        tasks: Mapping[str, Task],
        looks: Mapping[str, bool],
    ) -> tuple[dict[str, Track], bool]:
        """Tracks after each object was followed, and whether this leaves time for a search."""
        tracks = dict(state.tracks)
        reviewed = next((name for name, track in tracks.items() if is_under_review(track)), None)
        is_time_left = may_compare = True
        for model in most_certain_first(self._models, tracks):
            name = model.object_id
            task = tasks[name]
            is_busy = not schedule.is_free and task.interval_ns < UNHURRIED_NS
            is_free = is_time_left and not is_busy and reviewed in (None, name)
            task = replace(
                task,
                neighbours=self._neighbours(model, tracks),
                may_search=state.options.recover and is_free,
                may_compare=may_compare or task.interval_ns >= UNHURRIED_NS,
            )
            tracks[name] = follow(task, looks[name])
            may_compare = may_compare and tracks[name].compared_ns != task.scene.frame.t_ns
            if was_reviewed(tracks[name], task.scene.frame.t_ns):
                is_time_left = False
        return tracks, is_time_left

    def _search(
        self,
        state: TrackerState,
        tasks: Mapping[str, Task],
        tracks: dict[str, Track],
        *,
        is_time_left: bool,
    ) -> tuple[dict[str, Track], Search | None, Search | None]:
        """Tracks, the pending search and the pending look after what is missing was looked for."""
        search, look = state.search, state.look
        if not state.options.recover or not self._models:
            return tracks, search, look
        first, *_ = tasks.values()
        if first.is_first:
            # At first there is nothing to be late for.
            return settle_all(list(tasks.values()), tracks), search, look
        looked, look = look_around(self._beside(tasks, tracks), look, runner=self._looks)
        if looked or not is_time_left:
            return {**tracks, **looked}, search, look
        budget_ms = min(SEARCH_SHARE * first.interval_ns / 1e6, state.options.search_ms)
        beside = self._beside(tasks, tracks)
        missing = [task for task in beside if is_missing(task.track)]
        awaiting = awaiting_look(beside, look)
        found, search = redetect(
            missing, search, budget_ms=budget_ms, runner=self._searches, looked_for=awaiting
        )
        return {**tracks, **found}, search, look

    def _learn(
        self,
        rig: RigState,
        scene: Scene,
        tracks: Mapping[str, Track],
        schedule: Schedule,
        *,
        is_seen_anew: bool,
    ) -> RigState:
        """The rig's state after the bands of the background that are due were learned."""
        standing = self._standing(tracks, scene.layers, is_first=schedule.is_first)
        learner, frame, exposures = self._rig_tracker, scene.frame, scene.exposures
        for band in bands_to_learn(schedule, frame, tracks, is_seen_anew=is_seen_anew):
            exposure = exposures[band.lens]
            background = learner.learn(
                rig.background, frame, standing, exposure=exposure, band=band
            )
            rig = replace(rig, background=background)
        if is_seen_anew:
            return learner.learn_unscanned(rig, frame, standing=standing, exposures=exposures)
        return rig

    def _output(
        self,
        state: TrackerState,
        frame: Frame,
        times_ns: Sequence[int],
        notices: tuple[CameraNotice, ...],
    ) -> TrackOutput:
        """The report of a frame; `times_ns` are the begins of its stages, as many as ran."""
        assert state.rig is not None
        objects = tuple(report(m, state.tracks[m.object_id], frame) for m in self._models)
        ends = (*times_ns[1:], self._stopwatch())
        stages = {
            name: end - begin for name, begin, end in zip(STAGES, times_ns, ends, strict=False)
        }
        calibration = state.rig.calibration
        return TrackOutput(
            objects,
            MappingProxyType({**dict.fromkeys(STAGES, 0), **stages}),
            calibration.world_from_rig,
            calibration.described() if state.options.calibrate else "",
            notices,
        )

    def _standing(
        self, tracks: Mapping[str, Track], layers: LayerCache, *, is_first: bool
    ) -> StandingObjects:
        poses = {name: track.world_from_object for name, track in tracks.items()}
        sources = tuple(m.source for m in self._models)
        return StandingObjects(sources, poses, layers, care_beside(tracks, is_first=is_first))

    def _scene(
        self, frame: Frame, rig: RigState, layers: LayerCache, *, is_first: bool = False
    ) -> Scene:
        return Scene(
            frame,
            rig.calibration.world_from_rig,
            rig.calibration.sigma,
            rig.background,
            LensExposures(frame.images, rig.background),
            self._renderer,
            self._bounds_m,
            self._support_planes,
            layers,
            is_first,
        )

    def _task(
        self,
        scene: Scene,
        model: TrackModel,
        state: TrackerState,
        schedule: Schedule,
    ) -> Task:
        turn = schedule.measures
        whose = None if turn is None else self._models[turn % len(self._models)]
        return Task(
            scene=scene,
            model=model,
            track=state.tracks[model.object_id],
            neighbours=self._neighbours(model, state.tracks),
            support_heights_m=self._support_heights_m,
            is_turn=whose is model,
            is_first=schedule.is_first,
            may_search=state.options.recover,
            may_compare=True,
            use_texture=state.options.texture,
            # By the stream's interval, not by the time since the last processed frame: late frames
            # that did more for it would be late for ever.
            interval_ns=(scene.frame.t_ns - state.t_ns) // schedule.pictures,
            costs=self._costs,
        )

    def _beside(self, tasks: Mapping[str, Task], tracks: Mapping[str, Track]) -> list[Task]:
        """Tasks of all objects with their latest tracks and neighbours."""
        return [
            replace(
                tasks[model.object_id],
                track=tracks[model.object_id],
                neighbours=self._neighbours(model, tracks),
            )
            for model in self._models
        ]

    def _neighbours(self, model: TrackModel, tracks: Mapping[str, Track]) -> tuple[Neighbour, ...]:
        """The other objects and their poses, without those that are lost."""
        return tuple(
            (other, tracks[other.object_id].world_from_object)
            for other in self._models
            if other is not model and tracks[other.object_id].state is not TrackState.LOST
        )


def _marker_pose(state: TrackerState, frame: Frame) -> Pose:
    """`world_from_rig` by the marker in a frame, or in the last one that had it.

    Raises:
        ValueError: there is none.
    """
    if frame.world_from_rig is not None:
        return frame.world_from_rig
    if state.rig is None:
        raise ValueError(f"frame {frame.seq} of {frame.stream_id!r} has no camera pose")
    return state.rig.marker_world_from_rig


def _hold_all(state: TrackerState, frame: Frame, rig: RigState, schedule: Schedule) -> TrackerState:
    """The state after a frame of a camera that shows nothing of the room: all objects are held."""
    tracks = {name: hold(track, frame.t_ns) for name, track in state.tracks.items()}
    return replace(
        state, tracks=MappingProxyType(tracks), rig=rig, schedule=schedule, t_ns=frame.t_ns
    )
