"""Lenses of an Insta360 as the camera calibrated them itself, in the studio's camera model.

Only version 3 of its strings is used. Version 1 is a circle without distortion, off by 5 % between
axis and rim; how version 2 scales its polynomial is not published.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.insta360.files.metadata import WindowCrop, read_metadata
from devices.insta360.files.offsets import LensV3, OffsetError, OffsetsV3, read_offsets
from devices.insta360.files.trailer import METADATA, TrailerError, read_trailer
from devices.insta360.protobuf import ProtobufError
from scenes.cameras import Fisheye, Rig
from scenes.frames import FRONT_FROM_BACK_LENS
from scenes.pose import Pose

Values = NDArray[np.float64]

MAX_ANGLE_RAD = math.radians(100.0)
"""Half the field of view that is used: the vendor gives 200° for X3 to X5, and the circle of a
published X5's string ends there at its square's border."""

MAX_MISFIT = 0.002
"""Root mean square of what our model leaves over, as a share of the lens picture's side. A
published X5 has 0.0004 (0.6 px of 1440): five times that is another lens than its string says."""

MAX_LENS_DISTANCE_M = 0.2
"""Metres between two lenses of one camera; the published X5 has 0.032. Chosen: wider than any 360°
camera that is held in a hand, so that a wrong unit is refused."""

ANGLES, TURNS = 101, 36
"""Directions to which a lens is fitted: from the axis to `MAX_ANGLE_RAD`, and around it. Chosen:
the result is the same to 0.01 px with twice as many."""


@dataclass(frozen=True, slots=True)
class CarriedLenses:
    """Calibration of its two lenses that a camera, or a file of it, carries.

    Attributes:
        words: the string (`offsets.py`).
        camera: model in its own words; empty if unsaid.
        crop: part of the sensor that is in the picture; None for all of it.
    """

    words: str
    camera: str = ""
    crop: WindowCrop | None = None

    def rig(self, size_px: int, *, turns: tuple[int, int] = (0, 0)) -> Rig:
        """Return its lenses for upright pictures of a size, back to back.

        By how the lenses are tilted, under 1°, nothing is turned: its sense is not published, and
        what fits lenses to a room finds it.

        Args:
            size_px: side of a lens's picture.
            turns: quarter turns clockwise of the stored pictures that were undone.

        Raises:
            OffsetError: no calibration, another version, or one that no such camera has.
        """
        offsets = read_offsets(self.words) if self.words else None
        if not isinstance(offsets, OffsetsV3) or len(offsets.lenses) != 2:
            found = (
                "no calibration"
                if offsets is None
                else f"{type(offsets).__name__[-2:]} of {len(offsets.lenses)} lenses"
            )
            raise OffsetError(f"lens calibration: {found}, wanted version 3 of 2 lenses")
        pairs = zip(offsets.lenses, turns, strict=True)
        lenses = tuple(
            _fitted(lens, size_px, index=index, turn=turn, crop=self.crop)
            for index, (lens, turn) in enumerate(pairs)
        )
        front, back = offsets.lenses
        apart_m = math.dist((front.tx_m, front.ty_m, front.tz_m), (back.tx_m, back.ty_m, back.tz_m))
        if apart_m > MAX_LENS_DISTANCE_M:
            raise OffsetError(
                f"lens calibration: lenses {apart_m:g} m apart, wanted at most "
                f"{MAX_LENS_DISTANCE_M:g} m"
            )
        behind = Pose(FRONT_FROM_BACK_LENS.rotation, np.array([0.0, 0.0, -apart_m]))
        return Rig(lenses, (Pose.identity(), behind))


def read_carried(path: Path) -> CarriedLenses | None:
    """Return the calibration that a file carries; None where it has none of any version.

    Raises:
        OffsetError: its trailer is damaged; names the file.
        OSError: it cannot be read.
    """
    try:
        trailer = read_trailer(path)
        data = None if trailer is None else trailer.data(METADATA)
        metadata = None if data is None else read_metadata(data)
        if metadata is None or not metadata.offset:
            return None
        return CarriedLenses(metadata.offset, metadata.camera_type, metadata.window_crop)
    except TrailerError as error:
        raise OffsetError(str(error)) from None
    except ProtobufError as error:
        raise OffsetError(f"{path}: metadata: {error}; copy it from the camera again") from None


def _fitted(
    lens: LensV3, size_px: int, *, index: int, turn: int, crop: WindowCrop | None
) -> Fisheye:
    """Return the lens of our model that puts directions where the vendor's puts them."""
    grid = np.meshgrid(
        np.linspace(0.0, MAX_ANGLE_RAD, ANGLES),
        np.linspace(0.0, 2 * math.pi, TURNS, endpoint=False),
    )
    theta, phi = grid[0].ravel(), grid[1].ravel()
    x_px, y_px = _place(lens, theta=theta, phi=phi)
    x, y = _in_picture(
        (x_px - index * lens.height_px) / lens.height_px, y_px / lens.height_px, crop=crop
    )
    wanted = size_px * np.concatenate([x, y])
    powers = theta[:, None] ** (2 * np.arange(5) + 1)
    one, none = np.ones((len(theta), 1)), np.zeros((len(theta), 1))
    terms = np.concatenate(
        [
            np.hstack([powers * np.cos(phi)[:, None], one, none]),
            np.hstack([powers * np.sin(phi)[:, None], none, one]),
        ]
    )
    found = np.linalg.lstsq(terms, wanted, rcond=None)[0]
    misfit = math.sqrt(2 * float(np.mean((terms @ found - wanted) ** 2))) / size_px
    where = f"lens calibration: lens {index}"
    centre = found[5:] / size_px - 0.5
    if not (misfit <= MAX_MISFIT and found[0] > 0 and float(np.abs(centre).max()) < 0.25):
        raise OffsetError(
            f"{where}: centre {found[5]:.0f}, {found[6]:.0f} of {size_px} px, {100 * misfit:.2f} % "
            f"left over; wanted within a quarter of the middle and at most {100 * MAX_MISFIT:g} %"
        )
    # A quarter turn anticlockwise takes what is right to the top, what is down to the right.
    for _ in range(turn):
        centre = np.array([centre[1], -centre[0]])
    cx, cy = (float(value) for value in size_px * (centre + 0.5))
    k1, k2, k3, k4 = (float(value) for value in found[1:5] / found[0])
    try:
        return Fisheye(size_px, size_px, float(found[0]), cx, cy, MAX_ANGLE_RAD, (k1, k2, k3, k4))
    except ValueError as error:
        raise OffsetError(f"{where}: {error}") from None


