"""One picture of a film: what a view shows, drawn in full at the film's size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray
from PySide6.QtGui import QFont, QImage, QPainter

from scenes.bodies.crowd import Crowd
from scenes.cameras import Pinhole
from scenes.package import ScenePackage
from studio.app.film.moments import Moment
from studio.app.film.plan import FilmPlan
from studio.app.model.documents.document import Document
from studio.app.model.names import CAMERA
from studio.app.viewport.drawing.scene_drawing import SceneDrawing
from studio.app.viewport.drawing.shapes import Shape, Shown, shapes_of
from studio.app.viewport.drawing.view_memory import ViewMemory
from studio.app.viewport.drawing.view_picture import View, draw_view
from studio.app.viewport.insets.sources import eyes_of
from studio.app.viewport.seen_twin import FIELD_OF_VIEW
from studio.app.viewport.view_overlay import Overlay, image_of

BACKDROP = (14, 16, 20)
"""Of what has no picture: the view's own."""

TEXT_SHARE = 1 / 40
"""Height of letters over the picture's: 18 pixels at 720, as in a window of that height."""


@dataclass(frozen=True, slots=True, eq=False)
class FilmSet:
    """Drawing, document and layers that all pictures of a film share.

    Attributes:
        drawing: of the scene.
        document: with names, and what was added by hand.
        shown: which layers.
        layers: shapes of the layers that take a while to make.
        crowd: people from picture to picture.
        memory: what stays as it is from picture to picture; None keeps nothing.
    """

    drawing: SceneDrawing
    document: Document
    shown: Shown
    layers: Sequence[Shape] = ()
    crowd: Crowd = field(default_factory=Crowd)
    memory: ViewMemory | None = None

    @property
    def scene(self) -> ScenePackage:
        """The scene that is filmed."""
        return self.drawing.scene


def film_picture(made_of: FilmSet, plan: FilmPlan, moment: Moment) -> NDArray[np.uint8]:
    """(height, width, 3) RGB; may be called from any thread, from one at a time.

    A view has its labels; an instant at which whoever sees it is away is dark.
    """
    width, height = plan.width_px, plan.height_px
    if plan.source == CAMERA:
        return _fitted(moment.camera_picture, width, height)
    eyes = moment.world_from_camera or plan.world_from_camera
    if plan.source:
        eyes = eyes_of(plan.source, moment.state, made_of.document, made_of.scene)
    if eyes is None:
        return _fitted(None, width, height)
    made_of.crowd.furniture = made_of.drawing.furniture
    shapes = shapes_of(
        moment.state,
        shown=made_of.shown,
        twin=made_of.document.twin,
        world_from_rig=moment.state.world_from_rig or made_of.scene.world_from_rig,
        seen_by=plan.source,
        crowd=made_of.crowd,
    )
    camera = Pinhole.from_fov(width, height, FIELD_OF_VIEW)
    seen = (*shapes, *(made_of.layers if not plan.source else ()))
    view = View(moment.state, camera, eyes, moment.live, seen, seen_by=plan.source)
    picture, _ = draw_view(made_of.drawing, view, memory=made_of.memory)
    if plan.source or not made_of.shown.labels:
        return picture
    return _labelled(picture, view, made_of)


def _labelled(picture: NDArray[np.uint8], view: View, made_of: FilmSet) -> NDArray[np.uint8]:
    image = image_of(picture)
    painter = QPainter(image)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    font = QFont(painter.font())
    font.setPixelSize(max(9, round(TEXT_SHARE * image.height())))
    painter.setFont(font)
    overlay = Overlay(painter, view.camera, view.world_from_camera)
    overlay.label_all(view.state, made_of.document, made_of.scene, people=made_of.shown.avatars)
    painter.end()
    return pixels_of(image)


def _fitted(picture: NDArray[np.uint8] | None, width: int, height: int) -> NDArray[np.uint8]:
    """A picture as large as it fits, in the middle."""
    whole = np.empty((height, width, 3), np.uint8)
    whole[:] = BACKDROP
    if picture is None:
        return whole
    scale = min(width / picture.shape[1], height / picture.shape[0])
    wide = max(1, round(scale * picture.shape[1]))
    tall = max(1, round(scale * picture.shape[0]))
    how = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
    left, top = (width - wide) // 2, (height - tall) // 2
    whole[top : top + tall, left : left + wide] = cv2.resize(
        picture, (wide, tall), interpolation=how
    )
    return whole


def pixels_of(image: QImage) -> NDArray[np.uint8]:
    """(H, W, 3) RGB of a picture of Qt's."""
    rgb = image.convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(rgb.constBits(), np.uint8).reshape(rgb.height(), rgb.bytesPerLine())
    return rows[:, : 3 * rgb.width()].reshape(rgb.height(), rgb.width(), 3).copy()
