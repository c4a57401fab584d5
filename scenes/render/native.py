"""The native renderer: checks its arguments, keeps prepared clouds, calls the Rust kernels."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose, renormalised
from scenes.render.picture_memory import PictureMemory, rendering_of
from scenes.render.renderer import PosedSplats, Rendering, RenderOptions
from scenes.render.request import (
    check_cloud,
    check_is_posed,
    check_view,
    refuse_exact,
    refuse_parts,
)
from scenes.splats import SplatCloud

if TYPE_CHECKING:
    from scenes import _native
    from scenes._native import Probe, Tape


KEPT_CLOUDS = 64
"""Prepared clouds a renderer keeps; the one not drawn for longest goes first."""


class NativeRenderer:
    """Draws splats with the Rust kernels. One instance may be used from several threads.

    A cloud is prepared (sorted along a Z curve, factors of its covariances) the first time it is
    drawn; the same `SplatCloud` object is found again by identity, so keep it instead of making an
    equal one per frame. The interpreter lock is free while a picture is drawn. Worker threads do
    not survive a fork: start other processes by spawning, or give them a renderer of their own.

    Args:
        portable: use no vector instructions beyond the platform's minimum (tests, comparisons).
        instructions: one of `available_instructions()`; None takes the widest, or "scalar" if
            `portable`.

    Raises:
        ImportError: the native crate has not been built.
        ValueError: this machine does not have those instructions.
    """

    def __init__(self, *, portable: bool = False, instructions: str | None = None) -> None:
        try:
            from scenes import _native
        except ImportError as error:
            raise ImportError(
                f"the native renderer scenes._native cannot be loaded ({error}); "
                "run any command through ./nexus, which builds it"
            ) from error
        self._prepare = _native.PreparedCloud
        self._still = _native.StillPicture
        self._probe = _native.Probe
        self._alone = _native.Alone
        self._engine = _native.Engine(portable=portable, instructions=instructions)
        self._differentiator = _native.Differentiator(instructions=self._engine.simd)
        self._clouds: OrderedDict[int, tuple[SplatCloud, _native.PreparedCloud]] = OrderedDict()
        self._lock = threading.Lock()
        self._memory = PictureMemory()

    def __reduce__(self) -> tuple[Callable[[str], NativeRenderer], tuple[str]]:
        """Arrives in another process as that process's renderer of the same instructions."""
        return _of_this_process, (self.instructions,)

    @property
    def instructions(self) -> str:
        """Instruction set in use: "avx512", "avx2" or "scalar"."""
        return self._engine.simd

    def available_instructions(self) -> tuple[str, ...]:
        """Instruction sets this machine has, the narrowest first."""
        return tuple(self._engine.available())

    def prepare(self, cloud: SplatCloud) -> int:
        """Prepare a cloud ahead of its first picture; returns the number of damaged splats."""
        return self._prepared(cloud).dropped

    def render(
        self,
        objects: Sequence[PosedSplats],
        camera: Pinhole | Fisheye,
        world_from_camera: Pose,
        options: RenderOptions | None = None,
    ) -> Rendering:
        """Draw all objects in one global order; see `scenes.render.renderer` for the semantics.

        Splats with a value that is not finite, a scale that is not positive or a zero quaternion
        are left out.

        Raises:
            ValueError: names the argument, what it got and what it wants.
        """
        options = options or RenderOptions()
        clouds = self._check(objects, camera, options)
        return self._draw(clouds, objects, camera, world_from_camera, draw_of(options))

    def reach(
        self,
        objects: Sequence[PosedSplats],
        camera: Pinhole | Fisheye,
        world_from_camera: Pose,
        options: RenderOptions | None = None,
    ) -> tuple[slice, slice] | None:
        """Rows and columns outside which nothing of some objects is drawn; None if nothing is.

        Raises:
            ValueError: as `render`.
        """
        options = options or RenderOptions()
        clouds = self._check(objects, camera, options)
        found = self._engine.reach(
            clouds,
            _camera_from_objects(objects, world_from_camera),
            lens=lens_of(camera),
            draw=draw_of(options),
        )
        if found is None:
            return None
        left, top, right, bottom = found
        return slice(top, bottom), slice(left, right)

    def shares(
        self,
        objects: Sequence[PosedSplats],
        index: int,
        camera: Pinhole | Fisheye,
        world_from_camera: Pose,
        options: RenderOptions,
    ) -> Rendering:
        """The part of `scenes.render.front.front_of` that is native: sums instead of colours.

        `rgb` holds the object's blend weight, its weighted depth and that of all others.
        """
        clouds = self._check(objects, camera, options)
        options = replace(options, background=(0.0, 0.0, 0.0), sh_degree=0)
        draw = draw_of(options, marked=index)
        return self._draw(clouds, objects, camera, world_from_camera, draw)

    def record(
        self,
        objects: Sequence[PosedSplats],
        camera: Pinhole | Fisheye,
        world_from_camera: Pose,
        options: RenderOptions,
    ) -> tuple[Rendering, Tape]:
        """Draw and remember how: the part of `scenes.render.gradients.record` that is native."""
        clouds = self._check(objects, camera, options)
        refuse_exact(options, "gradients are those of EWA")
        flat, tape = self._differentiator.record(
            clouds,
            _camera_from_objects(objects, world_from_camera),
            lens=lens_of(camera),
            draw=draw_of(options),
        )
        return rendering_of(flat, camera.height_px, camera.width_px), tape

    def probe(
        self,
        objects: Sequence[PosedSplats],
        camera: Pinhole | Fisheye,
        world_from_camera: Pose,
        options: RenderOptions,
    ) -> Probe:
        """The part of `benchmarks.raster.stages.stages_of` that is native."""
        _, tape = self.record(objects, camera, world_from_camera, options)
        return self._probe(tape)

    def alone(
        self,
        cloud: SplatCloud,
        camera: Pinhole | Fisheye,
        world_from_camera: Pose,
        options: RenderOptions,
    ) -> _native.Alone:
        """A cloud to be drawn alone on black, whole, at one upright pose after the other.

        Kernels draw it that compare it with a picture (`tracking.likelihood.patch_fit`).
        """
        refuse_parts(options, "what is compared is drawn whole")
        (prepared,) = self._check([PosedSplats(cloud, Pose.identity())], camera, options)
        camera_from_world = world_from_camera.inverse()
        rows = np.hstack([camera_from_world.rotation, camera_from_world.translation[:, None]])
        return self._alone(
            self._engine,
            prepared,
            rows.ravel().tolist(),
            lens=lens_of(camera),
            draw=draw_of(options),
        )

    def drawn_by_kernel(
        self, clouds: Sequence[SplatCloud], *, camera: Pinhole | Fisheye, options: RenderOptions
    ) -> _native.KernelDrawing:
        """Clouds as a kernel takes them that draws each of them alone on black, whole, itself.

        `tracking.likelihood.pose_likelihood.pose_supports` hands them over.
        """
        refuse_parts(options, "what is compared is drawn whole")
        check_view(camera, options)
        return {
            "engine": self._engine,
            "clouds": [self._prepared(cloud, index) for index, cloud in enumerate(clouds)],
            "lens": lens_of(camera),
            "draw": draw_of(options),
        }

    def _check(
        self,
        objects: Sequence[PosedSplats],
        camera: Pinhole | Fisheye,
        options: RenderOptions,
    ) -> list[_native.PreparedCloud]:
        """The objects' clouds, prepared; arrays are looked at when they are, and not again.

        Raises:
            TypeError, ValueError: as `check_request`.
        """
        clouds: list[_native.PreparedCloud] = []
        for index, posed in enumerate(objects):
            check_is_posed(posed, index)
            clouds.append(self._prepared(posed.cloud, index))
        check_view(camera, options)
        return clouds

    def _draw(
        self,
        clouds: list[_native.PreparedCloud],
        objects: Sequence[PosedSplats],
        camera: Pinhole | Fisheye,
        world_from_camera: Pose,
        draw: _native.Draw,
    ) -> Rendering:
        arrays = self._memory.take(camera.width_px * camera.height_px)
        self._engine.render(
            clouds,
            _camera_from_objects(objects, world_from_camera),
            lens=lens_of(camera),
            draw=draw,
            picture=arrays,
        )
        drawn = rendering_of(arrays, camera.height_px, camera.width_px)
        self._memory.give(arrays)
        return drawn

    def _prepared(self, cloud: SplatCloud, index: int = 0) -> _native.PreparedCloud:
        key = id(cloud)
        with self._lock:
            if key in self._clouds:
                self._clouds.move_to_end(key)
                return self._clouds[key][1]
        check_cloud(cloud, index)
        prepared = self._prepare(
            cloud.means.ravel(),
            cloud.scales.ravel(),
            cloud.rotations.ravel(),
            cloud.opacities,
            cloud.sh.ravel(),
        )
        with self._lock:
            # Holding the cloud keeps its id from being given to another one.
            self._clouds[key] = (cloud, prepared)
            while len(self._clouds) > KEPT_CLOUDS:
                self._clouds.popitem(last=False)
        return prepared

    def still_picture(
        self, camera: Pinhole | Fisheye, options: RenderOptions
    ) -> _native.StillPicture:
        """An empty picture for `update_still`, which `scenes.render.still` uses."""
        check_view(camera, options)
        return self._still(lens=lens_of(camera), draw=draw_of(options))

    def update_still(
        self,
        picture: _native.StillPicture,
        objects: Sequence[PosedSplats],
        camera: Pinhole | Fisheye,
        world_from_camera: Pose,
        options: RenderOptions,
    ) -> NDArray[np.bool_]:
        """Draw into `picture` what changed; returns a flag per tile of 16 × 16 pixels, flat."""
        clouds = self._check(objects, camera, options)
        poses = _camera_from_objects(objects, world_from_camera)
        return picture.update(self._engine, clouds, poses, threads=options.threads)


