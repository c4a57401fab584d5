"""The traced light of a built-in room on disk: small, and tied to the room's shape.

Light is kept as the square root of its factor in 2048 steps up to `BRIGHTEST`; neighbours differ
little, so differences are stored, low and high bytes apart, and compress well.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from scenes.samples.light import Float32Array, Texels

DATA = Path(__file__).parent / "data"
BRIGHTEST = 8.0
"""Largest factor of light that is kept."""
STEPS = 2048
"""Steps of its square root."""
MOVED_M = 1e-3
"""A texel that lies farther from where it was traced belongs to another room."""


def save_light(path: Path, texels: Texels, light: Float32Array) -> None:
    """Writes the light (N, 3) of a room's texels.

    Raises:
        OSError: the file cannot be written.
    """
    level = np.sqrt(np.clip(light, 0.0, BRIGHTEST) / BRIGHTEST)
    steps = np.round(level * (STEPS - 1)).astype(np.uint16)
    change = np.diff(steps, axis=0, prepend=np.zeros((1, 3), np.uint16))
    low, high = (change & 0xFF).astype(np.uint8), (change >> 8).astype(np.uint8)
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(path, low=low.T, high=high.T, marks=_marks(texels))


def load_light(path: Path, texels: Texels) -> Float32Array:
    """(N, 3) light of a room's texels as `save_light` wrote it.

    Raises:
        ValueError: it was traced for a room of another shape, or never.
    """
    remedy = f"run: python -m benchmarks.trace_light {path.stem}"
    if not path.exists():
        raise ValueError(f"{path}: no light was traced for this room; {remedy}")
    with np.load(path, allow_pickle=False) as arrays:
        marks = arrays["marks"]
        change = arrays["low"].T + 256 * arrays["high"].T.astype(np.uint16)
    wanted = _marks(texels)
    if marks.shape != wanted.shape or np.abs(marks - wanted).max() > MOVED_M:
        raise ValueError(f"{path}: traced for a room of another shape; {remedy}")
    level = np.cumsum(change, axis=0, dtype=np.uint16).astype(np.float32) / np.float32(STEPS - 1)
    return np.square(level) * np.float32(BRIGHTEST)


def _marks(texels: Texels) -> Float32Array:
    """Centre of every surface's first texel: distinguishes rooms of different shape."""
    sizes = [rows * columns for rows, columns in texels.shapes]
    first = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    return texels.centres[first].astype(np.float32)
