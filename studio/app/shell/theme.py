"""The studio's colours and shapes, dark and light. Text and frames meet WCAG AA."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from PySide6.QtGui import QColor, QFont, QFontDatabase, QPalette
from PySide6.QtWidgets import QApplication

from studio.view.fonts import FIXED, SYMBOLS, TEXT, font_files


@dataclass(frozen=True, slots=True)
class Theme:
    """Colours of one theme, as #rrggbb.

    Attributes:
        ground: of the window.
        panel: of docks.
        field: of lists and inputs.
        raised: of buttons.
        line: between them; it only parts, and nothing is lost without it.
        frame: of inputs and boxes to tick, which are found by it.
        text: what is read.
        faint: what is read second.
        disabled: words of what cannot be used now; not on `raised`.
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
    frame: str
    text: str
    faint: str
    disabled: str
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
    frame="#727d8e",
    text="#e6e9ee",
    faint="#a3acb9",
    disabled="#868f9d",
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
    frame="#777f8b",
    text="#1b2028",
    faint="#525c6a",
    disabled="#626b77",
    accent="#0a68ab",
    on_accent="#ffffff",
    good="#157347",
    warning="#8a5a00",
    bad="#b3261e",
    calm="#4b6078",
)
THEMES: Mapping[str, Theme] = {"dark": DARK, "light": LIGHT}
"""By name, as in the settings."""

MARKS = Path(__file__).parent / "marks"
"""Folder of ticks and arrows, one file a theme: a style sheet takes pictures from files only."""

FIGURE_SPACE = "\u2007"
"""A space as wide as a digit: numbers that are filled up with it keep their place."""

SHAPES: Mapping[str, str] = {"good": "●", "warning": "▲", "bad": "✖", "calm": "○", "unknown": "◌"}
"""A state's shape, beside its colour: whoever sees no colours reads shapes."""

POINT_SIZE = 10.0
"""Of the interface's text at scale 1, points."""


def apply_theme(application: QApplication, name: str, text_scale: float) -> None:
    """Colour the whole application, and size its text, which is in the program's own faces."""
    theme = THEMES[name]
    application.setStyle("Fusion")
    _register_fonts(application)
    font = QFont([TEXT, SYMBOLS])
    # Words are as wide on every machine, whatever it does to fit letters to pixels.
    font.setHintingPreference(QFont.HintingPreference.PreferVerticalHinting)
    font.setPointSizeF(POINT_SIZE * text_scale)
    # Digits of one width: numbers that change do not jump.
    font.setFeature(QFont.Tag("tnum"), 1)
    application.setFont(font)
    application.setPalette(palette(theme))
    application.setStyleSheet(style_sheet(theme, name, text_scale))


def fixed_font() -> QFont:
    """The face whose letters are all of one width; its size follows the interface's text."""
    font = QFont([FIXED, SYMBOLS])
    font.setHintingPreference(QFont.HintingPreference.PreferVerticalHinting)
    return font


def _register_fonts(application: QApplication) -> None:
    if application.property("nexus fonts"):
        return
    for path in font_files():
        if QFontDatabase.addApplicationFont(str(path)) < 0:
            raise OSError(f"{path}: no font can be read from it; install the program anew")
    application.setProperty("nexus fonts", True)


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
    for key in (role.WindowText, role.Text, role.ButtonText, role.PlaceholderText):
        made.setColor(QPalette.ColorGroup.Disabled, key, QColor(theme.disabled))
    return made


def figures(value: float, form: str) -> str:
    """A number as wide as its format says, filled up by spaces as wide as digits.

    Args:
        value: the number.
        form: its format with a width, such as `6.1f`.
    """
    return format(value, form).replace(" ", FIGURE_SPACE)


def style_sheet(theme: Theme, name: str, text_scale: float = 1.0) -> str:
    """Return the style sheet, for what a palette lacks: docks, tabs, menus, inputs, focus.

    Args:
        theme: its colours.
        name: of the theme, for the marks.
        text_scale: icons are as much larger as the text.
    """
    named = [part(theme, name) for part in (_buttons, _inputs, _docks)]
    named.append(_focus(theme))
    return "\n".join((_bars(theme), _lists(theme), *named, _icons(text_scale)))


