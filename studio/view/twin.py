"""Pictures of the twin: the scan of the room with every object's splats at its tracked pose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.frames import look_at
from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.render.reduction import thinned
from scenes.render.renderer import PosedSplats, Renderer, RenderOptions
from scenes.splats import SplatCloud
from studio.view.contact_shadows import (
    ContactShadow,
    Region,
    contact_shadow,
    draw_contact_shadows,
    tilt_of,
)
from studio.view.open_room import RoomSides, Side, room_sides
from studio.view.resting import RestingView, in_bytes
from studio.view.surface_drawing import LivePicture, draw_surface

Colour = tuple[float, float, float]

BACKGROUND: Colour = (0.055, 0.063, 0.078)
"""Behind everything, seen from outside a room: the colour of the film's frame."""

ABOVE_M = 16.0
"""Height of the camera that looks down: far up, so that walls hardly lean."""

CUT_M = 2.15
"""Height from which the view from above leaves everything out, the ceiling."""

MARGIN_M = 0.15

MAX_OPEN_ROOMS = 6
"""Rooms without some of their sides that are kept: an orbit passes three sets of sides, coarse and
fine."""

TILT = 0.05
"""Of a rotation's entries: an object that leans by less casts the same shadow."""

COARSE_SPLATS = 200_000
"""Splats of the room in a coarse picture."""


@dataclass(frozen=True, slots=True, eq=False)
class DrawnTwin:
    """A picture of the twin, and how far what it shows is.

    Attributes:
        picture: (H, W, 3) RGB.
        depth: (H, W) float32 metres, z of a pinhole, range of a fisheye; 0 where nothing is.
    """

    picture: NDArray[np.uint8]
    depth: NDArray[np.float32]


