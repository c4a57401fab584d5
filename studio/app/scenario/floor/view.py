"""The floor from above: people, their ways, goals and remote paths as handles that are dragged."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import (
    QBrush,
    QColor,
    QImage,
    QPainter,
    QPainterPath,
    QPen,
    QPixmap,
    QResizeEvent,
)
from PySide6.QtWidgets import (
    QGraphicsItem,
    QGraphicsPathItem,
    QGraphicsScene,
    QGraphicsSimpleTextItem,
    QGraphicsView,
)

from sim.scenarios.actions import name_of
from sim.scenarios.scenario import Scenario
from studio.app.model.workbench import Workbench
from studio.app.scenario.colours import on, person_colour, theme_of
from studio.app.scenario.floor.handle import PX_PER_M, Handle, to_scene
from studio.app.scenario.plan import Block, Item, RoomPlan

PERSON_M = 0.24
"""Radius of a person's disc: the simulator's body."""

HANDLE_M = 0.11
"""Radius of a handle."""

NOSE_SHARE, NOSE_HANDLE_M = 1.7, 0.07
"""How far the arrow of a person's facing reaches, in radii; and the handle at its tip."""

MARGIN_M = 0.3

Part = Literal["left", "right", "whole"]

Corner = Sequence[float]

EDGES: dict[Part, tuple[int, ...]] = {"left": (0, 3), "right": (1, 2), "whole": (0, 1, 2, 3)}
"""Numbers of the corners that a part is: they go clockwise from the top left."""


