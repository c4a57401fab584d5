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
from scenes.render.renderer import PosedSplats
from scenes.splats import SplatCloud
from scenes.state import ObjectModel, TrackState
from tracking.background.images import BackgroundImages, Exposure, LensExposures, render_background
from tracking.background.layers import LayerCache, LayerKey, window_of
from tracking.background.learning import Band, Care, band_of, learn, looked_at, whole_lens
from tracking.camera.calibration import MAX_CARRIED, Calibration, calibrate
from tracking.camera.common_motion import CommonMotion
from tracking.camera.rig_state import (
    RigState,
    camera_notices,
    looked_through,
    rig_state,
)
from tracking.evidence.evidence import Neighbour, Scene
from tracking.follow.first_frame import settled
from tracking.follow.follow import follow
from tracking.follow.outcome import hold, see_anew
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
from tracking.schedule import Schedule
from tracking.window.window import Layer

UNHURRIED_NS = 50_000_000
"""Frame interval in ns; faster frames review yaws only where nothing else is due. Chosen on the
rooms lab and desk."""


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
        layers: objects rendered into the lens pictures of recent frames.
        options: settings that hold for the next frame.
    """

    tracks: Mapping[str, Track]
    rig: RigState | None
    schedule: Schedule | None
    t_ns: int
    search: Search | None = None
    layers: Mapping[LayerKey, Layer] = field(default_factory=lambda: MappingProxyType({}))
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
    ) -> None:
        ids = [o.object_id for o in objects]
        if len(set(ids)) != len(ids):
            raise ValueError(f"Tracker: object ids {ids}: wanted each once")
        self._room = room
        self._renderer = renderer
        self._options = options or TrackerOptions()
        self._stopwatch = stopwatch
        self._costs = costs
        self._searches = searches
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
        """The state with other settings, for the next frame on; nothing else of it changes.

        The camera's pose stays as it is until the camera moves.
        """
        return replace(state, options=options)

    def step(
        self, state: TrackerState, frame: Frame, now_ns: int
    ) -> tuple[TrackerState, TrackOutput]:
        """Poses of all objects at one frame.

        A frame without a camera pose is taken from where the camera was last: its code is hidden,
        and whether it moves meanwhile is seen in the pictures.

        Raises:
            ValueError: neither the frame nor one before it has a camera pose.
        """
        del now_ns
        marker_world_from_rig = frame.world_from_rig
        if marker_world_from_rig is None and state.rig is not None:
            marker_world_from_rig = state.rig.marker_world_from_rig
        if marker_world_from_rig is None:
            raise ValueError(f"frame {frame.seq} of {frame.stream_id!r} has no camera pose")
        began = self._stopwatch()
        options = state.options
        schedule = (
            Schedule(frame.seq) if state.schedule is None else state.schedule.following(frame.seq)
        )
        layers = LayerCache(state.layers)
        rig = self._locate(state, frame, marker_world_from_rig, layers)
        notices = camera_notices(state.rig, rig, frame.t_ns)
        if rig.blind is not None:
            located = self._stopwatch()
            tracks = {name: hold(track, frame.t_ns) for name, track in state.tracks.items()}
            following = replace(
                state,
                tracks=MappingProxyType(tracks), rig=rig, schedule=schedule, t_ns=frame.t_ns,
            )  # fmt: skip
            return following, self._output(following, frame, (began, located), notices)
        is_elsewhere = state.rig is not None and rig.background is not state.rig.background
        if is_elsewhere:
            anew = {name: see_anew(track) for name, track in state.tracks.items()}
            state = replace(state, tracks=MappingProxyType(anew))
        scene = self._scene(frame, rig, layers, is_first=schedule.is_first)
        rectified = self._stopwatch()
        tracks = dict(state.tracks)
        # By the stream's interval, not by the time since the last processed frame: late frames that
        # did more for it would be late for ever.
        interval_ns = (frame.t_ns - state.t_ns) // schedule.pictures
        tasks = {
            m.object_id: self._task(scene, m, state, schedule, interval_ns=interval_ns)
            for m in self._models
        }
        if is_elsewhere:
            # The camera moved: what rested rests still, unless a measurement clearly says no.
            tasks = {name: replace(task, is_turn=True) for name, task in tasks.items()}
            looks = {name: track.state is TrackState.STATIC for name, track in tracks.items()}
        else:
            looks = {name: first_look(task) for name, task in tasks.items()}
        detected = self._stopwatch()
        searched = False
        is_busy = not schedule.is_free and interval_ns < UNHURRIED_NS
        reviewed = next((name for name, track in tracks.items() if is_under_review(track)), None)
        for model in _most_certain_first(self._models, tracks):
            name = model.object_id
            is_free = not searched and not is_busy and reviewed in (None, name)
            task = replace(
                tasks[name],
                neighbours=self._neighbours(model, tracks),
                may_search=options.recover and is_free,
            )
            tracks[name] = follow(task, looks[name])
            searched = searched or was_reviewed(tracks[name], frame.t_ns)
        search = state.search
        if options.recover and schedule.is_first:
            # At first there is nothing to be late for.
            tracks = settled(list(tasks.values()), tracks)
        elif options.recover and not searched:
            budget_ms = min(SEARCH_SHARE * interval_ns / 1e6, options.search_ms)
            found, search = redetect(
                self._lost(tasks, tracks), search, budget_ms=budget_ms, runner=self._searches
            )
            tracks |= found
        posed = self._stopwatch()
        for band in _bands_to_learn(schedule, frame, tracks):
            care = _care(tracks, is_first=schedule.is_first)
            exposure = scene.exposures[band.lens]
            background = self._learned(rig.background, frame, tracks, exposure, band, care, layers)
            rig = replace(rig, background=background)
        following = TrackerState(
            MappingProxyType(tracks), rig, schedule, frame.t_ns, search, layers.kept(), options
        )
        times = began, rectified, detected, posed
        return following, self._output(following, frame, times, notices)

    def _output(
        self,
        state: TrackerState,
        frame: Frame,
        times_ns: Sequence[int],
        notices: tuple[CameraNotice, ...],
    ) -> TrackOutput:
        """What is reported of a frame; `times_ns` are the begins of its stages, as many as ran."""
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

    def _locate(
        self,
        state: TrackerState,
        frame: Frame,
        marker_world_from_rig: Pose,
        layers: LayerCache,
    ) -> RigState:
        """The camera's pose and its background, both kept while the camera does not move."""
        known = state.rig
        if known is None:
            calibration = self._calibrated(state, frame, marker_world_from_rig)
        elif not known.is_unmoved(marker_world_from_rig):
            # Where the marker went, the refined camera went too: a better start than it.
            marked = marker_world_from_rig @ known.marker_world_from_rig.inverse()
            nominal = marked @ known.calibration.world_from_rig
            calibration = self._calibrated(state, frame, nominal)
        else:
            known = looked_through(known, frame)
            blind, motion = known.blind, known.motion
            if motion is not None:
                calibration = self._carried(state, frame, known.calibration, motion)
            elif blind is not None and blind.is_due(frame.t_ns):
                nominal = known.calibration.world_from_rig
                calibration = self._calibrated(state, frame, nominal, is_near=False)
                if not calibration.trusted:
                    return replace(known, blind=replace(blind, tried_ns=frame.t_ns))
            else:
                return known
        background = render_background(
            self._renderer, self._room, frame.rig, calibration.world_from_rig
        )
        ranges_m = background.ranges_m
        exposures = LensExposures(frame.images, background)
        for index, lens in enumerate(frame.rig.lenses):
            band = whole_lens(index, lens.height_px)
            care = _care(state.tracks, is_first=known is None)
            background = self._learned(
                background, frame, state.tracks, exposures[index], band, care, layers
            )
        return rig_state(frame, marker_world_from_rig, calibration, background, ranges_m=ranges_m)

    def _carried(
        self, state: TrackerState, frame: Frame, before: Calibration, motion: CommonMotion
    ) -> Calibration:
        """The pose of a camera that moved by what its pictures say, now and then refined anew."""
        carried = before.carried_along(motion.then_from_now)
        if carried.carried <= MAX_CARRIED or not state.options.calibrate:
            return carried
        refined = self._calibrated(state, frame, carried.world_from_rig)
        return refined if refined.trusted else carried

    def _calibrated(
        self, state: TrackerState, frame: Frame, nominal: Pose, *, is_near: bool = True
    ) -> Calibration:
        """A pose of the camera refined against the room, if that is asked for."""
        if not state.options.calibrate:
            return Calibration.unrefined(nominal)
        standing = tuple(
            PosedSplats(m.source.splats, state.tracks[m.object_id].world_from_object)
            for m in self._models
        )
        return calibrate(
            frame, nominal, self._room, self._renderer, objects=standing, is_near=is_near
        )

    def _learned(
        self,
        background: BackgroundImages,
        frame: Frame,
        tracks: Mapping[str, Track],
        exposure: Exposure,
        band: Band,
        care: Care,
        layers: LayerCache,
    ) -> BackgroundImages:
        """Background images updated from this frame in a band, away from all objects."""
        lens = frame.rig.lenses[band.lens]
        rows = looked_at(band, lens.width_px, lens.height_px)
        taken: list[Layer] = []
        for model in self._models:
            item, pose = model.source, tracks[model.object_id].world_from_object
            view = frame.rig, background.world_from_rig
            drawn, _ = window_of(item, pose, *view, lens=band.lens).part
            if drawn.start < rows.stop and rows.start < drawn.stop:
                layer = layers.layer(item, pose, *view, self._renderer, lens=band.lens)
                taken.append(layer)
        return learn(background, frame, exposure, taken, band, care=care)

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
        *,
        interval_ns: int,
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
            use_texture=state.options.texture,
            interval_ns=interval_ns,
            costs=self._costs,
        )

    def _lost(self, tasks: Mapping[str, Task], tracks: Mapping[str, Track]) -> list[Task]:
        """Tasks of the objects that have to be looked for, with their latest tracks."""
        return [
            replace(
                tasks[model.object_id],
                track=tracks[model.object_id],
                neighbours=self._neighbours(model, tracks),
            )
            for model in self._models
            if is_missing(tracks[model.object_id])
        ]

    def _neighbours(self, model: TrackModel, tracks: Mapping[str, Track]) -> tuple[Neighbour, ...]:
        """The other objects and their poses, without those that are lost."""
        return tuple(
            (other, tracks[other.object_id].world_from_object)
            for other in self._models
            if other is not model and tracks[other.object_id].state is not TrackState.LOST
        )


