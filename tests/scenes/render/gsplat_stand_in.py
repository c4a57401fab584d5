"""Numpy in place of torch and of gsplat's stages, so that the adapter runs where no GPU is.

Each stage checks what it is handed as gsplat 1.5.3 does (shapes, dtypes) and then does the same
arithmetic, slowly; what the adapter may pass and what it means is written down here once more.
"""

from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np

from scenes.cameras import Fisheye, Pinhole
from scenes.harmonics import basis
from scenes.pose import rotation_from_quaternion
from scenes.render.reference.projection import project


class Tensor(np.ndarray):
    """An array with torch's way back to the host."""

    def cpu(self):
        return self

    def numpy(self):
        return np.asarray(self)


def tensor(values, dtype=np.float32):
    return np.asarray(values, dtype=dtype).view(Tensor)


def stand_in_torch(*, has_cuda=True):
    """The few functions of torch that the adapter uses."""

    def as_tensor(values, device):
        assert device == "cuda"
        assert values.dtype == np.float32
        assert values.flags.writeable
        return values.view(Tensor)

    return SimpleNamespace(
        cuda=SimpleNamespace(is_available=lambda: has_cuda),
        no_grad=nullcontext,
        as_tensor=as_tensor,
        concatenate=lambda parts, dim=0: np.concatenate(parts, dim).view(Tensor),
    )


def check(array, shape, dtype=np.float32):
    assert isinstance(array, Tensor)
    assert array.shape == shape, array.shape
    assert array.dtype == dtype, array.dtype


class StandInGsplat:
    """gsplat's stages; `calls` holds the keyword arguments of every projection."""

    def __init__(self):
        self.calls = []

    def fully_fused_projection(
        self, means, covars, quats, scales, viewmats, Ks, width, height, **options
    ):
        n = len(means)
        assert covars is None
        for array, shape in ((means, (n, 3)), (quats, (n, 4)), (scales, (n, 3))):
            check(array, shape)
        check(viewmats, (1, 4, 4))
        check(Ks, (1, 3, 3))
        check(options["opacities"], (n,))
        self.calls.append({"viewmats": viewmats, "Ks": Ks, "size": (width, height), **options})
        (fx, _, cx), (_, fy, cy), _ = Ks[0].tolist()
        rotation, shift = viewmats[0, :3, :3].astype(float), viewmats[0, :3, 3].astype(float)
        points = np.asarray(means.astype(float) @ rotation.T + shift)
        if options["camera_model"] == "pinhole":
            camera = Pinhole(width, height, fx, fy, cx, cy)
            pixels, _, jacobians, _ = project(camera, points)
        else:
            assert options["camera_model"] == "fisheye"
            assert fx == fy
            camera = Fisheye(width, height, fx, cx, cy, np.pi)
            pixels, _, jacobians, _ = project(camera, points)
        factors = rotation_from_quaternion(np.asarray(quats)) * np.asarray(scales)[:, None]
        sharp = jacobians @ rotation @ factors
        sharp = sharp @ np.swapaxes(sharp, 1, 2)
        blurred = sharp + options["eps2d"] * np.eye(2)
        compensations = np.sqrt(np.maximum(np.linalg.det(sharp), 0) / np.linalg.det(blurred))
        z = points[:, 2]
        is_kept = (z >= options["near_plane"]) & (z <= options["far_plane"])
        reach = np.ceil(3.34 * np.sqrt(np.diagonal(blurred, axis1=1, axis2=2)))
        radii = np.where(is_kept[:, None], np.minimum(reach, 1e6), 0)
        inverse = np.linalg.inv(blurred)
        conics = np.stack([inverse[:, 0, 0], inverse[:, 0, 1], inverse[:, 1, 1]], axis=1)
        return (
            tensor(radii[None], np.int32),
            tensor(pixels[None], np.float64),
            tensor(z[None]),
            tensor(conics[None], np.float64),
            tensor(compensations[None]) if options["calc_compensations"] else None,
        )

    def spherical_harmonics(self, degree, dirs, coeffs):
        n = len(dirs)
        check(dirs, (n, 3))
        check(coeffs, (n, coeffs.shape[1], 3))
        assert (degree + 1) ** 2 <= coeffs.shape[1]
        lengths = np.linalg.norm(dirs, axis=1, keepdims=True)
        values = basis(np.asarray(dirs / np.where(lengths > 0, lengths, 1)), degree)
        return tensor(np.einsum("nk,nkc->nc", values, coeffs[:, : (degree + 1) ** 2]))

    def isect_tiles(self, means2d, radii, depths, tile_size, tile_width, tile_height):
        n = means2d.shape[1]
        check(radii, (1, n, 2), np.int32)
        check(depths, (1, n))
        assert tile_size == 16
        order = np.argsort(depths[0], kind="stable")
        drawn = order[(radii[0, order] > 0).all(axis=1)]
        return None, (tile_width, tile_height), drawn

    def isect_offset_encode(self, crossings, images, tile_width, tile_height):
        assert images == 1
        assert crossings == (tile_width, tile_height)
        return tensor(np.zeros((1, tile_height, tile_width)), np.int32)

    def rasterize_to_pixels(
        self, means2d, conics, colors, opacities, width, height, tile_size, offsets, order
    ):
        n = means2d.shape[1]
        assert conics.shape == (1, n, 3)
        check(colors, (1, n, 4))
        check(opacities, (1, n))
        assert offsets.shape[1] * tile_size >= height
        assert offsets.shape[2] * tile_size >= width
        y, x = np.mgrid[:height, :width] + 0.5
        through, out = np.ones((height, width)), np.zeros((height, width, 4))
        for i in order:
            dx, dy = x - means2d[0, i, 0], y - means2d[0, i, 1]
            xx, xy, yy = conics[0, i]
            power = 0.5 * (xx * dx * dx + yy * dy * dy) + xy * dx * dy
            alpha = np.minimum(0.999, opacities[0, i] * np.exp(-power))
            alpha = np.where((alpha < 1 / 255) | (through < 0), 0.0, np.asarray(alpha))
            after = through * (1 - alpha)
            # A pixel that would fall below the stop takes no more: kept as a negative remainder.
            is_done = (after <= 1e-4) & (alpha > 0)
            weight = np.where(is_done, 0.0, alpha * np.abs(through)) * (through > 0)
            out += weight[..., None] * np.asarray(colors[0, i])
            through = np.where(is_done, -np.abs(through), np.where(through < 0, through, after))
        return tensor(out[None]), tensor(1 - np.abs(through)[None, ..., None])