class FloorPlan(QGraphicsView):
    """The floor plan.

    Args:
        bench: whose actions the handles call.
    """

    def __init__(self, bench: Workbench) -> None:
        super().__init__()
        self._bench = bench
        self._picture: QPixmap | None = None
        self._extent_m = 0.0
        self._bounds = QRectF(-300, -300, 600, 600)
        self.setScene(QGraphicsScene(self))
        self.setRenderHint(QPainter.RenderHint.Antialiasing)
        self.setFrameShape(QGraphicsView.Shape.NoFrame)
        self.setMinimumSize(200, 180)
        self.setAccessibleName("Floor plan")
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)

    def set_picture(self, picture: NDArray[np.uint8] | None, extent_m: float) -> None:
        """The picture from above, (S, S, 3) RGB, and how many metres it shows."""
        self._extent_m = extent_m
        if picture is None:
            self._picture = None
            return
        rows = np.ascontiguousarray(picture)
        height, width, _ = rows.shape
        image = QImage(rows.data, width, height, 3 * width, QImage.Format.Format_RGB888)
        self._picture = QPixmap.fromImage(image.copy())

    def show_plan(
        self, scenario: Scenario, plan: RoomPlan, blocks: tuple[Block, ...], selected: str
    ) -> None:
        """Draw everything anew.

        Args:
            scenario: what happens.
            plan: of the room.
            blocks: whose ways are drawn.
            selected: the person who is drawn strongly; "" for all.
        """
        scene = self.scene()
        grabbed = scene.mouseGrabberItem()
        if grabbed is not None:
            return
        scene.clear()
        self._draw_room(plan)
        for item in plan.items:
            self._draw_object(item)
        self._draw_camera(scenario, plan)
        for index, person in enumerate(scenario.people):
            is_strong = selected in ("", person.person_id)
            own = [block for block in blocks if block.person_id == person.person_id]
            ways = self._draw_ways(own, person_colour(index), is_strong)
            if is_strong:
                self._draw_goals(own, person_colour(index))
            handle = self._draw_person(person.person_id, person.start, person.facing_deg, index)
            handle.lead((), ways[:1])
        for surface in scenario.surfaces:
            self._draw_surface(surface.surface_id, surface.corners_in_world)
        for remote in scenario.remote:
            self._draw_remote(remote.user_id, remote.path)
        self._fit()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep the whole room in sight."""
        super().resizeEvent(event)
        self._fit()

    def _fit(self) -> None:
        self.fitInView(self._bounds, Qt.AspectRatioMode.KeepAspectRatio)

    def _draw_room(self, plan: RoomPlan) -> None:
        theme, scene = theme_of(self), self.scene()
        scene.setBackgroundBrush(QColor(theme.field))
        low, high = to_scene(plan.low[0], plan.high[1]), to_scene(plan.high[0], plan.low[1])
        room = QRectF(low, high)
        margin = MARGIN_M * PX_PER_M
        self._bounds = room.adjusted(-margin, -margin, margin, margin)
        scene.setSceneRect(self._bounds)
        if self._picture is not None and self._extent_m > 0:
            # The picture is square and the room is not: only the room and its walls are shown.
            scale = self._picture.width() / (self._extent_m * PX_PER_M)
            wall = 0.5 * MARGIN_M * PX_PER_M
            size = QRectF(0, 0, scale * (room.width() + wall), scale * (room.height() + wall))
            size.moveCenter(QRectF(self._picture.rect()).center())
            shown = scene.addPixmap(self._picture.copy(size.toRect()))
            shown.setScale(1.0 / scale)
            shown.setPos(room.topLeft() - QPointF(0.5 * wall, 0.5 * wall))
            shown.setOpacity(0.55)
            shown.setTransformationMode(Qt.TransformationMode.SmoothTransformation)
        scene.addRect(room, QPen(QColor(theme.faint), 3))

    def _draw_object(self, item: Item) -> None:
        theme = theme_of(self)
        w, d = (size * PX_PER_M for size in item.box_m[:2])
        shape = self.scene().addRect(
            QRectF(-w / 2, -d / 2, w, d), QPen(QColor(theme.text), 2), QBrush(QColor(theme.raised))
        )
        shape.setOpacity(0.85)
        shape.setPos(to_scene(float(item.place[0]), float(item.place[1])))
        shape.setRotation(-math.degrees(item.yaw))
        shape.setToolTip(f"{self._bench.name_of(item.object_id)} ({item.object_id} in texts)")
        where = to_scene(float(item.place[0]), float(item.place[1]))
        self._label(self._bench.name_of(item.object_id), where + QPointF(0, 0.5 * max(w, d) + 2))

    def _draw_camera(self, scenario: Scenario, plan: RoomPlan) -> None:
        camera = scenario.camera.position
        x, y = (plan.camera[0], plan.camera[1]) if camera is None else camera[:2]
        height = 1.3 if camera is None else camera[2]
        handle = Handle(
            (float(x), float(y)),
            HANDLE_M,
            QColor(theme_of(self).text),
            lambda a, b: self._bench.do("scenario.camera", key="position", value=[a, b, height]),
        )
        handle.setToolTip("360° camera: drag to move")
        self.scene().addItem(handle)
        handle.lead(self._label("camera", handle.pos() + QPointF(0, HANDLE_M * PX_PER_M)))

    def _draw_ways(
        self, blocks: list[Block], colour: QColor, is_strong: bool
    ) -> list[QGraphicsPathItem]:
        """One item a block that goes somewhere."""
        drawn: list[QGraphicsPathItem] = []
        for block in blocks:
            path = QPainterPath()
            for k, (x, y) in enumerate(block.way):
                point = to_scene(float(x), float(y))
                path.lineTo(point) if k else path.moveTo(point)
            item = QGraphicsPathItem(path)
            pen = QPen(colour, 4 if is_strong else 2, Qt.PenStyle.SolidLine)
            pen.setCapStyle(Qt.PenCapStyle.RoundCap)
            item.setPen(pen)
            item.setOpacity(0.9 if is_strong else 0.4)
            item.setToolTip(f"{block.index + 1}. {name_of(block.action)}")
            self.scene().addItem(item)
            drawn += [item] if path.elementCount() > 1 else []
        return drawn

    def _draw_goals(self, blocks: list[Block], colour: QColor) -> None:
        for block in blocks:
            to = getattr(block.action, "to", None)
            if not isinstance(to, tuple):
                continue

            def drop(x: float, y: float, block: Block = block) -> None:
                self._bench.do(
                    "scenario.set_action",
                    person=block.person_id,
                    index=block.index,
                    key="to",
                    value=[x, y],
                )

            handle = Handle((float(to[0]), float(to[1])), HANDLE_M, colour, drop)
            item_id = getattr(block.action, "object", None)
            what = self._bench.name_of(item_id) if item_id else ""
            words = f"{block.index + 1}. {name_of(block.action)} {what}".strip()
            handle.setToolTip(f"{words}: drag the goal")
            self.scene().addItem(handle)
            self._number(str(block.index + 1), handle, on(colour))

    def _draw_person(
        self, person_id: str, start: tuple[float, float], facing_deg: float, index: int
    ) -> Handle:
        colour = person_colour(index)
        name = self._bench.name_of(person_id)
        handle = Handle(
            start,
            PERSON_M,
            colour,
            lambda x, y: self._bench.do("scenario.move_person", id=person_id, x=x, y=y),
        )
        known = name if name == person_id else f"{name} ({person_id} in texts)"
        handle.setToolTip(f"{known} starts here: drag to move")
        turn, size = math.radians(facing_deg), PERSON_M * PX_PER_M
        nose = QPainterPath()
        for k, (angle, reach) in enumerate(((0.0, NOSE_SHARE), (0.6, 0.98), (-0.6, 0.98))):
            point = QPointF(
                reach * size * math.cos(turn + angle), -reach * size * math.sin(turn + angle)
            )
            nose.lineTo(point) if k else nose.moveTo(point)
        nose.closeSubpath()
        arrow = QGraphicsPathItem(nose, handle)
        arrow.setBrush(colour)
        arrow.setPen(QPen(on(colour), 2))
        self._number(name[:1].upper(), handle, on(colour))
        self.scene().addItem(handle)
        handle.lead(self._label(name, handle.pos() + QPointF(0, 1.7 * size)))
        reach_m = NOSE_SHARE * PERSON_M
        tip = (start[0] + reach_m * math.cos(turn), start[1] + reach_m * math.sin(turn))
        turned = partial(self._turn_to, person_id, start)
        nose_handle = Handle(tip, NOSE_HANDLE_M, colour, turned)
        nose_handle.setToolTip(f"{known} faces this way: drag to turn")
        self.scene().addItem(nose_handle)
        handle.lead((nose_handle,))
        return handle

    def _turn_to(self, person_id: str, start: tuple[float, float], x: float, y: float) -> None:
        deg = round(math.degrees(math.atan2(y - start[1], x - start[0])))
        self._bench.do("scenario.face_person", id=person_id, deg=float(deg))

    def _draw_surface(self, surface_id: str, corners: Sequence[Corner]) -> None:
        colour = QColor(theme_of(self).good)
        left = to_scene(*middle_of(corners, "left"))
        right = to_scene(*middle_of(corners, "right"))
        line = self.scene().addLine(QLineF(left, right), QPen(colour, 5))
        line.setToolTip(f"live surface {surface_id}")
        hints: dict[Part, str] = {
            "left": "left edge",
            "right": "right edge",
            "whole": "drag to move",
        }
        for part, hint in hints.items():
            size_m = HANDLE_M if part == "whole" else 0.7 * HANDLE_M
            moved = partial(self._move_surface, surface_id, corners, part)
            handle = Handle(middle_of(corners, part), size_m, colour, moved)
            handle.setToolTip(f"live surface {surface_id}, {hint}: drag to move")
            self.scene().addItem(handle)
        self._label(surface_id, (left + right) * 0.5 + QPointF(0, HANDLE_M * PX_PER_M))

    def _move_surface(
        self, surface_id: str, corners: Sequence[Corner], part: Part, x: float, y: float
    ) -> None:
        moved = [list(corner) for corner in with_part_at(corners, part, x, y)]
        self._bench.do("scenario.set_surface", id=surface_id, corners=moved)

    def _draw_remote(self, user_id: str, path: tuple[tuple[float, float, float], ...]) -> None:
        colour = QColor(theme_of(self).accent)
        line = QPainterPath()
        for k, (x, y, _) in enumerate(path):
            point = to_scene(x, y)
            line.lineTo(point) if k else line.moveTo(point)
        item = QGraphicsPathItem(line)
        item.setPen(QPen(colour, 3, Qt.PenStyle.DashLine))
        self.scene().addItem(item)
        for k, (x, y, _) in enumerate(path):

            def drop(a: float, b: float, k: int = k) -> None:
                self._bench.do("scenario.move_remote_point", id=user_id, index=k, x=a, y=b)

            handle = Handle((x, y), 0.8 * HANDLE_M, colour, drop)
            handle.setToolTip(f"{self._bench.name_of(user_id)}, point {k + 1}: drag to move")
            self.scene().addItem(handle)
        self._label(
            self._bench.name_of(user_id), to_scene(*path[0][:2]) + QPointF(0, HANDLE_M * PX_PER_M)
        )

    def _label(self, text: str, below: QPointF) -> tuple[QGraphicsItem, QGraphicsItem]:
        """The words and the ground below them."""
        item = QGraphicsSimpleTextItem(text)
        font = item.font()
        font.setPixelSize(17)
        font.setBold(True)
        item.setFont(font)
        theme = theme_of(self)
        size = item.boundingRect()
        item.setPos(below - QPointF(size.width() / 2, 0))
        item.setBrush(QColor(theme.text))
        item.setZValue(7)
        ground = self.scene().addRect(
            item.mapRectToScene(size).adjusted(-3, 0, 3, 0),
            QPen(Qt.PenStyle.NoPen),
            QBrush(QColor(theme.field)),
        )
        ground.setOpacity(0.75)
        ground.setZValue(6)
        for each in (item, ground):
            each.setAcceptedMouseButtons(Qt.MouseButton.NoButton)
        self.scene().addItem(item)
        return item, ground

    def _number(self, text: str, parent: QGraphicsItem, colour: QColor) -> None:
        item = QGraphicsSimpleTextItem(text, parent)
        font = item.font()
        font.setPixelSize(16)
        font.setBold(True)
        item.setFont(font)
        item.setBrush(colour)
        size = item.boundingRect()
        item.setPos(-size.width() / 2, -size.height() / 2)


def middle_of(corners: Sequence[Corner], part: Part) -> tuple[float, float]:
    """(x, y) of the middle of a part, metres.

    Args:
        corners: four (x, y, z), clockwise from the top left.
        part: which.
    """
    of = [corners[k] for k in EDGES[part]]
    return sum(c[0] for c in of) / len(of), sum(c[1] for c in of) / len(of)


def with_part_at(
    corners: Sequence[Corner], part: Part, x: float, y: float
) -> list[tuple[float, float, float]]:
    """The corners after a part was dragged to a place, to the millimetre.

    Args:
        corners: four (x, y, z), clockwise from the top left.
        part: what was dragged.
        x: where its middle is now, metres.
        y: likewise.
    """
    from_x, from_y = middle_of(corners, part)
    moved = {k: (x - from_x, y - from_y) for k in EDGES[part]}
    found: list[tuple[float, float, float]] = []
    for k, corner in enumerate(corners):
        dx, dy = moved.get(k, (0.0, 0.0))
        found.append((round(corner[0] + dx, 3), round(corner[1] + dy, 3), float(corner[2])))
    return found
