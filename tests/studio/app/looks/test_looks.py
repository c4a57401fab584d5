"""Every dock looks as it did when somebody last looked at it.

`NEXUS_GOLDEN=write` writes the pictures anew: look at each before they are kept.
"""

import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from studio.console.display import why_no_window
from tests.studio.app.looks.picture_difference import difference
from tests.studio.app.looks.shots import BUSY, EMPTY, Shot, open_stage, settle

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.golden,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]
GOLDEN = Path(__file__).parent / "golden"
SIZE_PX = (1280, 800)
SHRUNK = 2
"""Golden pictures are so many times smaller."""
NAMES = [shot.name for shot in (*EMPTY, *BUSY)]


def pixels_of(image):
    """(H, W, 3) RGB of Qt's picture, as small as the golden ones."""
    from PySide6.QtGui import QImage

    rgb = image.convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(rgb.constBits(), np.uint8).reshape(rgb.height(), rgb.bytesPerLine())
    picture = rows[:, : 3 * rgb.width()].reshape(rgb.height(), rgb.width(), 3)
    small = rgb.width() // SHRUNK, rgb.height() // SHRUNK
    return cv2.resize(picture, small, interpolation=cv2.INTER_AREA)


def golden(theme, name):
    return GOLDEN / f"{theme}-{name}.jpg"


@pytest.fixture(scope="module", params=["dark", pytest.param("light", marks=pytest.mark.slow)])
def taken(request, qapp, looks_recording, tmp_path_factory):
    """All pictures of a theme by name, and the stage they were taken on."""
    stage = open_stage(
        tmp_path_factory.mktemp("home"),
        theme=request.param,
        size_px=SIZE_PX,
        recording=looks_recording,
    )
    stage.hide_room()
    stage.window.bench.perform("layout.save", name="as it was")
    found = {shot.name: pixels_of(image) for shot, image in stage.take((*EMPTY, *BUSY))}
    if os.environ.get("NEXUS_GOLDEN") == "write":
        GOLDEN.mkdir(exist_ok=True)
        for name, picture in found.items():
            bgr = cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)
            cv2.imwrite(str(golden(request.param, name)), bgr, [cv2.IMWRITE_JPEG_QUALITY, 88])
    yield request.param, stage, found
    stage.close()


def kept(theme, name):
    found = cv2.imread(str(golden(theme, name)))
    assert found is not None, f"{golden(theme, name)} is missing: NEXUS_GOLDEN=write writes it"
    return cv2.cvtColor(found, cv2.COLOR_BGR2RGB)


@pytest.mark.parametrize("name", NAMES)
def test_it_looks_as_it_did(taken, name, tmp_path):
    theme, _, found = taken
    seen = difference(kept(theme, name), found[name])
    if not seen.is_small:
        cv2.imwrite(str(tmp_path / "seen.png"), found[name][..., ::-1])
    assert seen.is_small, f"{theme} {name}: {seen}, see {tmp_path / 'seen.png'}"


def again(stage, shot):
    """The picture of a shot once more, in the layout in which it was first taken."""
    stage.window.bench.perform("layout.load", name="as it was")
    return pixels_of(next(iter(stage.take((shot,))))[1])


def test_a_broken_style_sheet_is_seen(taken, qapp):
    theme, stage, _ = taken
    sheet = qapp.styleSheet()
    shot = Shot("keys", "dock.keys", "keys")
    qapp.setStyleSheet(sheet.replace("QTreeView", "QTreeVeiw").replace("QLineEdit", "QLineEdti"))
    unframed = difference(kept(theme, "keys"), again(stage, shot))
    qapp.setStyleSheet("")
    unstyled = difference(kept(theme, "keys"), again(stage, shot))
    qapp.setStyleSheet(sheet)
    assert difference(kept(theme, "keys"), again(stage, shot)).is_small
    assert not unstyled.is_small
    assert not unframed.is_small


def test_an_empty_and_a_clipped_dock_are_seen(taken):
    theme, stage, _ = taken
    shot = Shot("keys", "dock.keys", "keys")
    content = stage.window.content("keys")
    content.list.hide()
    empty = difference(kept(theme, "keys"), again(stage, shot))
    content.list.show()
    content.setMinimumHeight(900)
    clipped = difference(kept(theme, "keys"), again(stage, shot))
    content.setMinimumHeight(0)
    settle()
    assert not empty.is_small
    assert not clipped.is_small
