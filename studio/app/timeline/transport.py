"""The row of buttons over the timeline: play, step, jump, fork, compare; the time; the signs."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QHBoxLayout, QLabel, QProgressBar, QSizePolicy, QToolButton, QWidget

from studio.app.model.keys import keys_of
from studio.app.model.workbench import Workbench
from studio.app.shell.theme import Theme, figures, fixed_font
from studio.app.timeline.playback import Playback

BUTTONS = (
    "timeline.previous",
    "timeline.step_back",
    "timeline.play",
    "timeline.step",
    "timeline.next",
    "timeline.slower",
    "timeline.faster",
    "timeline.loop",
    "timeline.first_failure",
    "timeline.yaw",
    "timeline.mark",
    "timeline.fork",
    "timeline.compare",
    "timeline.close",
)
"""Actions that have a button, from the left."""

NAMED = {
    "timeline.first_failure": "First failure",
    "timeline.fork": "Fork here",
    "timeline.compare": "Compare",
}
"""Buttons whose icon says too little, and the word beside it."""

LEGEND = (
    ("▦ static", "calm"),
    ("■ tracked", "good"),
    ("▨ occluded", "warning"),
    ("▩ lost", "bad"),
    ("☰ fault", "warning"),
    ("▼ marker", "accent"),
    ("✖ first failure", "bad"),
)
"""Signs, what they stand for, and the theme's colour of each."""


class Transport(QWidget):
    """Buttons and time.

    Args:
        bench: whose actions the buttons do.
    """

    def __init__(self, bench: Workbench) -> None:
        super().__init__()
        self._bench = bench
        row = QHBoxLayout(self)
        row.setContentsMargins(6, 2, 8, 2)
        row.setSpacing(0)
        self.buttons: dict[str, QToolButton] = {}
        for action_id in BUTTONS:
            button = QToolButton()
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            if action_id in NAMED:
                button.setText(NAMED[action_id])
                button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
            button.clicked.connect(partial(_clicked, bench, action_id))
            self.buttons[action_id] = button
            row.addWidget(button)
        self.time = QLabel()
        self.time.setFont(fixed_font())
        self.progress = QProgressBar()
        self.progress.setMaximumWidth(160)
        self.progress.setFormat("reading %p %")
        self.progress.hide()
        row.addSpacing(8)
        row.addWidget(self.time)
        row.addStretch(1)
        row.addWidget(self.progress)

    def colour(self, theme: Theme) -> None:
        """Draw icons in a theme's colours; write the hints anew."""
        import qtawesome  # loads fonts: not before the window is shown

        for action_id, button in self.buttons.items():
            action = self._bench.actions.get(action_id)
            button.setIcon(
                qtawesome.icon(action.icon, color=theme.text, color_disabled=theme.disabled)
            )
            keys = keys_of(action, self._bench.settings)
            known = f" ({keys})" if keys else ""
            button.setToolTip(f"{action.title}{known}" + (f": {action.hint}" * bool(action.hint)))
            button.setAccessibleName(action.title)

    def show_available(self) -> None:
        """Let those be pressed that do something now."""
        for action_id, button in self.buttons.items():
            button.setEnabled(self._bench.actions.get(action_id).is_available)

    def show_time(
        self, playback: Playback, picture_ns: int | None = None, *, cut: str = ""
    ) -> None:
        """Say where it is, of what length, and how fast.

        Args:
            playback: the playhead.
            picture_ns: when the camera's picture was taken, if it is not that of the playhead.
            cut: how the recording came to an early end, in words; empty if it did not.
        """
        due = picture_ns is not None and not playback.is_playing
        picture = f"  picture of {playback.seconds(picture_ns or 0):.2f} s" if due else ""
        playing = "▶" if playback.is_playing else "‖"
        loop = "  loop" if playback.is_looping else ""
        self.time.setText(
            f"{playing}{figures(playback.seconds(playback.t_ns), '8.2f')} s of "
            f"{playback.seconds(playback.end_ns):.1f} s{f' ({cut})' * bool(cut)}"
            f"  ×{playback.speed:g}{loop}{picture}"
        )

    def show_share(self, share: float) -> None:
        """How much of a recording has been read, 0..1."""
        self.progress.setValue(round(100 * share))
        self.progress.show()


class Legend(QLabel):
    """Legend of the rows' signs; gives way where there is no room."""

    def __init__(self) -> None:
        super().__init__()
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)

    def colour(self, theme: Theme) -> None:
        """Write it in a theme's colours."""
        words = [f'<span style="color:{getattr(theme, c)}">{text}</span>' for text, c in LEGEND]
        self.setText(" &nbsp; ".join(words))


def _clicked(bench: Workbench, action_id: str, _checked: bool = False) -> None:
    bench.do(action_id)
