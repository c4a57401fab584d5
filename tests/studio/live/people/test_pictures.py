"""What live surfaces show is sent small, not too often, and only when it has changed."""

import threading

import cv2
import numpy as np
import pytest

from scenes.state import LiveSurface
from studio.live.people.pictures import EVERY_NS, MAX_SIDE_PX, SurfacePictures, jpeg_of
from studio.view.surface_drawing import LivePicture

CORNERS = np.array([[0, 0, 2.0], [1, 0, 2.0], [1, 0, 1.0], [0, 0, 1.0]])


class Screen:
    def __init__(self):
        self.shown = []
        self.is_shown = threading.Event()

    def show(self, surface_id, jpeg):
        self.shown.append((surface_id, jpeg))
        self.is_shown.set()

    def wait(self):
        assert self.is_shown.wait(5.0)
        self.is_shown.clear()


def picture(colour, *, size=(60, 80)):
    return LivePicture(
        LiveSurface("wall", CORNERS, (size[1], size[0]), "camera"),
        np.full((*size, 3), colour, np.uint8),
    )


@pytest.fixture
def screen():
    return Screen()


@pytest.fixture
def pictures(screen):
    made = SurfacePictures(screen)
    yield made
    made.close()


def test_a_picture_arrives_in_its_colours(screen, pictures):
    pictures.show([picture((200, 40, 20))], 0)
    screen.wait()
    ((key, jpeg),) = screen.shown
    seen = cv2.cvtColor(cv2.imdecode(np.frombuffer(jpeg, np.uint8), 1), cv2.COLOR_BGR2RGB)
    assert key == "wall"
    assert np.abs(seen.astype(int) - (200, 40, 20)).max() <= 4


def test_pictures_too_soon_after_the_last_are_left_out(screen, pictures):
    pictures.show([picture((0, 0, 0))], 0)
    screen.wait()
    pictures.show([picture((90, 90, 90))], EVERY_NS - 1)
    pictures.show([picture((200, 200, 200))], EVERY_NS)
    screen.wait()
    assert len(screen.shown) == 2


def test_the_same_picture_is_not_sent_again(screen, pictures):
    for k, colour in enumerate(((10, 10, 10), (10, 10, 10), (250, 10, 10))):
        pictures.show([picture(colour)], k * EVERY_NS)
        while pictures.is_busy:
            pass
    assert len(screen.shown) == 2


def test_a_large_picture_is_made_smaller():
    seen = cv2.imdecode(
        np.frombuffer(jpeg_of(picture((9, 9, 9), size=(700, 4096)).picture), np.uint8), 1
    )
    assert seen.shape == (175, MAX_SIDE_PX, 3)
