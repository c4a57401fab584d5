"""Personal video, port 3810: the camera is started, streamed from, and stopped.

Each is a connection of its own. A stream's payload is an encoded picture and a trailer about it.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum

from devices.hololens.wire.packets import MODE_CALIBRATION, MODE_DATA, MODE_POSE
from devices.hololens.wire.taking import Take, WireError, taken

START, STOP = 0x07, 0x0B
"""First bytes that start the camera and stop it: flags 4 and 8, with mode 3."""

STARTING = struct.Struct("<7B3f2I")
"""After `START`: seven switches, opacity, output width and height, stabilisation, perspective."""

REQUEST = struct.Struct("<HHBBBBIB")
"""After the mode: width, height, pictures a second, divisor, profile, level, bit rate, options."""

OPTION = struct.Struct("<QQ")
"""One option of the encoder: its key and value."""

CALIBRATION_REQUEST = struct.Struct("<HHB")
"""After mode 2: width, height, pictures a second."""

CALIBRATION_FLOATS = 52
"""Numbers of a calibration: 2, 2, 3, 2, 16, 16, 4, 7."""

TRAILER = struct.Struct("<4fQ2QIIII2f3fHH")
"""After each picture, 80 bytes: focal length, principal point, exposure and its compensation, lens
position, focus state, ISO, white balance, gains of ISO and white balance, width, height."""

RAW_ALIGNMENT = 64
"""Rows of raw pictures are so many bytes long, or the next multiple."""

GROUP_OPTION = 10
"""Key of the option that says how many pictures there are from one keyframe to the next."""

DEFAULT_LEVEL = 255
"""Level that leaves the choice to the headset."""

MAX_PAYLOAD_BYTES = 1 << 24
"""Largest payload, bytes: five times the largest raw picture, 1952 × 1100."""

ACCESS_UNIT_DELIMITER = b"\x00\x00\x00\x01\x09\x10"
"""Begin of every H.264 picture: clients cut off six bytes without looking. 0x10: I pictures only
may follow; 0xF0 says any."""

ANY_PICTURE_DELIMITER = b"\x00\x00\x00\x01\x09\xf0"
"""The same for pictures of any kind."""


class Profile(IntEnum):
    """How pictures are coded."""

    H264_BASE = 0
    H264_MAIN = 1
    H264_HIGH = 2
    HEVC_MAIN = 3
    RAW = 255


FORMATS: dict[tuple[int, int], tuple[int, ...]] = {
    (1952, 1100): (15, 30, 60),
    (1920, 1080): (15, 30),
    (1504, 846): (5, 15, 30, 60),
    (1280, 720): (15, 30),
    (1128, 636): (15, 30),
    (960, 540): (15, 30),
    (760, 428): (15, 30),
    (640, 360): (15, 30),
    (500, 282): (15, 30),
    (424, 240): (15, 30),
}
"""Sizes in pixels that the camera has, and their pictures a second."""


@dataclass(frozen=True, slots=True)
class StartVideo:
    """Start of the camera, with what mixed-reality capture would put into its pictures."""

    enable_mrc: bool = False
    hologram_composition: bool = False
    recording_indicator: bool = False
    video_stabilization: bool = False
    blank_protected: bool = False
    show_mesh: bool = False
    shared: bool = False
    global_opacity: float = 0.9
    output_width: float = 0.0
    output_height: float = 0.0
    stabilization_length: int = 0
    perspective: int = 1


@dataclass(frozen=True, slots=True)
class StopVideo:
    """Stop of the camera."""


@dataclass(frozen=True, slots=True)
class VideoRequest:
    """Request for a stream.

    Attributes:
        has_pose: whether poses are wanted.
        width_px: one of `FORMATS`.
        height_px: likewise.
        fps: likewise.
        divisor: every so many pictures one is sent.
        profile: of `Profile`.
        level: of the encoder.
        bitrate: bits a second.
        options: keys and values for the encoder.
    """

    has_pose: bool
    width_px: int
    height_px: int
    fps: int
    divisor: int
    profile: Profile
    level: int
    bitrate: int
    options: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True, slots=True)
class CalibrationRequest:
    """Request for what is known of the lens at a size."""

    width_px: int
    height_px: int
    fps: int


VideoOpening = StartVideo | StopVideo | VideoRequest | CalibrationRequest
"""All that a client may say, as the first thing and the last."""


def encode_opening(opening: VideoOpening) -> bytes:
    """Return what a client sends."""
    match opening:
        case StartVideo():
            switches = (
                opening.enable_mrc,
                opening.hologram_composition,
                opening.recording_indicator,
                opening.video_stabilization,
                opening.blank_protected,
                opening.show_mesh,
                opening.shared,
            )
            return bytes([START]) + STARTING.pack(
                *switches,
                opening.global_opacity,
                opening.output_width,
                opening.output_height,
                opening.stabilization_length,
                opening.perspective,
            )
        case StopVideo():
            return bytes([STOP])
        case CalibrationRequest():
            size = CALIBRATION_REQUEST.pack(opening.width_px, opening.height_px, opening.fps)
            return bytes([MODE_CALIBRATION]) + size
        case VideoRequest():
            head = REQUEST.pack(
                opening.width_px,
                opening.height_px,
                opening.fps,
                opening.divisor,
                opening.profile,
                opening.level,
                opening.bitrate,
                len(opening.options),
            )
            mode = MODE_POSE if opening.has_pose else MODE_DATA
            return bytes([mode]) + head + b"".join(OPTION.pack(*each) for each in opening.options)


def read_opening(take: Take) -> VideoOpening:
    """Read what a client sends.

    Raises:
        WireError: the mode or the profile is none.
    """
    mode = take(1)[0]
    if mode == START:
        values = taken(take, STARTING)
        return StartVideo(*map(bool, values[:7]), *values[7:])
    if mode == STOP:
        return StopVideo()
    if mode == MODE_CALIBRATION:
        return CalibrationRequest(*taken(take, CALIBRATION_REQUEST))
    if mode not in (MODE_DATA, MODE_POSE):
        raise WireError(f"personal video: mode {mode}, wanted 0, 1, 2, {START} or {STOP}")
    *form, profile, level, bitrate, count = taken(take, REQUEST)
    options = tuple(OPTION.iter_unpack(take(OPTION.size * count)))
    try:
        known = Profile(profile)
    except ValueError:
        raise WireError(f"personal video: profile {profile}, wanted 0..3 or 255") from None
    width, height, fps, divisor = form
    return VideoRequest(
        mode == MODE_POSE, width, height, fps, divisor, known, level, bitrate, options
    )


def default_bitrate(width_px: int, height_px: int, *, fps: int, profile: Profile) -> int:
    """Return the bits a second that clients ask for where nobody says another rate."""
    per = 150 if profile is Profile.HEVC_MAIN else 75
    return width_px * height_px * fps * 12 // per


@dataclass(frozen=True, slots=True)
class VideoTrailer:
    """Word of the headset on one picture.

    Attributes:
        focal: along x and y, pixels.
        principal: point, pixels, the middle of the first pixel at (0, 0).
        exposure_time: 100 ns.
        exposure_compensation: two numbers of the camera's.
        lens_position: of the focus.
        focus_state: of the focus.
        iso_speed: ISO.
        white_balance: kelvin.
        iso_gains: analogue and digital.
        white_balance_gains: of red, green, blue.
        width_px: of the picture.
        height_px: of the picture.
    """

    focal: tuple[float, float]
    principal: tuple[float, float]
    width_px: int
    height_px: int
    exposure_time: int = 0
    exposure_compensation: tuple[int, int] = (0, 0)
    lens_position: int = 0
    focus_state: int = 0
    iso_speed: int = 0
    white_balance: int = 0
    iso_gains: tuple[float, float] = (1.0, 1.0)
    white_balance_gains: tuple[float, float, float] = (1.0, 1.0, 1.0)


def encode_trailer(trailer: VideoTrailer) -> bytes:
    """Return the 80 bytes after a picture."""
    return TRAILER.pack(
        *trailer.focal,
        *trailer.principal,
        trailer.exposure_time,
        *trailer.exposure_compensation,
        trailer.lens_position,
        trailer.focus_state,
        trailer.iso_speed,
        trailer.white_balance,
        *trailer.iso_gains,
        *trailer.white_balance_gains,
        trailer.width_px,
        trailer.height_px,
    )


def read_payload(payload: bytes) -> tuple[bytes, VideoTrailer]:
    """Return a picture's bytes and what is said of it.

    Raises:
        WireError: the payload is shorter than a trailer.
    """
    if len(payload) < TRAILER.size:
        raise WireError(f"personal video: payload of {len(payload)} bytes, least {TRAILER.size}")
    values = TRAILER.unpack(payload[-TRAILER.size :])
    trailer = VideoTrailer(
        focal=values[0:2],
        principal=values[2:4],
        exposure_time=values[4],
        exposure_compensation=values[5:7],
        lens_position=values[7],
        focus_state=values[8],
        iso_speed=values[9],
        white_balance=values[10],
        iso_gains=values[11:13],
        white_balance_gains=values[13:16],
        width_px=values[16],
        height_px=values[17],
    )
    return payload[: -TRAILER.size], trailer
