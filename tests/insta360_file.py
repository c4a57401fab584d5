"""Files as an Insta360 would write them, of lenses that a test chooses."""

import math
from fractions import Fraction

import av
import numpy as np

from devices.insta360.files.metadata import new_metadata, write_metadata
from devices.insta360.files.offsets import LensV3, OffsetsV3, write_offsets
from devices.insta360.files.trailer import METADATA, PROTOBUF, Trailer, write_trailer

XI = 2.0
"""As in the published X5's string."""


def offsets_of(rig, distance_m=0.03):
    """Version 3 of a rig's lenses, square pictures side by side; the radius is fitted."""
    lenses = []
    for square, lens in enumerate(rig.lenses):
        theta = np.linspace(0.0, math.radians(101.0), 200)
        m = np.sin(theta) / (np.cos(theta) + XI)
        powers = m[:, None] ** np.array([1, 3, 5, 7])
        radius = lens.f_px * sum(
            k * theta ** (2 * n + 1) for n, k in enumerate((1.0, *lens.distortion))
        )
        f, *k = np.linalg.lstsq(powers, radius, rcond=None)[0]
        k1, k2, k3 = (value / f for value in k)
        lenses.append(
            LensV3(
                *(XI, f, f, lens.cx + square * lens.width_px, lens.cy, 0.0, 0.0, 90.0),
                *(0.0, 0.0, -distance_m * square, k1, k2, k3, 0.0, 0.0),
                *(2 * lens.width_px, lens.height_px, 113),
            )
        )
    return OffsetsV3(tuple(lenses), 197632)


def write_insv(path, shots, rig, fps=10):
    """A file with a picture track a lens, RGB, and the calibration of `rig` in its trailer."""
    shots = list(shots)
    with av.open(str(path), "w", format="mp4") as container:
        streams = []
        for picture in shots[0]:
            stream = container.add_stream("libx264", rate=Fraction(fps))
            stream.height, stream.width = picture.shape[:2]
            stream.pix_fmt = "yuv420p"
            stream.options = {"preset": "ultrafast", "crf": "12"}
            streams.append(stream)
        for pictures in shots:
            for stream, picture in zip(streams, pictures, strict=True):
                frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
                container.mux(stream.encode(frame))
        for stream in streams:
            container.mux(stream.encode())
    words = write_offsets(offsets_of(rig))
    metadata = write_metadata(
        new_metadata(serial="IXE36", camera_type="Insta360 X4", firmware="1", offset_v3=words)
    )
    write_trailer(path, path, Trailer().with_record(METADATA, PROTOBUF, metadata))
    return path
