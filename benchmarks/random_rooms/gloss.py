"""Highlights on shiny objects. They lie where light and view put them, so they change with both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.samples.shapes import Surface

FloatArray = NDArray[np.float64]

SHARP = 40.0
"""Exponent of the highlight that one camera sees (Blinn 1977); lacquer and glazes have 20 to
100."""

BLURRED = 9.0
"""The same in a scan, which averages the highlights of views from all around."""

SCAN_SHARE = 0.35
"""How much of a highlight is left in that average."""


def seen_from(
    surfaces: Sequence[Surface], halfway: FloatArray, strength: float
) -> tuple[Surface, ...]:
    """The surfaces with the highlight that one camera sees.

    Args:
        surfaces: of an object.
        halfway: (3,) unit vector between the directions to light and camera, in the object's frame.
        strength: 0..1 of full white.
    """
    return _with_highlight(surfaces, halfway, strength, SHARP)


def scanned(
    surfaces: Sequence[Surface], halfway: FloatArray, strength: float
) -> tuple[Surface, ...]:
    """The surfaces with the pale, wide highlight that a scan keeps; arguments as in `seen_from`."""
    return _with_highlight(surfaces, halfway, SCAN_SHARE * strength, BLURRED)


def _with_highlight(
    surfaces: Sequence[Surface], halfway: FloatArray, strength: float, exponent: float
) -> tuple[Surface, ...]:
    if strength <= 0:
        return tuple(surfaces)
    result: list[Surface] = []
    for surface in surfaces:
        facing = np.maximum(_normals(surface.points) @ halfway, 0.0)
        height, width = surface.picture.shape[:2]
        smooth = np.asarray(cv2.resize(facing.astype(np.float32), (width, height)))
        added = 255.0 * strength * smooth.reshape(height, width, 1) ** exponent
        bright = np.clip(surface.picture + added, 0, 255).astype(np.uint8)
        result.append(replace(surface, picture=bright))
    return tuple(result)


def _normals(points: FloatArray) -> FloatArray:
    """(R, C, 3) unit normals at the points of a grid; zero where it has no area."""
    down, across = np.gradient(points, axis=0), np.gradient(points, axis=1)
    normals = np.cross(down, across)
    return normals / np.maximum(np.linalg.norm(normals, axis=2, keepdims=True), 1e-12)
