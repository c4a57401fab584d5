"""Objects rendered into the lens pictures, cached while they and the camera do not move."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from scenes.cameras import Fisheye, Rig
from scenes.pose import Pose
from scenes.render.renderer import PosedSplats, Renderer, RenderOptions
from scenes.state import ObjectModel
from tracking.window.extent import extent, part_of
from tracking.window.window import Layer, Window, window_around

KEPT = 64
"""Number of cached layers; the least recently used is dropped."""


LayerKey = tuple[str, int, bytes, bytes]
"""Object id, lens, and the poses of object and rig."""

RENDER_OPTIONS = RenderOptions(threads=1, antialias=True)


class LayerCache:
    """Cache of rendered layers, for one frame; a cached layer equals a fresh rendering.

    Args:
        layers: kept from the frame before.
    """

    def __init__(self, layers: Mapping[LayerKey, Layer] | None = None) -> None:
        self._layers: OrderedDict[LayerKey, Layer] = OrderedDict(layers or {})

    def kept(self) -> Mapping[LayerKey, Layer]:
        """The layers, least recently used first, for the cache of the next frame."""
        return MappingProxyType(OrderedDict(self._layers))

    def layer(
        self,
        item: ObjectModel,
        world_from_object: Pose,
        rig: Rig,
        world_from_rig: Pose,
        renderer: Renderer,
        *,
        lens: int,
    ) -> Layer:
        """An object drawn alone at a lens's own pixels.

        Args:
            item: the object.
            world_from_object: where it is.
            rig: the 360° camera.
            world_from_rig: its pose.
            renderer: draws splats.
            lens: index of the lens.
        """
        key = (item.object_id, lens, _bytes_of(world_from_object), _bytes_of(world_from_rig))
        found = self._layers.get(key)
        if found is None:
            posed = PosedSplats(item.splats, world_from_object)
            window = window_of(item, world_from_object, rig, world_from_rig, lens=lens)
            found = drawn_layer(posed, window, rig.lenses[lens], renderer)
            self._layers[key] = found
            if len(self._layers) > KEPT:
                self._layers.popitem(last=False)
        else:
            self._layers.move_to_end(key)
        return found


def window_of(
    item: ObjectModel, world_from_object: Pose, rig: Rig, world_from_rig: Pose, *, lens: int
) -> Window:
    """The part of a lens picture that an object is drawn into."""
    centre_m, radius_m = item.sphere()
    centre = world_from_object @ centre_m
    return window_around(rig, world_from_rig, centre, radius_m=radius_m, lens=lens)


def _bytes_of(pose: Pose) -> bytes:
    return pose.rotation.tobytes() + pose.translation.tobytes()


def drawn_layer(posed: PosedSplats, window: Window, lens: Fisheye, renderer: Renderer) -> Layer:
    """An object drawn alone at the lens's own pixels.

    Args:
        posed: its splats, where they are.
        window: around the object; only what is inside is drawn.
        lens: the whole lens.
        renderer: draws splats.
    """
    camera_from_object = window.world_from_camera.inverse() @ posed.world_from_object
    camera = part_of(lens, window.part)
    rows, columns = extent(posed.cloud, camera, camera_from_object, margin_px=1)
    left, top = window.left + columns.start, window.top + rows.start
    camera = part_of(camera, (rows, columns))
    drawn = renderer.render((posed,), camera, window.world_from_camera, RENDER_OPTIONS)
    shown = drawn.alpha > 0
    rows, columns = np.flatnonzero(shown.any(axis=1)), np.flatnonzero(shown.any(axis=0))
    if len(rows) == 0:
        rows = columns = np.zeros(1, dtype=np.intp)
    part = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1))
    return Layer(
        left + int(columns[0]),
        top + int(rows[0]),
        np.ascontiguousarray(drawn.rgb[part]),
        np.ascontiguousarray(drawn.alpha[part]),
        np.ascontiguousarray(drawn.depth[part]),
    )
