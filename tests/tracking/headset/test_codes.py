"""Codes in a picture: read once, then found where they are expected."""

import cv2
import numpy as np

from scenes.prepare.align.codes.symbols import qr_symbol
from tracking.headset import codes
from tracking.headset.codes import READ_EVERY, CodeReader

SYMBOL = qr_symbol("room:1")
CORNERS = np.array([[300.0, 120.0], [372.0, 124.0], [368.0, 198.0], [296.0, 192.0]])


def picture(corners=CORNERS):
    """A code on a grey wall, drawn four times as large and averaged."""
    fine = 4
    printed = SYMBOL.picture(module_px=16)
    quiet, side = 16 * SYMBOL.quiet_modules, 16 * SYMBOL.modules
    square = np.float32([[0, 0], [side, 0], [side, side], [0, side]]) + quiet
    turn = cv2.getPerspectiveTransform(square - 0.5, np.float32(corners) * fine - 0.5)
    ground = np.full((428 * fine, 760 * fine), 120, np.uint8)
    drawn = cv2.warpPerspective(
        printed, turn, ground.shape[::-1], ground, cv2.INTER_AREA, borderMode=cv2.BORDER_TRANSPARENT
    )
    small = cv2.resize(drawn, (760, 428), interpolation=cv2.INTER_AREA)
    return cv2.GaussianBlur(small, (0, 0), 0.6)


def test_a_wanted_code_is_read_and_measured():
    found = CodeReader(frozenset({"room:1"})).find(picture(), {})
    assert [seen.payload for seen in found] == ["room:1"]
    assert np.abs(found[0].corners_px - CORNERS).max() < 0.1


def test_a_code_of_elsewhere_is_left_alone():
    assert CodeReader(frozenset({"room:2"})).find(picture(), {}) == []


def test_only_the_kind_of_code_that_is_wanted_is_looked_for(monkeypatch):
    """To look for tags where there are none took most of a thread."""
    looked = []
    for name in ("qr_codes", "april_tags"):
        monkeypatch.setattr(codes, name, lambda grey, name=name: looked.append(name) or [])
    CodeReader(frozenset({"room:1"})).find(picture(), {})
    assert looked == ["qr_codes"]
    CodeReader(frozenset({"apriltag:36h11:3"})).find(picture(), {})
    assert looked == ["qr_codes", "april_tags"]
    CodeReader(frozenset({"room:1", "apriltag:36h11:3"})).find(picture(), {})
    assert looked == ["qr_codes", "april_tags", "qr_codes", "april_tags"]


def test_a_code_that_is_hidden_makes_nobody_read_while_another_is_found(monkeypatch):
    reader = CodeReader(frozenset({"room:1", "room:2"}))
    reader.find(picture(), {})
    read = []
    monkeypatch.setattr(codes, "qr_codes", lambda grey: read.append(1) or [])
    for _ in range(READ_EVERY - 1):
        assert len(reader.find(picture(), {"room:1": CORNERS, "room:2": CORNERS - 200.0})) == 1
    assert not read
    reader.find(picture(), {"room:1": CORNERS, "room:2": CORNERS - 200.0})
    assert read


def test_a_known_code_is_found_where_it_is_expected_without_reading():
    reader = CodeReader(frozenset({"room:1"}))
    reader.find(picture(), {})
    found = reader.find(picture(CORNERS + 5.3), {"room:1": CORNERS + 4.8})
    assert len(found) == 1
    assert np.abs(found[0].corners_px - CORNERS - 5.3).max() < 0.1
    assert reader.find(np.full((428, 760), 120, np.uint8), {"room:1": CORNERS}) == []
