import dataclasses

import cv2
import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.prepare.align.codes.anchors import find_anchors
from scenes.prepare.align.codes.symbols import april_tag, qr_symbol
from scenes.prepare.align.codes.triangulate import predicted_corners
from scenes.prepare.align.similarity import Similarity
from scenes.prepare.progress import Cancelled
from scenes.prepare.reconstruction import Reconstruction, View
from tests.scenes.prepare.align.printed import SIDE_M, photo_of, wall_codes

CAMERA = Pinhole(320, 240, 400.0, 400.0, 160.0, 120.0)
CODE = wall_codes(1)["code:0"]
EYES = ((-0.4, 1.3, 1.4), (0.2, 1.4, 1.7), (0.9, 1.4, 1.5))


def filmed(tmp_path, symbol, eyes=EYES, *, alter=lambda photo: photo, **options):
    """Photos of one symbol from several places, and where its corners really are in them."""
    views, truth = [], {}
    rng = np.random.default_rng(4)
    for k, eye in enumerate(eyes):
        world_from_camera = look_at(np.array(eye), CODE.translation + np.array([0.05 * k, 0, 0.02]))
        view = View(f"{k}.png", tmp_path / f"{k}.png", CAMERA, world_from_camera)
        corners = predicted_corners(Similarity.from_pose(CODE, SIDE_M), view)
        assert corners is not None
        photo = alter(photo_of(symbol, corners, rng, **options))
        cv2.imwrite(str(view.image), photo)
        views.append(view)
        truth[view.name] = corners
    none = np.zeros((0, 3))
    reconstruction = Reconstruction(
        tuple(views), none, none.astype(np.uint8), np.zeros(0, np.float32)
    )
    return reconstruction, truth


@pytest.mark.parametrize("symbol", [qr_symbol("room:1"), april_tag(7)], ids=["qr", "tag"])
def test_codes_are_found_read_and_measured(tmp_path, symbol):
    reconstruction, truth = filmed(tmp_path, symbol)
    told = []
    (found,) = find_anchors(reconstruction, progress=lambda done, note: told.append(done))
    assert found.payload == symbol.payload
    assert [s.view for s in found.sightings] == list(truth)
    for sighting in found.sightings:
        assert sighting.was_read
        assert np.abs(sighting.corners_px - truth[sighting.view]).max() < 0.1
    assert told == sorted(told)
    assert told[-1] == 1.0


def test_a_code_too_slanted_to_read_is_found_where_it_must_be(tmp_path):
    slanted = (1.3, 1.85, 1.5)
    reconstruction, truth = filmed(tmp_path, qr_symbol("room:1"), (*EYES, slanted), blur_px=0.6)
    closer = dataclasses.replace(
        reconstruction, views=tuple(v for v in reconstruction.views if v.name == "3.png")
    )
    assert find_anchors(closer) == ()
    (found,) = find_anchors(reconstruction)
    last = found.sightings[-1]
    assert (last.view, last.was_read) == ("3.png", False)
    assert np.abs(last.corners_px - truth["3.png"]).max() < 0.15


def test_a_mirrored_code_is_refused_with_the_reason(tmp_path):
    reconstruction, _ = filmed(tmp_path, qr_symbol("room:1"), alter=lambda p: p[:, ::-1])
    (found,) = find_anchors(reconstruction)
    assert found.sightings == ()
    assert all("mirrored" in r.reason for r in found.refusals)
    assert len(found.refusals) == len(EYES)


def test_a_code_printed_twice_is_refused_with_the_reason(tmp_path):
    def twice(photo):
        return np.concatenate([photo[:, 60:220], photo[:, 60:220]], axis=1)

    reconstruction, _ = filmed(tmp_path, qr_symbol("room:1"), EYES[:1], alter=twice)
    (found,) = find_anchors(reconstruction)
    assert found.sightings == ()
    assert "more than once" in found.refusals[0].reason


def test_a_blurred_code_is_not_used(tmp_path):
    reconstruction, _ = filmed(tmp_path, qr_symbol("room:1"), blur_px=3.5)
    assert all(anchor.sightings == () for anchor in find_anchors(reconstruction))


def test_a_half_covered_code_is_not_used(tmp_path):
    reconstruction, truth = filmed(tmp_path, april_tag(7), EYES[:1])
    photo = cv2.imread(str(reconstruction.views[0].image), cv2.IMREAD_GRAYSCALE)
    middle = truth["0.png"].mean(axis=0).astype(int)
    photo[:, middle[0] :] = 128
    cv2.imwrite(str(reconstruction.views[0].image), photo)
    assert all(anchor.sightings == () for anchor in find_anchors(reconstruction))


def test_an_empty_wall_has_no_codes(tmp_path):
    reconstruction, _ = filmed(tmp_path, qr_symbol("room:1"), alter=lambda p: np.full_like(p, 90))
    assert find_anchors(reconstruction) == ()


def test_it_can_be_cancelled(tmp_path):
    reconstruction, _ = filmed(tmp_path, qr_symbol("room:1"))

    def cancel(done, note):
        raise Cancelled

    with pytest.raises(Cancelled):
        find_anchors(reconstruction, progress=cancel)
