"""The studio's colours and shapes, dark and light. Text meets WCAG AA."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from PySide6.QtGui import QColor, QFont, QPalette
from PySide6.QtWidgets import QApplication


@dataclass(frozen=True, slots=True)
class Theme:
    """Colours of one theme, as #rrggbb.

    Attributes:
        ground: of the window.
        panel: of docks.
        field: of lists and inputs.
        raised: of buttons.
        line: between them.
        text: what is read.
        faint: what is read second.
        accent: what is selected or goes on.
        on_accent: text on the accent.
        good: passed, tracked.
        warning: watch out, hidden.
        bad: failed, lost.
        calm: at rest.
    """

    ground: str
    panel: str
    field: str
    raised: str
    line: str
    text: str
    faint: str
    accent: str
    on_accent: str
    good: str
    warning: str
    bad: str
    calm: str


DARK = Theme(
    ground="#14171c",
    panel="#1b1f26",
    field="#12151a",
    raised="#2a303a",
    line="#363d49",
    text="#e6e9ee",
    faint="#a3acb9",
    accent="#4aa8e8",
    on_accent="#08121a",
    good="#4fc38a",
    warning="#e5b24a",
    bad="#f0766e",
    calm="#8fa3ba",
)
LIGHT = Theme(
    ground="#e9ecf0",
    panel="#f6f7f9",
    field="#ffffff",
    raised="#e2e6eb",
    line="#c3c9d2",
    text="#1b2028",
    faint="#525c6a",
    accent="#0b6bb0",
    on_accent="#ffffff",
    good="#157347",
    warning="#8a5a00",
    bad="#b3261e",
    calm="#4b6078",
)
THEMES: Mapping[str, Theme] = {"dark": DARK, "light": LIGHT}
"""By name, as in the settings."""

SHAPES: Mapping[str, str] = {"good": "●", "warning": "▲", "bad": "✖", "calm": "○", "unknown": "◌"}
"""A state's shape, beside its colour: whoever sees no colours reads shapes."""

POINT_SIZE = 10.0
"""Of the interface's text at scale 1, points."""


def apply_theme(application: QApplication, name: str, text_scale: float) -> None:
    """Colour the whole application, and size its text."""
    theme = THEMES[name]
    application.setStyle("Fusion")
    font = QFont(application.font())
    font.setPointSizeF(POINT_SIZE * text_scale)
    application.setFont(font)
    application.setPalette(palette(theme))
    application.setStyleSheet(style_sheet(theme))


def palette(theme: Theme) -> QPalette:
    """The theme as Qt's palette."""
    role = QPalette.ColorRole
    colours = {
        role.Window: theme.panel,
        role.WindowText: theme.text,
        role.Base: theme.field,
        role.AlternateBase: theme.panel,
        role.ToolTipBase: theme.raised,
        role.ToolTipText: theme.text,
        role.Text: theme.text,
        role.PlaceholderText: theme.faint,
        role.Button: theme.raised,
        role.ButtonText: theme.text,
        role.BrightText: theme.bad,
        role.Link: theme.accent,
        role.Highlight: theme.accent,
        role.HighlightedText: theme.on_accent,
        role.Mid: theme.line,
        role.Midlight: theme.line,
        role.Dark: theme.ground,
        role.Light: theme.raised,
        role.Shadow: theme.ground,
        role.Accent: theme.accent,
    }
    made = QPalette()
    for key, colour in colours.items():
        made.setColor(key, QColor(colour))
    for key in (role.WindowText, role.Text, role.ButtonText):
        made.setColor(QPalette.ColorGroup.Disabled, key, QColor(theme.faint).darker(125))
    return made


