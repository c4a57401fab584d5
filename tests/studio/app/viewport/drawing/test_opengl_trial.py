"""Whether OpenGL can be tried is found out without ending this process."""

import sys

import pytest

from studio.app.viewport.drawing import scene_drawing

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="Linux only")


@pytest.mark.parametrize(
    ("trial", "can"),
    [("pass", True), ("import os; os.abort()", False), ("raise SystemExit(2)", False)],
)
def test_without_egl_a_process_of_its_own_decides(monkeypatch, trial, can):
    monkeypatch.setattr(scene_drawing, "_has_egl", lambda: False)
    monkeypatch.setattr(scene_drawing, "TRIAL", trial)
    assert scene_drawing.can_try_opengl() == can


def test_with_egl_no_process_is_started(monkeypatch):
    monkeypatch.setattr(scene_drawing, "_has_egl", lambda: True)
    monkeypatch.setattr(scene_drawing, "TRIAL", "raise SystemExit(2)")
    assert scene_drawing.can_try_opengl()
