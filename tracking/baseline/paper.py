"""The paper's tracker (section 4.4) with its own constants: the baseline, kept as it is.

Deviations, all forced by what is not available here:

- SIFT with mutual nearest neighbours stands in for SuperPoint + LightGlue (the weights are for
  research only); any other `Matcher` can be given.
- Objects are found by the difference to the empty room instead of YOLO11m-seg; a YOLO file can be
  given as `detector`.
- Values that the paper does not state: motion trigger 3 px, Chamfer threshold 2.5 px² a direction,
  Powell stops after 200 drawings, the Kalman filter is a random walk per component.
- The ±5 cm in x and y are taken about the ray through the box centre at the depth being tried, not
  about a fixed point: the kinder reading, since a fixed one fails whenever the depth starts wrong.
- An object that the border of the view cuts counts as partially occluded: it is not estimated.
- The user's choice of objects in the first frame is "all that the ray association finds".
- A pose is published the moment it is computed, then approached linearly over the update interval;
  the paper's extra second of computing is not simulated, which flatters the baseline.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from devices.messages import Frame
from scenes.pose import Pose
from scenes.render.renderer import PosedSplats, Renderer
from scenes.splats import SplatCloud
from scenes.state import ObjectModel, TrackedObject, TrackState
from scenes.warp import VirtualView
from tracking.background.images import BackgroundImages, fit_exposure, render_background
from tracking.background.layers import drawn_layer
from tracking.background.learning import learn, whole_lens
from tracking.baseline.detect import BackgroundDetector, Detection, Detector, Expected
from tracking.baseline.estimate import UPDATE_NS, PaperTrack, estimate
from tracking.baseline.identity import (
    Track2D,
    Visibility,
    associate,
    begin_track,
    settle,
    update_tracks,
)
from tracking.baseline.matcher import Matcher, SiftMatcher
from tracking.baseline.rectify import RectifiedView, front, rectify
from tracking.baseline.smoothing import Glide, Kalman
from tracking.model.object_model import make_model
from tracking.output import Stopwatch, TrackOutput, no_stopwatch
from tracking.window.window import window_around

UNCERTAINTY = np.diag([0.1**2] * 4)
"""Covariance reported for a pose: the filter's measurement noise."""


@dataclass(frozen=True, slots=True)
class PaperOptions:
    """Settings that the paper's local user may change.

    Attributes:
        fov_deg: field of view of the rectified front view.
    """

    fov_deg: float = 130.0


@dataclass(frozen=True, slots=True, eq=False)
class PaperState:
    """State of the paper's tracker between frames.

    Attributes:
        tracks_2d: identity layer, by object id; only objects that were found.
        tracks: pose layer, by object id; all objects.
        background: the empty room at the camera's pose, or None before the first frame.
        view: the rectified view at that pose.
    """

    tracks_2d: Mapping[str, Track2D]
    tracks: Mapping[str, PaperTrack]
    background: BackgroundImages | None
    view: VirtualView | None


