"""Gyro and exposure records of a trailer, as arrays in SI units on the camera's own axes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.insta360.files.metadata import STANDARD_GRAVITY_M_S2, Metadata
from devices.insta360.files.trailer import TrailerError

_RAW = np.dtype([("t", "<u8"), ("accel", "<u2", 3), ("gyro", "<u2", 3)])
_FLOAT = np.dtype([("t", "<u8"), ("accel", "<f8", 3), ("gyro", "<f8", 3)])
_EXPOSURE = np.dtype([("t", "<u8"), ("exposure", "<f8")])

_ZERO, _SPAN = 32768, 32768.0
"""Raw samples are 16-bit numbers around the middle of their range."""

LATEST_NS = (1 << 63) - 1
"""Times are signed 64-bit nanoseconds."""


@dataclass(frozen=True, slots=True, eq=False)
class GyroSamples:
    """Samples of the inertial sensor, in its own axes, which differ between models.

    Attributes:
        t_ns: (N,) int64, the camera's clock.
        accel_m_s2: (N, 3) specific force.
        gyro_rad_s: (N, 3) angular velocity.
    """

    t_ns: NDArray[np.int64]
    accel_m_s2: NDArray[np.float64]
    gyro_rad_s: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Exposures:
    """Exposure of each picture.

    Attributes:
        t_ns: (N,) int64, the camera's clock.
        exposure_s: (N,).
    """

    t_ns: NDArray[np.int64]
    exposure_s: NDArray[np.float64]


def read_gyro(data: bytes, metadata: Metadata) -> GyroSamples:
    """The gyro record of a file with this metadata, which says in what form samples are.

    Raises:
        TrailerError: its size or a time cannot be; raw samples without their ranges.
        ProtobufError: the metadata's ranges are no message.
    """
    records = _array(data, _RAW if metadata.raw_gyro else _FLOAT, "gyro")
    accel, gyro = records["accel"].astype(np.float64), records["gyro"].astype(np.float64)
    if metadata.raw_gyro:
        ranges = metadata.gyro_ranges
        if ranges is None:
            raise TrailerError("gyro record: raw samples, but the metadata lacks their ranges")
        accel = (accel - _ZERO) * (ranges[0] / _SPAN)
        gyro = (gyro - _ZERO) * (math.radians(ranges[1]) / _SPAN)
    return GyroSamples(_times(records["t"], metadata), accel * STANDARD_GRAVITY_M_S2, gyro)


def write_gyro(samples: GyroSamples, metadata: Metadata) -> bytes:
    """Inverse of `read_gyro`; raw samples beyond their range are set to its ends.

    Raises:
        TrailerError: raw samples without their ranges, or a time before zero.
        ProtobufError: the metadata's ranges are no message.
    """
    records = np.zeros(len(samples.t_ns), _RAW if metadata.raw_gyro else _FLOAT)
    records["t"] = _ticks(samples.t_ns, metadata)
    accel = samples.accel_m_s2 / STANDARD_GRAVITY_M_S2
    if metadata.raw_gyro:
        ranges = metadata.gyro_ranges
        if ranges is None:
            raise TrailerError("gyro record: raw samples, but the metadata lacks their ranges")
        records["accel"] = _counts(accel, ranges[0])
        records["gyro"] = _counts(samples.gyro_rad_s, math.radians(ranges[1]))
    else:
        records["accel"], records["gyro"] = accel, samples.gyro_rad_s
    return records.tobytes()


def read_exposures(data: bytes, metadata: Metadata) -> Exposures:
    """The exposure record of a file with this metadata.

    Raises:
        TrailerError: its size or a time cannot be.
    """
    records = _array(data, _EXPOSURE, "exposure")
    return Exposures(_times(records["t"], metadata), records["exposure"].astype(np.float64))


def write_exposures(exposures: Exposures, metadata: Metadata) -> bytes:
    """Inverse of `read_exposures`.

    Raises:
        TrailerError: a time before zero.
    """
    records = np.zeros(len(exposures.t_ns), _EXPOSURE)
    records["t"] = _ticks(exposures.t_ns, metadata)
    records["exposure"] = exposures.exposure_s
    return records.tobytes()


def _array(data: bytes, kind: np.dtype[np.void], name: str) -> NDArray[np.void]:
    if len(data) % kind.itemsize:
        raise TrailerError(
            f"{name} record of {len(data)} bytes, wanted a multiple of {kind.itemsize}"
        )
    return np.frombuffer(data, kind)


def _times(ticks: NDArray[np.uint64], metadata: Metadata) -> NDArray[np.int64]:
    if len(ticks) and int(ticks.max()) > LATEST_NS // metadata.tick_ns:
        raise TrailerError(f"record with a time of {int(ticks.max())}: no camera's clock")
    return ticks.astype(np.int64) * metadata.tick_ns


def _ticks(t_ns: NDArray[np.int64], metadata: Metadata) -> NDArray[np.uint64]:
    if len(t_ns) and int(t_ns.min()) < 0:
        raise TrailerError(f"record with a time of {int(t_ns.min())} ns, wanted at least 0")
    return (t_ns // metadata.tick_ns).astype(np.uint64)


def _counts(values: NDArray[np.float64], full_scale: float) -> NDArray[np.uint16]:
    counts = np.round(values * (_SPAN / full_scale)) + _ZERO
    return np.clip(counts, 0, 65535).astype(np.uint16)
