"""Small pictures in the upper right of the view, each closed by itself."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QRectF, Qt, QTimer
from PySide6.QtGui import QImage, QPainter, QPaintEvent, QPen, QResizeEvent
from PySide6.QtWidgets import QToolButton, QWidget

from scenes.cameras import Pinhole
from scenes.pose import Pose
from studio.app.model.actions import Choice
from studio.app.model.names import CAMERA
from studio.app.model.runs.live_run import HeadsetView, LiveRun
from studio.app.model.workbench import Topic, Workbench
from studio.app.viewport.drawing.scene_drawing import Drawings
from studio.app.viewport.drawing.shapes import Shown, shapes_of
from studio.app.viewport.drawing.view_picture import View
from studio.app.viewport.insets.inset_painter import InsetPainter
from studio.app.viewport.insets.sources import eyes_of, sources_of, title_of
from studio.app.viewport.seen_twin import FIELD_OF_VIEW
from studio.app.viewport.view_overlay import BACKDROP, GROUND, INK, image_of

SIZE_PX = (320, 180)
"""Of a drawn picture; it is scaled to where it stands."""

POLL_MS = 30
"""Between two looks at what the thread has drawn."""

MAX_INSETS = 3
"""Small pictures at a time: two points of view and the 360° camera."""

HEADSET_NS = 100_000_000
"""Between two shown pictures of a headset, ns: ten a second, somewhat more than a drawn view gets
of the thread's time."""

OLD_S = 1.0
"""Age of a headset's picture that is said, seconds: its longest gap in ordinary use is 0.2 s."""

A_ROW = 2
"""In a row: at 1280 × 800 the view is some 640 pixels wide, and a face is seen in 200."""

SHARE = 0.3
"""Of the view's width that one takes."""

MIN_PX = 200
"""One is that wide also in a narrow view, if two are inside it."""

EDGE_PX, GAP_PX = 12, 8
"""To the view's edges, and between two, pixels."""

FOOT_PX = 36
"""Left free at the view's lower edge, where its own words stand, pixels."""

ROLES = ("local", "remote")
"""Roles of the two people whose views stand beside each other."""

Place = tuple[int, int, int, int]
"""Left, top, width, height, pixels."""


