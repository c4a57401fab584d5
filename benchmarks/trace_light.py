"""Traces the light of the built-in rooms with Mitsuba; run after a room's shape or light changed.

    python -m benchmarks.trace_light lab desk

Needs `requirements/dev.in` and LLVM 16 or later (Debian: `apt install libllvm19`, and
`DRJIT_LIBLLVM_PATH` where it is not found). Nothing else needs either: the result is committed.
"""

from __future__ import annotations

import argparse
import importlib
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.samples import SAMPLE_NAMES, unlit_room
from scenes.samples.light import (
    AreaLight,
    Float32Array,
    FloatArray,
    Texels,
    UnlitRoom,
    linear_light,
    texels_of,
)
from scenes.samples.light_file import DATA, save_light
from scenes.samples.pictures.atlas import mesh_from_surfaces

VARIANT = "llvm_ad_rgb"
BOUNCES = 8
COARSE_SAMPLES = 64
COARSER = 4.0
SAMPLES = 96
LANES = 1 << 20
OFF_SURFACE_M = 1.5e-3
SPARK = 12.0
"""No single path counts for more than this, next to a window of radiance about 10."""
SEEN_SHARE = 0.2
"""Texels of which less can be seen take their neighbours' light."""
WHITE_BALANCE = 0.35
"""How much of the light's own colour the camera takes away."""
REFERENCE_M = 0.4


def main(names: Sequence[str], samples: int) -> None:
    """Trace rooms and write their light beside this file."""
    for name in names:
        room = unlit_room(name)
        texels = texels_of(room.surfaces)
        light = traced(room, texels, samples)
        save_light(DATA / f"{name}.npz", texels, light)


def traced(room: UnlitRoom, texels: Texels, samples: int = SAMPLES) -> Float32Array:
    """(N, 3) light of every texel, exposed for the room's reference, without sampling noise.

    Paths are traced in full for coarse texels only. The fine ones gather that light: what a ray
    meets there is known already, so that a sample costs two rays instead of a dozen.
    """
    tracer = _Tracer(room)
    coarse = texels_of(room.surfaces, coarser=COARSER)
    tracer.remember(room, coarse, _whole(tracer, coarse, COARSE_SAMPLES))
    return _whole(tracer, texels, samples) * _exposure(tracer, room)


