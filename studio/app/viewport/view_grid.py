"""Up to four views beside each other, one of them in hand; and a small picture in the corner."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, QRectF, Qt, QTimer
from PySide6.QtGui import QCloseEvent, QColor, QPainter, QPaintEvent, QPen, QResizeEvent
from PySide6.QtWidgets import QGridLayout, QWidget

from scenes.cameras import Pinhole
from scenes.pose import Pose
from studio.app.model.workbench import Topic, Workbench
from studio.app.viewport.by_hand.items import pose_of
from studio.app.viewport.by_hand.placing import places_text
from studio.app.viewport.by_hand.tools import InHand, Tool
from studio.app.viewport.drawing.painter import TwinPainter, View
from studio.app.viewport.drawing.scene_drawing import Drawings
from studio.app.viewport.drawing.shapes import Shown, shapes_of
from studio.app.viewport.layers import Layers
from studio.app.viewport.view import FIELD_OF_VIEW, TwinView
from studio.app.viewport.view_actions import add_view_actions
from studio.app.viewport.view_overlay import image_of
from studio.app.viewport.viewer import object_eyes

MAX_VIEWS = 4
POLL_MS = 60
"""Between two looks at the layers that threads make, milliseconds."""

INSET_SHARE = 0.3
"""Of the view's width that the small picture takes."""


