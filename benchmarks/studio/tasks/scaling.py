"""D4: a splat file of unknown unit gets its metres from two clicks in the view and one number."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.studio.shown import has_picture, rest, shown_window
from studio.console.rows import Row, at_most

if TYPE_CHECKING:
    from scenes.splats import SplatCloud

ERROR_BAR_PERCENT, SCALED_BAR_S, CLICKS_BAR = 2.0, 120.0, 6
UNITS_PER_M = 2.7
"""Of the file: as arbitrary as structure from motion leaves it."""
COMPARED = 4000
"""Pairs of splats whose distances are compared with the true ones."""


def metric_scale(folder: Path) -> list[Row]:
    """D4: the room `desk` as a file of unknown unit; its two printed codes are this far apart."""
    from scenes.formats.ply import write_ply
    from scenes.frames import WORLD_FROM_FORWARD_CAMERA
    from scenes.harmonics import turned
    from scenes.opening import open_scene

    desk = open_scene("desk")
    ends = np.stack([code.world_from_code.translation for code in desk.codes])
    upright = replace(
        desk.room, means=desk.room.means * UNITS_PER_M, scales=desk.room.scales * UNITS_PER_M
    )
    path = folder / "of-elsewhere.ply"
    write_ply(path, turned(upright, WORLD_FROM_FORWARD_CAMERA.inverse()))

    window, wait = shown_window("desk", home=folder / "home")
    wait(lambda: window.is_filled and has_picture(window))
    bench = window.bench

    def is_open(name: str) -> bool:
        return bench.scene is not None and bench.scene.name == name and has_picture(window)

    bench.perform("file.drop", paths=[str(path)])
    wait(lambda: is_open(path.name))
    begin = time.monotonic()
    bench.perform("view.tool_measure")
    _click(window, wait, ends * UNITS_PER_M)
    bench.perform("preparation.set_scale", metres=float(np.linalg.norm(ends[1] - ends[0])))
    wait(lambda: bench.document.scene != str(path) and is_open(path.name))
    scaled_s = time.monotonic() - begin
    scene = bench.scene
    assert scene is not None
    factor = _scale_of(scene.room, desk.room)
    floor_m = float(np.percentile(scene.room.means[:, 2], 1))
    window.close()
    error_percent = 100 * abs(factor - 1)
    # The tool, two ends, the number, the button.
    return [
        at_most("studio.D4.length_error_percent", error_percent, "%", bar=ERROR_BAR_PERCENT),
        at_most("studio.D4.scaled_s", scaled_s, "s", bar=SCALED_BAR_S),
        at_most("studio.D4.clicks", 5, "", bar=CLICKS_BAR),
        Row("studio.D4.floor_m", floor_m, "m"),
    ]


def _click(window: Any, wait: Any, places: NDArray[np.float64]) -> None:
    """Click where places are seen, the view turned so that it shows them all."""
    from PySide6.QtCore import QPoint, Qt
    from PySide6.QtTest import QTest

    from studio.app.viewport.orbit import Orbit

    view = window.view.active
    x, y, z = (float(v) for v in places.mean(axis=0))
    # From across the room both codes are seen.
    orbit = Orbit((x, y, z), math.radians(-141.0), 0.05, 3.0 * UNITS_PER_M)
    view.set_viewer(replace(view.viewer, orbit=orbit))
    rest(wait, 1.0)
    wait(lambda: view.painted.is_full)
    shown = view.painted.view
    pixels, _ = shown.camera.project(shown.world_from_camera.inverse() @ places)
    width_px, height_px = shown.camera.width_px, shown.camera.height_px
    per_px = np.array([view.width() / width_px, view.height() / height_px])
    for pixel in np.rint(pixels * per_px).astype(int):
        at = QPoint(*pixel.tolist())
        QTest.mouseClick(view, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, at)


def _scale_of(found: SplatCloud, true: SplatCloud) -> float:
    """How much longer lengths are than they should be; both hold the same splats in one order."""
    rng = np.random.default_rng(0)
    a, b = rng.integers(0, len(true), (2, COMPARED))
    spans = [np.linalg.norm(c.means[a] - c.means[b], axis=1) for c in (found, true)]
    apart = spans[1] > 0
    return float(np.median(spans[0][apart] / spans[1][apart]))
