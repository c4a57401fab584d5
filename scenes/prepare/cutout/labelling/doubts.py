"""Doubts about marks: what they hold is no object, half of one, or more than one.

Where nothing is cut an error says so; where something is, a person reads a line beside the result.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.prepare.cutout.connected_bodies import bodies
from scenes.prepare.cutout.labelling.ending_bodies import GAP, TOUCHING
from scenes.prepare.cutout.labelling.graph_cut import Links
from scenes.prepare.cutout.labelling.surface_cells import SurfaceCells
from scenes.prepare.cutout.votes.silhouettes import in_box

BoolArray = NDArray[np.bool_]
FloatArray = NDArray[np.float64]
Box = tuple[float, float, float, float]

FILLED = 0.1
"""Share of a box's pixels that an object covers, at least, where it covers most: fewer are scraps.
Measured: 0.28 and more of 21 objects of three rooms, 0.14 of a ball of 146 cells; less than 0.1 in
every third box around nothing. Of 59 objects of eight rooms it refuses a cushion that is all but
hidden (0.03), unless somebody clicks on it, too."""

GRID = 40
"""Cells along a box's side, in which what an object covers is counted."""

FLAT, OPEN = 0.25, 0.075
"""Share of what was found that lies in a flat patch which goes on outside the boxes, and links that
lead out of them per cell: with more of both it is a part of a floor or a table, or half of
something flat. Measured: 0.12 and less of objects that were cut with an IoU above 0.85, and 0.02;
0.25 to 0.74 and 0.08 to 0.36 of half a book, mug, laptop or cereal box."""

EMPTY = 0.35
"""Share of a box beside its edge in which nothing was found, and a part may be missing. Measured:
0.32 and less of whole objects, 0.51 of a lamp without its foot."""

OTHER, MIN_OTHER = 0.25, 50
"""Of the object's cells, and so many cells: a body beside it that is larger is something else, not
a scrap of it."""

FEW_PHOTOS = 2
"""Photos that show an object, at most, whose depth is a guess."""


@dataclass(frozen=True, slots=True, eq=False)
class Boxed:
    """A box around an object in one view.

    Attributes:
        name: of the view.
        camera: its lens.
        world_from_camera: its pose.
        box_px: left, top, right, bottom.
        slack: share of its size by which what is inside may lie beside it.
    """

    name: str
    camera: Pinhole | Fisheye
    world_from_camera: Pose
    box_px: Box
    slack: float

    def pixels(self, points: FloatArray) -> FloatArray:
        """(N, 2) px of world points."""
        return self.camera.project(self.world_from_camera.inverse() @ points)[0]

    def holds(self, points: FloatArray) -> BoolArray:
        """(N,) whether world points fall into it."""
        pose = self.world_from_camera
        return in_box(points, self.camera, pose, self.box_px, self.slack)


@dataclass(frozen=True, slots=True, eq=False)
class Labelled:
    """Cells of an object, and what was known of them when they were found.

    Attributes:
        labels: (N,) the object's.
        held: (N,) those that least energy gave it: the object's, and bodies that were left out.
        flat: (N,) how sure it is that a cell's flat patch goes on outside the boxes, 0..1.
        inside: (N,) those inside all boxes.
        sure: (N,) those at a stroke that somebody drew.
        openness: links that lead out of the boxes, per cell.
        links: between cells.
    """

    labels: BoolArray
    held: BoolArray
    flat: FloatArray
    inside: BoolArray
    sure: BoolArray
    openness: float
    links: Links

    @property
    def goes_on(self) -> bool:
        """Whether it leaves the boxes."""
        return self.openness > TOUCHING


def require_object(cells: SurfaceCells, found: Labelled, *, boxed: Sequence[Boxed]) -> None:
    """Check that what was found fills its boxes, and is more than a piece of something flat.

    Raises:
        ValueError: it does not; says in which views.
    """
    places = cells.places[found.labels]
    if max(_filled(places, box, side_m=cells.side_m) for box in boxed) < FILLED:
        raise ValueError(
            f"there is no object in {_boxes(boxed)}, or hardly anything of it was found; draw each "
            "box around one whole object, and click on it as well if there is one"
        )
    if found.openness > OPEN and float(found.flat[found.labels].mean()) > FLAT:
        where = _where_it_goes_on(cells, found, boxed=boxed)
        raise ValueError(
            f"what is drawn in {_boxes(boxed)} lies flat and goes on beyond {where}: there is no "
            "object, or the box is around half of one; draw it around one whole object"
        )


def require_meeting(points: Sequence[FloatArray], boxed: Sequence[Boxed]) -> FloatArray:
    """(K, 3) of what is drawn inside each box, those points that all boxes hold.

    Raises:
        ValueError: there are none; says which boxes are around different places, and how far apart
            these are.
    """
    bare = [box.name for box, drawn in zip(boxed, points, strict=True) if not len(drawn)]
    if bare:
        raise ValueError(
            f"nothing is drawn inside the box in {', '.join(bare)}: no photo shows a surface "
            "there; draw it around the object in a photo that shows it"
        )
    every = np.concatenate(points)
    held = every[np.logical_and.reduce([box.holds(every) for box in boxed])]
    if len(held):
        return held
    middles = np.stack([np.median(drawn, axis=0) for drawn in points])
    apart = np.linalg.norm(middles[:, None] - middles, axis=2)
    first, second = divmod(int(np.argmax(apart)), len(boxed))
    raise ValueError(
        f"the boxes in {boxed[first].name} and {boxed[second].name} are around different places, "
        f"{apart.max():.2f} m apart; draw both around the same object, and if it was moved between "
        "these photos, take photos of before or of after alone"
    )


