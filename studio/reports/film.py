"""The film of a session: camera, twin from the same viewpoint, twin from above, side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

from devices.messages import Frame
from devices.recording_codec import RecordedTruth
from scenes.cameras import Rig
from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.render.renderer import PosedSplats
from scenes.state import (
    Annotation,
    Avatar,
    Proposal,
    SharedPrimitive,
    TrackedObject,
    TrackState,
    lines_now,
)
from studio.evaluate.metrics import pose_error
from studio.evaluate.scores import SYMMETRY_OF_KIND
from studio.session.session import SessionOutput
from studio.view.overlay import (
    FAINT,
    INK,
    LOCAL,
    REMOTE,
    STATE_COLOURS,
    STATE_WORDS,
    TRUTH,
    Colour,
    draw_avatar,
    draw_footprint,
    draw_line,
    width_of,
    write_words,
)
from studio.view.shared_things import met_proposals, primitive_splats, proposed_splats
from studio.view.surface_drawing import LivePicture
from studio.view.twin import BACKGROUND, Twin, lens_camera

PANEL_PX = 480
"""Side of each of the three panels in pixels, chosen: three fit a screen 1500 pixels wide."""

GAP_PX, HEADER_PX, FOOTER_PX = 8, 64, 72
COLUMN_GAP_PX = 14
"""Between the words of two objects, pixels."""
"""Pixels around the panels, above and below them, chosen for the text's sizes."""

WIDTH_PX = 3 * PANEL_PX + 4 * GAP_PX
"""Of a film's picture, pixels."""

HEIGHT_PX = HEADER_PX + PANEL_PX + FOOTER_PX
"""Of a film's picture, pixels; even, as H.264 wants it."""

Picture = NDArray[np.uint8]
Words = list[tuple[tuple[float, float], str, Colour, int, bool]]
"""Position (pixels), text, colour, size (pixels), bold: see `studio.view.overlay.write_words`."""


@dataclass(frozen=True, slots=True)
class FilmTitle:
    """Text of the header: the scene, how the session came about, and where a fork begins."""

    scene: str
    detail: str
    fork_ns: int | None = None


@dataclass(frozen=True, slots=True, eq=False)
class FilmFrame:
    """Contents of one picture of the film: a session's output without its large images.

    Attributes:
        t_ns: capture time on the session clock.
        camera_panel: (PANEL_PX, PANEL_PX, 3) RGB of the front lens.
        rig: the camera's lenses.
        world_from_rig: the camera's pose as the session knows it, or None.
        tracks: the shown method's answer by object id.
        live: surfaces that show live video.
        avatars: people at that time.
        truth: the ground truth, or None.
        lines: what people have drawn until then.
        primitives: what they have put into the room.
        proposals: where objects should go.
    """

    t_ns: int
    camera_panel: Picture
    rig: Rig
    world_from_rig: Pose | None
    tracks: Mapping[str, TrackedObject]
    live: tuple[LivePicture, ...]
    avatars: tuple[Avatar, ...]
    truth: RecordedTruth | None
    lines: tuple[Annotation, ...] = ()
    primitives: tuple[SharedPrimitive, ...] = ()
    proposals: tuple[Proposal, ...] = ()


def film_frame(output: SessionOutput) -> FilmFrame:
    """The film's part of one output: a few milliseconds, most of them for a smaller image."""
    frame, truth = output.input.frame, output.message.truth
    return FilmFrame(
        t_ns=frame.t_ns,
        camera_panel=_camera_panel(frame),
        rig=frame.rig,
        world_from_rig=frame.world_from_rig,
        tracks={track.object_id: track for track in output.shown.objects},
        live=output.surfaces,
        avatars=output.input.avatars,
        truth=None if truth is None else truth.recorded,
        lines=lines_now(output.state),
        primitives=tuple(output.state.primitives.values()),
        proposals=tuple(output.state.proposals.values()),
    )


