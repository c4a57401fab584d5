"""Two boxes on a floor, close to each other, each to be found from boxes drawn in a few views."""

import numpy as np
import pytest

from benchmarks.raster.reference.renderer import ReferenceRenderer
from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.prepare.cutout.labelling.separate import separate
from scenes.prepare.cutout.marks.masked_view import MaskedView
from scenes.prepare.cutout.marks.masks import GrabCutMasks, Prompt
from scenes.prepare.cutout.marks.prompted_views import PromptedView, masked_views
from scenes.prepare.cutout.object.upright_box import upright_box
from scenes.prepare.cutout.votes.lifting import lift, share
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats
from scenes.splats import SplatCloud, concatenate

CAMERA = Pinhole(240, 180, 200.0, 200.0, 120.0, 90.0)
STEP_M = 0.02
PLACES = {"red": ((0.0, 0.0), (0.3, 0.2, 0.4)), "blue": ((0.55, 0.1), (0.2, 0.3, 0.3))}


def face(corner, u, v, colour, rng):
    """Flat splats on a rectangle, as a scan of it would give."""
    corner, u, v = (np.asarray(x, dtype=np.float64) for x in (corner, u, v))
    s = (np.arange(round(np.linalg.norm(u) / STEP_M)) + 0.5) * STEP_M / np.linalg.norm(u)
    t = (np.arange(round(np.linalg.norm(v) / STEP_M)) + 0.5) * STEP_M / np.linalg.norm(v)
    s, t = (grid.reshape(-1, 1) for grid in np.meshgrid(s, t))
    n = len(s)
    means = corner + s * u + t * v + rng.normal(0, 0.0007, (n, 3))
    thin = int(np.argmin(np.abs(u) + np.abs(v)))
    scales = np.full((n, 3), 0.7 * STEP_M)
    scales[:, thin] = 0.001
    sh = (np.asarray(colour) + rng.normal(0, 0.03, (n, 1)) - 0.5) / 0.2820948
    return SplatCloud(
        means,
        scales,
        np.tile([1.0, 0, 0, 0], (n, 1)),
        np.full(n, 0.95),
        sh[:, None, :].astype(np.float32),
    )


def box(centre, size, colour, rng):
    """All six faces, the one it stands on too."""
    low = np.array([centre[0] - size[0] / 2, centre[1] - size[1] / 2, 0.0])
    x, y, z = np.diag(size)
    pairs = [
        (low, x, y),
        (low + z, x, y),
        (low, x, z),
        (low + y, x, z),
        (low, y, z),
        (low + x, y, z),
    ]
    return concatenate([face(corner, u, v, colour, rng) for corner, u, v in pairs])


@pytest.fixture(scope="module")
def room():
    """The splats, and which thing each belongs to: 0 the room, 1 red, 2 blue."""
    rng = np.random.default_rng(3)
    parts = [face((-1, -1, 0), (2.4, 0, 0), (0, 2.2, 0), (0.7, 0.65, 0.6), rng)]
    colours = {"red": (0.7, 0.25, 0.2), "blue": (0.2, 0.3, 0.7)}
    parts += [box(*PLACES[name], colours[name], rng) for name in PLACES]
    truth = np.concatenate([np.full(len(part), k) for k, part in enumerate(parts)])
    return concatenate(parts), truth


@pytest.fixture(scope="module")
def renderer():
    return NativeRenderer()


def views_of(room, number, renderer, angles=(0.4, 2.3, 4.4), pad_px=6.0):
    """Boxes as a person would draw them, a little too large, around one thing."""
    cloud, truth = room
    centre = np.array([*list(PLACES.values())[number - 1][0], 0.18])
    result = []
    for k, angle in enumerate(angles):
        eye = centre + np.array([1.1 * np.cos(angle), 1.1 * np.sin(angle), 0.7])
        world_from_camera = look_at(eye, centre)
        alone = [PosedSplats(cloud.select(truth == number), Pose.identity())]
        rows, columns = np.nonzero(renderer.render(alone, CAMERA, world_from_camera).alpha > 0.5)
        around = (
            columns.min() - pad_px,
            rows.min() - pad_px,
            columns.max() + 1 + pad_px,
            rows.max() + 1 + pad_px,
        )
        prompt = Prompt(tuple(float(edge) for edge in around))
        result.append(PromptedView(f"v{k}", CAMERA, world_from_camera, prompt))
    return result


def iou(labels, wanted):
    return (labels & wanted).sum() / (labels | wanted).sum()