def _camera_from_objects(
    objects: Sequence[PosedSplats], world_from_camera: Pose
) -> NDArray[np.float64]:
    """(M, 12) row-major 3×4 matrices.

    Poses were checked when they were made; checking their products costs a small picture 2 % of
    its time.
    """
    rotation_from_world = world_from_camera.rotation.T
    origin = -rotation_from_world @ world_from_camera.translation
    poses = np.empty((len(objects), 3, 4), dtype=np.float64)
    for row, posed in zip(poses, objects, strict=True):
        placed = posed.world_from_object
        row[:, :3] = renormalised(rotation_from_world @ placed.rotation)
        row[:, 3] = rotation_from_world @ placed.translation + origin
    return poses.reshape(-1, 12)


def cameras_from_objects(poses: Sequence[Pose], world_from_camera: Pose) -> NDArray[np.float64]:
    """(N, 12) row-major 3×4 of `world_from_object` poses in a camera, all at once."""
    camera_from_world = world_from_camera.inverse()
    rotations = camera_from_world.rotation @ np.array([pose.rotation for pose in poses])
    squares = rotations @ rotations.transpose(0, 2, 1)
    rows = np.empty((len(poses), 3, 4), dtype=np.float64)
    rows[:, :, :3] = 1.5 * rotations - 0.5 * squares @ rotations
    places = np.array([pose.translation for pose in poses])
    rows[:, :, 3] = places @ camera_from_world.rotation.T + camera_from_world.translation
    return rows.reshape(-1, 12)


