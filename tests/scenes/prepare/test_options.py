from pathlib import Path

import numpy as np
import pytest

from scenes.pose import Pose
from scenes.prepare.options import KnownLength, KnownObject, PrepareOptions
from scenes.quad import QrCode

SOMEWHERE = Path("somewhere")
LENGTH = KnownLength(2.0, {}, {})
THING = KnownObject(np.zeros((8, 3)), {})


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"quality": "best"}, "quality 'best'"),
        ({"trainer": "magic"}, "trainer 'magic'"),
        ({"steps": 0}, "0 training steps"),
        ({"splats": SOMEWHERE}, "need the poses"),
        ({"splats": SOMEWHERE, "poses": SOMEWHERE, "trainer": "brush"}, "and a trainer"),
        ({"splats": SOMEWHERE, "poses": SOMEWHERE, "steps": 9}, "and steps"),
        ({"trainer": "gsplat"}, "gsplat is a script"),
        ({"program": SOMEWHERE}, "no trainer that it belongs to"),
        ({"metric_poses": True}, "none are given"),
        ({"metric_poses": True, "poses": SOMEWHERE, "known_length": LENGTH}, "in metres already"),
        ({"known_length": LENGTH, "sides_m": 0.2}, "both give the scale"),
        ({"known_object": THING, "sides_m": 0.2}, "a known object, and codes"),
        ({"known_object": THING, "known_length": LENGTH}, "a known object, and codes"),
        ({"known_object": THING, "metric_poses": True, "poses": SOMEWHERE}, "in metres already"),
        ({"per_axis": True}, "measured on codes"),
        ({"known_codes": (QrCode("a", 0.2, Pose.identity()),)}, "printed size"),
        ({"headset_mesh": SOMEWHERE, "collision": False}, "headset's mesh"),
    ],
)
def test_what_contradicts_itself_is_told(wrong, message):
    with pytest.raises(ValueError, match=message):
        PrepareOptions(**wrong)


@pytest.mark.parametrize(
    "right",
    [
        {},
        {"splats": SOMEWHERE, "poses": SOMEWHERE},
        {"trainer": "inria", "program": SOMEWHERE},
        {"trainer": "brush"},
        {"poses": SOMEWHERE, "metric_poses": True, "sides_m": 0.2},
    ],
)
def test_what_goes_together_is_taken(right):
    assert PrepareOptions(**right)
