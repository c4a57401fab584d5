"""Actions of people as blocks on time, a row a person: drag to reorder, double-click to change."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from PySide6.QtCore import QPoint, QRectF, QSize, Qt
from PySide6.QtGui import (
    QColor,
    QContextMenuEvent,
    QFontMetricsF,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
)
from PySide6.QtWidgets import QMenu, QSizePolicy, QToolTip, QWidget

from sim.scenarios.actions import name_of
from studio.app.model.workbench import Workbench
from studio.app.scenario.colours import on, person_colour, theme_of
from studio.app.scenario.fields import ACTION_FIELDS
from studio.app.scenario.plan import Block

ROW_PX, NAME_PX, AXIS_PX, GAP_PX = 46, 18, 22, 4
MIN_WORDS_PX = 26
"""Narrower blocks have no words in them; the pointer says what they are."""
MIN_PX_PER_S = 14.0
"""Below this, names of actions do not fit; the row scrolls instead."""

Key = tuple[str, int]
"""A person's id and the index of an action."""


class ActionBlocks(QWidget):
    """The blocks.

    Args:
        bench: whose actions reorder and remove.
        edit: called when a block is to be changed; None when none is.
    """

    def __init__(self, bench: Workbench, edit: Callable[[Key | None], object]) -> None:
        super().__init__()
        self._bench, self._edit = bench, edit
        self._blocks: tuple[Block, ...] = ()
        self._people: tuple[str, ...] = ()
        self._duration_s = 10.0
        self.selected: Key | None = None
        self._grabbed: Key | None = None
        self._at = QPoint()
        self._pressed = QPoint()
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setMouseTracking(True)
        self.setAccessibleName("Actions on time")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def show_blocks(
        self, people: tuple[str, ...], blocks: tuple[Block, ...], duration_s: float
    ) -> None:
        """Show what everybody does and how long the scenario lasts."""
        self._people, self._blocks, self._duration_s = people, blocks, duration_s
        keys = {(block.person_id, block.index) for block in blocks}
        if self.selected not in keys:
            self.selected = None
        self.setFixedHeight(self.sizeHint().height())
        self.setMinimumWidth(round(MIN_PX_PER_S * self._span_s()) + 12)
        self.update()

    def sizeHint(self) -> QSize:
        """See Qt."""
        return QSize(320, AXIS_PX + max(1, len(self._people)) * (ROW_PX + NAME_PX) + 6)

    def block_rects(self) -> Mapping[Key, QRectF]:
        """Rectangle of each block."""
        scale = self._px_per_s()
        found: dict[Key, QRectF] = {}
        for block in self._blocks:
            row = self._people.index(block.person_id)
            top = AXIS_PX + row * (ROW_PX + NAME_PX) + NAME_PX
            left = 6 + block.start_s * scale
            width = max(6.0, (block.end_s - block.start_s) * scale - 2)
            found[block.person_id, block.index] = QRectF(left, top, width, ROW_PX - GAP_PX)
        return found

    def paintEvent(self, event: QPaintEvent) -> None:
        """See Qt."""
        del event
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        self._draw_axis(painter)
        rects = self.block_rects()
        theme = theme_of(self)
        for row, person in enumerate(self._people):
            top = AXIS_PX + row * (ROW_PX + NAME_PX)
            painter.setPen(QColor(theme.text))
            count = sum(block.person_id == person for block in self._blocks)
            name = self._bench.name_of(person)
            words = f"{name}  ·  {count} actions" if count else f"{name}  ·  stands still"
            painter.drawText(8, top + 14, words)
        for block in self._blocks:
            key = (block.person_id, block.index)
            colour = person_colour(self._people.index(block.person_id))
            if key == self._grabbed and self._is_dragging():
                colour.setAlpha(90)
            self._draw_block(painter, block, rects[key], colour)
        if self._grabbed is not None and self._is_dragging():
            self._draw_gap(painter, rects)

    def _draw_axis(self, painter: QPainter) -> None:
        theme, scale = theme_of(self), self._px_per_s()
        step = next(s for s in (1, 2, 5, 10, 20, 60, 120, 600, 3600) if s * scale >= 34)
        for k in range(0, math.floor(self._span_s()) + 1, step):
            x = round(6 + k * scale)
            painter.setPen(QColor(theme.line))
            painter.drawLine(x, AXIS_PX - 4, x, self.height())
            painter.setPen(QColor(theme.faint))
            painter.drawText(x + 3, 14, f"{k} s")
        x = round(6 + self._duration_s * scale)
        painter.fillRect(
            QRectF(x, AXIS_PX - 4, self.width() - x, self.height()), QColor(0, 0, 0, 40)
        )
        painter.setPen(QPen(QColor(theme.bad), 2, Qt.PenStyle.DashLine))
        painter.drawLine(x, AXIS_PX - 4, x, self.height())

    def _draw_block(self, painter: QPainter, block: Block, rect: QRectF, colour: QColor) -> None:
        is_selected = (block.person_id, block.index) == self.selected
        theme = theme_of(self)
        painter.setPen(QPen(QColor(theme.text) if is_selected else colour.darker(130), 2))
        painter.setBrush(colour)
        painter.drawRoundedRect(rect, 4, 4)
        painter.setPen(on(colour))
        inside = rect.adjusted(5, 2, -3, -2)
        metrics = QFontMetricsF(painter.font())
        item_id = getattr(block.action, "object", None)
        seconds = f"{block.end_s - block.start_s:.1f} s"
        what = self._bench.name_of(item_id) if item_id else seconds
        for k, words in enumerate((name_of(block.action).replace("_", " "), what)):
            where = QRectF(inside.left(), inside.top() + 18 * k, inside.width(), 18)
            # A time that is cut says another time; a name that is cut is still a name.
            is_name = k == 0 or bool(item_id)
            if metrics.horizontalAdvance(words) <= inside.width() or (
                is_name and inside.width() > MIN_WORDS_PX
            ):
                line = metrics.elidedText(words, Qt.TextElideMode.ElideRight, inside.width())
                painter.drawText(where, Qt.AlignmentFlag.AlignVCenter, line)

    def _draw_gap(self, painter: QPainter, rects: Mapping[Key, QRectF]) -> None:
        assert self._grabbed is not None
        person, index = self._grabbed
        to = self._target_index()
        rect = rects[person, to]
        x = rect.left() - 1 if to <= index else rect.right() + 1
        painter.setPen(QPen(QColor(theme_of(self).text), 3))
        painter.drawLine(round(x), round(rect.top()) - 3, round(x), round(rect.bottom()) + 3)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Select and take hold."""
        self._grabbed = self._key_at(event.position().toPoint())
        self._pressed = self._at = event.position().toPoint()
        self._select(self._grabbed)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag, or say what is under the pointer."""
        self._at = event.position().toPoint()
        if self._grabbed is not None:
            self.update()
            return
        key = self._key_at(self._at)
        if key is not None:
            block = next(b for b in self._blocks if (b.person_id, b.index) == key)
            item_id = getattr(block.action, "object", None)
            what = f"{self._bench.name_of(item_id)} ({item_id} in texts)" if item_id else ""
            words = f"{key[1] + 1}. {name_of(block.action)} {what}".strip()
            times = f"about {block.start_s:.1f} to {block.end_s:.1f} s"
            QToolTip.showText(event.globalPosition().toPoint(), f"{words}\n{times}", self)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Put it where it was dragged."""
        self._at = event.position().toPoint()
        grabbed, is_dragged = self._grabbed, self._is_dragging()
        to = self._target_index() if grabbed is not None and is_dragged else -1
        self._grabbed = None
        self.update()
        if grabbed is None or not is_dragged or to == grabbed[1]:
            return
        if self._bench.do("scenario.move_action", person=grabbed[0], index=grabbed[1], to=to):
            self._select((grabbed[0], to))

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Open its form."""
        key = self._key_at(event.position().toPoint())
        self._select(key)
        self._edit(key)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Arrows select, with Alt they reorder; Return opens the form, Delete removes."""
        key, left, right = event.key(), Qt.Key.Key_Left, Qt.Key.Key_Right
        keys = sorted(self.block_rects(), key=lambda k: (self._people.index(k[0]), k[1]))
        if self.selected is None:
            self._select(keys[0] if keys else None)
        elif key in (left, right):
            step = 1 if key == right else -1
            if event.modifiers() & Qt.KeyboardModifier.AltModifier:
                person, index = self.selected
                if (person, index + step) in keys:
                    values = {"person": person, "index": index, "to": index + step}
                    self._bench.do("scenario.move_action", **values)
                    self._select((person, index + step))
            else:
                self._select(keys[(keys.index(self.selected) + step) % len(keys)])
        elif key in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self._edit(self.selected)
        elif key in (Qt.Key.Key_Delete, Qt.Key.Key_Backspace):
            self._remove()
        else:
            super().keyPressEvent(event)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """Offer changes of a block, and actions to insert."""
        key = self._key_at(event.pos())
        if key is None:
            return
        self._select(key)
        menu = QMenu(self)
        menu.addAction("Change …", lambda: self._edit(key))
        menu.addAction("Remove", self._remove)
        insert = menu.addMenu("Insert before")
        for do in ACTION_FIELDS:
            values = {"person": key[0], "do": do, "index": key[1]}
            insert.addAction(
                do.replace("_", " "), lambda v=values: self._bench.do("scenario.add_action", **v)
            )
        menu.popup(event.globalPos())

    def _remove(self) -> None:
        if self.selected is not None:
            person, index = self.selected
            self._edit(None)
            self._bench.do("scenario.remove_action", person=person, index=index)

    def _select(self, key: Key | None) -> None:
        self.selected = key
        self.update()

    def _key_at(self, at: QPoint) -> Key | None:
        return next((k for k, rect in self.block_rects().items() if rect.contains(at)), None)

    def _is_dragging(self) -> bool:
        return (self._at - self._pressed).manhattanLength() > 8

    def _target_index(self) -> int:
        assert self._grabbed is not None
        person, index = self._grabbed
        own = {k[1]: r for k, r in self.block_rects().items() if k[0] == person}
        return sum(k != index and rect.center().x() < self._at.x() for k, rect in own.items())

    def _span_s(self) -> float:
        return max([self._duration_s, *(block.end_s for block in self._blocks)])

    def _px_per_s(self) -> float:
        return max(MIN_PX_PER_S, (self.width() - 12) / max(self._span_s(), 0.1))
