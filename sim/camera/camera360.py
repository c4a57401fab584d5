"""The simulated 360° camera: two fisheye lenses on a stand, drawn from the meshes of the room.

What it never draws by itself is a splat: the tracker's models are made of splats, and its pictures
are not. What exists only as a scan is drawn by a `ScannedLook` that it is given, which shows
another reconstruction than the tracker's.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Rig
from scenes.frames import FRONT_FROM_BACK_LENS
from scenes.mesh import PhysicalRoom, TexturedMesh
from scenes.pose import Pose
from sim.bodies import Body, Placement, solids_in_world
from sim.camera.lens_picture import (
    DrawAlone,
    DrawnBody,
    Layer,
    ScannedLook,
    Tolerances,
    clusters,
    compose,
    compose_nearer,
    draw_body,
    draw_room,
    fine_lens,
)
from sim.camera.lens_raster import FisheyeRasteriser, Light, PixelRect
from sim.camera.shadows import ShadowMap, shadow_map
from sim.camera.stand import camera_stand
from sim.camera.tessellate import refine_mesh

LENS_BASELINE_M = 0.03
STILL_FRAMES = 3
STILL_M = 2e-4
STILL_RAD = 4e-4
ROOM_EDGE_M = 0.02
ROOM_EDGE_RAD = 0.035
BODY_EDGE_M = 0.045
BLUR_MARGIN_PX = 4


def default_rig(lens_size_px: int = 1440, fov_deg: float = 200.0) -> Rig:
    """A front and a back lens of `fov_deg` each, 3 cm apart along the optical axis.

    The rig's axes are the front lens's (x right, y down, z forward).
    """
    lens = Fisheye.from_fov(lens_size_px, math.radians(fov_deg))
    back = Pose(FRONT_FROM_BACK_LENS.rotation, np.array([0.0, 0.0, -LENS_BASELINE_M]))
    return Rig((lens, lens), (Pose.identity(), back))


@dataclass(frozen=True, slots=True)
class CameraOptions:
    """How the camera is drawn.

    Attributes:
        supersampling: grid points along a pixel's side; edges have its square of levels.
        blur_px: standard deviation of the lens blur, pixels.
        stand: whether the camera's pole and feet are seen.
    """

    supersampling: int = 2
    blur_px: float = 0.6
    stand: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class LensView:
    """Picture of one lens, before the sensor.

    Attributes:
        rgb: (H, W, 3) uint8, free of noise.
        ids: (H, W) uint8: 0 room, k the k-th body of the camera (from 1).
    """

    rgb: NDArray[np.uint8]
    ids: NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False)
class CameraView:
    """One frame of all lenses.

    Attributes:
        lenses: one view per lens of the rig.
        visible_fraction: per body id, visible pixels over both lenses / pixels if it were alone;
            0 for a body outside every lens.
    """

    lenses: tuple[LensView, ...]
    visible_fraction: Mapping[str, float]


@dataclass(slots=True, eq=False)
class _Lens:
    """A lens, its place and its layers; the rest layer changes when something starts or stops."""

    fine: Fisheye
    lens_from_world: Pose
    room: Layer
    rest: Layer
    rest_rgb: NDArray[np.uint8]
    rest_ids: NDArray[np.uint8]
    rest_counts: NDArray[np.int64]


@dataclass(slots=True, eq=False)
class _BodyState:
    """State of a body from frame to frame."""

    placement: Placement
    drawn: tuple[DrawnBody, ...]
    still_frames: int
    resting: bool


class Camera360:
    """Draws the room through every lens of a rig that stands still.

    Args:
        room: static meshes and light.
        rig: the lenses.
        world_from_rig: where the camera stands.
        bodies: everything that may move, at most 255.
        options: see `CameraOptions`.
        look: draws what has no meshes; needed for scanned rooms only.

    Raises:
        ValueError: too many bodies, or two with the same id.
    """

    def __init__(
        self,
        room: PhysicalRoom,
        rig: Rig,
        world_from_rig: Pose,
        bodies: Sequence[Body],
        *,
        options: CameraOptions = CameraOptions(),
        look: ScannedLook | None = None,
    ) -> None:
        names = [body.body_id for body in bodies]
        if len(bodies) > 255 or len(set(names)) != len(names):
            raise ValueError(f"Camera360: bodies {names}, wanted at most 255 with different ids")
        self.rig = rig
        self.world_from_rig = world_from_rig
        self.body_ids = tuple(names)
        self._room = room
        self._options = options
        self._look = look
        self._tolerances = Tolerances() if look is None else look.tolerances
        self._bodies = {body.body_id: body for body in bodies}
        self._rasteriser = FisheyeRasteriser()
        self._meshes = {body.body_id: self._upload(body) for body in bodies}
        self._outlines = {body.body_id: _outline(body) for body in bodies}
        self._states: dict[str, _BodyState] = {}
        self._lenses = self._draw_empty_room()

    def view(self, placements: Mapping[str, Placement]) -> CameraView:
        """Draw one frame.

        Args:
            placements: where each body is; a body that is not named is not there.

        Raises:
            KeyError: a name is not one of the camera's bodies.
        """
        before = {name for name, state in self._states.items() if state.resting}
        states = {name: self._state(name, placement) for name, placement in placements.items()}
        resting = {name for name, state in states.items() if state.resting}
        changed = before ^ resting
        dirty = [self._states[name] if name in before else states[name] for name in sorted(changed)]
        self._states = states
        if changed:
            for index, lens in enumerate(self._lenses):
                self._rebuild_rest(index, lens, [state.drawn[index] for state in dirty])
        views: list[LensView] = []
        visible = np.zeros(len(self.body_ids) + 1, np.int64)
        for index, lens in enumerate(self._lenses):
            moving = [states[n].drawn[index] for n in states if n not in resting]
            view, counts = self._lens_view(lens, moving)
            views.append(view)
            visible += counts
        alone = {name: sum(d.alone_px for d in state.drawn) for name, state in states.items()}
        fractions = {
            name: float(visible[1 + k] / alone[name]) if alone.get(name) else 0.0
            for k, name in enumerate(self.body_ids)
        }
        return CameraView(tuple(views), fractions)

    def close(self) -> None:
        """Free the window; call on the thread that draws. The camera is of no use afterwards."""
        self._rasteriser.close()

    def room_range(self, lens_index: int) -> NDArray[np.float32]:
        """(H, W) float32 range of the empty room on the fine grid, metres; inf where nothing is."""
        return self._lenses[lens_index].room.range_m

    def _state(self, name: str, placement: Placement) -> _BodyState:
        """The body's state in this frame; it is drawn again only if it has moved."""
        previous = self._states.get(name)
        if previous is not None and _is_still(previous.placement, placement):
            still = previous.still_frames + 1
            return replace(previous, still_frames=still, resting=still >= STILL_FRAMES)
        drawn = self._draw(name, placement)
        first_frame = previous is None and not self._states
        return _BodyState(placement, drawn, 0, resting=first_frame)

    def _draw(self, name: str, placement: Placement) -> tuple[DrawnBody, ...]:
        body = self._bodies[name]
        room = self._room
        shadow: ShadowMap = shadow_map(
            solids_in_world(body, placement),
            placement.support_z_m,
            light_direction=room.light_direction,
            ambient=room.ambient,
            key=room.key,
        )
        outline = np.concatenate(
            [
                world_from_part @ points
                for world_from_part, points in zip(
                    placement.world_from_part, self._outlines[name], strict=True
                )
            ]
        )
        return tuple(
            draw_body(
                self._alone(name, placement, lens),
                lens.lens_from_world @ outline,
                lens.fine,
                number=1 + self.body_ids.index(name),
                shadow=shadow,
                lens_from_world=lens.lens_from_world,
            )
            for lens in self._lenses
        )

    def _alone(self, name: str, placement: Placement, lens: _Lens) -> DrawAlone:
        """Return what draws a body alone through a lens."""
        look = self._look
        if look is not None and look.draws(name):
            return lambda rect: look.body(name, lens.fine, lens.lens_from_world, placement, rect)
        parts = [
            (number, lens.lens_from_world @ world_from_part)
            for numbers, world_from_part in zip(
                self._meshes[name], placement.world_from_part, strict=True
            )
            for number in numbers
        ]
        direction = lens.lens_from_world.rotation @ self._room.light_direction
        light = Light(direction, self._room.ambient, self._room.key)
        return lambda rect: self._rasteriser.draw(parts, lens.fine, rect, light=light)

    def _lens_view(
        self, lens: _Lens, moving: Sequence[DrawnBody]
    ) -> tuple[LensView, NDArray[np.int64]]:
        s = self._options.supersampling
        rgb = lens.rest_rgb.copy()
        ids = lens.rest_ids.copy()
        counts = lens.rest_counts.copy()
        whole = PixelRect(0, 0, lens.fine.width_px, lens.fine.height_px)
        for rect in clusters([r for body in moving for r in body.touched], s):
            # The blur at the border of the rectangle needs what lies beyond.
            grown = rect.grown(s * BLUR_MARGIN_PX, whole)
            layer = compose(
                lens.rest,
                grown,
                moving,
                lens=lens.fine,
                lens_from_world=lens.lens_from_world,
                tolerances=self._tolerances,
            )
            inner = rect.counted_from(grown)
            changed = layer.part(inner)
            for part in _numbered_parts(moving, rect):
                counts += self._count(layer.part(part.counted_from(grown)).ids)
                counts -= self._count(lens.rest.ids[part.rows_columns])
            target = rect.divided(s).rows_columns
            rgb[target] = self._to_sensor(layer.rgb)[inner.divided(s).rows_columns]
            ids[target] = self._at_pixels(changed.ids)
        return LensView(rgb, ids), counts

    def _rebuild_rest(self, index: int, lens: _Lens, dirty: Sequence[DrawnBody]) -> None:
        """Draw the resting bodies again wherever one of them came or went."""
        resting = [s.drawn[index] for s in self._states.values() if s.resting]
        rects = [rect for body in dirty for rect in body.touched]
        for rect in clusters(rects, self._options.supersampling):
            layer = compose(
                lens.room,
                rect,
                resting,
                lens=lens.fine,
                lens_from_world=lens.lens_from_world,
                tolerances=self._tolerances,
            )
            target = lens.rest.part(rect)
            target.rgb[:], target.range_m[:] = layer.rgb, layer.range_m
            target.ids[:] = layer.ids
        lens.rest_counts = self._count(lens.rest.ids)
        lens.rest_ids = self._at_pixels(lens.rest.ids).copy()
        lens.rest_rgb = self._to_sensor(lens.rest.rgb)

    def _to_sensor(self, fine_rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Mean over each pixel, then the lens's blur."""
        s = self._options.supersampling
        height, width = fine_rgb.shape[0] // s, fine_rgb.shape[1] // s
        rgb = cv2.resize(fine_rgb, (width, height), interpolation=cv2.INTER_AREA)
        if self._options.blur_px > 0:
            rgb = cv2.GaussianBlur(rgb, (0, 0), self._options.blur_px)
        return np.asarray(rgb, dtype=np.uint8)

    def _at_pixels(self, fine_ids: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """A view of the numbers at one grid point of each pixel."""
        s = self._options.supersampling
        return fine_ids[s // 2 :: s, s // 2 :: s]

    def _count(self, ids: NDArray[np.uint8]) -> NDArray[np.int64]:
        levels = len(self.body_ids) + 1
        counts = cv2.calcHist([np.ascontiguousarray(ids)], [0], None, [256], [0, 256])
        return counts.ravel()[:levels].astype(np.int64)

    def _upload(self, body: Body) -> list[list[int]]:
        return [
            [self._rasteriser.add(refine_mesh(m, max_edge_m=BODY_EDGE_M)) for m in part.meshes]
            for part in body.parts
        ]

    def _draw_empty_room(self) -> list[_Lens]:
        static: list[TexturedMesh] = list(self._room.static)
        if self._options.stand:
            static.append(camera_stand(self.world_from_rig, self.rig))
        lenses = [
            (fine_lens(camera, self._options.supersampling), self.world_from_rig @ rig_from_lens)
            for camera, rig_from_lens in zip(self.rig.lenses, self.rig.rig_from_lens, strict=True)
        ]
        # The room is drawn once: a window as large as the lens costs its vertices once, too.
        rasteriser = FisheyeRasteriser(max(fine.width_px for fine, _ in lenses))
        eye = np.mean([pose.translation for _, pose in lenses], axis=0)
        numbers = [
            rasteriser.add(
                refine_mesh(mesh, max_edge_m=ROOM_EDGE_M, eye=eye, max_edge_rad=ROOM_EDGE_RAD)
            )
            for mesh in static
        ]
        drawn: list[_Lens] = []
        for fine, world_from_lens in lenses:
            lens_from_world = world_from_lens.inverse()
            room = draw_room(rasteriser, numbers, fine, lens_from_world)
            if self._look is not None:
                room = compose_nearer(self._look.room(fine, world_from_lens), room)
            drawn.append(
                _Lens(
                    fine,
                    lens_from_world,
                    room,
                    room.copy(),
                    self._to_sensor(room.rgb),
                    self._at_pixels(room.ids).copy(),
                    self._count(room.ids),
                )
            )
        rasteriser.close()
        return drawn


def _outline(body: Body) -> tuple[NDArray[np.float64], ...]:
    """Per part, the vertices that span its picture."""
    return tuple(np.concatenate([mesh.vertices for mesh in part.meshes]) for part in body.parts)


def _is_still(a: Placement, b: Placement) -> bool:
    """Whether a body has stayed where it was, to less than can be seen."""
    if a.support_z_m != b.support_z_m:
        return False
    return all(
        float(np.abs(p.translation - q.translation).max()) < STILL_M
        and float(np.abs(p.rotation - q.rotation).max()) < STILL_RAD
        for p, q in zip(a.world_from_part, b.world_from_part, strict=True)
    )


def _numbered_parts(bodies: Sequence[DrawnBody], rect: PixelRect) -> list[PixelRect]:
    """Rectangles, none over another, that hold all that bodies cover within one of `clusters`."""
    rects = [body.rect for body in bodies if body.rect is not None]
    inside = [r for r in rects if rect.x0 <= r.x0 < rect.x1 and rect.y0 <= r.y0 < rect.y1]
    return clusters(inside, 1)