def style_sheet(theme: Theme) -> str:
    """What the palette cannot say: docks, tabs, menus, focus."""
    return f"""
    QMainWindow, QMenuBar, QToolBar, QStatusBar {{ background: {theme.ground}; }}
    QToolBar {{ border: none; padding: 4px 8px; spacing: 4px; }}
    QToolBar QToolButton {{ padding: 4px 8px; border-radius: 4px; }}
    QToolBar QToolButton:hover {{ background: {theme.raised}; }}
    QToolBar QToolButton:checked {{ background: {theme.raised}; color: {theme.accent}; }}
    QMenuBar::item {{ padding: 4px 9px; background: transparent; }}
    QMenuBar::item:selected, QMenu::item:selected {{
        background: {theme.accent}; color: {theme.on_accent}; }}
    QMenu {{ background: {theme.panel}; border: 1px solid {theme.line}; padding: 4px; }}
    QMenu::item {{ padding: 4px 24px 4px 20px; }}
    QMenu::separator {{ height: 1px; background: {theme.line}; margin: 4px 8px; }}
    QMenu::item:disabled {{ color: {theme.faint}; }}
    QPushButton {{ padding: 4px 12px; border: 1px solid {theme.line}; border-radius: 4px;
        background: {theme.raised}; }}
    QPushButton:hover {{ border-color: {theme.accent}; }}
    QPushButton:default {{ background: {theme.accent}; color: {theme.on_accent}; }}
    QPushButton:disabled {{ color: {theme.faint}; background: {theme.panel}; }}
    *:focus {{ outline: none; }}
    QPushButton:focus, QLineEdit:focus, QSpinBox:focus, QDoubleSpinBox:focus, QComboBox:focus,
    QTreeView:focus, QTableView:focus, QListView:focus, QPlainTextEdit:focus, QToolButton:focus {{
        border: 1px solid {theme.accent}; }}
    QLineEdit, QPlainTextEdit {{ border: 1px solid {theme.line}; border-radius: 3px;
        padding: 3px 6px; background: {theme.field}; }}
    QHeaderView::section {{ background: {theme.panel}; color: {theme.faint}; border: none;
        border-bottom: 1px solid {theme.line}; padding: 3px 6px; }}
    QTabWidget::pane {{ border: none; border-top: 1px solid {theme.line}; }}
    QTabBar::tab {{ padding: 5px 12px; color: {theme.faint}; background: transparent;
        border-bottom: 2px solid transparent; }}
    QTabBar::tab:selected {{ color: {theme.text}; border-bottom: 2px solid {theme.accent}; }}
    QScrollBar:vertical {{ width: 10px; background: transparent; }}
    QScrollBar:horizontal {{ height: 10px; background: transparent; }}
    QScrollBar::handle {{ background: {theme.line}; border-radius: 4px; min-height: 24px;
        min-width: 24px; }}
    QScrollBar::add-line, QScrollBar::sub-line {{ width: 0; height: 0; }}
    QToolTip {{ background: {theme.raised}; color: {theme.text}; border: 1px solid {theme.line};
        padding: 4px; }}
    QSplitter::handle {{ background: {theme.ground}; }}
    ads--CDockContainerWidget, ads--CDockSplitter::handle {{ background: {theme.ground}; }}
    ads--CDockAreaWidget {{ background: {theme.panel}; border: none; }}
    ads--CDockAreaTitleBar {{ background: {theme.ground}; border: none; padding: 0; }}
    ads--CDockWidget {{ background: {theme.panel}; border: none; }}
    ads--CDockWidgetTab {{ background: {theme.ground}; border: none; padding: 3px 6px; }}
    ads--CDockWidgetTab[activeTab="true"] {{ background: {theme.panel};
        border-top: 2px solid {theme.accent}; }}
    #dockWidgetTabLabel, ads--CDockWidgetTab ads--CElidingLabel {{ color: {theme.faint}; }}
    ads--CDockWidgetTab[activeTab="true"] #dockWidgetTabLabel,
    ads--CDockWidgetTab[activeTab="true"] ads--CElidingLabel {{ color: {theme.text}; }}
    ads--CTitleBarButton, #tabCloseButton, #dockAreaCloseButton {{ background: transparent;
        border: none; padding: 2px; }}
    #floatingTitleLabel {{ color: {theme.text}; }}
    """
