"""Lenses that a camera carries, taken for its stream; how poses are found is tested where it is."""

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.wire.fuzz import OFFSET_V1, OFFSET_V3
from devices.camera.address import parse_address
from devices.camera.lenses.layout import Arrangement, LensLayout
from devices.camera.received import Received
from devices.insta360.files.lens_rig import CarriedLenses
from studio.live.placing import place_camera
from studio.live.setup import LiveSetup, Place
from tests.stream_pictures import picture_from_rgb

SETUP = LiveSetup(parse_address("insta360://127.0.0.1"), place=Place.SCAN, calibrates=False)
CARRIED = CarriedLenses(OFFSET_V3, "Insta360 X5")
PAIR = LensLayout(Arrangement.SIDE_BY_SIDE, (0, 0))


def placed(tiny, *, layout=PAIR, carried=CARRIED, setup=SETUP, sizes=((480, 240),)):
    pictures = tuple(
        picture_from_rgb(np.zeros((height, width, 3), np.uint8)) for width, height in sizes
    )
    received = Received(0, 1, 2, None, pictures)
    return place_camera(
        [received],
        layout,
        setup,
        tiny.scene,
        renderer=None,
        locate=None,
        say=lambda _: None,
        carried=carried,
    )


def test_the_camera_s_own_lenses_are_used_and_it_is_said(tiny):
    camera = placed(tiny)
    assert camera.found.endswith("lenses as Insta360 X5 itself has calibrated them")
    assert camera.rig.lenses == CARRIED.rig(240).lenses
    turned = placed(tiny, layout=LensLayout(Arrangement.SIDE_BY_SIDE, (1, 3)))
    assert turned.rig.lenses == CARRIED.rig(240, turns=(1, 3)).lenses


def test_a_track_a_lens_is_two_lenses(tiny):
    one = LensLayout(Arrangement.ONE_LENS, (0,))
    camera = placed(tiny, layout=one, sizes=((240, 240), (240, 240)))
    assert camera.rig.lenses == CARRIED.rig(240).lenses
    usual = placed(tiny, layout=one, sizes=((240, 240), (240, 240)), carried=None)
    assert len(usual.rig.lenses) == 2


@pytest.mark.parametrize(
    ("layout", "carried", "says"),
    [
        (PAIR, CarriedLenses(OFFSET_V1), "not used: the camera's own lens calibration: V1"),
        (LensLayout(Arrangement.ONE_LENS, (0,)), CARRIED, "not for this picture"),
        (LensLayout(Arrangement.EQUIRECTANGULAR, (0,)), CARRIED, "not for this picture"),
    ],
)
def test_what_does_not_suit_is_said_and_usual_lenses_are_used(tiny, layout, carried, says):
    camera = placed(tiny, layout=layout, carried=carried)
    assert says in camera.found
    assert camera.rig.lenses[0].is_equidistant


def test_a_camera_file_goes_before_what_the_camera_says(tiny, tmp_path):
    frame = next(tiny.inputs()).frame
    from tests.studio.verbs.test_track import camera_file

    path = camera_file(tmp_path / "cam.json", frame.rig, frame.world_from_rig)
    camera = placed(tiny, setup=replace(SETUP, camera_file=path))
    assert "calibrated" not in camera.found
    assert camera.rig.lenses[0].max_angle == frame.rig.lenses[0].max_angle
    assert not math.isclose(camera.rig.lenses[0].f_px, CARRIED.rig(240).lenses[0].f_px)
