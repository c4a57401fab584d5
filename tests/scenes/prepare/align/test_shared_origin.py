import dataclasses
import json

import numpy as np
import pytest

from scenes.prepare.align.align import align
from scenes.prepare.align.shared_origin import shared_origin_from_json, shared_origin_to_json
from tests.scenes.prepare.align.printed import SIDE_M, capture, wall_codes


@pytest.fixture(scope="module")
def alignment():
    reconstruction, sightings, _ = capture(np.random.default_rng(0), codes=wall_codes(2))
    return align(reconstruction, sightings, sides_m=SIDE_M, rng=np.random.default_rng(0))


def test_the_origin_is_told_from_every_code(alignment):
    text = shared_origin_to_json(alignment)
    codes = shared_origin_from_json(text)
    for code, anchor in zip(codes, alignment.anchors, strict=True):
        assert (code.payload, code.side_m) == (anchor.payload, SIDE_M)
        np.testing.assert_allclose(
            code.world_from_code.matrix(), anchor.world_from_code.matrix(), atol=1e-12
        )
    first = json.loads(text)["codes"][0]
    origin_in_code = np.array(first["code_from_world"]["translation"])
    # The origin is on the floor under the first code: 1.5 m down, which is -y of the print.
    np.testing.assert_allclose(origin_in_code, [0, -1.5, 0], atol=0.02)
    assert 0 < first["sigma_m"] < 0.05


def test_without_codes_there_is_nothing_to_find(alignment):
    with pytest.raises(ValueError, match="film a printed code"):
        shared_origin_to_json(dataclasses.replace(alignment, anchors=()))


@pytest.mark.parametrize(
    "spoil",
    [
        lambda v: v.update(version=2),
        lambda v: v.update(format="other"),
        lambda v: v.pop("codes"),
        lambda v: v["codes"][0].update(side_m=-1),
        lambda v: v["codes"][0]["code_from_world"].update(wxyz=[1, 1, 1, 1]),
        lambda v: v["codes"][0].pop("payload"),
    ],
)
def test_a_damaged_file_is_refused(alignment, spoil):
    values = json.loads(shared_origin_to_json(alignment))
    spoil(values)
    with pytest.raises(ValueError, match="shared origin"):
        shared_origin_from_json(json.dumps(values))
