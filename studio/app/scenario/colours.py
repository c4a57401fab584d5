"""Colours of the scenario editor, from the theme that the window has."""

from __future__ import annotations

from PySide6.QtGui import QColor, QPalette
from PySide6.QtWidgets import QWidget

from studio.app.shell.theme import THEMES, Theme

PEOPLE = ("#e8894a", "#4aa8e8", "#b07be0", "#4fc38a", "#e0679a", "#c9b13c")
"""Of people, in the order of the scenario; their names stand beside them."""


def theme_of(widget: QWidget) -> Theme:
    """The theme whose window colour the widget has: the one nearest in lightness."""
    is_dark = widget.palette().color(QPalette.ColorRole.Window).lightness() < 128
    return THEMES["dark" if is_dark else "light"]


def person_colour(index: int) -> QColor:
    """The colour of one of the people."""
    return QColor(PEOPLE[index % len(PEOPLE)])


def on(colour: QColor) -> QColor:
    """Text on a colour: whichever of black and white is read better."""
    luminance = 0.2126 * colour.redF() + 0.7152 * colour.greenF() + 0.0722 * colour.blueF()
    return QColor("#0d1014") if luminance > 0.42 else QColor("#ffffff")