class FilmMaker:
    """Draws the film's pictures.

    Args:
        scene: the scan.
        twin: draws it.
        title: for the header.
    """

    def __init__(self, scene: ScenePackage, twin: Twin, title: FilmTitle) -> None:
        self._scene = scene
        self._models = {item.object_id: item for item in scene.objects}
        self._twin = twin
        self._title = title
        self._above = twin.above(PANEL_PX)

    def picture(self, frame: FilmFrame) -> Picture:
        """One picture of the film, (HEIGHT_PX, WIDTH_PX, 3) RGB."""
        background = np.array(BACKGROUND) * 255
        canvas = np.empty((HEIGHT_PX, WIDTH_PX, 3), dtype=np.uint8)
        canvas[:] = background.astype(np.uint8)
        panels = (frame.camera_panel, self._from_camera(frame), self._from_above(frame))
        for place, panel in enumerate(panels):
            x = GAP_PX + place * (PANEL_PX + GAP_PX)
            canvas[HEADER_PX : HEADER_PX + PANEL_PX, x : x + PANEL_PX] = panel
        words = self._header(frame) + self._footer(frame)
        return write_words(canvas, words)

    def _from_camera(self, frame: FilmFrame) -> Picture:
        rig = frame.rig
        camera = lens_camera(rig.lenses[0], PANEL_PX)
        world_from_rig = frame.world_from_rig or self._scene.world_from_rig
        world_from_camera = world_from_rig @ rig.rig_from_lens[0]
        drawn = self._twin.picture(
            _poses(frame.tracks),
            camera,
            world_from_camera,
            live=frame.live,
            things=self._drawn_objects(frame),
        )
        for object_id, track in frame.tracks.items():
            if track.state is not TrackState.STATIC:
                draw_footprint(
                    drawn,
                    camera,
                    world_from_camera,
                    track.world_from_object,
                    self._models[object_id].box_m,
                    colour=STATE_COLOURS[track.state],
                    dashed=track.state is TrackState.OCCLUDED,
                )
        for line in frame.lines:
            draw_line(drawn, camera, world_from_camera, line)
        return drawn

    def _from_above(self, frame: FilmFrame) -> Picture:
        camera, world_from_camera = self._above
        poses = _poses(frame.tracks)
        drawn = self._twin.picture_from_above(poses, PANEL_PX, things=self._drawn_objects(frame))
        true_poses = frame.truth.world_from_object if frame.truth is not None else {}
        for object_id, track in frame.tracks.items():
            box = self._models[object_id].box_m
            if object_id in true_poses:
                true = true_poses[object_id]
                draw_footprint(
                    drawn, camera, world_from_camera, true, box, colour=TRUTH, width_px=1
                )
            draw_footprint(
                drawn,
                camera,
                world_from_camera,
                track.world_from_object,
                box,
                colour=STATE_COLOURS[track.state],
                dashed=track.state is TrackState.OCCLUDED,
            )
        for avatar in frame.avatars:
            draw_avatar(drawn, camera, world_from_camera, avatar)
        for line in frame.lines:
            draw_line(drawn, camera, world_from_camera, line)
        return drawn

    def _drawn_objects(self, frame: FilmFrame) -> list[PosedSplats]:
        """Return what people have put into the room, as splats."""
        poses = _poses(frame.tracks)
        met = met_proposals(
            frame.proposals, poses, models=self._models, symmetry_of_kind=SYMMETRY_OF_KIND
        )
        return [
            *proposed_splats(frame.proposals, self._models, met=met),
            *(primitive_splats(item) for item in frame.primitives),
        ]

    def _header(self, frame: FilmFrame) -> Words:
        left = float(GAP_PX + 4)
        clock = f"{frame.t_ns / 1e9:6.1f} s"
        right = WIDTH_PX - GAP_PX - 4 - width_of(clock, 20, bold=True)
        words: Words = [
            ((left, 24.0), self._title.scene, INK, 18, True),
            (
                (left + 14 + width_of(self._title.scene, 18, bold=True), 24.0),
                self._title.detail + _since_fork(frame.t_ns, self._title.fork_ns),
                FAINT,
                13,
                False,
            ),
            ((right, 26.0), clock, INK, 20, True),
        ]
        captions = ("360° camera, front lens", "twin, same viewpoint", "twin from above")
        for place, caption in enumerate(captions):
            x = left + place * (PANEL_PX + GAP_PX)
            words.append(((x, HEADER_PX - 9.0), caption, FAINT, 13, False))
        x = left + 2 * (PANEL_PX + GAP_PX) + width_of(captions[2], 13) + 18
        for text, colour in (("— true", TRUTH), ("● on site", LOCAL), ("● remote", REMOTE)):
            words.append(((x, HEADER_PX - 9.0), text, colour, 12, False))
            x += width_of(text, 12) + 14
        return words

    def _footer(self, frame: FilmFrame) -> Words:
        """One column per object: name, state, and how far the track is from the truth."""
        words: Words = []
        column = (WIDTH_PX - 2 * GAP_PX) / max(len(frame.tracks), 1)
        top = HEADER_PX + PANEL_PX
        for place, (object_id, track) in enumerate(frame.tracks.items()):
            x = GAP_PX + 4 + place * column
            model = self._models[object_id]
            words.append(((x, top + 24.0), model.name, INK, 14, True))
            after = x + width_of(model.name, 14, bold=True) + 10
            room_px = x + column - COLUMN_GAP_PX - after
            state = _longest((f"● {STATE_WORDS[track.state]}", "●"), room_px)
            words.append(((after, top + 24.0), state, STATE_COLOURS[track.state], 13, False))
            truth = frame.truth
            if truth is None or object_id not in truth.world_from_object:
                continue
            symmetry = SYMMETRY_OF_KIND.get(model.kind, 1)
            true = truth.world_from_object[object_id]
            error = pose_error(track.world_from_object, true, symmetry=symmetry)
            turn = f"{error.yaw_deg:5.1f}°" if symmetry else "  round"
            seen = truth.visible_fraction.get(object_id, 1.0)
            short = f"{error.world_cm:4.1f} cm {turn}"
            texts = (f"off by {short} · {seen:.0%} in sight", f"{short} · {seen:.0%}", short)
            text = _longest(texts, column - COLUMN_GAP_PX)
            words.append(((x, top + 48.0), text, FAINT, 13, False))
        return words