def lens_of(camera: Pinhole | Fisheye) -> _native.Lens:
    """A camera in the words of the native crate."""
    size, centre = (camera.width_px, camera.height_px), (camera.cx, camera.cy)
    if isinstance(camera, Pinhole):
        return {
            "size": size,
            "focal": (camera.fx, camera.fy),
            "centre": centre,
            "max_angle": None,
            "distortion": None,
        }
    return {
        "size": size,
        "focal": (camera.f_px, camera.f_px),
        "centre": centre,
        "max_angle": camera.max_angle,
        "distortion": None if camera.is_equidistant else camera.distortion,
    }


def draw_of(options: RenderOptions, *, marked: int | None = None) -> _native.Draw:
    """Options in the words of the native crate; `marked` as in `NativeRenderer.shares`."""
    background, mask = options.background, options.tile_mask
    is_picture = isinstance(background, np.ndarray)
    return {
        "background": (0.0, 0.0, 0.0) if is_picture else background,
        "backdrop": np.ascontiguousarray(background).ravel() if is_picture else None,
        "region": options.region,
        "tile_mask": None if mask is None else np.ascontiguousarray(mask).ravel(),
        "near": options.near_m,
        "antialias": options.antialias,
        "sh_degree": options.sh_degree,
        "exact_above": options.exact_above_rad,
        "threads": options.threads,
        "marked": marked,
    }


@cache
def _of_this_process(instructions: str) -> NativeRenderer:
    """The renderer that stands in for all those of another process."""
    return NativeRenderer(instructions=instructions)
