"""Objects rendered into the lens pictures, cached while they and the camera do not move."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from scenes.cameras import Fisheye, Rig
from scenes.pose import Pose
from scenes.render.renderer import PosedSplats, Renderer, RenderOptions
from scenes.state import ObjectModel
from tracking.window.extent import extent, part_of
from tracking.window.window import Layer, Window, window_around

LayerKey = tuple[str, int]
"""Object id and lens."""


@dataclass(frozen=True, slots=True, eq=False)
class Drawn:
    """An object as it was drawn last into a lens picture.

    Attributes:
        poses: bytes of the poses of object and rig.
        layer: the drawing.
    """

    poses: bytes
    layer: Layer


RENDER_OPTIONS = RenderOptions(threads=1, antialias=True)


class LayerCache:
    """Cache of rendered layers, for one frame; a cached layer equals a fresh rendering.

    The newest of each object and lens is kept: what moves is never seen at its former pose again,
    and a search takes along what it begins with.

    Args:
        layers: kept from the frame before.
    """

    def __init__(self, layers: Mapping[LayerKey, Drawn] | None = None) -> None:
        self._layers: dict[LayerKey, Drawn] = dict(layers or {})

    def kept(self) -> Mapping[LayerKey, Drawn]:
        """The layers, for the cache of the next frame."""
        return MappingProxyType(dict(self._layers))

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
        key = (item.object_id, lens)
        poses = _bytes_of(world_from_object) + _bytes_of(world_from_rig)
        found = self._layers.get(key)
        if found is None or found.poses != poses:
            posed = PosedSplats(item.splats, world_from_object)
            window = window_of(item, world_from_object, rig, world_from_rig, lens=lens)
            found = Drawn(poses, drawn_layer(posed, window, rig.lenses[lens], renderer))
            self._layers[key] = found
        return found.layer


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