class ViewGrid(QWidget):
    """The middle of the window."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__()
        self.bench = bench
        self.views: list[TwinView] = []
        self.is_linked = False
        self.layers = Layers(bench)
        self.drawings = Drawings()
        self._inset = Inset(bench, self, self.drawings)
        self._layout = QGridLayout(self)
        self._layout.setContentsMargins(0, 0, 0, 0)
        self._layout.setSpacing(2)
        self.active: TwinView
        self.set_count(1)
        add_view_actions(self)
        self._timer = QTimer(self)
        self._timer.timeout.connect(self._poll)
        self._timer.start(POLL_MS)

    def _poll(self) -> None:
        problem = self.drawings.problem()
        if problem is not None:
            self.bench.say("warning", problem)
        if self.layers.poll():
            for view in self.views:
                view.redraw()

    @property
    def inset(self) -> Inset:
        """The small picture in the corner."""
        return self._inset

    def set_count(self, count: int) -> None:
        """Show so many views.

        Raises:
            ValueError: more than `MAX_VIEWS`, or none.
        """
        if not 1 <= count <= MAX_VIEWS:
            raise ValueError(f"count = {count}, wanted 1 to {MAX_VIEWS} views")
        while len(self.views) > count:
            gone = self.views.pop()
            self._layout.removeWidget(gone)
            gone.close()
            gone.deleteLater()
        while len(self.views) < count:
            view = TwinView(
                self.bench,
                layers=self.layers,
                drawings=self.drawings,
                finished=self._finished,
            )
            view.installEventFilter(self)
            if self.views and self.views[0].viewer is not None:
                view.set_viewer(self.views[0].viewer)
            self.views.append(view)
        for place, view in enumerate(self.views):
            self._layout.addWidget(view, place // 2, place % 2)
        self.active = self.views[0]
        self.inset.raise_()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """See Qt: the view that is touched is the one in hand; linked views follow it."""
        kind = event.type()
        if isinstance(watched, TwinView):
            if kind in (QEvent.Type.FocusIn, QEvent.Type.MouseButtonPress):
                self.active = watched
            followed = (QEvent.Type.MouseMove, QEvent.Type.Wheel, QEvent.Type.KeyRelease)
            if self.is_linked and kind in followed and watched.viewer is not None:
                for view in self.views:
                    if view is not watched and view.viewer != watched.viewer:
                        view.set_viewer(watched.viewer)
        return False

    def _finished(self, hand: InHand) -> None:
        """A tool has what it needs: what it makes is an action, so that scripts have it too."""
        places = places_text(tuple(hand.places))
        if hand.tool is Tool.DRAW and len(places) > 1:
            self.bench.do("twin.annotate", points=places)
        elif hand.tool is Tool.SURFACE:
            self.bench.do("twin.add_surface", corners=places)
        elif hand.tool is Tool.MEASURE and len(places) > 1:
            from studio.app.viewport.view_overlay import measure_text

            self.bench.say("info", f"measured {measure_text(hand.places)}")

    def resizeEvent(self, event: QResizeEvent) -> None:
        """See Qt."""
        super().resizeEvent(event)
        self.inset.place()

    def closeEvent(self, event: QCloseEvent) -> None:
        """End the threads that draw."""
        self._timer.stop()
        self.layers.close()
        self.inset.close()
        for view in self.views:
            view.close()
        self.drawings.close()
        event.accept()


class Inset(QWidget):
    """A small picture in the upper right: the 360° camera's, or what somebody or something sees."""

    def __init__(self, bench: Workbench, over: QWidget, drawings: Drawings) -> None:
        super().__init__(over)
        self._bench = bench
        self._over = over
        self._drawings = drawings
        self._painter: TwinPainter | None = None
        self._picture = None
        self.source = ""
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        bench.listen(Topic.STATE, self.redraw)
        bench.listen(Topic.SCENE, self._new_scene)
        self.hide()

    def show_source(self, source: str) -> None:
        """Show the view of "camera", an avatar or an object by its id; "" closes it.

        Raises:
            ValueError: there is nobody and nothing of that name.
        """
        if source not in ("", "camera") and self._eyes(source) is None:
            known = ["camera", *self._bench.state.avatars]
            raise ValueError(f"{source!r}: wanted an object's id or one of {', '.join(known)}")
        self.source = source
        self._picture = None
        self.setVisible(bool(source))
        if source not in ("", "camera") and self._painter is None and self._bench.scene is not None:
            self._painter = TwinPainter(self._drawings.of(self._bench.scene))
        self.place()
        self.redraw()

    def place(self) -> None:
        """Stand in the upper right of the view."""
        width = int(INSET_SHARE * self._over.width())
        height = width if self.source == "camera" else width * 9 // 16
        self.setGeometry(self._over.width() - width - 12, 12, width, height)

    def redraw(self) -> None:
        """Ask for a picture of what is now."""
        if not self.source:
            return
        if self.source == "camera":
            self.update()
            return
        eyes = self._eyes(self.source)
        if self._painter is None or eyes is None:
            return
        scene = self._bench.scene
        shapes = shapes_of(
            self._bench.state,
            shown=Shown.of(self._bench.settings.layers),
            twin=self._bench.document.twin,
            world_from_rig=scene.world_from_rig if scene else None,
            seen_by=self.source,
        )
        camera = Pinhole.from_fov(320, 180, FIELD_OF_VIEW)
        view = View(self._bench.state, camera, eyes, self._bench.live, tuple(shapes))
        self._painter.show(view)
        self.update()

    def _eyes(self, source: str) -> Pose | None:
        avatar = self._bench.state.avatars.get(source)
        if avatar is not None:
            return avatar.world_from_head
        twin = self._bench.document.twin
        if source in twin.cameras:
            return twin.cameras[source]
        pose = pose_of(self._bench, source)
        scene = self._bench.scene
        heights = {} if scene is None else {o.object_id: o.box_m[2] for o in scene.objects}
        return None if pose is None else object_eyes(pose, heights.get(source, 0.2))

    def _new_scene(self) -> None:
        if self._painter is not None:
            self._painter.stop()
            self._painter = None
        self.source = ""
        self.hide()

    def paintEvent(self, event: QPaintEvent) -> None:
        """See Qt."""
        painted = self._painter.pictures.take() if self._painter is not None else None
        if painted is not None:
            self._picture = painted.picture
        picture = self._bench.camera_picture if self.source == "camera" else self._picture
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor(14, 16, 20))
        if picture is not None:
            painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
            painter.drawImage(QRectF(self.rect()), image_of(picture))
        painter.setPen(QPen(QColor(236, 239, 243), 1))
        painter.drawRect(self.rect().adjusted(0, 0, -1, -1))
        title = "360° camera, front lens" if self.source == "camera" else f"what {self.source} sees"
        painter.fillRect(
            1, 1, painter.fontMetrics().horizontalAdvance(title) + 14, 22, QColor(14, 16, 20, 190)
        )
        painter.drawText(8, 17, title)
        if self._painter is not None and painted is None and self.source != "camera":
            from PySide6.QtCore import QTimer

            QTimer.singleShot(40, self.update)

    def closeEvent(self, event: QCloseEvent) -> None:
        """End the thread that draws."""
        self._bench.stop_listening(self.redraw)
        self._bench.stop_listening(self._new_scene)
        self._new_scene()
        event.accept()