class Insets:
    """The small pictures of one window.

    Args:
        bench: what is shown.
        over: what they stand on.
        drawings: what draws the scene, shared with the views.
    """

    def __init__(self, bench: Workbench, over: QWidget, drawings: Drawings) -> None:
        self._bench = bench
        self._over = over
        self._drawings = drawings
        self._painter: InsetPainter | None = None
        self._shown: dict[str, Inset] = {}
        self._is_covered = False
        self._headset_ns: dict[str, int] = {}
        """Times of the pictures of headsets that are shown."""
        self._timer = QTimer(over)
        self._timer.timeout.connect(self._poll)
        for topic in (Topic.STATE, Topic.SETTINGS):
            bench.listen(topic, self.redraw)
        bench.listen(Topic.SCENE, self._new_scene)

    @property
    def sources(self) -> tuple[str, ...]:
        """Sources of the shown pictures, in the order in which they were opened."""
        return tuple(self._shown)

    @property
    def pictures(self) -> tuple[Inset, ...]:
        """Their widgets, in the same order."""
        return tuple(self._shown.values())

    def choices(self) -> list[Choice]:
        """All views that can be shown, and which are."""
        bench = self._bench
        found = self._known()
        return [
            Choice(
                bench.name_of(source),
                {"source": source},
                is_on=source in self._shown,
            )
            for source in dict.fromkeys((*found, *self._shown))
        ]

    def switch(self, source: str) -> None:
        """Open the view of the camera, a person or an object by its id, or close it."""
        if source in self._shown:
            self.close_source(source)
        else:
            self.open_source(source)

    def switch_people(self) -> None:
        """Open the views of whoever is in the room and of whoever is elsewhere, or close both.

        Of each the first one.

        Raises:
            ValueError: one of them is not here, or `MAX_INSETS` are shown.
        """
        avatars = self._bench.state.avatars.values()
        roles = [next((a.user_id for a in avatars if a.role == role), None) for role in ROLES]
        people = [person for person in roles if person is not None]
        if len(people) < len(ROLES):
            missing = " and ".join(r for r, p in zip(ROLES, roles, strict=True) if p is None)
            raise ValueError(f"views of both people: no {missing} person is here, let them join")
        if all(person in self._shown for person in people):
            for person in people:
                self.close_source(person)
            return
        for person in people:
            self.open_source(person)

    def open_source(self, source: str) -> None:
        """Show a view beside those that are shown.

        Raises:
            ValueError: there is nobody and nothing of that id, or `MAX_INSETS` are shown.
        """
        bench, known = self._bench, self._known()
        if source not in known:
            raise ValueError(f"{source!r}: nobody sees that; wanted one of {', '.join(known)}")
        if source in self._shown:
            return
        if len(self._shown) >= MAX_INSETS:
            names = ", ".join(title_of(s, bench.name_of(s)) for s in self._shown)
            raise ValueError(
                f"{len(self._shown)} small pictures are shown ({names}), {MAX_INSETS} at most: "
                "close one by its ✕"
            )
        inset = Inset(self._over, close=lambda: self._bench.do("view.inset", source=source))
        self._shown[source] = inset
        inset.setVisible(not self._is_covered)
        self.place()
        self.redraw()
        self._timer.start(POLL_MS)

    def close_source(self, source: str) -> None:
        """Close one; without any of that id nothing happens."""
        inset = self._shown.pop(source, None)
        if inset is None:
            return
        if self._painter is not None:
            self._painter.forget(source)
        self._headset_ns.pop(source, None)
        inset.hide()
        inset.deleteLater()
        self.place()
        if not self._shown:
            self._timer.stop()

    def close_all(self) -> None:
        """Close them all."""
        for source in self.sources:
            self.close_source(source)

    def place(self) -> None:
        """Stand where they belong, above what they stand on."""
        heights = [1.0 if source == CAMERA else SIZE_PX[1] / SIZE_PX[0] for source in self._shown]
        places = placed(heights, self._over.width(), self._over.height())
        for inset, place in zip(self._shown.values(), places, strict=True):
            inset.setGeometry(*place)
            inset.raise_()

    def hide(self) -> None:
        """Show none of them, and leave them open."""
        for inset in self._shown.values():
            inset.hide()

    def cover(self, is_covered: bool) -> None:
        """Show none of them while something else is in the place of what they stand on."""
        if is_covered != self._is_covered:
            self._is_covered = is_covered
            for inset in self._shown.values():
                inset.setVisible(not is_covered)

    def redraw(self) -> None:
        """Ask for pictures of what is now."""
        for source, inset in self._shown.items():
            bench = self._bench
            if self._headset(source) is not None:
                continue  # shown as its own pictures come
            inset.name(title_of(source, bench.name_of(source)))
            if source == CAMERA:
                inset.show_picture(bench.camera_picture, "no picture of the camera yet")
                continue
            eyes = eyes_of(source, bench.state, bench.document, bench.scene)
            if eyes is None:
                name = bench.name_of(source)
                inset.show_picture(None, f"{name} is not here now")
            elif bench.scene is not None:
                self._ask(source, eyes)

    def _ask(self, source: str, eyes: Pose) -> None:
        bench, scene = self._bench, self._bench.scene
        assert scene is not None
        shapes = shapes_of(
            bench.state,
            shown=Shown.of(bench.settings.layers),
            twin=bench.document.twin,
            world_from_rig=bench.state.world_from_rig or scene.world_from_rig,
            seen_by=source,
            crowd=self._drawings.crowd,
        )
        camera = Pinhole.from_fov(*SIZE_PX, FIELD_OF_VIEW)
        if self._painter is None:
            self._painter = InsetPainter(self._drawings.of(scene))
        self._painter.show(
            source, View(bench.state, camera, eyes, bench.live, tuple(shapes), seen_by=source)
        )

    def _known(self) -> tuple[str, ...]:
        """Return all sources; a headset's also before it is known where its wearer is."""
        bench = self._bench
        found = sources_of(bench.state, bench.document, bench.scene)
        live = bench.shared(LiveRun)
        seen = None if live is None else live.headset_view()
        return tuple(dict.fromkeys((*found, *(() if seen is None else (seen.person_id,)))))

    def _headset(self, source: str) -> HeadsetView | None:
        """Return the picture of somebody's own headset; None where a view of theirs is drawn."""
        live = self._bench.shared(LiveRun)
        seen = None if live is None else live.headset_view()
        return None if seen is None or seen.person_id != source else seen

    def _show_headset(self, source: str, inset: Inset, *, seen: HeadsetView) -> None:
        """Show the newest picture of a headset, and its age where it is old."""
        if seen.t_ns is None:
            inset.show_picture(None, "no picture of the headset yet")
            return
        name = title_of(source, self._bench.name_of(source))
        inset.name(f"{name}, {seen.age_s:.0f} s old" if seen.age_s > OLD_S else name)
        shown_ns = self._headset_ns.get(source)
        if shown_ns is None or seen.t_ns - shown_ns >= HEADSET_NS:
            self._headset_ns[source] = seen.t_ns
            inset.show_picture(seen.draw(), "no picture of the headset yet")

    def _poll(self) -> None:
        bench = self._bench
        for source, inset in self._shown.items():
            seen = self._headset(source)
            if seen is not None:
                self._show_headset(source, inset, seen=seen)
            if seen is not None or self._painter is None:
                continue
            painted = self._painter.take(source)
            # Somebody who left while they were drawn stays away.
            is_here = eyes_of(source, bench.state, bench.document, bench.scene) is not None
            if painted is not None and is_here:
                inset.show_picture(painted.picture)

    def _new_scene(self) -> None:
        self.close_all()
        if self._painter is not None:
            self._painter.stop()
            self._painter = None

    def close(self) -> None:
        """End the thread that draws."""
        for callback in (self.redraw, self._new_scene):
            self._bench.stop_listening(callback)
        self._new_scene()


