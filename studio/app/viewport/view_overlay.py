"""Overlay of a view in the window's own pixels: handles, labels, measures, words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QImage, QLinearGradient, QPainter, QPen

from scenes.cameras import Pinhole
from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.state import SceneState, TrackState
from studio.app.model.documents.document import Document
from studio.app.model.names import shown_name
from studio.app.model.workbench import Workbench
from studio.app.viewport.by_hand.dragging import CornerDrag, Drag, HandleDrag, SizeDrag
from studio.app.viewport.by_hand.gizmo import Gizmo, Handle
from studio.app.viewport.by_hand.handles import Handles
from studio.app.viewport.by_hand.items import boxes_of
from studio.app.viewport.by_hand.picking import length_m
from studio.app.viewport.by_hand.tools import InHand, Tool
from studio.app.viewport.drawing.floor_errors import STOPS, FloorErrors
from studio.app.viewport.drawing.shapes import box_edges, pieces
from studio.app.viewport.labels import Wanted, spread
from studio.app.viewport.layers import Layers
from studio.evaluate.scores import SYMMETRY_OF_KIND
from studio.view.overlay import STATE_COLOURS, STATE_WORDS
from studio.view.shared_things import MET, OPEN, attention_rings, met_proposals

BACKDROP = QColor(14, 16, 20)
INK, GROUND = QColor(236, 239, 243), QColor(14, 16, 20, 190)
"""Words over pictures, and what they stand on: both themes' pictures are as bright as the room."""

HANDLES: Mapping[Handle, QColor] = {
    "x": QColor(240, 100, 92),
    "y": QColor(110, 200, 110),
    "z": QColor(96, 160, 245),
    "floor": QColor(245, 210, 90),
    "yaw": QColor(245, 210, 90),
    "tilt_x": QColor(240, 100, 92),
    "tilt_y": QColor(110, 200, 110),
    "size": QColor(245, 210, 90),
    "size_x": QColor(240, 100, 92),
    "size_y": QColor(110, 200, 110),
    "size_z": QColor(96, 160, 245),
}
PICKED = QColor(86, 180, 233)
SCALE_PX = (210, 12)
"""Width and height of the colour scale, pixels."""

NEAREST_M = 0.05
"""Ends of edges that are nearer to the viewer's plane are not drawn, metres."""

STATE_SHAPES = {
    TrackState.STATIC: "○",
    TrackState.TRACKED: "●",
    TrackState.OCCLUDED: "◐",
    TrackState.LOST: "✖",
}
"""A state's shape, beside its colour and word."""


@dataclass(frozen=True, slots=True, eq=False)
class _Label:
    """Words over something, their middle, their colour, and how far it is."""

    text: str
    at: QPointF
    colour: QColor
    depth_m: float


