import pytest

from devices.camera.lenses.layout import Arrangement, Box, LensLayout


@pytest.mark.parametrize(
    ("arrangement", "size", "boxes"),
    [
        (Arrangement.SIDE_BY_SIDE, (2880, 1440), (Box(0, 0, 1440, 1440), Box(1440, 0, 1440, 1440))),
        (Arrangement.STACKED, (960, 1920), (Box(0, 0, 960, 960), Box(0, 960, 960, 960))),
        (Arrangement.ONE_LENS, (1920, 1080), (Box(420, 0, 1080, 1080),)),
        (Arrangement.SIDE_BY_SIDE, (1920, 1080), (Box(0, 60, 960, 960), Box(960, 60, 960, 960))),
    ],
)
def test_lens_pictures_are_squares_in_the_middle_of_their_share(arrangement, size, boxes):
    turns = (0,) * len(boxes)
    assert LensLayout(arrangement, turns).boxes(*size) == boxes


def test_an_equirectangular_picture_is_one():
    assert LensLayout(Arrangement.EQUIRECTANGULAR, (2,)).boxes(101, 51) == (Box(0, 0, 100, 50),)


@pytest.mark.parametrize(
    ("arrangement", "turns"),
    [
        (Arrangement.SIDE_BY_SIDE, (0,)),
        (Arrangement.ONE_LENS, (0, 0)),
        (Arrangement.STACKED, (0, 4)),
    ],
)
def test_turns_that_do_not_suit_are_refused(arrangement, turns):
    with pytest.raises(ValueError, match="turns"):
        LensLayout(arrangement, turns)


def test_people_read_angles():
    layout = LensLayout(Arrangement.SIDE_BY_SIDE, (3, 1))
    assert layout.shown == "side by side, turned by 270° and 90°"