class Inset(QWidget):
    """One small picture with a title and a button that closes it.

    Args:
        over: what it stands on.
        close: called by the button.
    """

    def __init__(self, over: QWidget, close: Callable[[], object]) -> None:
        super().__init__(over)
        self._image: QImage | None = None
        self._words = "drawing …"
        self.title = ""
        self.drawn = 0
        """Pictures that it has shown."""
        self.button = QToolButton(self)
        self.button.setText("✕")
        self.button.setCursor(Qt.CursorShape.ArrowCursor)
        self.button.setStyleSheet(
            f"QToolButton {{ color: {INK.name()}; border: none; padding: 0px;"
            f" background: {BACKDROP.name()}; }} QToolButton:hover {{ color: {BACKDROP.name()};"
            f" background: {INK.name()}; }}"
        )
        self.button.clicked.connect(lambda _on=False: close())

    @property
    def words(self) -> str:
        """Words in it instead of a picture; "" where there is one."""
        return "" if self._image is not None else self._words

    def name(self, title: str) -> None:
        """Set the title: whose view it is."""
        if title != self.title:
            self.title = title
            self.setAccessibleName(title)
            self.button.setAccessibleName(f"Close: {title}")
            self.button.setToolTip(f"Close: {title}")
            self.update()

    def show_picture(self, picture: NDArray[np.uint8] | None, words: str = "") -> None:
        """Show an (H, W, 3) RGB picture, or words where there is none."""
        self._image = None if picture is None else image_of(picture)
        self._words = words
        self.drawn += picture is not None
        self.update()

    @property
    def _bar_px(self) -> int:
        return self.fontMetrics().height() + 6

    def resizeEvent(self, event: QResizeEvent) -> None:
        """See Qt."""
        super().resizeEvent(event)
        side = self._bar_px - 1
        self.button.setGeometry(self.width() - side - 1, 1, side, side)

    def paintEvent(self, event: QPaintEvent) -> None:
        """See Qt."""
        painter = QPainter(self)
        painter.fillRect(self.rect(), BACKDROP)
        if self._image is not None:
            painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
            painter.drawImage(QRectF(self.rect()), self._image)
        painter.setPen(QPen(INK, 1))
        if self._image is None:
            inside = self.rect().adjusted(8, self._bar_px, -8, -4)
            flags = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap
            painter.drawText(inside, flags, self._words)
        painter.drawRect(self.rect().adjusted(0, 0, -1, -1))
        metrics = painter.fontMetrics()
        room = self.width() - self._bar_px - 16
        title = metrics.elidedText(self.title, Qt.TextElideMode.ElideRight, max(room, 0))
        painter.fillRect(1, 1, metrics.horizontalAdvance(title) + 14, self._bar_px - 1, GROUND)
        painter.drawText(8, 3 + metrics.ascent(), title)


def placed(heights: Sequence[float], width_px: int, height_px: int) -> list[Place]:
    """Places of the pictures, none over another, all inside the view.

    Args:
        heights: of each, over its width.
        width_px: of the view.
        height_px: of the view.
    """
    room = (width_px - 2 * EDGE_PX - (A_ROW - 1) * GAP_PX) // A_ROW
    wide = max(1, min(max(round(SHARE * width_px), MIN_PX), room))
    rows = [heights[at : at + A_ROW] for at in range(0, len(heights), A_ROW)]
    tall = sum(max(row) for row in rows)
    free = height_px - EDGE_PX - FOOT_PX - GAP_PX * max(len(rows) - 1, 0)
    if tall > 0 and wide * tall > free:
        wide = max(1, int(free / tall))
    places: list[Place] = []
    top = EDGE_PX
    for row in rows:
        for number, height in enumerate(row):
            left = width_px - EDGE_PX - (number + 1) * wide - number * GAP_PX
            places.append((left, top, wide, max(1, int(height * wide))))
        top += max(1, int(max(row) * wide)) + GAP_PX
    return places