def _focus(theme: Theme) -> str:
    """A ring of two pixels; the padding is a pixel less, so that nothing moves."""
    padded = {
        "QPushButton": "3px 11px",
        "QToolButton": "3px 5px",
        "QToolBar QToolButton": "3px 7px",
        "QToolBar:vertical QToolButton": "4px",
        "QLineEdit": "2px 5px",
        "QPlainTextEdit": "2px 5px",
        "QTextBrowser": "0",
        "QAbstractSpinBox": "1px 17px 1px 4px",
        "QComboBox": "2px 19px 2px 6px",
        "QTreeView": "0",
        "QListView": "0",
        "QTableView": "0",
    }
    rings = [
        f"{part}:focus {{ border: 2px solid {theme.accent}; padding: {padding}; }}"
        for part, padding in padded.items()
    ]
    return "\n".join(
        [
            "QTreeView, QListView, QTableView, QTextBrowser { padding: 1px; }",
            *rings,
            "QAbstractSpinBox QLineEdit:focus { border: none; padding: 0; }",
            f"QCheckBox:focus::indicator {{ border: 2px solid {theme.accent}; margin: -1px; }}",
            f"QPushButton:default:focus {{ border-color: {theme.text}; }}",
        ]
    )


def _icons(text_scale: float) -> str:
    def side(px: int) -> str:
        return f"qproperty-iconSize: {round(px * text_scale)}px {round(px * text_scale)}px;"

    return f"""
    QToolButton {{ {side(18)} }}
    QPushButton, QTreeView, QListView, QTabBar, ads--CDockWidgetTab {{ {side(16)} }}
    QToolBar, QToolBar QToolButton {{ {side(24)} }}
    ads--CTitleBarButton, #tabCloseButton, #dockAreaCloseButton, #floatingTitleCloseButton,
    #floatingTitleMaximizeButton, #floatingTitleDockButton {{ {side(12)} }}
    """


def _mark(what: str, name: str) -> str:
    return f"url({(MARKS / f'{what}-{name}.svg').as_posix()})"


def _bars(theme: Theme) -> str:
    return f"""
    QMainWindow, QMenuBar, QToolBar, QStatusBar {{ background: {theme.ground}; }}
    QStatusBar {{ padding: 0 8px; }}
    QStatusBar::item {{ border: none; }}
    QStatusBar QLabel {{ padding: 0 6px; }}
    QToolBar {{ border: none; padding: 3px 8px; spacing: 2px; }}
    QToolBar:vertical {{ padding: 6px 3px; }}
    QToolBar:vertical QToolButton {{ padding: 5px; }}
    QToolBar:vertical::separator {{ height: 1px; }}
    QToolBar::separator {{ background: {theme.line}; width: 1px; margin: 6px 6px; }}
    QToolBar QToolButton {{ padding: 4px 8px; border: 1px solid transparent; border-radius: 4px; }}
    QToolBar QToolButton:hover {{ background: {theme.raised}; }}
    QToolBar QToolButton:checked {{ background: {theme.raised}; color: {theme.accent}; }}
    QToolBar QToolButton:disabled {{ color: {theme.disabled}; }}
    QMenuBar::item {{ padding: 4px 9px; background: transparent; }}
    QMenuBar::item:selected, QMenu::item:selected {{
        background: {theme.accent}; color: {theme.on_accent}; }}
    QMenu {{ background: {theme.panel}; border: 1px solid {theme.frame}; padding: 4px; }}
    QMenu::item {{ padding: 4px 24px 4px 20px; }}
    QMenu::item:disabled {{ color: {theme.disabled}; background: transparent; }}
    QMenu::separator {{ height: 1px; background: {theme.line}; margin: 4px 8px; }}
    QTabWidget::pane {{ border: none; border-top: 1px solid {theme.line}; }}
    QTabBar::tab {{ padding: 5px 12px; color: {theme.faint}; background: transparent;
        border-bottom: 2px solid transparent; }}
    QTabBar::tab:hover {{ color: {theme.text}; }}
    QTabBar::tab:selected {{ color: {theme.text}; border-bottom: 2px solid {theme.accent}; }}
    QTabBar::tab:focus {{ border-bottom: 2px solid {theme.text}; }}
    QToolTip {{ background: {theme.raised}; color: {theme.text}; border: 1px solid {theme.frame};
        padding: 4px; }}
    #floating {{ background: {theme.panel}; border: 1px solid {theme.frame}; border-radius: 8px; }}
    #clear, #clear > QWidget > QWidget {{ background: transparent; }}
    #faint {{ color: {theme.faint}; }}
    """


