"""Parts of a picture against the whole, bit for bit, and backgrounds that are pictures."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.raster.reference.renderer import ReferenceRenderer
from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.gradients import record
from scenes.render.native import NativeRenderer
from scenes.render.renderer import TILE_PX, PosedSplats, RenderOptions, tiles_of
from scenes.render.still import StillView

BACK = Pose(np.eye(3), [0.0, 0.0, -1.5])
GREEN = (0.2, 0.7, 0.1)
CAMERAS = (Pinhole.from_fov(83, 67, np.radians(75)), Fisheye.from_fov(90, np.radians(250)))
PARTS = ("rgb", "alpha", "depth", "ids")


def pixels_of(camera, region, tile_mask):
    """(H, W) which pixels are drawn, in other words than the renderers'."""
    y, x = np.mgrid[: camera.height_px, : camera.width_px]
    drawn = np.ones(x.shape, dtype=bool)
    if region is not None:
        left, top, width, height = region
        drawn &= (x >= left) & (x < left + width) & (y >= top) & (y < top + height)
    if tile_mask is not None:
        drawn &= tile_mask[y // TILE_PX, x // TILE_PX]
    return drawn


def assert_part(part, whole, drawn, background):
    for name in PARTS:
        np.testing.assert_array_equal(getattr(part, name)[drawn], getattr(whole, name)[drawn], name)
    behind = np.broadcast_to(np.asarray(background, dtype=np.float32), part.rgb.shape)
    np.testing.assert_array_equal(part.rgb[~drawn], behind[~drawn])
    assert not part.alpha[~drawn].any()
    assert not part.depth[~drawn].any()
    assert (part.ids[~drawn] == -1).all()


@pytest.fixture(scope="module")
def scene(wild_cloud):
    """Two objects around the cameras' axes, some of their splats behind."""
    return [
        PosedSplats(wild_cloud(400, degree=1, seed=1), Pose.identity()),
        PosedSplats(wild_cloud(60, seed=2, spread_m=0.2), Pose.from_yaw(0.4, (0.3, 0.1, 0.2))),
    ]


@st.composite
def scopes(draw, camera):
    """(region, tile_mask), either of them missing at times."""
    region = None
    if draw(st.booleans()):
        left = draw(st.integers(0, camera.width_px - 1))
        top = draw(st.integers(0, camera.height_px - 1))
        width = draw(st.integers(1, camera.width_px - left))
        height = draw(st.integers(1, camera.height_px - top))
        region = (left, top, width, height)
    tile_mask = None
    if draw(st.booleans()):
        rows, columns = tiles_of(camera)
        flags = draw(st.lists(st.booleans(), min_size=rows * columns, max_size=rows * columns))
        tile_mask = np.array(flags).reshape(rows, columns)
    return region, tile_mask


@settings(max_examples=40, deadline=None, derandomize=True, database=None)
@given(data=st.data(), camera=st.sampled_from(CAMERAS), threads=st.integers(1, 3))
def test_a_part_is_the_wholes_to_the_bit(scene, data, camera, threads):
    region, tile_mask = data.draw(scopes(camera))
    options = RenderOptions(background=GREEN, threads=threads)
    part_options = RenderOptions(
        background=GREEN, region=region, tile_mask=tile_mask, threads=threads
    )
    drawn = pixels_of(camera, region, tile_mask)
    for name in NativeRenderer().available_instructions():
        renderer = NativeRenderer(instructions=name)
        whole = renderer.render(scene, camera, BACK, options)
        part = renderer.render(scene, camera, BACK, part_options)
        assert_part(part, whole, drawn, GREEN)
        assert_part(
            record(renderer, scene, camera, BACK, part_options).rendering, whole, drawn, GREEN
        )
        view = StillView(renderer, camera, world_from_camera=BACK, options=part_options)
        view.update(scene[:1])
        assert_part(view.update(scene).rendering, whole, drawn, GREEN)


def test_the_references_part_is_its_wholes(scene):
    rng = np.random.default_rng(3)
    for camera in CAMERAS:
        tile_mask = rng.random(tiles_of(camera)) < 0.5
        options = RenderOptions(background=GREEN, region=(20, 9, 41, 37), tile_mask=tile_mask)
        part = ReferenceRenderer().render(scene, camera, BACK, options)
        whole = ReferenceRenderer().render(scene, camera, BACK, RenderOptions(background=GREEN))
        assert_part(part, whole, pixels_of(camera, (20, 9, 41, 37), tile_mask), GREEN)


def test_a_still_view_draws_no_closed_tile_again(native, scene):
    camera = CAMERAS[1]
    tile_mask = np.zeros(tiles_of(camera), dtype=bool)
    tile_mask[2, 1:4] = True
    view = StillView(
        native, camera, world_from_camera=BACK, options=RenderOptions(tile_mask=tile_mask)
    )
    view.update(scene[:1])
    again = view.update(scene).drawn
    assert again.any()
    assert not again[~tile_mask].any()


def test_gradients_come_from_the_region_alone(native, drawn_cloud, small_lens):
    options = RenderOptions()
    posed = drawn_cloud(Pose.identity(), small_lens, BACK, options, seed=3)
    shape = (small_lens.height_px, small_lens.width_px)
    region = (9, 5, 21, 23)
    inside = pixels_of(small_lens, region, None)
    d_rgb = np.random.default_rng(0).normal(size=(*shape, 3)).astype(np.float32)
    part = record(native, [posed], small_lens, BACK, RenderOptions(region=region))
    whole = record(native, [posed], small_lens, BACK, options)
    d_inside = np.where(inside[..., None], d_rgb, np.float32(0))
    for name in ("means", "scales", "rotations", "opacities", "sh"):
        got = getattr(part.gradients(d_rgb).objects[0], name)
        wanted = getattr(whole.gradients(d_inside).objects[0], name)
        np.testing.assert_allclose(got, wanted, atol=1e-5 * np.abs(wanted).max())


def test_a_picture_shines_through_like_a_colour(renderer, scene, camera):
    plain = renderer.render(scene, camera, BACK, RenderOptions(background=GREEN))
    shape = (camera.height_px, camera.width_px, 3)
    flat = np.broadcast_to(np.array(GREEN, dtype=np.float32), shape)
    same = renderer.render(scene, camera, BACK, RenderOptions(background=flat))
    np.testing.assert_allclose(same.rgb, plain.rgb, rtol=0, atol=1e-7)
    picture = np.random.default_rng(1).random(shape, dtype=np.float32)
    rendering = renderer.render(scene, camera, BACK, RenderOptions(background=picture))
    black = renderer.render(scene, camera, BACK)
    wanted = black.rgb + (1 - black.alpha[..., None]) * picture
    np.testing.assert_allclose(rendering.rgb, wanted, rtol=0, atol=1e-6)


@pytest.mark.parametrize("camera", CAMERAS)
def test_a_part_shows_the_background_picture_around_it(native, scene, camera):
    shape = (camera.height_px, camera.width_px, 3)
    picture = np.random.default_rng(1).random(shape, dtype=np.float32)
    region = (17, 3, 30, 40)
    whole = native.render(scene, camera, BACK, RenderOptions(background=picture))
    options = RenderOptions(background=picture, region=region)
    drawn = pixels_of(camera, region, None)
    assert_part(native.render(scene, camera, BACK, options), whole, drawn, picture)
    assert_part(
        StillView(native, camera, world_from_camera=BACK, options=options).update(scene).rendering,
        whole,
        drawn,
        picture,
    )


def test_gradients_see_the_background_picture(native, drawn_cloud, small_lens):
    posed = drawn_cloud(Pose.identity(), small_lens, BACK, RenderOptions(), seed=5)
    shape = (small_lens.height_px, small_lens.width_px)
    picture = np.random.default_rng(2).random((*shape, 3), dtype=np.float32)
    d_rgb = np.random.default_rng(0).normal(size=(*shape, 3)).astype(np.float32)
    # rgb = black + (1 - alpha) · picture
    d_alpha = -(picture * d_rgb).sum(axis=2)
    options = RenderOptions(background=picture)
    got = record(native, [posed], small_lens, BACK, options).gradients(d_rgb).objects[0]
    wanted = record(native, [posed], small_lens, BACK).gradients(d_rgb, d_alpha).objects[0]
    for name in ("means", "opacities", "sh"):
        a, b = getattr(got, name), getattr(wanted, name)
        np.testing.assert_allclose(a, b, atol=1e-5 * np.abs(b).max())


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (RenderOptions(region=(0, 0, 0, 5)), "region"),
        (RenderOptions(region=(-1, 0, 5, 5)), "region"),
        (RenderOptions(region=(80, 0, 4, 5)), "region"),
        (RenderOptions(region=(0, 0, 5)), "region"),  # type: ignore[arg-type]
        (RenderOptions(region=(0, 0, 5.0, 5)), "region"),  # type: ignore[arg-type]
        (RenderOptions(tile_mask=np.ones((5, 5), dtype=bool)), "tile_mask"),
        (RenderOptions(tile_mask=np.ones((5, 6), dtype=np.uint8)), "tile_mask"),  # type: ignore[arg-type]
        (RenderOptions(tile_mask=[[True]]), "tile_mask"),  # type: ignore[arg-type]
        (RenderOptions(background=np.zeros((67, 83, 3))), "background"),
        (RenderOptions(background=np.zeros((83, 67, 3), dtype=np.float32)), "background"),
        (RenderOptions(background=np.full((67, 83, 3), np.nan, dtype=np.float32)), "background"),
    ],
)
def test_bad_scopes_and_pictures_are_named(renderer, options, named):
    with pytest.raises(ValueError, match=rf"options\.{named}: got .*, wanted "):
        renderer.render([], CAMERAS[0], BACK, options)