def doubts(
    cells: SurfaceCells, found: Labelled, *, boxed: Sequence[Boxed], other: FloatArray | None
) -> tuple[str, ...]:
    """Sentences about an object that may be none of what was meant; none where all is well.

    Args:
        cells: around the object.
        found: the object.
        boxed: its boxes.
        other: (3,) the middle of something else in them, as `something_else` found it.
    """
    notes: list[str] = []
    if found.goes_on:
        where = _where_it_goes_on(cells, found, boxed=boxed)
        notes.append(f"it goes on beyond {where}; draw that box around all of it")
    notes += _empty_part(cells.places[found.labels], boxed)
    if other is not None and boxed[0].holds(other[None]).all():
        x, y = boxed[0].pixels(other[None])[0]
        notes.append(
            f"something else is in {_boxes(boxed)}, around {x:.0f}, {y:.0f} px in "
            f"{boxed[0].name}, and was left out; draw a box around each alone"
        )
    photos = int(np.percentile(cells.seen_by[found.labels], 90))
    if photos <= FEW_PHOTOS:
        how_many = "one photo shows" if photos == 1 else f"{photos} photos show"
        notes.append(
            f"only {how_many} it, so that its depth is a guess; take some more from its left and "
            "its right, and prepare the room again"
        )
    return tuple(notes)


def something_else(cells: SurfaceCells, found: Labelled) -> FloatArray | None:
    """(3,) the middle of the largest body in the boxes that was left out; None of scraps."""
    left_out = np.flatnonzero(found.held & ~found.labels & (found.flat < 0.5))
    if not len(left_out):
        return None
    count, body = bodies(cells.places[left_out], GAP * cells.side_m)
    sizes = np.bincount(body, minlength=count)
    largest = int(np.argmax(sizes))
    if sizes[largest] < max(OTHER * found.labels.sum(), MIN_OTHER):
        return None
    return np.asarray(np.median(cells.places[left_out[body == largest]], axis=0))


def _where_it_goes_on(cells: SurfaceCells, found: Labelled, *, boxed: Sequence[Boxed]) -> str:
    """The edge of the box that lies within the object, in words."""
    first, second, _ = found.links
    inner, outer = np.concatenate([first, second]), np.concatenate([second, first])
    beyond = cells.places[outer[found.labels[inner] & ~found.inside[outer]]]
    outside = [beyond[~box.holds(beyond)] for box in boxed]
    worst = int(np.argmax([len(places) for places in outside]))
    box = boxed[worst]
    left, top, right, bottom = box.box_px
    x, y = box.pixels(outside[worst]).T
    past = {"left": x < left, "right": x > right, "upper": y < top, "lower": y > bottom}
    edge = max(past, key=lambda name: int(past[name].sum()))
    return f"the {edge} edge of the box in {box.name}"


def _filled(places: FloatArray, box: Boxed, *, side_m: float) -> float:
    """Share of a box that cells cover."""
    low, size, _ = _shown(box)
    in_camera = box.world_from_camera.inverse() @ places
    away = float(np.median(np.linalg.norm(in_camera, axis=1)))
    pixels = (box.pixels(places) - low) / size * GRID
    # A cell is as wide as its side; the finer grid would count holes between cells.
    radius = np.maximum(0.5 * side_m / away * _focal_px(box) / size * GRID, 0.5)
    covered = np.zeros((GRID, GRID), dtype=bool)
    start = np.clip(np.floor(pixels - radius + 0.5), 0, GRID).astype(int)
    stop = np.clip(np.floor(pixels + radius + 0.5), 0, GRID).astype(int)
    for (x0, y0), (x1, y1) in zip(start, stop, strict=True):
        covered[y0:y1, x0:x1] = True
    return float(covered.mean())


def _focal_px(box: Boxed) -> float:
    """Pixels per radian in a box's middle."""
    middle = np.mean([box.box_px[:2], box.box_px[2:]], axis=0)
    rays = box.camera.unproject(np.stack([middle, middle + np.array([1.0, 0.0])]))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    return 1.0 / max(float(np.arccos(np.clip(rays[0] @ rays[1], -1.0, 1.0))), 1e-6)


def _empty_part(places: FloatArray, boxed: Sequence[Boxed]) -> list[str]:
    """A sentence of the box that is emptiest beside one of its edges, if it is."""
    most, note = EMPTY, ""
    for box in boxed:
        low, size, is_open = _shown(box)
        near, far = np.percentile(box.pixels(places), (1, 99), axis=0)
        gaps = [*((near - low) / size), *((low + size - far) / size)]
        for edge, gap, opens in zip(
            ("left", "upper", "right", "lower"), gaps, is_open, strict=True
        ):
            if gap > most and not opens:
                most = float(gap)
                note = (
                    f"nothing of it was found in the {edge} {gap:.0%} of the box in {box.name}: a "
                    "part may be missing; click on that part there as well, or draw the box closer"
                )
    return [note] if note else []


def _shown(box: Boxed) -> tuple[FloatArray, FloatArray, tuple[bool, ...]]:
    """(2,) left and top of a box within its picture, (2,) its size, and edges at the border."""
    whole = np.array([box.camera.width_px, box.camera.height_px], dtype=np.float64)
    low = np.clip(box.box_px[:2], 0.0, whole - 1)
    high = np.clip(box.box_px[2:], low + 1, whole)
    at_border = (*(low <= 1), *(high >= whole - 1))
    return low, high - low, tuple(bool(edge) for edge in at_border)


def _boxes(boxed: Sequence[Boxed]) -> str:
    names = ", ".join(box.name for box in boxed)
    return f"the boxes in {names}" if len(boxed) > 1 else f"the box in {names}"
