"""Only splats that draw the photos are taken."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from scenes.formats.registry import write_splats
from scenes.prepare.train.held_out import draw_photo
from scenes.prepare.train.trained_import import check_trained, import_trained
from scenes.prepare.train.training_photos import read_photo
from scenes.render.native import NativeRenderer
from scenes.render.renderer import RenderOptions
from tests.scenes.prepare.conftest import painted_ball


@pytest.fixture(scope="module")
def renderer():
    return NativeRenderer()


@pytest.mark.parametrize("name", ["trained.ply", "trained.spz"])
def test_splats_in_the_photos_frame_are_taken(filmed_ball, renderer, tmp_path, name):
    write_splats(tmp_path / name, painted_ball())
    assert len(import_trained(tmp_path / name, filmed_ball, renderer)) == 1500


def flat_ball():
    """The ball of discs that lie on its surface: their turn matters."""
    ball = painted_ball()
    normals = ball.means / np.linalg.norm(ball.means, axis=1, keepdims=True)
    # The turn from z to the normal, about their common perpendicular.
    half = normals + np.array([0, 0, 1])
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    turns = np.column_stack([half[:, 2], -half[:, 1], half[:, 0], np.zeros(len(half))])
    scales = np.tile(np.array([0.07, 0.07, 0.002], dtype=np.float32), (len(half), 1))
    return replace(ball, rotations=turns.astype(np.float32), scales=scales)


def test_the_psnr_is_told(filmed_ball, renderer):
    assert check_trained(painted_ball(), filmed_ball, renderer, where="x") > 40


@pytest.mark.parametrize(("turn", "order"), [(-1, "x, y, z, w"), (1, "y, z, w, x")])
def test_quaternions_in_another_order_are_refused_with_the_cure(
    filmed_ball, renderer, tmp_path, turn, order
):
    ball = flat_ball()
    photos = filmed_by(ball, filmed_ball, tmp_path)
    check_trained(ball, photos, renderer, where="x")
    turned = replace(ball, rotations=np.roll(ball.rotations, turn, axis=1))
    with pytest.raises(ValueError, match=f"quaternions read as {order}"):
        check_trained(turned, photos, renderer, where="x")


def test_another_frame_is_refused(filmed_ball, renderer):
    ball = painted_ball()
    other = replace(ball, means=(2 * ball.means + [1, 0, 1]).astype(np.float32))
    with pytest.raises(ValueError, match=r"theirs: draws the photos at .* dB, wanted at least 15"):
        check_trained(other, filmed_ball, renderer, where="theirs")


def test_mixed_up_coefficients_are_refused_with_the_cure(filmed_ball, renderer, tmp_path):
    ball = painted_ball()
    rng = np.random.default_rng(0)
    # As a colour that comes from one side only.
    higher = 0.6 * rng.normal(size=(len(ball), 1, 3)) * np.array([[1], [0], [-1]])
    good = replace(ball, sh=np.concatenate([ball.sh, higher], axis=1).astype(np.float32))
    in_turn = higher.reshape(len(ball), 3, 3).transpose(0, 2, 1)
    mixed = replace(ball, sh=np.concatenate([ball.sh, in_turn], axis=1).astype(np.float32))
    photos = filmed_by(good, filmed_ball, tmp_path)
    check_trained(good, photos, renderer, where="x")
    with pytest.raises(ValueError, match="coefficients read as red, green, blue in turn"):
        check_trained(mixed, photos, renderer, where="x")


def filmed_by(cloud, reconstruction, folder):
    """The reconstruction with photos of another cloud."""
    views = []
    for view in reconstruction.views:
        drawn = draw_photo(NativeRenderer(), cloud, read_photo(view, 640), RenderOptions())
        path = folder / view.name
        cv2.imwrite(str(path), np.round(255 * drawn[..., ::-1]).astype(np.uint8))
        views.append(replace(view, image=path))
    return replace(reconstruction, views=tuple(views))


def test_damaged_values_are_refused(filmed_ball, renderer):
    ball = painted_ball()
    means = ball.means.copy()
    means[7, 1] = np.nan
    with pytest.raises(ValueError, match="means"):
        check_trained(replace(ball, means=means), filmed_ball, renderer, where="x")