def _place(lens: LensV3, *, theta: Values, phi: Values) -> tuple[Values, Values]:
    """Return pixels on the vendor's canvas of directions by angle off axis and around it."""
    ahead = np.cos(theta) + lens.xi
    if float(ahead.min()) <= 0.05:
        raise OffsetError(
            f"lens calibration: xi {lens.xi:g}, wanted more than "
            f"{0.05 - math.cos(MAX_ANGLE_RAD):.2f}"
        )
    x, y = np.sin(theta) * np.cos(phi) / ahead, np.sin(theta) * np.sin(phi) / ahead
    r2 = x * x + y * y
    grown = 1.0 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3))
    u = x * grown + 2 * lens.p1 * x * y + lens.p2 * (r2 + 2 * x * x)
    v = y * grown + lens.p1 * (r2 + 2 * y * y) + 2 * lens.p2 * x * y
    return lens.fx_px * u + lens.cx_px, lens.fy_px * v + lens.cy_px


def _in_picture(x: Values, y: Values, *, crop: WindowCrop | None) -> tuple[Values, Values]:
    """Return shares of the stored picture's side of shares of the lens's square on the canvas."""
    if crop is None or not (crop.sensor_width_px > 0 and crop.width_px > 0):
        return x, y
    share = crop.width_px / crop.sensor_width_px
    left, top = crop.x_px / crop.sensor_width_px, crop.y_px / crop.sensor_width_px
    if left == 0.0 and top == 0.0:
        # A camera that does not say where its window lies has it in the middle.
        left = top = 0.5 * (1.0 - share)
    if not (share <= 1.0 and left >= 0.0 and top >= 0.0 and max(left, top) + share <= 1.0 + 1e-9):
        raise OffsetError(
            f"lens calibration: a window of {crop.width_px} px at {crop.x_px}, {crop.y_px} of a "
            f"sensor of {crop.sensor_width_px} px, wanted one inside it"
        )
    return (x - left) / share, (y - top) / share
