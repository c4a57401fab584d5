"""Small scenes with a loss whose gradients can be had by differences, and how gradients compare."""

from dataclasses import replace

import numpy as np

from benchmarks.raster.reference.differences import FrozenPicture, difference
from scenes.render.pose_step import moved

VALUES = ("means", "scales", "rotations", "opacities", "sh")
STEPS = dict.fromkeys(VALUES, 5e-6) | {"sh": 1e-4}
"""About the cube root of a rounding, where that and the third derivative weigh the same; a picture
is linear in the coefficients."""


def waves(camera, seed):
    """dL/d(rgb, alpha, depth) of a loss that is linear in the picture."""
    shape = (camera.height_px, camera.width_px)
    rng = np.random.default_rng(seed)
    names = ("d_rgb", "d_alpha", "d_depth")
    return {
        name: _smooth(size, rng)
        for name, size in zip(names, ((*shape, 3), shape, shape), strict=True)
    }


def _smooth(shape, rng):
    """Waves of at least 8 px: white noise would cancel over a splat, down to the last digits."""
    y, x = np.indices(shape[:2]).reshape(2, *shape[:2], *[1] * (len(shape) - 2))
    fx, fy, phase = rng.uniform([[-0.75], [-0.75], [0]], [[0.75], [0.75], [6.28]], (3, shape[-1]))
    if len(shape) == 2:
        fx, fy, phase = fx[0], fy[0], phase[0]
    return np.sin(fx * x + fy * y + phase).astype(np.float32)


class FrozenScene:
    """Objects before a lens, a loss, and its differences with mask and order frozen."""

    def __init__(self, objects, camera, world_from_camera, options, *, seed):
        self.objects, self.camera, self.options = objects, camera, options
        self.world_from_camera = world_from_camera
        self.d_picture = waves(camera, seed)
        self.frozen = FrozenPicture(objects, camera, world_from_camera, options)

    def loss(self, **changed):
        picture = self.frozen.draw(**changed)
        parts = (picture.rgb, picture.alpha, picture.depth)
        return sum(
            float((a * b).sum()) for a, b in zip(parts, self.d_picture.values(), strict=True)
        )

    def by_values(self, name, index, splat, count=None):
        """Gradient of the first `count` values of one array of one splat, flat."""
        base = getattr(self.frozen.clouds[index], name)

        def moved_by(place):
            def loss(t):
                values = base.copy()
                values.reshape(len(base), -1)[splat, place] += t
                clouds = list(self.frozen.clouds)
                clouds[index] = replace(clouds[index], **{name: values})
                return self.loss(clouds=clouds)

            return loss

        places = range(base[0].size if count is None else count)
        return np.array([difference(moved_by(place), STEPS[name]) for place in places])

    def by_object_steps(self, index):
        base = self.frozen.world_from_objects

        def moved_by(entry):
            def loss(t):
                poses = list(base)
                poses[index] = moved(base[index], t * np.eye(6)[entry])
                return self.loss(world_from_objects=poses)

            return loss

        return np.array([difference(moved_by(entry)) for entry in range(6)])

    def by_camera_steps(self):
        def moved_by(entry):
            def loss(t):
                step = t * np.eye(6)[entry]
                return self.loss(world_from_camera=moved(self.world_from_camera, step))

            return loss

        return np.array([difference(moved_by(entry)) for entry in range(6)])


def assert_values_agree(pairs, tolerance, what):
    """Of (wanted, got) gradients of splats: to their norm, or a hundredth of the largest's."""
    largest = max(np.linalg.norm(wanted) for wanted, _ in pairs)
    assert largest > 0.1, what
    errors = [
        np.linalg.norm(got - wanted) / max(np.linalg.norm(wanted), 1e-2 * largest)
        for wanted, got in pairs
    ]
    assert max(errors) <= tolerance, (what, max(errors))


def assert_steps_agree(wanted, got, tolerance):
    assert np.abs(got - wanted).max() <= tolerance * np.abs(wanted).max()
