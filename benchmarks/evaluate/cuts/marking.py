"""How a careful person marks an object: in which photos, with which boxes, where the click goes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.evaluate.cutouts import MIN_SHARE, from_different_sides, padded_box
from benchmarks.evaluate.cuts.captures import Capture, TrueObject
from scenes.cameras import Pinhole, pixel_centres
from scenes.prepare.cutout.marks.masks import Prompt
from scenes.prepare.cutout.marks.prompted_views import PromptedView
from scenes.prepare.reconstruction import View, read_picture
from scenes.rays import RayScene

FloatArray = NDArray[np.float64]

COARSER = 4
"""Photos are chosen on pictures so many times smaller."""

LESS_SHARE = 0.4
"""Of an object: a photo has to show so much of it where none shows most of it."""

MIN_SEEN_PX = 300
"""Of an object in sight, in the photo's pixels: what is smaller, people film again."""

WAYS: Mapping[str, int] = {"click": 1, "one_box": 1, "two_boxes": 2, "three_boxes": 3}
"""Ways of marking, and in how many photos."""

KEPT = "marks.json"
"""Beside a capture: choosing the photos takes a minute."""


@dataclass(frozen=True, slots=True)
class Mark:
    """Marks on one object in one photo.

    Attributes:
        photo: its name.
        box_px: (left, top, right, bottom) around the visible outline, padded as by hand.
        click_px: the middle of the largest circle within that outline.
    """

    photo: str
    box_px: tuple[float, float, float, float]
    click_px: tuple[float, float]


def marks_of(capture: Capture) -> dict[str, tuple[Mark, ...]]:
    """Marks in up to three photos by object, the best photo first; none where no photo shows it."""
    path, key = capture.folder / KEPT, _key(capture)
    if path.is_file():
        kept = json.loads(path.read_text(encoding="utf-8"))
        if kept["key"] == key:
            return {
                name: tuple(
                    Mark(m["photo"], tuple(m["box_px"]), tuple(m["click_px"])) for m in marks
                )
                for name, marks in kept["marks"].items()
            }
    found = _found(capture)
    plain = {name: [asdict(mark) for mark in marks] for name, marks in found.items()}
    path.write_text(json.dumps({"key": key, "marks": plain}, indent=1), encoding="utf-8")
    return found


def prompted(capture: Capture, marks: Sequence[Mark], *, way: str) -> tuple[PromptedView, ...]:
    """The marked photos of one way of marking; fewer where fewer photos show the object.

    Args:
        capture: whose photos.
        marks: of one object.
        way: one of `WAYS`.
    """
    views = {view.name: view for view in capture.photos}
    made = []
    for mark in marks[: WAYS[way]]:
        view = views[mark.photo]
        prompt = (
            Prompt(inside_px=np.array([mark.click_px]))
            if way == "click"
            else Prompt(box_px=mark.box_px)
        )
        made.append(
            PromptedView(view.name, view.camera, view.world_from_camera, prompt, read_picture(view))
        )
    return tuple(made)


def _found(capture: Capture) -> dict[str, tuple[Mark, ...]]:
    alone = [RayScene(item.triangles) for item in capture.objects]
    parts = capture.parts
    owner = np.repeat(np.arange(len(parts)) - 1, [len(part) for part in parts])
    whole_scene = _Owned(RayScene(np.concatenate(parts)), owner)
    ranked: list[list[tuple[int, int, float, View]]] = [[] for _ in alone]
    for view in capture.photos:
        if not isinstance(view.camera, Pinhole):
            continue
        small = replace(view, camera=smaller(view.camera, COARSER))
        shown = whole_scene.owners(small)
        for number, scene in enumerate(alone):
            rank = _rank(_outline(small, scene), shown == number)
            if rank is not None:
                turn = _turn(view, capture.objects[number])
                ranked[number].append((*rank, turn, view))
    marks: dict[str, tuple[Mark, ...]] = {}
    for number, item in enumerate(capture.objects):
        best = sorted(ranked[number], key=lambda entry: entry[:2])
        chosen = [best[k][3] for k in from_different_sides([turn for _, _, turn, _ in best])]
        outlines = [(view, whole_scene.owners(view) == number) for view in chosen]
        marks[item.object_id] = tuple(_mark(view, seen) for view, seen in outlines if seen.any())
    return marks


@dataclass(frozen=True, slots=True, eq=False)
class _Owned:
    """A scene whose triangles have owners."""

    scene: RayScene
    owner: NDArray[np.intp]

    def owners(self, view: View) -> NDArray[np.intp]:
        """(H, W) whose surface each pixel shows; -1 for what never moves and for nothing."""
        hit = _cast(view, self.scene)
        shape = view.camera.height_px, view.camera.width_px
        return np.where(hit >= 0, self.owner[np.maximum(hit, 0)], -1).reshape(shape)


def _outline(view: View, scene: RayScene) -> NDArray[np.bool_]:
    """(H, W) where an object would be seen if it were alone."""
    return (_cast(view, scene) >= 0).reshape(view.camera.height_px, view.camera.width_px)


def _cast(view: View, scene: RayScene) -> NDArray[np.int64]:
    """(H · W,) the triangle of each pixel, -1 for none."""
    rays = view.camera.unproject(pixel_centres(view.camera)) @ view.world_from_camera.rotation.T
    eyes = np.broadcast_to(view.world_from_camera.translation, rays.shape)
    return scene.cast(eyes, rays).triangle


def _rank(whole: NDArray[np.bool_], seen: NDArray[np.bool_]) -> tuple[int, int] | None:
    """How good a photo is for marking, the least the best; None if it shows too little.

    Whole and mostly in sight, then hidden by half, then at the photo's edge; the larger first.
    """
    share = seen.sum() / max(whole.sum(), 1)
    if share < LESS_SHARE or COARSER**2 * seen.sum() < MIN_SEEN_PX:
        return None
    at_edge = whole[0].any() or whole[-1].any() or whole[:, 0].any() or whole[:, -1].any()
    kind = 2 if at_edge else int(share < MIN_SHARE)
    return kind, -int(seen.sum())


def _turn(view: View, item: TrueObject) -> float:
    """From which direction a photo looks at an object, seen from above."""
    eye = view.world_from_camera.translation - item.middle
    return float(np.arctan2(eye[1], eye[0]))


def _mark(view: View, outline: NDArray[np.bool_]) -> Mark:
    # The picture's edge ends an outline, too.
    inner = cv2.distanceTransform(np.pad(outline, 1).astype(np.uint8), cv2.DIST_L2, 5)
    row, column = np.unravel_index(int(np.argmax(inner)), inner.shape)
    return Mark(view.name, padded_box(outline), (float(column) - 0.5, float(row) - 0.5))


def smaller(camera: Pinhole, times: int) -> Pinhole:
    """The camera of a picture that is so many times smaller each way."""
    width, height = camera.width_px // times, camera.height_px // times
    across, down = width / camera.width_px, height / camera.height_px
    return Pinhole(
        width,
        height,
        camera.fx * across,
        camera.fy * down,
        camera.cx * across,
        camera.cy * down,
    )


def _key(capture: Capture) -> str:
    """Of the photos' poses, the meshes and the code."""
    digest = hashlib.sha256(Path(__file__).read_bytes())
    for view in capture.photos:
        digest.update(np.round(view.world_from_camera.matrix(), 6).tobytes())
    for part in capture.parts:
        digest.update(np.round(part, 6).tobytes())
    return digest.hexdigest()