@pytest.mark.parametrize("number", [1, 2])
@pytest.mark.parametrize("pad_px", [4.0, 12.0])
@pytest.mark.parametrize("angles", [(0.4, 2.3, 4.4), (1.0, 3.2), (5.5, 0.2, 3.0)])
def test_every_splat_is_found_hidden_ones_too(room, renderer, number, pad_px, angles):
    cloud, truth = room
    views = views_of(room, number, renderer, angles, pad_px)
    masked = masked_views(cloud, views, masks=GrabCutMasks(), renderer=renderer)
    found = separate(cloud, masked, renderer=renderer)
    assert iou(found.labels, truth == number) > 0.95
    around = upright_box(cloud.select(found.labels), cloud.select(~found.labels))
    size = np.array(list(PLACES.values())[number - 1][1])
    np.testing.assert_allclose(sorted(around.size_m), sorted(size), atol=0.02)


def test_a_bad_mask_is_left_out(room, renderer):
    cloud, truth = room
    masked = list(
        masked_views(cloud, views_of(room, 1, renderer), masks=GrabCutMasks(), renderer=renderer)
    )
    wrong = np.zeros_like(masked[1].mask)
    wrong[10:40, 10:60] = True
    good = masked[1]
    masked[1] = MaskedView("wrong", CAMERA, good.world_from_camera, wrong)
    found = separate(cloud, masked, renderer=renderer)
    assert [view.used for view in found.views] == [True, False, True]
    assert iou(found.labels, truth == 1) > 0.95


def test_a_click_says_which_of_two_bodies_is_meant(room, renderer):
    cloud, truth = room
    picked = []
    for number in (1, 2):
        masked = []
        for k, view in enumerate(views_of(room, 1, renderer, pad_px=0.0)):
            both = share(cloud, truth > 0, CAMERA, view.world_from_camera, renderer=renderer) > 0.5
            only = share(cloud, truth == number, CAMERA, view.world_from_camera, renderer=renderer)
            row, column = np.argwhere(only > 0.9).mean(axis=0).round().astype(int)
            click = np.array([[column + 0.5, row + 0.5]]) if only[row, column] > 0.5 else None
            clicks = np.zeros((0, 2)) if click is None else click
            masked.append(
                MaskedView(f"v{k}", CAMERA, view.world_from_camera, both, inside_px=clicks)
            )
        labels = separate(cloud, masked, renderer=renderer).labels
        picked.append([(labels & (truth == k)).sum() for k in (1, 2)])
    assert picked[0][0] > 20 * picked[0][1]
    assert picked[1][1] > 20 * picked[1][0]


def test_views_without_an_object_are_refused(room, renderer):
    cloud, _ = room
    here = look_at(np.array([1.0, 1.0, 0.8]), np.array([0.0, 0.0, 0.1]))
    empty = MaskedView("v", CAMERA, here, np.zeros((180, 240), dtype=bool))
    with pytest.raises(ValueError, match="no view with a mask"):
        separate(cloud, [], renderer=renderer)
    with pytest.raises(ValueError, match="the mask is empty in v"):
        separate(cloud, [empty], renderer=renderer)
    away = look_at(np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, 5.0]))
    full = MaskedView("sky", CAMERA, away, np.ones((180, 240), dtype=bool))
    with pytest.raises(ValueError, match="no splats lie inside the masks"):
        separate(cloud, [full], renderer=renderer)


def test_votes_are_the_blend_weights_of_the_definition(room):
    """A splat's vote is how much the picture's sum changes with its colour."""
    cloud, _ = room
    few = cloud.select(np.arange(0, len(cloud), 97))
    camera = Pinhole(48, 36, 40.0, 40.0, 24.0, 18.0)
    here = look_at(np.array([1.0, 1.0, 0.8]), np.array([0.2, 0.0, 0.1]))
    mask = np.zeros((36, 48), dtype=bool)
    mask[:, :20] = True
    vote = lift(few, MaskedView("v", camera, here, mask), renderer=NativeRenderer())
    seen = np.argsort(vote.seen)[-3:]
    for k in seen:
        sh = np.full((len(few), 1, 3), -0.5 / 0.28209479177387814, dtype=np.float32)
        sh[k] *= -1
        marked = SplatCloud(few.means, few.scales, few.rotations, few.opacities, sh)
        picture = ReferenceRenderer().render([PosedSplats(marked, Pose.identity())], camera, here)
        weight = picture.rgb[..., 0]
        np.testing.assert_allclose(vote.seen[k], weight.sum(), rtol=2e-3, atol=1e-3)
        np.testing.assert_allclose(vote.inside[k], weight[mask].sum(), rtol=2e-3, atol=1e-3)
