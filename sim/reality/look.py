"""How a scanned room looks to the simulated camera: its second reconstruction, drawn in layers."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye
from scenes.mesh import PhysicalRoom
from scenes.pose import Pose
from scenes.render.renderer import WIDE_RAD, PosedSplats, Renderer, Rendering, RenderOptions
from scenes.splats import SplatCloud
from sim.bodies import Placement
from sim.camera.lens_picture import ROOM_ID, Drawn, Layer, Tolerances
from sim.camera.lens_raster import PixelRect
from sim.reality.light import Irradiance, irradiance_at, relit

SOLID = 0.5
"""Alpha from which on a point of the fine grid shows a body: there its outline runs."""
CONTACT_M = 0.03
"""Depth tolerances: a support is trained to about a splat's size, two centimetres in a room."""
SHADOW_M = 0.06
"""A shadow falls on what is trained to within three of those."""
LIGHT_CELL_M = 0.25
"""Side of the cells in which the light is estimated once: it changes over a window's width."""


class SplatLook:
    """Draws a scanned room; see `sim.camera.camera360.ScannedLook`.

    Args:
        room: with splats of its own.
        renderer: draws them.
        scanned_at: `world_from_object` of those that the room has elsewhere than when it was
            scanned, by id.

    Raises:
        ValueError: the room has no splats.
    """

    def __init__(
        self,
        room: PhysicalRoom,
        *,
        renderer: Renderer,
        scanned_at: Mapping[str, Pose] = MappingProxyType({}),
    ) -> None:
        if room.splats is None:
            raise ValueError(f"room {room.name!r} is made of meshes; it needs no other look")
        self._room = room.splats
        self._unseen = _mean_colour(room.splats)
        self._renderer = renderer
        self._objects: Mapping[str, SplatCloud] = {
            item.object_id: item.splats for item in room.objects if item.splats is not None
        }
        here = {item.object_id: item.world_from_object for item in room.objects}
        self._scanned_at = {**here, **scanned_at}
        self._heights_m = {item.object_id: 0.5 * item.box_m[2] for item in room.objects}
        self._light: dict[tuple[int, int, int], Irradiance] = {}

    @property
    def tolerances(self) -> Tolerances:
        """See `sim.camera.camera360.ScannedLook`."""
        return Tolerances(CONTACT_M, SHADOW_M)

    def draws(self, body_id: str) -> bool:
        """See `sim.camera.camera360.ScannedLook`."""
        return body_id in self._objects

    def room(self, lens: Fisheye, world_from_lens: Pose) -> Layer:
        """See `sim.camera.camera360.ScannedLook`."""
        # A ceiling that nobody photographed is not black either.
        options = RenderOptions(background=self._unseen, exact_above_rad=WIDE_RAD)
        drawn = self._renderer.render(
            [PosedSplats(self._room, Pose.identity())], lens, world_from_lens, options
        )
        range_m = np.where(drawn.alpha > SOLID, drawn.depth, np.float32(np.inf))
        ids = np.full(range_m.shape, ROOM_ID, np.uint8)
        return Layer(_bytes(drawn.rgb), range_m, ids)

    def body(
        self,
        body_id: str,
        lens: Fisheye,
        lens_from_world: Pose,
        placement: Placement,
        rect: PixelRect,
    ) -> Drawn:
        """See `sim.camera.camera360.ScannedLook`."""
        (world_from_object,) = placement.world_from_part
        cloud = self._in_its_light(body_id, world_from_object)
        region = (rect.x0, rect.y0, rect.width_px, rect.height_px)
        drawn = self._renderer.render(
            [PosedSplats(cloud, world_from_object)],
            lens,
            lens_from_world.inverse(),
            RenderOptions(region=region),
        )
        return _within(drawn, rect)

    def _in_its_light(self, body_id: str, world_from_object: Pose) -> SplatCloud:
        middle = np.array([0.0, 0.0, self._heights_m[body_id]])
        scanned_at = self._scanned_at[body_id]
        return relit(
            self._objects[body_id],
            before=self._light_at(scanned_at @ middle),
            world_from_object_before=scanned_at,
            now=self._light_at(world_from_object @ middle),
            world_from_object=world_from_object,
        )

    def _light_at(self, place: NDArray[np.float64]) -> Irradiance:
        """Between the light in the middles of the eight cells around a place."""
        at = place / LIGHT_CELL_M - 0.5
        low = np.floor(at).astype(int)
        share = at - low
        total = np.zeros((9, 3))
        for corner in np.ndindex(2, 2, 2):
            weight = float(np.prod(np.where(corner, share, 1.0 - share)))
            x, y, z = (low + corner).tolist()
            total += weight * self._light_in((x, y, z)).coefficients
        return Irradiance(total)

    def _light_in(self, cell: tuple[int, int, int]) -> Irradiance:
        if cell not in self._light:
            middle = (np.array(cell) + 0.5) * LIGHT_CELL_M
            self._light[cell] = irradiance_at(middle, self._room, self._renderer)
        return self._light[cell]


def _mean_colour(room: SplatCloud) -> tuple[float, float, float]:
    """RGB of a room's splats, each weighed by how much it covers."""
    sizes = np.sort(room.scales.astype(np.float64), axis=1)[:, 1:].prod(axis=1)
    colours = np.clip(room.colours().astype(np.float64), 0.0, 1.0)
    red, green, blue = np.average(colours, axis=0, weights=sizes * room.opacities)
    return float(red), float(green), float(blue)


def _within(drawn: Rendering, rect: PixelRect) -> Drawn:
    """Colour and range of what is solid in a rectangle of a picture."""
    where = rect.rows_columns
    alpha, depth = drawn.alpha[where], drawn.depth[where]
    colour = drawn.rgb[where] / np.maximum(alpha, np.float32(SOLID))[..., None]
    return _bytes(colour), np.where(alpha > SOLID, depth, np.float32(np.inf))


def _bytes(rgb: NDArray[np.floating]) -> NDArray[np.uint8]:
    return np.round(255.0 * np.clip(rgb, 0.0, 1.0)).astype(np.uint8)