def _buttons(theme: Theme, name: str) -> str:
    return f"""
    *:focus {{ outline: none; }}
    QPushButton {{ padding: 4px 12px; border: 1px solid {theme.line}; border-radius: 4px;
        background: {theme.raised}; color: {theme.text}; }}
    QPushButton:hover {{ border-color: {theme.accent}; }}
    QPushButton:pressed {{ background: {theme.line}; }}
    QPushButton:default {{ background: {theme.accent}; color: {theme.on_accent}; }}
    QPushButton:disabled {{ color: {theme.disabled}; background: {theme.panel}; }}
    QToolButton {{ padding: 4px 6px; border: 1px solid transparent; border-radius: 4px;
        background: transparent; color: {theme.text}; }}
    QToolButton:hover, QToolButton:checked {{ background: {theme.raised}; }}
    QToolButton:disabled {{ color: {theme.disabled}; background: transparent; }}
    QToolButton[popupMode="2"] {{ padding-right: 18px; }}
    QToolButton::menu-indicator {{ image: {_mark("down", name)}; width: 8px; height: 8px;
        subcontrol-position: center right; right: 6px; }}
    QScrollBar:vertical {{ width: 10px; background: transparent; }}
    QScrollBar:horizontal {{ height: 10px; background: transparent; }}
    QScrollBar::handle {{ background: {theme.line}; border-radius: 4px; min-height: 24px;
        min-width: 24px; }}
    QScrollBar::handle:hover {{ background: {theme.frame}; }}
    QScrollBar::add-line, QScrollBar::sub-line {{ width: 0; height: 0; }}
    QScrollBar::add-page, QScrollBar::sub-page {{ background: transparent; }}
    QSlider::groove:horizontal {{ height: 4px; border-radius: 2px; background: {theme.frame}; }}
    QSlider::sub-page:horizontal {{ border-radius: 2px; background: {theme.accent}; }}
    QSlider::handle:horizontal {{ width: 12px; height: 12px; margin: -5px 0; border-radius: 7px;
        border: 1px solid {theme.panel}; background: {theme.text}; }}
    QSlider::handle:horizontal:focus {{ background: {theme.accent}; }}
    QSlider::handle:horizontal:disabled {{ background: {theme.disabled}; }}
    QProgressBar {{ border: 1px solid {theme.frame}; border-radius: 3px; background: {theme.field};
        text-align: center; }}
    QProgressBar::chunk {{ background: {theme.line}; }}
    """


def _inputs(theme: Theme, name: str) -> str:
    fields = "QLineEdit, QPlainTextEdit, QTextBrowser, QAbstractSpinBox, QComboBox"
    off = ", ".join(f"{part.strip()}:disabled" for part in fields.split(","))
    return f"""
    {fields} {{ border: 1px solid {theme.frame}; border-radius: 3px; background: {theme.field};
        color: {theme.text}; selection-background-color: {theme.accent};
        selection-color: {theme.on_accent}; }}
    {off} {{ border-color: {theme.line}; color: {theme.disabled}; background: {theme.panel}; }}
    QLineEdit, QPlainTextEdit {{ padding: 3px 6px; }}
    QAbstractSpinBox {{ padding: 2px 18px 2px 5px; }}
    QAbstractSpinBox QLineEdit, QKeySequenceEdit QLineEdit {{ border: none; padding: 0;
        background: transparent; }}
    QKeySequenceEdit QLineEdit {{ border: 1px solid {theme.frame}; padding: 3px 6px; }}
    QAbstractSpinBox::up-button, QAbstractSpinBox::down-button {{ subcontrol-origin: border;
        width: 16px; border: none; background: transparent; }}
    QAbstractSpinBox::up-button {{ subcontrol-position: top right; }}
    QAbstractSpinBox::down-button {{ subcontrol-position: bottom right; }}
    QAbstractSpinBox::up-button:hover, QAbstractSpinBox::down-button:hover {{
        background: {theme.raised}; }}
    QAbstractSpinBox::up-arrow {{ image: {_mark("up", name)}; width: 8px; height: 8px; }}
    QAbstractSpinBox::down-arrow {{ image: {_mark("down", name)}; width: 8px; height: 8px; }}
    QAbstractSpinBox::up-arrow:disabled, QAbstractSpinBox::down-arrow:disabled {{ image: none; }}
    QComboBox {{ padding: 3px 20px 3px 7px; }}
    QComboBox::drop-down {{ subcontrol-origin: padding; subcontrol-position: center right;
        width: 20px; border: none; }}
    QComboBox::down-arrow {{ image: {_mark("down", name)}; width: 9px; height: 9px; }}
    QComboBox::down-arrow:disabled {{ image: none; }}
    QComboBox QAbstractItemView {{ border: 1px solid {theme.frame}; background: {theme.panel}; }}
    QCheckBox {{ spacing: 7px; }}
    QCheckBox::indicator, QTreeView::indicator {{ width: 14px; height: 14px;
        border: 1px solid {theme.frame}; border-radius: 3px; background: {theme.field}; }}
    QCheckBox::indicator:hover, QCheckBox:focus::indicator {{ border-color: {theme.accent}; }}
    QCheckBox::indicator:checked, QTreeView::indicator:checked {{
        background: {theme.accent}; border-color: {theme.accent};
        image: {_mark("tick", name)}; }}
    QCheckBox::indicator:disabled {{ border-color: {theme.line}; background: {theme.panel}; }}
    QCheckBox:disabled {{ color: {theme.disabled}; }}
    """