def _longest(texts: Sequence[str], room_px: float) -> str:
    """The first of some texts, the longest first, that has room; else the last."""
    return next((text for text in texts if width_of(text, 13) <= room_px), texts[-1])


def _since_fork(t_ns: int, fork_ns: int | None) -> str:
    if fork_ns is None:
        return ""
    if t_ns < fork_ns:
        return f" · as recorded until {fork_ns / 1e9:g} s"
    return f" · FORK since {fork_ns / 1e9:g} s"


def _poses(tracks: Mapping[str, TrackedObject]) -> dict[str, Pose]:
    return {object_id: track.world_from_object for object_id, track in tracks.items()}


def _camera_panel(frame: Frame) -> Picture:
    """(PANEL_PX, PANEL_PX, 3) RGB of the front lens, cut to the lens's circle like the twin's."""
    size = (PANEL_PX, PANEL_PX)
    small = cv2.resize(frame.images[0], size, interpolation=cv2.INTER_AREA)
    lens = lens_camera(frame.rig.lenses[0], PANEL_PX)
    y, x = np.mgrid[:PANEL_PX, :PANEL_PX] + 0.5
    outside = np.hypot(x - lens.cx, y - lens.cy) > lens.circle_px
    small[outside] = (np.array(BACKGROUND) * 255).astype(np.uint8)
    return cast(Picture, small)
