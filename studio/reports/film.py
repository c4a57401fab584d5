"""The film of a session: camera, twin from the same viewpoint, twin from above, side by side."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import cast

import av
import cv2
import numpy as np
from av.video.frame import VideoFrame
from av.video.reformatter import ColorRange, Colorspace
from av.video.stream import VideoStream
from numpy.typing import NDArray

from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.state import TrackedObject, TrackState
from studio.evaluate.metrics import pose_error
from studio.evaluate.scores import SYMMETRY_OF_KIND
from studio.session.sources import SessionMessage
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
    width_of,
    write_words,
)
from studio.view.surface_drawing import LivePicture
from studio.view.twin import BACKGROUND, Twin, lens_camera

PANEL_PX, GAP_PX, HEADER_PX, FOOTER_PX = 480, 8, 64, 72
WIDTH_PX = 3 * PANEL_PX + 4 * GAP_PX
HEIGHT_PX = HEADER_PX + PANEL_PX + FOOTER_PX

Picture = NDArray[np.uint8]
Words = list[tuple[tuple[float, float], str, Colour, int, bool]]


@dataclass(frozen=True, slots=True)
class FilmTitle:
    """What the header says: the scene, and how the session came about."""

    scene: str
    detail: str


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

    def picture(
        self,
        message: SessionMessage,
        tracks: Mapping[str, TrackedObject],
        live: Sequence[LivePicture] = (),
    ) -> Picture:
        """One picture of the film, (HEIGHT_PX, WIDTH_PX, 3) RGB.

        Args:
            message: the frame, and the truth if there is one.
            tracks: the shown method's answer by object id.
            live: surfaces that show live video.
        """
        background = np.array(BACKGROUND) * 255
        canvas = np.empty((HEIGHT_PX, WIDTH_PX, 3), dtype=np.uint8)
        canvas[:] = background.astype(np.uint8)
        panels = (
            _camera_picture(message),
            self._from_camera(message, tracks, live),
            self._from_above(message, tracks),
        )
        for place, panel in enumerate(panels):
            x = GAP_PX + place * (PANEL_PX + GAP_PX)
            canvas[HEADER_PX : HEADER_PX + PANEL_PX, x : x + PANEL_PX] = panel
        words = self._header(message) + self._footer(message, tracks)
        return write_words(canvas, words)

    def _from_camera(
        self,
        message: SessionMessage,
        tracks: Mapping[str, TrackedObject],
        live: Sequence[LivePicture],
    ) -> Picture:
        rig = message.frame.rig
        camera = lens_camera(rig.lenses[0], PANEL_PX)
        world_from_rig = message.frame.world_from_rig or self._scene.world_from_rig
        world_from_camera = world_from_rig @ rig.rig_from_lens[0]
        drawn = self._twin.picture(_poses(tracks), camera, world_from_camera, live=live)
        for object_id, track in tracks.items():
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
        return drawn

    def _from_above(self, message: SessionMessage, tracks: Mapping[str, TrackedObject]) -> Picture:
        camera, world_from_camera = self._above
        drawn = self._twin.picture_from_above(_poses(tracks), PANEL_PX)
        true_poses = message.truth.recorded.world_from_object if message.truth is not None else {}
        for object_id, track in tracks.items():
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
        for avatar in message.input.avatars:
            draw_avatar(drawn, camera, world_from_camera, avatar)
        return drawn

    def _header(self, message: SessionMessage) -> Words:
        left = float(GAP_PX + 4)
        clock = f"{message.frame.t_ns / 1e9:6.1f} s"
        right = WIDTH_PX - GAP_PX - 4 - width_of(clock, 20, bold=True)
        words: Words = [
            ((left, 24.0), self._title.scene, INK, 18, True),
            (
                (left + 14 + width_of(self._title.scene, 18, bold=True), 24.0),
                self._title.detail,
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

    def _footer(self, message: SessionMessage, tracks: Mapping[str, TrackedObject]) -> Words:
        """One column per object: name, state, and how far the track is from the truth."""
        words: Words = []
        column = (WIDTH_PX - 2 * GAP_PX) / max(len(tracks), 1)
        top = HEADER_PX + PANEL_PX
        for place, (object_id, track) in enumerate(tracks.items()):
            x = GAP_PX + 4 + place * column
            model = self._models[object_id]
            words.append(((x, top + 24.0), model.name, INK, 14, True))
            after = x + width_of(model.name, 14, bold=True) + 10
            state = f"● {STATE_WORDS[track.state]}"
            words.append(((after, top + 24.0), state, STATE_COLOURS[track.state], 13, False))
            truth = message.truth.recorded if message.truth is not None else None
            if truth is None or object_id not in truth.world_from_object:
                continue
            symmetry = SYMMETRY_OF_KIND.get(model.kind, 1)
            true = truth.world_from_object[object_id]
            error = pose_error(track.world_from_object, true, symmetry=symmetry)
            turn = f"{error.yaw_deg:5.1f}°" if symmetry else "  round"
            seen = truth.visible_fraction.get(object_id, 1.0)
            text = f"off by {error.world_cm:4.1f} cm {turn} · {seen:.0%} in sight"
            words.append(((x, top + 48.0), text, FAINT, 13, False))
        return words


def write_film(path: Path, pictures: Iterable[Picture], fps: float) -> int:
    """Write pictures of even size as H.264 (yuv420p) that every player opens.

    Returns:
        How many pictures were written.

    Raises:
        OSError: the disk is full or the place not writable; no film is left then.
    """
    count = 0
    part = path.with_name(path.name + ".part")
    try:
        with av.open(str(part), "w", format="mp4", options={"movflags": "+faststart"}) as container:
            stream: VideoStream | None = None
            for picture in pictures:
                if stream is None:
                    rate = Fraction(fps).limit_denominator(1001)
                    options = {"crf": "21", "preset": "veryfast", "threads": "1"}
                    stream = cast(
                        VideoStream, container.add_stream("libx264", rate=rate, options=options)
                    )
                    stream.height, stream.width = picture.shape[:2]
                    stream.pix_fmt = "yuv420p"
                    stream.codec_context.colorspace = Colorspace.ITU709
                    stream.codec_context.color_range = ColorRange.MPEG
                frame = VideoFrame.from_ndarray(picture, format="rgb24").reformat(
                    format="yuv420p",
                    dst_colorspace=Colorspace.ITU709,
                    dst_color_range=ColorRange.MPEG,
                )
                frame.pts = count
                for packet in stream.encode(frame):
                    container.mux(packet)
                count += 1
            if stream is not None:
                for packet in stream.encode(None):
                    container.mux(packet)
        part.replace(path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise
    return count


def _poses(tracks: Mapping[str, TrackedObject]) -> dict[str, Pose]:
    return {object_id: track.world_from_object for object_id, track in tracks.items()}


def _camera_picture(message: SessionMessage) -> Picture:
    """The front lens's picture at the panel's size, cut to the lens's circle like the twin's."""
    size = (PANEL_PX, PANEL_PX)
    small = cv2.resize(message.frame.images[0], size, interpolation=cv2.INTER_AREA)
    lens = lens_camera(message.frame.rig.lenses[0], PANEL_PX)
    y, x = np.mgrid[:PANEL_PX, :PANEL_PX] + 0.5
    outside = np.hypot(x - lens.cx, y - lens.cy) > lens.circle_px
    small[outside] = (np.array(BACKGROUND) * 255).astype(np.uint8)
    return cast(Picture, small)