class Twin:
    """Draws one scene.

    Args:
        scene: the scan.
        renderer: draws splats.
    """

    def __init__(self, scene: ScenePackage, renderer: Renderer) -> None:
        self._room = self._coarse_room = PosedSplats(scene.room, Pose.identity())
        self._objects = {item.object_id: item for item in scene.objects}
        self._renderer = renderer
        self._footprint = scene.footprint_m
        self._usual = usual_colour(scene.room)
        self._sides: RoomSides | None = None
        self._open_rooms: dict[tuple[frozenset[Side], bool], PosedSplats] = {}
        self._cast: dict[str, tuple[bytes, ContactShadow | None]] = {}
        """Of every object the shadow that it cast last, and how it leaned then."""
        self._top_m = float(scene.room.means[:, 2].max(initial=0.0))

    def picture(
        self,
        poses: Mapping[str, Pose],
        camera: Pinhole | Fisheye,
        world_from_camera: Pose,
        *,
        near_m: float = 0.05,
        coarse: bool = False,
        live: Sequence[LivePicture] = (),
        things: Sequence[PosedSplats] = (),
    ) -> NDArray[np.uint8]:
        """(H, W, 3) RGB.

        Args:
            poses: `world_from_object` by object id; the others are where the scan saw them.
            camera: what to look through.
            world_from_camera: from where.
            near_m: what is nearer is left out.
            coarse: draw the room with fewer splats, if `make_coarse` was called.
            live: surfaces that show live video.
            things: that people have put into the room, see `studio.view.shared_things`.
        """
        return self.drawn(
            poses,
            camera,
            world_from_camera,
            near_m=near_m,
            coarse=coarse,
            live=live,
            things=things,
        ).picture

    def drawn(
        self,
        poses: Mapping[str, Pose],
        camera: Pinhole | Fisheye,
        world_from_camera: Pose,
        *,
        near_m: float = 0.05,
        coarse: bool = False,
        live: Sequence[LivePicture] = (),
        things: Sequence[PosedSplats] = (),
        opens: bool = False,
        resting: RestingView | None = None,
    ) -> DrawnTwin:
        """The picture as `picture` has it, with its depth.

        With `opens`, a room seen from outside is drawn without the walls and the ceiling between;
        with `resting`, a view is drawn again only where it changed since that one's last picture.
        """
        room = self._coarse_room if coarse else self._room
        if opens:
            room = self._opened(room, world_from_camera, is_coarse=coarse)
        posed = {
            object_id: PosedSplats(item.splats, poses.get(object_id, item.world_from_object))
            for object_id, item in self._objects.items()
        }
        behind = self._behind(camera, world_from_camera)
        options = RenderOptions(background=behind, near_m=near_m)
        clouds = [room, *posed.values(), *things]
        if resting is None:
            drawn = self._renderer.render(clouds, camera, world_from_camera, options)
            picture, depth = in_bytes(drawn.rgb), drawn.depth
        else:
            picture, depth = resting.draw(
                clouds, camera, world_from_camera=world_from_camera, options=options
            )
        if isinstance(camera, Pinhole):
            self._lay_shadows(picture, depth, camera, world_from_camera, posed)
        for surface in live:
            draw_surface(picture, depth, camera, world_from_camera, surface)
        return DrawnTwin(picture, depth)

    def _lay_shadows(
        self,
        picture: NDArray[np.uint8],
        depth: NDArray[np.float32],
        camera: Pinhole,
        world_from_camera: Pose,
        posed: Mapping[str, PosedSplats],
    ) -> None:
        """Let every object cast its shadow on what it stands on."""

        def bodies(region: Region) -> NDArray[np.float32]:
            options = RenderOptions(region=region)
            return self._renderer.render(
                [*posed.values()], camera, world_from_camera, options
            ).alpha

        found: list[tuple[ContactShadow, Pose]] = []
        for object_id, body in posed.items():
            shadow = self._shadow(object_id, body)
            if shadow is not None:
                found.append((shadow, body.world_from_object))
        draw_contact_shadows(picture, depth, camera, world_from_camera, found, bodies=bodies)

    def _shadow(self, object_id: str, body: PosedSplats) -> ContactShadow | None:
        """The shadow of an object as it leans now."""
        tilt = tilt_of(body.world_from_object.rotation)
        key = np.round(tilt / TILT).astype(int).tobytes()
        known = self._cast.get(object_id)
        if known is None or known[0] != key:
            known = (key, contact_shadow(body.cloud, tilt))
            self._cast[object_id] = known
        return known[1]

    def _opened(
        self, room: PosedSplats, world_from_camera: Pose, *, is_coarse: bool
    ) -> PosedSplats:
        """The room without the sides that hide it from an eye outside."""
        if self._sides is None:
            self._sides = room_sides(self._room.cloud, self._footprint)
        hiding = self._sides.hiding(world_from_camera.translation)
        if not hiding:
            return room
        key = hiding, is_coarse
        if key not in self._open_rooms:
            if len(self._open_rooms) >= MAX_OPEN_ROOMS:
                self._open_rooms.clear()
            cloud = self._sides.without(room.cloud, hiding)
            self._open_rooms[key] = PosedSplats(cloud, Pose.identity())
        return self._open_rooms[key]

    def _behind(
        self, camera: Pinhole | Fisheye, world_from_camera: Pose
    ) -> Colour | NDArray[np.float32]:
        """Return the colour of the scan's holes: inside the room, its usual one."""
        *place, height = world_from_camera.translation
        low, high = self._footprint
        if height > self._top_m or (place < low).any() or (place > high).any():
            return BACKGROUND
        return within_circle(camera, self._usual) if isinstance(camera, Fisheye) else self._usual

    def make_coarse(self) -> None:
        """Choose the splats of coarse pictures: a second's work for a million of them."""
        self._open_rooms.clear()
        cloud = thinned(self._room.cloud, COARSE_SPLATS)
        self._coarse_room = PosedSplats(cloud, Pose.identity())

    def above(self, size_px: int) -> tuple[Pinhole, Pose]:
        """A square camera that looks down on the whole floor: north (+y) is up in the picture."""
        low, high = self._footprint
        centre = 0.5 * (low + high)
        extent = float((high - low).max()) + 2 * MARGIN_M
        focal = size_px * (ABOVE_M - CUT_M) / extent
        eye = np.array([*centre, ABOVE_M])
        camera = Pinhole(size_px, size_px, focal, focal, 0.5 * size_px, 0.5 * size_px)
        return camera, look_at(eye, np.array([*centre, 0.0]))

    def picture_from_above(
        self, poses: Mapping[str, Pose], size_px: int, *, things: Sequence[PosedSplats] = ()
    ) -> NDArray[np.uint8]:
        """(S, S, 3) RGB of the room without its ceiling, see `above`."""
        camera, world_from_camera = self.above(size_px)
        near_m = ABOVE_M - CUT_M
        return self.picture(poses, camera, world_from_camera, near_m=near_m, things=things)


def usual_colour(room: SplatCloud) -> Colour:
    """The mean colour of a room's surfaces; without any, the one behind everything."""
    area = np.prod(np.sort(room.scales, axis=1)[:, 1:], axis=1)
    weight = (area * room.opacities).astype(np.float64)
    if not weight.sum() > 0.0:
        return BACKGROUND
    red, green, blue = np.clip(np.average(room.colours(), axis=0, weights=weight), 0.0, 1.0)
    return float(red), float(green), float(blue)


def within_circle(camera: Fisheye, colour: Colour) -> NDArray[np.float32]:
    """(H, W, 3) a colour where a lens sees anything, what is behind everything beside it."""
    x = np.arange(camera.width_px) + 0.5 - camera.cx
    y = np.arange(camera.height_px) + 0.5 - camera.cy
    sees = np.hypot(x[None, :], y[:, None]) <= camera.circle_px
    return np.where(sees[..., None], colour, BACKGROUND).astype(np.float32)


def lens_camera(lens: Fisheye, size_px: int) -> Fisheye:
    """The same lens on a square picture of another size."""
    return lens.resized(size_px, size_px)
