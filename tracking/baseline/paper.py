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
from scenes.cameras import Pinhole
from scenes.pose import Pose
from scenes.render.renderer import PosedSplats, Renderer
from scenes.splats import SplatCloud
from scenes.state import ObjectModel, TrackedObject, TrackState
from scenes.warp import VirtualView
from tracking.background.images import BackgroundImages, fit_exposure, render_background
from tracking.background.layers import drawn_layer
from tracking.background.learning import learn, whole_lens
from tracking.baseline.detect import BackgroundDetector, Detection, Detector, Expected
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
from tracking.baseline.refine import chamfer, contour_pixels, minimise_chamfer, observe_contour
from tracking.baseline.smoothing import Glide, Kalman
from tracking.baseline.yaw_search import coarse_yaw
from tracking.model.object_model import RENDER_OPTIONS, make_model
from tracking.output import Stopwatch, TrackOutput, no_stopwatch
from tracking.window.window import window_around

UPDATE_NS = 1_000_000_000
"""The paper's budget: one pose per object and second."""

FALSE_MOTION_PX2 = 5.0
"""Chamfer loss of the last pose below which nothing really moved (paper; value not given)."""

WINDOW_SIDES = 1.9
"""The part of the view that is drawn and compared, in sides of the detection box."""

UNCERTAINTY = np.diag([0.1**2] * 4)
"""Covariance reported for a pose: the filter's measurement noise."""


@dataclass(frozen=True, slots=True)
class PaperOptions:
    """What the paper's local user may change.

    Attributes:
        fov_deg: field of view of the rectified front view.
    """

    fov_deg: float = 130.0


@dataclass(frozen=True, slots=True, eq=False)
class PaperTrack:
    """One object's filter and displayed movement.

    Attributes:
        kalman: after the last update.
        glide: what viewers see.
        updated_ns: frame time of the last estimate, or None before the first.
    """

    kalman: Kalman
    glide: Glide
    updated_ns: int | None


@dataclass(frozen=True, slots=True, eq=False)
class PaperState:
    """What the paper's tracker remembers between frames.

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


@dataclass(frozen=True, slots=True, eq=False)
class _Window:
    """A part of the rectified view: a camera with the same rays, and what is seen through it."""

    camera: Pinhole
    world_from_camera: Pose
    image: NDArray[np.uint8]
    mask: NDArray[np.bool_]


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
            if track_2d is not None and _due(track_2d, tracks[source.object_id], frame.t_ns):
                track, done = self._estimate(
                    source, tracks[source.object_id], track_2d, view, frame
                )
                tracks[source.object_id] = track
                if done:
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
        """Where the detector should look: the last box, or the scan's box before the first."""
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

    def _estimate(
        self,
        source: ObjectModel,
        track: PaperTrack,
        track_2d: Track2D,
        view: RectifiedView,
        frame: Frame,
    ) -> tuple[PaperTrack, bool]:
        """Staged optimiser: coarse yaw by keypoints, then Chamfer (paper 4.4.2)."""
        detection = track_2d.detection
        if detection is None:
            return track, False
        window = _cut(view, detection)
        observed = observe_contour(window.mask)
        last = track.kalman.pose()
        centre = np.array([0.0, 0.0, 0.5 * source.box_m[2]])
        camera_from_world = window.world_from_camera.inverse()

        def pose_of(vector: NDArray[np.float64]) -> Pose:
            beside = np.array([vector[0], vector[1], 0.0])
            middle = window.world_from_camera @ (ray * vector[2] + beside)
            return Pose.from_yaw(float(vector[3]), middle - centre)

        def draw(world_from_object: Pose) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
            drawn = self._renderer.render(
                (PosedSplats(source.splats, world_from_object),),
                window.camera,
                window.world_from_camera,
                RENDER_OPTIONS,
            )
            picture = np.clip(drawn.rgb * 255.0 + 0.5, 0, 255).astype(np.uint8)
            return picture, drawn.alpha > 0.5

        mask = draw(last)[1]
        if chamfer(contour_pixels(mask), observed) < FALSE_MOTION_PX2:
            return replace(track, updated_ns=frame.t_ns), True
        in_camera = camera_from_world @ (last @ centre)
        depth = float(in_camera[2])
        aim = _centre_beside_box(mask, window.camera, in_camera)
        ray = window.camera.unproject((_box_centre(window.mask) + aim)[None])[0]
        ray = ray / ray[2]
        cut_out = np.where(window.mask[..., None], window.image, np.uint8(0))
        yaw, _ = coarse_yaw(
            cut_out,
            lambda candidate: draw(pose_of(np.array([0.0, 0.0, depth, candidate])))[0],
            self._matcher,
            fallback=last.yaw(),
        )
        best, _ = minimise_chamfer(
            np.array([0.0, 0.0, depth, yaw]), observed, lambda vector: draw(pose_of(vector))[1]
        )
        kalman = track.kalman.update(pose_of(best))
        glide = Glide(track.glide.at(frame.t_ns), kalman.pose(), frame.t_ns, frame.t_ns + UPDATE_NS)
        return PaperTrack(kalman, glide, frame.t_ns), True


