"""The window's words look the same on a machine without a font and on one with many."""

import os
import subprocess
import sys

import numpy as np
import pytest

GENERIC = {"Sans", "Sans Serif", "Serif", "Monospace"}
"""Names that fontconfig has without any font."""
WORDS = "Rehearsal → 12.5 cm ● tracked ▲ hidden ✖ lost σ Ωmega ◌ ✓ µ²"
BARE = """<?xml version="1.0"?><!DOCTYPE fontconfig SYSTEM "fonts.dtd">
<fontconfig><dir>{}</dir><cachedir>{}</cachedir></fontconfig>"""
DRAW = f"""
import sys
from PySide6.QtGui import QFont, QFontDatabase
from PySide6.QtWidgets import QApplication, QLabel, QVBoxLayout, QWidget
from studio.app.shell.theme import apply_theme, fixed_font

application = QApplication([])
installed = QFontDatabase.families()
apply_theme(application, "dark", 1.0)
both = QWidget()
column = QVBoxLayout(both)
for font in (QFont(), fixed_font()):
    label = QLabel({WORDS!r})
    label.setFont(font)
    column.addWidget(label)
both.adjustSize()
both.grab().save(sys.argv[1])
print(*installed, sep="\\n")
"""


def drawn(out, fonts):
    """The words drawn by a process of its own, and the families that its machine has."""
    environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen", **fonts}
    done = subprocess.run(
        [sys.executable, "-c", DRAW, str(out)],
        env=environment,
        check=True,
        capture_output=True,
        text=True,
    )
    from PIL import Image

    families = set(done.stdout.splitlines()) - GENERIC
    return np.asarray(Image.open(out).convert("RGB")).astype(int), families


@pytest.mark.gui
def test_words_and_signs_do_not_depend_on_the_machine_s_fonts(tmp_path):
    bare = tmp_path / "fonts.conf"
    (tmp_path / "none").mkdir()
    bare.write_text(BARE.format(tmp_path / "none", tmp_path / "cache"))
    here, _ = drawn(tmp_path / "here.png", {})
    without, none = drawn(tmp_path / "without.png", {"FONTCONFIG_FILE": str(bare)})
    assert not none
    assert here.shape == without.shape
    # Machines also say how letters are fitted to pixels; that moves edges, not words.
    assert np.abs(here - without).mean() < 2.0
    assert here.std() > 10.0