class PaperTracker:
    """Follows the objects of a scene as the paper does.

    Args:
        room: the room's splats without the movable objects.
        objects: the movable objects' splats and last known poses.
        renderer: draws splats.
        options: field of view.
        detector: finds the objects; background difference by default.
        matcher: finds keypoints; SIFT by default.
        stopwatch: for the stage durations.
    """

    def __init__(
        self,
        room: SplatCloud,
        objects: Sequence[ObjectModel],
        renderer: Renderer,
        options: PaperOptions | None = None,
        *,
        detector: Detector | None = None,
        matcher: Matcher | None = None,
        stopwatch: Stopwatch = no_stopwatch,
    ) -> None:
        self._room = room
        self._objects = tuple(objects)
        self._renderer = renderer
        self._options = options or PaperOptions()
        self._detector = detector or BackgroundDetector()
        self._matcher = matcher or SiftMatcher()
        self._stopwatch = stopwatch
        self._colours = {o.object_id: make_model(o, renderer).colours for o in self._objects}

    def start(self) -> PaperState:
        """Every object where the scene says, none of them found in the picture yet."""
        tracks = {
            o.object_id: PaperTrack(
                Kalman.at(o.world_from_object),
                Glide(o.world_from_object, o.world_from_object, 0, 0),
                None,
            )
            for o in self._objects
        }
        return PaperState(MappingProxyType({}), MappingProxyType(tracks), None, None)

    def step(self, state: PaperState, frame: Frame, now_ns: int) -> tuple[PaperState, TrackOutput]:
        """Detect in one frame; estimate the poses that are due.

        A frame without a camera pose is taken from where the camera was last.

        Raises:
            ValueError: neither the frame nor one before it has a camera pose.
        """
        del now_ns
        world_from_rig = frame.world_from_rig
        if world_from_rig is None and state.background is not None:
            world_from_rig = state.background.world_from_rig
        if world_from_rig is None:
            raise ValueError(f"frame {frame.seq} of {frame.stream_id!r} has no camera pose")
        began = self._stopwatch()
        state = self._at_camera(state, frame, world_from_rig)
        view = self._rectified(state, frame)
        rectified = self._stopwatch()
        tracks_2d = self._identify(state, view)
        detected = self._stopwatch()
        tracks = dict(state.tracks)
        tracks_2d = dict(tracks_2d)
        for source in self._objects:
            track_2d = tracks_2d.get(source.object_id)
            track = tracks[source.object_id]
            if track_2d is None or not _is_due(track_2d, track, frame.t_ns):
                continue
            if track_2d.detection is not None:
                tracks[source.object_id] = estimate(
                    source,
                    track,
                    track_2d.detection,
                    view,
                    t_ns=frame.t_ns,
                    renderer=self._renderer,
                    matcher=self._matcher,
                )
                tracks_2d[source.object_id] = settle(track_2d)
        posed = self._stopwatch()
        state = replace(
            state, tracks_2d=MappingProxyType(tracks_2d), tracks=MappingProxyType(tracks)
        )
        objects = tuple(_report(o, state, frame) for o in self._objects)
        ended = self._stopwatch()
        stages = {
            "rectify": rectified - began,
            "detect": detected - rectified,
            "pose": posed - detected,
            "smooth": ended - posed,
        }
        return state, TrackOutput(objects, MappingProxyType(stages), world_from_rig)

    def _at_camera(self, state: PaperState, frame: Frame, world_from_rig: Pose) -> PaperState:
        """Background images and table for this camera pose, kept while it stands still."""
        if state.background is not None and state.background.is_at(world_from_rig):
            return state
        background = render_background(self._renderer, self._room, frame.rig, world_from_rig)
        front_lens = frame.rig.lenses[0]
        standing = [
            drawn_layer(
                PosedSplats(o.splats, pose),
                window_around(
                    frame.rig,
                    world_from_rig,
                    pose @ np.array([0.0, 0.0, 0.5 * o.box_m[2]]),
                    radius_m=0.5 * float(np.linalg.norm(o.box_m)),
                    lens=0,
                ),
                front_lens,
                self._renderer,
            )
            for o in self._objects
            for pose in (state.tracks[o.object_id].kalman.pose(),)
        ]
        exposure = fit_exposure(frame.images[0], background.images[0], background.coverage[0])
        background = learn(
            background, frame, exposure, standing, whole_lens(0, front_lens.height_px)
        )
        return replace(
            state,
            background=background,
            view=front(frame.rig, world_from_rig, fov_deg=self._options.fov_deg),
        )

    def _rectified(self, state: PaperState, frame: Frame) -> RectifiedView:
        background, view = state.background, state.view
        if background is None or view is None:
            raise RuntimeError("the camera's background images are made before its view")
        exposure = fit_exposure(frame.images[0], background.images[0], background.coverage[0])
        return rectify(frame, view, background, (exposure,))

    def _identify(self, state: PaperState, view: RectifiedView) -> Mapping[str, Track2D]:
        """Ray association in the first frame, nearest neighbours afterwards."""
        expected = [self._expect(source, state, view) for source in self._objects]
        detections = self._detector.detect(view, [e for e in expected if e is not None])
        if state.tracks_2d:
            return update_tracks(state.tracks_2d, detections)
        poses = {o.object_id: o.world_from_object for o in self._objects}
        found = associate(
            detections,
            self._objects,
            poses,
            camera=view.camera,
            world_from_camera=view.world_from_camera,
        )
        return {name: begin_track(name, detections[index]) for name, index in found.items()}

    def _expect(
        self, source: ObjectModel, state: PaperState, view: RectifiedView
    ) -> Expected | None:
        """The box in which the detector should look: the last one, or the scan's at first."""
        pose = state.tracks[source.object_id].kalman.pose()
        in_camera = view.world_from_camera.inverse() @ (pose @ box_corners(source))
        pixels, valid = view.camera.project(in_camera)
        track = state.tracks_2d.get(source.object_id)
        if track is None:
            if not valid.all():
                return None
            box = np.concatenate([pixels.min(axis=0), pixels.max(axis=0)])
        else:
            # The size comes from the copy: a detection that swallowed a neighbour must not grow.
            size = np.ptp(pixels, axis=0) if valid.all() else track.size_px
            box = np.concatenate([track.centre_px - 0.5 * size, track.centre_px + 0.5 * size])
        return Expected(source.object_id, source.kind, box, self._colours[source.object_id])


def box_corners(source: ObjectModel) -> NDArray[np.float64]:
    """(8, 3) corners of an object's box in its frame."""
    x, y, z = source.box_m
    signs = np.array([(a, b, c) for a in (-0.5, 0.5) for b in (-0.5, 0.5) for c in (0.0, 1.0)])
    return signs * np.array([x, y, z])


def _is_due(track_2d: Track2D, track: PaperTrack, t_ns: int) -> bool:
    if track_2d.detection is None or _is_cut_off(track_2d.detection):
        return False
    rested = track.updated_ns is None or t_ns - track.updated_ns >= UPDATE_NS
    return track_2d.moved and track_2d.visibility is Visibility.VISIBLE and rested


def _is_cut_off(detection: Detection) -> bool:
    height, width = detection.mask.shape
    left, top, right, bottom = detection.box_px
    return bool(left < 1 or top < 1 or right > width - 1 or bottom > height - 1)


def _report(source: ObjectModel, state: PaperState, frame: Frame) -> TrackedObject:
    track = state.tracks[source.object_id]
    track_2d = state.tracks_2d.get(source.object_id)
    if track_2d is None:
        condition, seen = TrackState.LOST, 0.0
    elif track_2d.visibility is Visibility.VISIBLE:
        moving = track.glide.end_ns > frame.t_ns or track_2d.moved
        condition, seen = (TrackState.TRACKED if moving else TrackState.STATIC), 1.0
    else:
        seen = 0.5 if track_2d.visibility is Visibility.PARTIAL else 0.0
        condition = TrackState.OCCLUDED
    return TrackedObject(
        object_id=source.object_id,
        t_ns=frame.t_ns,
        world_from_object=track.glide.at(frame.t_ns),
        covariance=UNCERTAINTY,
        visible_fraction=seen,
        state=condition,
        confidence=seen,
        source_seq=frame.seq,
    )
