"""Objects as they are drawn into the lens pictures, kept while they and the camera stand still."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import replace

import numpy as np

from scenes.cameras import Fisheye
from scenes.render.renderer import PosedSplats, Renderer, RenderOptions
from tracking.window import Layer, Window

KEPT = 64
"""Layers that are kept; the one not asked for longest goes first."""

RENDER_OPTIONS = RenderOptions(threads=1, antialias=True)


class LayerMemo:
    """Remembers drawings. It never changes an answer: what is kept is what would be drawn."""

    def __init__(self) -> None:
        self._layers: OrderedDict[tuple[str, int, bytes], Layer] = OrderedDict()

    def layer(
        self,
        object_id: str,
        posed: PosedSplats,
        window: Window,
        lens: Fisheye,
        renderer: Renderer,
    ) -> Layer:
        """An object drawn alone at the lens's own pixels.

        Args:
            object_id: of the object.
            posed: its splats, where they are.
            window: around the object; only what is inside is drawn.
            lens: the whole lens.
            renderer: draws splats.
        """
        where = np.concatenate(
            [posed.world_from_object.matrix().ravel(), window.world_from_camera.matrix().ravel()]
        )
        key = (object_id, window.lens, where.tobytes())
        found = self._layers.get(key)
        if found is None:
            found = _drawn(posed, window, lens, renderer)
            self._layers[key] = found
            if len(self._layers) > KEPT:
                self._layers.popitem(last=False)
        else:
            self._layers.move_to_end(key)
        return found


def _drawn(posed: PosedSplats, window: Window, lens: Fisheye, renderer: Renderer) -> Layer:
    camera = replace(
        lens,
        width_px=window.camera.width_px * window.shrink,
        height_px=window.camera.height_px * window.shrink,
        cx=lens.cx - window.left,
        cy=lens.cy - window.top,
    )
    drawn = renderer.render((posed,), camera, window.world_from_camera, RENDER_OPTIONS)
    rows = np.flatnonzero(drawn.alpha.max(axis=1) > 0)
    columns = np.flatnonzero(drawn.alpha.max(axis=0) > 0)
    if len(rows) == 0:
        rows = columns = np.zeros(1, dtype=np.intp)
    part = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1))
    return Layer(
        window.left + int(columns[0]),
        window.top + int(rows[0]),
        np.ascontiguousarray(drawn.rgb[part]),
        np.ascontiguousarray(drawn.alpha[part]),
        np.ascontiguousarray(drawn.depth[part]),
    )
