"""High-dynamic-range pictures as a screen for standard range shows them, in Rec. 709."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

HLG, PQ = 18, 16
"""Numbers of the transfer functions in video files. Source: ITU-T H.273, table 3."""
NAMES = {HLG: "HLG", PQ: "PQ"}
WHITE_NITS = 203.0
"""Of a white sheet of paper in HDR pictures. Source: ITU-R BT.2408."""
PEAK_NITS = 1000.0
"""Of the screen that HLG is graded on; its system gamma is then 1.2. Source: ITU-R BT.2100."""
SYSTEM_GAMMA = 1.2
"""System gamma of HLG for a display of 1000 nits (ITU-R BT.2100)."""
LUMINANCE = np.array([0.2627, 0.6780, 0.0593], dtype=np.float32)
"""Weights of red, green and blue in luminance (ITU-R BT.2020)."""
REC709_FROM_REC2020 = np.array(
    [[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]],
    dtype=np.float32,
)
"""Source: ITU-R BT.2087."""
CODES = 65_536
"""Values of a 16-bit signal."""


def hdr_kind(frame: Any) -> str:
    """Kind of HDR of a video's frame; empty for standard range."""
    return NAMES.get(int(frame.color_trc or 0), "")


def bgr_picture(frame: Any, size: tuple[int, int] | None = None) -> NDArray[np.uint8]:
    """(H, W, 3) BGR of a frame as it is stored, HDR tone-mapped.

    Args:
        frame: PyAV's.
        size: width and height to shrink it to.
    """
    shape = {} if size is None else {"width": size[0], "height": size[1], "interpolation": "AREA"}
    if not hdr_kind(frame):
        return frame.reformat(**shape, format="bgr24").to_ndarray()
    codes = frame.reformat(**shape, format="rgb48le").to_ndarray()
    return tone_mapped(codes, int(frame.color_trc))


def tone_mapped(codes: NDArray[np.uint16], transfer: int) -> NDArray[np.uint8]:
    """(H, W, 3) BGR bytes of 16-bit RGB in Rec. 2020; what is brighter than white is white."""
    signal = np.arange(CODES) / (CODES - 1)
    if transfer == PQ:
        light = (_pq_nits(signal) / WHITE_NITS).astype(np.float32)[codes]
    else:
        light = _hlg_light(signal)[codes]
        luminance = np.maximum(light @ LUMINANCE, 1e-6)
        gain = (PEAK_NITS / WHITE_NITS) * luminance ** (SYSTEM_GAMMA - 1.0)
        light = light * gain[..., None]
    linear = np.clip(light @ REC709_FROM_REC2020.T, 0.0, 1.0)
    shown = np.where(
        linear < 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 1e-9) ** (1 / 2.4) - 0.055
    )
    return np.ascontiguousarray(np.rint(255.0 * shown).astype(np.uint8)[..., ::-1])


def _hlg_light(signal: NDArray[np.float64]) -> NDArray[np.float32]:
    """Scene light 0..1. Source: ITU-R BT.2100, table 5."""
    a, b, c = 0.17883277, 0.28466892, 0.55991073
    low, high = signal**2 / 3, (np.exp((signal - c) / a) + b) / 12
    return np.where(signal <= 0.5, low, high).astype(np.float32)


def _pq_nits(signal: NDArray[np.float64]) -> NDArray[np.float64]:
    """Light of the screen in cd/m². Source: ITU-R BT.2100, table 4."""
    m1, m2, c1, c2, c3 = 0.1593017578125, 78.84375, 0.8359375, 18.8515625, 18.6875
    power = signal ** (1 / m2)
    return 10_000 * (np.maximum(power - c1, 0) / (c2 - c3 * power)) ** (1 / m1)