def _bands_to_learn(
    schedule: Schedule, frame: Frame, tracks: Mapping[str, Track]
) -> Sequence[Band]:
    """Bands of the background to update once the objects are located: all of it in the first frame.

    While an object is lost, nothing is learned: it may be anywhere.
    """
    heights = [lens.height_px for lens in frame.rig.lenses]
    if schedule.is_first and not _misses_any(tracks):
        return [whole_lens(index, height_px) for index, height_px in enumerate(heights)]
    return [] if schedule.learns is None else [band_of(schedule.learns, heights)]


def _misses_any(tracks: Mapping[str, Track]) -> bool:
    """Whether an object is lost."""
    return any(track.state is TrackState.LOST for track in tracks.values())


def _care(tracks: Mapping[str, Track], *, is_first: bool) -> Care:
    """How carefully the background is learned.

    From a single picture, shadows of the room cannot be distinguished from those of objects that
    will move.
    """
    is_unseen = any(track.visible_fraction == 0 for track in tracks.values())
    if is_unseen or _misses_any(tracks):
        return Care.WARY
    return Care.CAUTIOUS if is_first else Care.LITTLE


def _most_certain_first(
    models: Sequence[TrackModel], tracks: Mapping[str, Track]
) -> list[TrackModel]:
    """Resting objects, moving ones, lost ones: each is compared with settled neighbours."""
    order = {
        TrackState.STATIC: 0,
        TrackState.TRACKED: 1,
        TrackState.OCCLUDED: 2,
        TrackState.LOST: 3,
    }
    return sorted(models, key=lambda m: order[tracks[m.object_id].state])