class Overlay:
    """Paints over one picture.

    Args:
        painter: of the widget.
        camera: of the picture, in the widget's pixels.
        world_from_camera: its pose.
    """

    def __init__(self, painter: QPainter, camera: Pinhole, world_from_camera: Pose) -> None:
        self._painter = painter
        self._camera = camera
        self._camera_from_world = world_from_camera.inverse()

    def items(self, bench: Workbench, layers: Layers, *, area: QRectF, hovered: str) -> None:
        """Boxes of what is selected and of what the mouse is over, names, and the scale of errors.

        Args:
            bench: whose items.
            layers: which layers are shown.
            area: of the picture.
            hovered: id of the item under the mouse, or "".
        """
        boxes = boxes_of(bench)
        for item_id, colour in ((hovered, INK), (bench.selection, PICKED)):
            if item_id in boxes:
                self.box(*boxes[item_id], colour)
        if layers.shown.labels:
            people = layers.shown.avatars
            self.label_all(bench.state, bench.document, bench.scene, people=people)
        if layers.shown.avatars and bench.scene is not None:
            self.attention(bench.state, bench.scene)
        if layers.errors is not None:
            self.error_scale(area, layers.errors)

    def attention(self, state: SceneState, scene: ScenePackage) -> None:
        """Light rings around objects that somebody points at."""
        for ring in attention_rings(state, scene.objects):
            places = [self._pixel_ahead(point) for point in ring]
            for pen in (QPen(QColor(0, 0, 0, 150), 6.0), QPen(HANDLES["yaw"], 3.5)):
                self._painter.setPen(pen)
                for first, last in pairwise(places):
                    if first is not None and last is not None:
                        self._painter.drawLine(first, last)

    def handles(self, handles: Handles, *, drag: Drag | None, hovered: Handle | None) -> None:
        """Handles of the selected item, the held or hovered one larger."""
        if handles.gizmo is not None:
            is_held = isinstance(drag, HandleDrag | SizeDrag)
            self.gizmo(handles.gizmo, drag.handle if is_held else hovered)
        if handles.corners is not None:
            held = drag.corner if isinstance(drag, CornerDrag) else None
            self.corners(handles.corners.pixels(), held)

    def label_all(
        self, state: SceneState, document: Document, scene: ScenePackage | None, *, people: bool
    ) -> list[QRectF]:
        """Names of objects that do not rest, with their states, and of people; see `spread`.

        Returns:
            The areas of those that are shown.
        """
        labels = self._objects(state, document, scene)
        if people:
            labels += self._people(state, document, scene)
        labels += self._proposals(state, document=document, scene=scene)
        metrics = self._painter.fontMetrics()
        wanted: list[Wanted] = []
        for label in labels:
            width, height = metrics.horizontalAdvance(label.text) + 10, metrics.height() + 4
            bottom = label.at.y() - metrics.ascent() - 2 + height
            wanted.append(Wanted(label.at.x(), bottom, width, height, label.depth_m))
        areas: list[QRectF] = []
        for place in spread(wanted, self._camera.width_px, self._camera.height_px):
            label, size = labels[place.number], wanted[place.number]
            area = QRectF(place.left_px, place.top_px, size.width_px, size.height_px)
            areas.append(area)
            if place.is_raised:  # a line says whose it is
                self._painter.setPen(QPen(label.colour, 1.0))
                self._painter.drawLine(QPointF(label.at.x(), area.bottom()), label.at)
            left = QPointF(area.left() + 5, area.top() + metrics.ascent() + 2)
            self.words(left, label.text, label.colour)
        return areas

    def _objects(
        self, state: SceneState, document: Document, scene: ScenePackage | None
    ) -> list[_Label]:
        heights = {} if scene is None else {o.object_id: o.box_m[2] for o in scene.objects}
        found: list[_Label] = []
        for key, track in state.objects.items():
            if track.state is TrackState.STATIC:
                continue
            top = track.world_from_object.translation + np.array([0, 0, heights.get(key, 0.3)])
            name = shown_name(key, document, scene)
            text = f"{STATE_SHAPES[track.state]} {name} {STATE_WORDS[track.state]}"
            colour = QColor(*STATE_COLOURS[track.state])
            found += self._labels_at(top, QPointF(0, -10), text, colour)
        return found

    def _people(
        self, state: SceneState, document: Document, scene: ScenePackage | None
    ) -> list[_Label]:
        found: list[_Label] = []
        for key, avatar in state.avatars.items():
            above = avatar.world_from_head.translation + np.array([0, 0, 0.22])
            name = shown_name(key, document, scene, people=state.avatars)
            found += self._labels_at(above, QPointF(), name, INK)
        return found

    def _proposals(
        self, state: SceneState, *, document: Document, scene: ScenePackage | None
    ) -> list[_Label]:
        models = {} if scene is None else {item.object_id: item for item in scene.objects}
        poses = {key: track.world_from_object for key, track in state.objects.items()}
        proposals = state.proposals.values()
        met = met_proposals(proposals, poses, models=models, symmetry_of_kind=SYMMETRY_OF_KIND)
        found: list[_Label] = []
        for each in proposals:
            who = each.user_name or shown_name(each.user_id, document, scene, people=state.avatars)
            what, is_met = shown_name(each.object_id, document, scene), each.proposal_id in met
            text = f"✔ {what} stands as proposed by {who}" if is_met else f"{who}: {what} here"
            height = models[each.object_id].box_m[2] if each.object_id in models else 0.3
            top = each.world_from_object.translation + np.array([0, 0, height + 0.05])
            colour = QColor.fromRgbF(*(MET if is_met else OPEN))
            found += self._labels_at(top, QPointF(0, -6), text, colour)
        return found

    def _labels_at(
        self, point: NDArray[np.float64], shift: QPointF, text: str, colour: QColor
    ) -> list[_Label]:
        """A label at a place; none where that is out of sight."""
        at = self._pixel(point)
        depth_m = float((self._camera_from_world @ point)[2])
        return [] if at is None else [_Label(text, at + shift, colour, depth_m)]

    def box(self, world_from_box: Pose, size_m: tuple[float, float, float], colour: QColor) -> None:
        """Edges of an item's box, in front of everything; those behind the viewer are left out."""
        edges = pieces(box_edges("", size_m, world_from_box).points)
        for pen in (QPen(QColor(0, 0, 0, 150), 4.0), QPen(colour, 2.0)):
            self._painter.setPen(pen)
            for edge in edges:
                for ends in pairwise(edge):
                    first, last = map(self._pixel_ahead, ends)
                    if first is not None and last is not None:
                        self._painter.drawLine(first, last)

    def gizmo(self, gizmo: Gizmo, held: Handle | None) -> None:
        """Handles of the selected item; the one that is held or pointed at is thicker."""
        for handle, line in gizmo.lines().items():
            points = [QPointF(x, y) for x, y in line if np.isfinite((x, y)).all()]
            pen = QPen(QColor(0, 0, 0, 150), 6.0 if handle == held else 4.5)
            self._painter.setPen(pen)
            self._painter.drawPolyline(points)
            self._painter.setPen(QPen(HANDLES[handle], 4.0 if handle == held else 2.5))
            self._painter.drawPolyline(points)
            if not points:
                continue
            end, radius = points[-1], 6.0 if handle == held else 4.5
            self._painter.setBrush(HANDLES[handle])
            if handle in ("x", "y", "z"):
                self._painter.drawEllipse(end, radius, radius)
            elif handle.startswith("size"):  # squares size, as in most programs
                corner = QPointF(radius, radius)
                self._painter.drawRect(QRectF(end - corner, end + corner))
            self._painter.setBrush(Qt.BrushStyle.NoBrush)

    def ring(self, area: QRectF) -> None:
        """A frame that says that keys go to this view."""
        self._painter.setBrush(Qt.BrushStyle.NoBrush)
        self._painter.setPen(QPen(PICKED, 3.0))
        self._painter.drawRect(area.adjusted(1.5, 1.5, -1.5, -1.5))

    def corners(self, pixels: NDArray[np.float64], held: int | None) -> None:
        """Handles (4, 2) of a live surface, the first one square; the held one is larger."""
        for corner, (x, y) in enumerate(pixels):
            if not np.isfinite((x, y)).all():
                continue
            radius = 8.0 if corner == held else 6.0
            area = QRectF(x - radius, y - radius, 2 * radius, 2 * radius)
            self._painter.setPen(QPen(GROUND, 2.0))
            self._painter.setBrush(PICKED if corner == held else INK)
            # The picture's top left differs from the others by its shape, not its colour alone.
            if corner == 0:
                self._painter.drawRect(area)
            else:
                self._painter.drawEllipse(area)
        self._painter.setBrush(Qt.BrushStyle.NoBrush)

    def in_hand(self, hand: InHand) -> None:
        """Places that were picked, and what they measure."""
        pixels = [self._pixel(place) for place in hand.places]
        known = [at for at in pixels if at is not None]
        self._painter.setPen(QPen(QColor(0, 0, 0, 150), 5))
        self._painter.drawPolyline(known)
        self._painter.setPen(QPen(PICKED, 2.5))
        self._painter.drawPolyline(known)
        self._painter.setBrush(PICKED)
        for at in known:
            self._painter.drawEllipse(at, 4.5, 4.5)
        self._painter.setBrush(Qt.BrushStyle.NoBrush)
        if hand.tool is Tool.MEASURE and len(hand.places) > 1 and known:
            self.words(known[-1] + QPointF(10, -8), measure_text(hand.places), INK)

    def error_scale(self, area: QRectF, errors: FloorErrors) -> None:
        """The colours of the errors on the floor, from 0 to the scale's end in metres."""
        title = "mean tracking error"
        width = SCALE_PX[0]
        left, top = area.right() - width - 24, area.bottom() - SCALE_PX[1] - 34
        metrics = self._painter.fontMetrics()
        ground = QRectF(left - 12, top - metrics.height() - 10, width + 24, metrics.height() + 50)
        self._painter.setPen(Qt.PenStyle.NoPen)
        self._painter.setBrush(GROUND)
        self._painter.drawRoundedRect(ground, 4, 4)
        ramp = QLinearGradient(left, 0, left + width, 0)
        for share, colour in zip(np.linspace(0, 1, len(STOPS)), STOPS, strict=True):
            ramp.setColorAt(float(share), QColor.fromRgbF(*colour))
        self._painter.setBrush(ramp)
        self._painter.drawRect(QRectF(left, top, width, SCALE_PX[1]))
        self._painter.setBrush(Qt.BrushStyle.NoBrush)
        self._painter.setPen(INK)
        self._painter.drawText(QPointF(left, top - 6), title)
        below = top + SCALE_PX[1] + metrics.ascent() + 3
        for share in (0.0, 0.5, 1.0):
            text = f"{share * errors.top_m:.3f} m"
            shift = share * metrics.horizontalAdvance(text)
            self._painter.drawText(QPointF(left + share * width - shift, below), text)

    def words(self, at: QPointF, text: str, colour: QColor) -> None:
        """Words on a dark ground, whose left end is at a place."""
        self._painter.setPen(Qt.PenStyle.NoPen)
        self._painter.setBrush(GROUND)
        self._painter.drawRoundedRect(self._ground(at, text), 4, 4)
        self._painter.setBrush(Qt.BrushStyle.NoBrush)
        self._painter.setPen(colour)
        self._painter.drawText(at, text)

    def _ground(self, at: QPointF, text: str) -> QRectF:
        metrics = self._painter.fontMetrics()
        width, height = metrics.horizontalAdvance(text), metrics.height()
        return QRectF(at.x() - 5, at.y() - metrics.ascent() - 2, width + 10, height + 4)

    def _pixel(self, point: NDArray[np.float64]) -> QPointF | None:
        pixels, seen = self._camera.project(self._camera_from_world @ np.atleast_2d(point))
        return QPointF(*pixels[0]) if seen[0] else None

    def _pixel_ahead(self, point: NDArray[np.float64]) -> QPointF | None:
        """As `_pixel`, also of places beside the picture."""
        at = self._camera_from_world @ point
        if at[2] < NEAREST_M:
            return None
        camera = self._camera
        x, y = camera.fx * at[0] / at[2] + camera.cx, camera.fy * at[1] / at[2] + camera.cy
        return QPointF(float(x), float(y))


def why_nothing(bench: Workbench) -> str:
    """Words for a view that has no picture yet."""
    if bench.scene is not None:
        return "drawing …"
    if bench.session is None or bench.session.is_busy:
        return "opening the room …"
    return "no room is open: open one (Ctrl+O), or drop it here"


def measure_text(places: Sequence[NDArray[np.float64]]) -> str:
    """A measured path in metres; of two places also the parts on the floor and up."""
    text = f"{length_m(places):.3f} m"
    if len(places) == 2:
        along = places[1] - places[0]
        text += f"   floor {np.hypot(along[0], along[1]):.3f} m   up {along[2]:+.3f} m"
    return text


def image_of(picture: NDArray[np.uint8]) -> QImage:
    """A picture for Qt, with pixels of its own."""
    rgb = np.ascontiguousarray(picture)
    height, width = rgb.shape[:2]
    return QImage(rgb.data, width, height, 3 * width, QImage.Format.Format_RGB888).copy()
