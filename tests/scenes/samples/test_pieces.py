import cv2
import numpy as np
import pytest

from scenes.pose import Pose
from scenes.samples.pieces import DESIGNS, THICK_M, UNIT_M, piece

SIDE_M = 4 * UNIT_M
"""Side of the square that all seven pieces make."""


def area_m2(object_id):
    corners = (UNIT_M * np.array(DESIGNS[object_id].corners)).astype(np.float32)
    return cv2.contourArea(corners)


def test_the_pieces_have_the_areas_of_a_tangram():
    square = SIDE_M**2
    assert sum(area_m2(name) for name in DESIGNS) == pytest.approx(square, rel=1e-5)
    shares = {name: round(16 * area_m2(name) / square) for name in DESIGNS}
    assert list(shares.values()) == [4, 4, 2, 1, 1, 2, 2]


@pytest.mark.parametrize("object_id", DESIGNS)
def test_the_boxes_lie_inside_a_piece_and_fill_most_of_it(object_id):
    """Pieces that lie side by side never touch by boxes that stick out."""
    item = piece(object_id, Pose.identity())
    outline = (UNIT_M * np.array(DESIGNS[object_id].corners)).astype(np.float32)[:, None]
    filled = 0.0
    for part in item.parts:
        x, y, z = part.half_size_m
        assert z == pytest.approx(THICK_M / 2)
        filled += 4 * x * y
        for corner in ((-x, -y, 0), (x, -y, 0), (x, y, 0), (-x, y, 0)):
            a, b, _ = part.object_from_box @ np.array(corner)
            assert cv2.pointPolygonTest(outline, (float(a), float(b)), measureDist=True) > -1e-6
    assert filled > 0.7 * area_m2(object_id)


@pytest.mark.parametrize("object_id", DESIGNS)
def test_a_print_differs_from_itself_at_every_turn(object_id):
    """Seen from above, no piece looks the same after a half or a quarter turn."""
    mesh = piece(object_id, Pose.identity()).meshes[0]
    top = np.abs(mesh.vertices[mesh.faces][:, :, 2] - THICK_M).max(axis=1) < 1e-9
    where = mesh.vertices[mesh.faces[top]].mean(axis=1)[:, :2]
    uv = mesh.uv[mesh.faces[top]].mean(axis=1)
    h, w = mesh.texture.shape[:2]
    at = (((1 - uv[:, 1]) * h).astype(int).clip(0, h - 1), (uv[:, 0] * w).astype(int))
    colours = mesh.texture[at].astype(float)
    for quarter in (1, 2, 3):
        c, s = ((0, 1), (-1, 0), (0, -1))[quarter - 1]
        turned = where @ np.array([[c, s], [-s, c]])
        nearest = np.linalg.norm(turned[:, None] - where[None], axis=2).argmin(axis=1)
        assert np.abs(colours - colours[nearest]).mean() > 8.0


def test_an_unknown_piece_is_refused():
    with pytest.raises(KeyError, match="trapezium"):
        piece("trapezium", Pose.identity())