def box_corners(source: ObjectModel) -> NDArray[np.float64]:
    """(8, 3) corners of an object's box in its frame."""
    x, y, z = source.box_m
    signs = np.array([(a, b, c) for a in (-0.5, 0.5) for b in (-0.5, 0.5) for c in (0.0, 1.0)])
    return signs * np.array([x, y, z])


def _box_centre(mask: NDArray[np.bool_]) -> NDArray[np.float64]:
    """(2,) centre of a mask's box in pixels."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return 0.5 * np.array([columns[0] + columns[-1] + 1, rows[0] + rows[-1] + 1], dtype=np.float64)


def _centre_beside_box(
    mask: NDArray[np.bool_], camera: Pinhole, in_camera: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(2,) pixels from an object's box centre to its projected centre, as drawn at the last pose.

    At the border of a wide view they differ by more than the 5 cm that x and y may change.
    """
    if not mask.any() or in_camera[2] < 0.1:
        return np.zeros(2)
    pixel = np.array(
        [
            camera.fx * in_camera[0] / in_camera[2] + camera.cx,
            camera.fy * in_camera[1] / in_camera[2] + camera.cy,
        ]
    )
    height, width = mask.shape
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    cut = rows[0] == 0 or columns[0] == 0 or rows[-1] == height - 1 or columns[-1] == width - 1
    return np.zeros(2) if cut else pixel - _box_centre(mask)


def _due(track_2d: Track2D, track: PaperTrack, t_ns: int) -> bool:
    if track_2d.detection is None or _is_cut_off(track_2d.detection):
        return False
    rested = track.updated_ns is None or t_ns - track.updated_ns >= UPDATE_NS
    return track_2d.moved and track_2d.visibility is Visibility.VISIBLE and rested


def _is_cut_off(detection: Detection) -> bool:
    height, width = detection.mask.shape
    left, top, right, bottom = detection.box_px
    return bool(left < 1 or top < 1 or right > width - 1 or bottom > height - 1)


def _cut(view: RectifiedView, detection: Detection) -> _Window:
    """The part of the view around a detection, as a camera of its own."""
    height, width = detection.mask.shape
    half = 0.5 * WINDOW_SIDES * float(detection.size_px().max()) + 4.0
    left, top = np.floor(np.clip(detection.centre_px() - half, 0, (width, height))).astype(int)
    right, bottom = np.ceil(np.clip(detection.centre_px() + half, 0, (width, height))).astype(int)
    whole = view.camera
    camera = Pinhole(
        int(right - left),
        int(bottom - top),
        whole.fx,
        whole.fy,
        whole.cx - float(left),
        whole.cy - float(top),
    )
    part = (slice(top, bottom), slice(left, right))
    return _Window(camera, view.world_from_camera, view.image[part], detection.mask[part])


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
