"""Words and frames contrast with their background: WCAG 2.2, level AA."""

import re
from pathlib import Path

import pytest

from studio.app.devices.latency_bar import FILLS
from studio.app.scenario.colours import PEOPLE, on
from studio.app.shell.theme import MARKS, THEMES, style_sheet

TEXT, PARTS = 4.5, 3.0
"""Least ratios of words, and of frames and marks that a control is found by."""
GROUNDS = ("ground", "panel", "field", "raised")


def luminance(colour):
    parts = [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    red, green, blue = (v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(one, other):
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def test_the_formula_is_the_one_of_wcag():
    assert contrast("#000000", "#ffffff") == pytest.approx(21.0)
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.005)


@pytest.mark.parametrize("name", THEMES)
@pytest.mark.parametrize("ground", GROUNDS)
@pytest.mark.parametrize("words", ["text", "faint", "good", "warning", "bad", "calm", "accent"])
def test_words_are_read_on_every_ground(name, ground, words):
    theme = THEMES[name]
    assert contrast(getattr(theme, words), getattr(theme, ground)) >= TEXT


@pytest.mark.parametrize("name", THEMES)
@pytest.mark.parametrize("ground", ["ground", "panel", "field"])
def test_words_of_what_is_disabled_are_read_where_they_stand(name, ground):
    theme = THEMES[name]
    assert contrast(theme.disabled, getattr(theme, ground)) >= TEXT
    assert contrast(theme.disabled, theme.text) > 1.5  # and are not taken for enabled ones


@pytest.mark.parametrize("name", THEMES)
@pytest.mark.parametrize("ground", GROUNDS)
def test_frames_of_inputs_and_boxes_are_seen(name, ground):
    theme = THEMES[name]
    assert contrast(theme.frame, getattr(theme, ground)) >= PARTS
    assert contrast(theme.accent, getattr(theme, ground)) >= PARTS


@pytest.mark.parametrize("name", THEMES)
def test_words_on_the_accent_are_read(name):
    assert contrast(THEMES[name].on_accent, THEMES[name].accent) >= TEXT


@pytest.mark.parametrize("name", THEMES)
@pytest.mark.parametrize("control", ["QCheckBox::indicator", "QComboBox", "QAbstractSpinBox"])
def test_the_sheet_frames_controls_with_the_frame_that_is_seen(name, control):
    sheet = style_sheet(THEMES[name], name)
    rules = re.findall(r"([^{}]+)\{([^{}]*)\}", sheet)
    own = [body for heads, body in rules if control in [h.strip() for h in heads.split(",")]]
    assert any(f"1px solid {THEMES[name].frame}" in body for body in own)


@pytest.mark.parametrize("name", THEMES)
def test_every_mark_that_the_sheet_names_is_there_in_a_colour_that_is_seen(name):
    theme = THEMES[name]
    files = set(re.findall(r"url\(([^)]*)\)", style_sheet(theme, name)))
    assert len(files) == len(list(MARKS.glob(f"*-{name}.svg"))) >= 5
    for file in files:
        colour = re.search(r'stroke="(#[0-9a-f]{6})"', Path(file).read_text())
        ground = theme.accent if "tick" in file else theme.field
        assert contrast(colour.group(1), ground) >= PARTS


@pytest.mark.parametrize("fill", FILLS)
def test_numbers_on_the_bars_of_stages_are_read(fill):
    assert contrast("#ffffff", fill) >= TEXT


def test_words_on_the_colours_of_people_are_read():
    from PySide6.QtGui import QColor

    for colour in PEOPLE:
        assert contrast(on(QColor(colour)).name(), colour) >= TEXT