def _lists(theme: Theme) -> str:
    return f"""
    QTreeView, QListView, QTableView {{ border: 1px solid {theme.line}; background: {theme.field};
        alternate-background-color: {theme.panel}; }}
    QTreeView::item, QListView::item {{ padding: 2px 4px; }}
    QTreeView::item:hover, QListView::item:hover {{ background: {theme.raised}; }}
    QTreeView::item:selected, QListView::item:selected, QTableView::item:selected {{
        background: {theme.accent}; color: {theme.on_accent}; }}
    QListView::item:disabled {{ color: {theme.disabled}; background: transparent; }}
    QHeaderView {{ background: {theme.panel}; }}
    QHeaderView::section {{ background: {theme.panel}; color: {theme.faint}; border: none;
        border-bottom: 1px solid {theme.line}; padding: 3px 6px; }}
    QTableView {{ gridline-color: {theme.line}; }}
    """


def _docks(theme: Theme, name: str) -> str:
    return f"""
    QSplitter::handle {{ background: {theme.ground}; }}
    ads--CDockContainerWidget, ads--CDockSplitter::handle {{ background: {theme.ground}; }}
    ads--CDockAreaWidget {{ background: {theme.panel}; border: none; }}
    ads--CDockAreaTitleBar {{ background: {theme.ground}; border: none; padding: 0; }}
    ads--CDockWidget {{ background: {theme.panel}; border: none; }}
    #dockWidgetScrollArea {{ padding: 0; border: none; }}
    ads--CDockWidgetTab {{ background: {theme.ground}; border: none; padding: 3px 6px;
        border-top: 2px solid {theme.ground}; }}
    ads--CDockWidgetTab[activeTab="true"] {{ background: {theme.panel};
        border-top: 2px solid {theme.accent}; }}
    ads--CDockWidgetTab #dockWidgetTabLabel {{ color: {theme.faint}; }}
    ads--CDockWidgetTab[activeTab="true"] #dockWidgetTabLabel {{ color: {theme.text}; }}
    ads--CTitleBarButton, #tabCloseButton, #dockAreaCloseButton {{ background: transparent;
        border: none; border-radius: 3px; padding: 3px; }}
    ads--CTitleBarButton:hover, #tabCloseButton:hover {{ background: {theme.raised}; }}
    #tabCloseButton, #dockAreaCloseButton {{ qproperty-icon: {_mark("close", name)}; }}
    #detachGroupButton {{ qproperty-icon: {_mark("float", name)}; }}
    #floatingTitleLabel {{ color: {theme.text}; }}
    ads--CFloatingWidgetTitleBar {{ background: {theme.ground}; }}
    #floatingTitleCloseButton {{ qproperty-icon: {_mark("close", name)}; border: none; }}
    #floatingTitleMaximizeButton {{ qproperty-icon: {_mark("whole", name)}; border: none; }}
    #floatingTitleDockButton {{ qproperty-icon: {_mark("dock", name)}; }}
    """
