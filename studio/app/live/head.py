"""The top of the live panel: state, LIVE badge, the one button, and what somebody must do."""

from __future__ import annotations

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from studio.app.live.words import (
    IDLE,
    Banner,
    Help,
    Light,
    begun_with_a_capital,
    elapsed_words,
    light_of,
    objects_words,
)
from studio.app.model.jobs.live_job import LiveJob
from studio.app.model.own_address import reachable
from studio.app.model.runs.live_run import NO_STEP, LiveRun, Step
from studio.app.model.workbench import Workbench
from studio.app.shell.theme import SHAPES, THEMES
from studio.live.status import LiveState, LiveStatus

LIVE_RED = "#c62828"
"""Of the badge, in both themes; white on it has 5.6:1."""

SIGNS_PX = 4
"""Pixels that signs such as ▲ may stand out of a line; they come from another font."""
LINES = 2
"""Of the sentence below the state that are kept free, so that little moves when it changes."""

STARTS = "Choose a camera, then check and connect."


class LiveHead(QWidget):
    """State, the one button and the banner of a live session.

    Args:
        bench: does what the buttons ask for.
        live: the live session.
    """

    def __init__(self, bench: Workbench, live: LiveRun) -> None:
        super().__init__()
        self._bench, self._live = bench, live
        self._light = IDLE
        self._banner: Banner | None = None
        self._held_px = 0
        self.state = QLabel()
        self.state.setAccessibleName("State of the live session")
        font = self.state.font()
        font.setBold(True)
        self.state.setFont(font)
        self.badge = QLabel()
        self.badge.setStyleSheet(
            f"background: {LIVE_RED}; color: #ffffff; border-radius: 4px; padding: 2px 8px; "
            "font-weight: bold;"
        )
        self.cancel = QPushButton("Cancel")
        self.cancel.setToolTip("end it before it is live")
        self.cancel.clicked.connect(lambda: bench.do("live.end"))
        self.next = QPushButton()
        self.next.setDefault(True)
        self.next.setToolTip("the next step (F6)")
        self.next.clicked.connect(lambda: bench.do("live.next"))
        row = QHBoxLayout()
        row.addWidget(self.state)
        row.addWidget(self.badge)
        row.addStretch(1)
        row.addWidget(self.cancel)
        row.addWidget(self.next)
        self.text = QLabel(STARTS)
        self.text.setWordWrap(True)
        self.text.setAlignment(Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignLeft)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 8, 8, 4)
        layout.addLayout(row)
        layout.addWidget(self.text)
        layout.addWidget(self._make_banner())
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)
        self.badge.hide()
        self.refresh_button()
        self.recolour()

    def hasHeightForWidth(self) -> bool:
        """No: what is around it would take its usual height for its least, and scroll."""
        return False

    def sizeHint(self) -> QSize:
        """As high as its words take at its width."""
        layout = self.layout()
        assert layout is not None
        return QSize(layout.totalSizeHint().width(), self._height_px())

    def minimumSizeHint(self) -> QSize:
        """See `sizeHint`."""
        layout = self.layout()
        assert layout is not None
        return QSize(layout.totalMinimumSize().width(), self.sizeHint().height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        """See Qt."""
        super().resizeEvent(event)
        if event.oldSize().width() != event.size().width():
            self._held_px = 0
            self.updateGeometry()

    def _make_banner(self) -> QWidget:
        self.banner = QFrame()
        self.banner.setObjectName("banner")
        self.banner_text = QLabel()
        self.banner_text.setWordWrap(True)
        self.banner_button = QPushButton(Help.FIND)
        self.banner_button.clicked.connect(lambda: self._bench.do("live.find_camera"))
        row = QHBoxLayout(self.banner)
        row.setContentsMargins(8, 6, 8, 6)
        row.addWidget(self.banner_text, 1)
        row.addWidget(self.banner_button)
        self.banner.hide()
        return self.banner

    def show_idle(self, job: LiveJob | None) -> None:
        """No session plays: what the last one came to, or how to begin one."""
        self._show_light(IDLE if job is None or not job.running else Light("unknown", "opening"))
        self._show_banner(None, is_locating=False)
        self._hold(is_playing=False)
        self.badge.hide()
        text = STARTS
        if job is not None:
            if job.running:
                text = "The room is being opened."
            elif job.failure is not None:
                self._show_light(Light("bad", "failed"))
                text = " ".join(str(job.failure).split()) or type(job.failure).__name__
            elif job.last_words:
                self._show_light(Light("calm", "ended"))
                text = begun_with_a_capital(job.last_words)
        self._show_text(text)
        self.refresh_button()

    def show_status(
        self, status: LiveStatus, banner: Banner | None, *, drawing: str, is_locating: bool
    ) -> None:
        """Show a session.

        Args:
            status: of it.
            banner: what somebody must do.
            drawing: how far the simulated camera's film is.
            is_locating: whether the camera is looked for beside it.
        """
        self._show_light(light_of(status))
        text = status.text
        if drawing and status.state is LiveState.CONNECTING:
            text = f"the simulated camera is made ready: {drawing}"
        if status.state is LiveState.LIVE:
            text = objects_words(status, self._bench.name_of)
            self.badge.setText(f"LIVE {elapsed_words(status.live_s or 0.0)}")
        self.badge.setVisible(status.state is LiveState.LIVE)
        self._show_text(begun_with_a_capital(reachable(text)))
        self._show_banner(banner, is_locating=is_locating)
        self._hold(is_playing=True)
        self.refresh_button()

    def refresh_button(self) -> None:
        """The next step, and whether there is one."""
        step = self._live.step
        self.next.setText(step)
        self.next.setEnabled(step not in NO_STEP)
        self.cancel.setVisible(step not in (Step.CHECK, Step.END, Step.ENDING))

    def recolour(self) -> None:
        """Follow the theme."""
        self._show_light(self._light)
        self.show_banner_again()

    def show_banner_again(self) -> None:
        """Colour the banner by the theme."""
        theme = THEMES[self._bench.settings.theme]
        kind = "calm" if self._banner is None else self._banner.kind
        colour = getattr(theme, kind)
        self.banner.setStyleSheet(
            f"#banner {{ border: 1px solid {colour}; border-left: 4px solid {colour}; "
            f"border-radius: 4px; background: {theme.field}; }}"
        )

    def _show_light(self, light: Light) -> None:
        self._light = light
        text = f"{SHAPES[light.kind]} {light.word}"
        theme = THEMES[self._bench.settings.theme]
        colour = f"color: {getattr(theme, light.kind, theme.calm)};"
        if self.state.text() != text or self.state.styleSheet() != colour:
            self.state.setText(text)
            self.state.setStyleSheet(colour)

    def _show_text(self, text: str) -> None:
        if self.text.toolTip() == text:
            return
        self.text.setText(text)
        self.text.setToolTip(text)

    def _show_banner(self, banner: Banner | None, *, is_locating: bool) -> None:
        if banner != self._banner:
            if banner is not None and (self._banner is None or banner.kind != self._banner.kind):
                self._bench.say("error" if banner.kind == "bad" else "warning", banner.text)
            self._banner = banner
            self.show_banner_again()
            if banner is not None:
                self.banner_text.setText(f"{SHAPES[banner.kind]} {banner.text}")
        self.banner_button.setVisible(banner is not None and banner.help is Help.FIND)
        self.banner_button.setText("Looking …" if is_locating else Help.FIND)
        self.banner_button.setEnabled(not is_locating)
        self.banner.setVisible(banner is not None)
        self.updateGeometry()

    def _hold(self, is_playing: bool) -> None:
        """Keep the place of text and banner while a session plays: the tabs below stay put."""
        policy = self.banner.sizePolicy()
        if policy.retainSizeWhenHidden() != is_playing:
            policy.setRetainSizeWhenHidden(is_playing)
            self.banner.setSizePolicy(policy)
        lines = LINES * self.fontMetrics().lineSpacing()
        self.text.setMinimumHeight(lines)
        self.banner_text.setMinimumHeight(lines + SIGNS_PX if is_playing else 0)
        self._held_px = self._height_px() if is_playing else 0

    def _height_px(self) -> int:
        """Height of its words at its width; while a session plays no less than before."""
        layout = self.layout()
        assert layout is not None
        return max(layout.totalHeightForWidth(self.width()), self._held_px)