def _whole(tracer: _Tracer, texels: Texels, samples: int) -> Float32Array:
    """(N, 3) light of texels, its noise measured by two independent halves."""
    (first, free_1), (second, free_2) = (tracer.light(texels, samples // 2, k) for k in (1, 2))
    outside = free_1 + free_2 > 2 * SEEN_SHARE
    result, start = np.empty_like(first), 0
    for shape in texels.shapes:
        here = slice(start, start + shape[0] * shape[1])
        start = here.stop
        result[here] = _denoise(
            first[here].reshape(*shape, 3),
            second[here].reshape(*shape, 3),
            outside[here].reshape(shape),
        ).reshape(-1, 3)
    return result


class _Tracer:
    """The room as a Mitsuba scene."""

    def __init__(self, room: UnlitRoom) -> None:
        self._mi: Any = importlib.import_module("mitsuba")
        self._mi.set_variant(VARIANT)
        self._dr: Any = importlib.import_module("drjit")
        described: dict[str, Any] = {"type": "scene", "room": self._mesh(room)}
        described |= {f"light-{k}": self._lamp(light) for k, light in enumerate(room.lights)}
        self._scene = self._mi.load_dict(described)
        self._integrator = self._mi.load_dict({"type": "path", "max_depth": BOUNCES, "rr_depth": 3})
        self._arriving: Any = None

    def remember(self, room: UnlitRoom, texels: Texels, light: Float32Array) -> None:
        """From now on, a ray ends where it meets the room: the light there is known."""
        surfaces, start = [], 0
        for surface, shape in zip(room.surfaces, texels.shapes, strict=True):
            here = slice(start, start + shape[0] * shape[1])
            start = here.stop
            level = 255.0 * np.sqrt(np.clip(light[here] / SPARK, 0.0, 1.0)).reshape(*shape, 3)
            if surface.glow > 0:
                level = np.zeros_like(level)
            size = surface.picture.shape[1::-1]
            picture = cv2.resize(level, size, interpolation=cv2.INTER_LINEAR)
            picture = np.rint(picture).astype(np.uint8).reshape(surface.picture.shape)
            surfaces.append(replace(surface, picture=picture))
        atlas = mesh_from_surfaces(surfaces, width_px=4096).texture
        self._arriving = self._mi.load_dict(
            {"type": "bitmap", "bitmap": self._mi.Bitmap(atlas.copy()), "raw": True}
        )

    def light(self, texels: Texels, samples: int, seed: int) -> tuple[Float32Array, Float32Array]:
        """(N, 3) light per unit of albedo, and (N,) share of rays that do not start inside."""
        rng = np.random.default_rng(seed)
        shifts = rng.random((len(texels.centres), 6))
        at_once = max(1, LANES // samples)
        parts = [
            self._chunk(texels, slice(k, k + at_once), shifts, samples, seed)
            for k in range(0, len(texels.centres), at_once)
        ]
        return np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])

    def _chunk(
        self, texels: Texels, here: slice, shifts: FloatArray, samples: int, seed: int
    ) -> tuple[Float32Array, Float32Array]:
        mi, dr = self._mi, self._dr
        count = len(texels.centres[here])
        lane = dr.arange(mi.UInt32, count * samples)
        texel, k = lane // samples, mi.Float(lane % samples)

        def vector(values: FloatArray) -> Any:
            return mi.Vector3f(
                *(dr.gather(mi.Float, mi.Float(values[here, j].astype(np.float32)), texel)
                  for j in range(3))
            )  # fmt: skip

        def pair(first: int) -> Any:
            """A low-discrepancy sequence per texel (R2), each with its own shift."""
            steps = (0.7548776662466927, 0.5698402909980532)
            return mi.Point2f(
                *(self._fraction(step * k + dr.gather(mi.Float, mi.Float(
                    shifts[here, first + j].astype(np.float32)), texel))
                  for j, step in enumerate(steps))
            )  # fmt: skip

        inside = pair(0) - 0.5
        normal = vector(texels.normals)
        where = vector(texels.centres) + inside.x * vector(texels.across)
        where = where + inside.y * vector(texels.down) + OFF_SURFACE_M * normal
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(seed * 7919 + here.start, count * samples)

        spot = dr.zeros(mi.SurfaceInteraction3f, count * samples)
        spot.p, spot.n = where, normal
        towards, weight = self._scene.sample_emitter_direction(spot, pair(2), test_visibility=True)
        direct = weight * (dr.maximum(dr.dot(towards.d, normal), 0.0) / dr.pi)

        around = mi.Frame3f(normal).to_world(mi.warp.square_to_cosine_hemisphere(pair(4)))
        ray = mi.Ray3f(where, around)
        hit = self._scene.ray_intersect(ray)
        if self._arriving is None:
            bounced, _, _ = self._integrator.sample(self._scene, sampler, mi.RayDifferential3f(ray))
            # Lamps that a ray meets at once have been counted as direct light.
            bounced = bounced - hit.emitter(self._scene).eval(hit)
        else:
            in_front = hit.is_valid() & (dr.dot(hit.n, around) < 0.0)
            light = SPARK * dr.square(self._arriving.eval(hit, in_front))
            bounced = hit.bsdf().eval_diffuse_reflectance(hit, in_front) * light
        total = dr.minimum(direct, SPARK) + dr.clip(bounced, 0.0, SPARK)
        outside = dr.select(hit.is_valid() & (dr.dot(hit.n, around) > 0.0), 0.0, 1.0)
        seen = [dr.block_sum(channel, samples) for channel in (total.x, total.y, total.z, outside)]
        means = np.array(seen, dtype=np.float32).T / samples
        # A texel that is partly covered is as bright as what can be seen of it.
        free = means[:, 3]
        light = means[:, :3] / np.maximum(free, SEEN_SHARE)[:, None]
        return light.astype(np.float32), free.astype(np.float32)

    def _fraction(self, value: Any) -> Any:
        return value - self._dr.floor(value)

    def _mesh(self, room: UnlitRoom) -> Any:
        mi = self._mi
        surfaces = [
            s if s.glow == 0 else replace(s, picture=np.zeros_like(s.picture))
            for s in room.surfaces
        ]
        mesh = mesh_from_surfaces(surfaces, width_px=4096)
        # Mitsuba counts the texture's v from its top.
        uv = mesh.uv * (1, -1) + (0, 1)
        albedo = {"type": "bitmap", "bitmap": mi.Bitmap(mesh.texture.copy())}
        properties = mi.Properties()
        properties["bsdf"] = mi.load_dict({"type": "diffuse", "reflectance": albedo})
        built = mi.Mesh(
            room.name, len(mesh.vertices), len(mesh.faces), props=properties,
            has_vertex_texcoords=True,
        )  # fmt: skip
        values = mi.traverse(built)
        values["vertex_positions"] = mesh.vertices.astype(np.float32).ravel()
        values["vertex_texcoords"] = uv.astype(np.float32).ravel()
        values["faces"] = mesh.faces.astype(np.uint32).ravel()
        values.update()
        return built

    def _lamp(self, light: AreaLight) -> dict[str, Any]:
        facing = np.cross(light.u, light.v)
        place = np.eye(4)
        place[:3, 0], place[:3, 1] = 0.5 * light.u, 0.5 * light.v
        place[:3, 2] = facing / np.linalg.norm(facing)
        place[:3, 3] = light.corner + 0.5 * (light.u + light.v)
        return {
            "type": "rectangle",
            "to_world": self._mi.ScalarTransform4f(place),
            "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}},
            "emitter": {
                "type": "area",
                "radiance": {"type": "rgb", "value": list(light.radiance)},
            },
        }


def _exposure(tracer: _Tracer, room: UnlitRoom) -> Float32Array:
    """(3,) factor that brings level ground around the reference to the room's level."""
    span = np.array([[2 * REFERENCE_M, 0.0, 0.0]]), np.array([[0.0, -2 * REFERENCE_M, 0.0]])
    ground = Texels(room.reference[None], *span, np.array([[0.0, 0.0, 1.0]]), ((1, 1),))
    white = tracer.light(ground, 16 * SAMPLES, 3)[0][0]
    balanced = WHITE_BALANCE * white + (1 - WHITE_BALANCE) * white.mean()
    return (linear_light(np.array([room.level * 255.0])) / balanced).astype(np.float32)


def _denoise(first: Float32Array, second: Float32Array, seen: NDArray[np.bool_]) -> Float32Array:
    """Two independent halves of one picture to one without noise (a local Wiener filter).

    Where the halves differ as much as the picture does from its blurred self, it is noise, and the
    blurred picture is taken. Texels inside solids take their neighbours' light.
    """
    mean, half_gap = 0.5 * (first + second), 0.5 * (first - second)
    share = np.where(seen, 1.0, 1e-4).astype(np.float32)
    smooth = _blur(mean, share, 2.0)
    noise = _blur(np.square(half_gap).mean(axis=2, keepdims=True), share, 3.0)
    detail = _blur(np.square(mean - smooth).mean(axis=2, keepdims=True), share, 1.0)
    keep = np.clip(1.0 - 1.5 * noise / np.maximum(detail, 1e-12), 0.0, 1.0)
    filled = np.where(seen[..., None], mean, smooth)
    soft = _blur(filled, share, 0.7)
    return np.asarray(smooth + keep * (soft - smooth), dtype=np.float32)


def _blur(values: Float32Array, share: Float32Array, sigma: float) -> Float32Array:
    def blur(image: Float32Array) -> Float32Array:
        wide = cv2.GaussianBlur(image, (0, 0), sigma, borderType=cv2.BORDER_REPLICATE)
        return np.asarray(wide, np.float32).reshape(image.shape)

    return blur(values * share[..., None]) / blur(share)[..., None]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Trace the light of built-in rooms.")
    parser.add_argument("rooms", nargs="*", default=SAMPLE_NAMES, choices=SAMPLE_NAMES)
    parser.add_argument("--samples", type=int, default=SAMPLES, help="paths per light texel")
    arguments = parser.parse_args()
    main(arguments.rooms, arguments.samples)
