from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenes.samples import SAMPLE_NAMES, unlit_room
from scenes.samples.light import lit, texels_of
from scenes.samples.light_file import BRIGHTEST, DATA, STEPS, load_light, save_light
from scenes.samples.pictures.textures import plain
from scenes.samples.shapes import bar, box, quad


def _floor(width=2.0, depth=1.0, rgb=(188, 188, 188)):
    """A level quad, columns along +X, rows along -Y."""
    return quad((0, depth, 0.0), (width, 0, 0), (0, -depth, 0), material=plain(rgb))


@given(width=st.floats(0.02, 3.0), depth=st.floats(0.02, 3.0))
def test_texels_tile_their_surface(width, depth):
    texels = texels_of([_floor(width, depth)])
    ((rows, columns),) = texels.shapes
    assert len(texels.centres) == rows * columns
    area = np.linalg.norm(np.cross(texels.across, texels.down), axis=1)
    assert area.sum() == pytest.approx(width * depth, rel=1e-9)
    assert np.ptp(area) < 1e-9
    assert np.allclose(texels.normals, (0, 0, 1))
    grid = texels.centres.reshape(rows, columns, 3)
    assert np.allclose(grid[0, 0], (width / columns / 2, depth - depth / rows / 2, 0))
    assert np.allclose(grid[-1, -1], (width - width / columns / 2, depth / rows / 2, 0))


def test_normals_point_out_of_solids():
    solid = [
        *box((-0.2, -0.1, 0), (0.2, 0.1, 0.3), material=plain((9, 9, 9))),
        *bar((0, 0, 1), (0, 0, 2), width=0.1, depth=0.1, material=plain((9, 9, 9)), radius=0.05),
    ]
    texels = texels_of(solid)
    middles = np.where(texels.centres[:, 2:] < 0.5, (0, 0, 0.15), (0, 0, 1.5))
    out = np.einsum("nd,nd->n", texels.normals, texels.centres - middles)
    assert (out > 0).all()


def test_light_of_one_leaves_pictures_and_less_darkens_them():
    floor, screen = _floor(), replace(_floor(), glow=1.0)
    count = sum(r * c for r, c in texels_of([floor, screen]).shapes)
    same = lit([floor, screen], np.ones((count, 3), np.float32))
    assert np.abs(same[0].picture.astype(int) - 188).max() <= 1
    half = lit([floor, screen], np.full((count, 3), 0.5, np.float32))
    # Half the light of sRGB 188, which is linear 0.503, is sRGB 137.
    assert np.abs(half[0].picture.astype(int) - 137).max() <= 1
    assert np.array_equal(half[1].picture, screen.picture)


def test_light_falls_where_it_was_traced():
    """Light that grows along x and y grows to the right and to the top of the picture."""
    floor = _floor()
    texels = texels_of([floor])
    light = np.stack(
        [texels.centres[:, 0] / 2, texels.centres[:, 1], np.full(len(texels.centres), 0.1)], axis=1
    )
    picture = lit([floor], light.astype(np.float32))[0].picture.astype(int)
    assert (np.diff(picture[..., 0], axis=1) >= 0).all()
    assert (np.diff(picture[..., 1], axis=0) <= 0).all()
    assert np.ptp(picture[:, 5, 0]) <= 1
    assert np.ptp(picture[..., 2]) == 0


@given(seed=st.integers(0, 2**16))
def test_a_file_gives_the_light_back(tmp_path_factory, seed):
    path = tmp_path_factory.mktemp("light") / "room.npz"
    texels = texels_of([_floor(), _floor(0.3, 0.2)])
    rng = np.random.default_rng(seed)
    light = rng.uniform(0, 1.2 * BRIGHTEST, texels.centres.shape).astype(np.float32)
    save_light(path, texels, light)
    again = load_light(path, texels)
    step = math.sqrt(BRIGHTEST) / (STEPS - 1)
    apart = np.sqrt(again) - np.sqrt(np.minimum(light, BRIGHTEST))
    assert np.abs(apart).max() <= 0.51 * step


def test_light_of_another_room_is_refused(tmp_path):
    path = tmp_path / "room.npz"
    texels = texels_of([_floor()])
    with pytest.raises(ValueError, match=r"no light was traced.*trace_light room"):
        load_light(path, texels)
    save_light(path, texels, np.ones(texels.centres.shape, np.float32))
    with pytest.raises(ValueError, match=r"another shape; run: python -m .*trace_light room"):
        load_light(path, texels_of([_floor(depth=1.01)]))
    with pytest.raises(ValueError, match="another shape"):
        load_light(path, texels_of([_floor(), _floor()]))


@pytest.mark.parametrize("name", SAMPLE_NAMES)
def test_the_committed_light_is_the_rooms_and_believable(name):
    """It was traced for the room as it is; day comes in at the window, corners are darker."""
    room = unlit_room(name)
    texels = texels_of(room.surfaces)
    light = load_light(DATA / f"{room.name}.npz", texels)
    grey = light.mean(axis=1)
    up = texels.normals[:, 2] > 0.99
    near = np.linalg.norm(texels.centres - room.reference, axis=1) < 0.35
    level = ((room.level + 0.055) / 1.055) ** 2.4
    assert grey[up & near].mean() == pytest.approx(level, rel=0.12)
    floor = up & (np.abs(texels.centres[:, 2]) < 1e-9)
    window = room.lights[0].corner + 0.5 * (room.lights[0].u + room.lights[0].v)
    away = np.abs(texels.centres[:, 0] - window[0])
    assert grey[floor & (away < 1.2)].mean() > 1.1 * np.median(grey[floor & (away > 3.0)])
    hidden = np.percentile(grey[floor], 2)
    assert hidden < 0.45 * np.median(grey[floor]), "under the furniture it is dark"
    assert (DATA / f"{room.name}.npz").stat().st_size < 2_000_000
