"""A cut, or another change of a scene, in a process of its own, on a copy; the old one is kept."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np

from scenes.cameras import Pinhole
from scenes.pose import Pose
from scenes.prepare.cutout.marks.drawn import Point, Stroke
from studio.app.preparation.child import Child

BEFORE, AFTER, PICTURES = "before", "cutting", "cut-pictures"

SHARPENED_M = 0.25
"""Radius in m of what is sharpened around a mark without a box."""


class Change(StrEnum):
    """Changes of a scene by marks in its photos."""

    CUT = "cut"
    CLEAN = "clean"
    SHARPEN = "sharpen"


@dataclass(frozen=True, slots=True)
class Mark:
    """Marks drawn on one photo, pixels.

    Attributes:
        view: name of the photo.
        box: left, top, right, bottom around the whole object, or None.
        clicks: (x, y) on the object.
        outlines: drawn by the lasso, (x, y) of their corners.
        strokes: of the brush.
    """

    view: str
    box: tuple[float, float, float, float] | None = None
    clicks: tuple[Point, ...] = ()
    outlines: tuple[tuple[Point, ...], ...] = ()
    strokes: tuple[Stroke, ...] = ()

    @property
    def is_empty(self) -> bool:
        """Whether nothing was drawn."""
        return self.box is None and not (self.clicks or self.outlines or self.strokes)

    @property
    def around(self) -> tuple[float, float, float, float] | None:
        """A box around the object: the one that was drawn, else around the outlines."""
        corners = [corner for outline in self.outlines for corner in outline]
        if self.box is not None or not corners:
            return self.box
        xs, ys = zip(*corners, strict=True)
        return min(xs), min(ys), max(xs), max(ys)


def clean_words(scene: Path, marks: Sequence[Mark]) -> list[str]:
    """The command line that takes marked splats out of the room.

    Raises:
        ValueError: nothing is marked.
    """
    words = ["cut", str(scene), "--clean", "--json"]
    for mark in marks:
        if mark.box is not None:
            words += ["--box", mark.view, *_written(mark.box)]
        for outline in mark.outlines:
            words += ["--lasso", mark.view, *_written(x for point in outline for x in point)]
        for stroke in mark.strokes:
            numbers = [stroke.radius_px, *(x for point in stroke.points for x in point)]
            words += ["--brush", mark.view, *_written(numbers)]
    if not {"--box", "--lasso", "--brush"} & set(words):
        raise ValueError("nothing is marked: draw around it, or brush over it, in 1 to 3 photos")
    return words


def _written(numbers: Iterable[float]) -> list[str]:
    return [f"{number:.1f}" for number in numbers]


def cut_words(scene: Path, name: str, marks: Sequence[Mark]) -> list[str]:
    """The command line that cuts out what is marked.

    Raises:
        ValueError: nothing is marked, or the object has no name.
    """
    if not name.strip():
        raise ValueError("what is the object called? type a name")
    words = ["cut", str(scene), "--name", name.strip(), "--json"]
    for mark in marks:
        if mark.around is not None:
            words += ["--box", mark.view, *_written(mark.around)]
        on_it = [*mark.clicks, *(point for stroke in mark.strokes for point in stroke.points)]
        if on_it:
            words += ["--click", mark.view, *_written(x for point in on_it for x in point)]
    if all(mark.is_empty for mark in marks):
        raise ValueError("nothing is marked: draw a box around the object in 1 to 3 photos")
    return words


def sharpen_words(copy: Path, name: str, *, marks: Sequence[Mark], scene: Path) -> list[str]:
    """The command line that trains a part of a scene with its photos' own resolution.

    Args:
        copy: the scene that is changed.
        name: of an object; with neither a name nor marks, all objects.
        marks: around a place, which goes before a name.
        scene: the scene that it is a copy of, beside which its photos are known.

    Raises:
        ValueError: nothing is at the place that is marked.
    """
    words = ["refine", str(copy)]
    drawn = next((mark for mark in marks if not mark.is_empty), None)
    if drawn is not None:
        centre, radius_m = marked_place(scene, drawn)
        at = ",".join(f"{value:.3f}" for value in centre)
        words += [f"--at={at}", "--radius", f"{radius_m:.3f}"]
    elif name.strip():
        words.append(name.strip())
    return [*words, "--work", str(scene.with_name(f"{scene.name}.prepare")), "--json"]


def marked_place(scene: Path, mark: Mark) -> tuple[tuple[float, float, float], float]:
    """The place in the room that a mark is on, m, and the radius in m of what it is around.

    Raises:
        ValueError: the scene shows nothing there, or has no such view.
    """
    from scenes.package import load_package
    from scenes.render.native import NativeRenderer
    from scenes.render.renderer import PosedSplats

    package = load_package(scene)
    view = next((view for view in package.views if view.name == mark.view), None)
    if view is None:
        raise ValueError(f"{scene.name}: no view {mark.view!r}: show its views again")
    shown = [PosedSplats(package.room, Pose.identity())]
    shown += [PosedSplats(item.splats, item.world_from_object) for item in package.objects]
    drawn = NativeRenderer().render(shown, view.camera, view.world_from_camera)
    (x, y), size_px = _middle_of(mark)
    row, column = round(y - 0.5), round(x - 0.5)
    height, width = drawn.depth.shape
    depth_m = float(drawn.depth[row, column]) if 0 <= row < height and 0 <= column < width else 0.0
    if depth_m <= 0.0:
        raise ValueError(f"{mark.view}: nothing is at the mark: mark a place on a surface")
    ray, aside = view.camera.unproject([(x, y), (x + 0.5 * size_px, y)])
    # Depth is along the axis of a pinhole, and the range of a fisheye.
    range_m = depth_m / float(ray[2]) if isinstance(view.camera, Pinhole) else depth_m
    centre = view.world_from_camera @ (range_m * ray)
    radius_m = range_m * float(np.linalg.norm(aside - ray)) if size_px > 0.0 else SHARPENED_M
    cx, cy, cz = centre.tolist()
    return (cx, cy, cz), radius_m


def _middle_of(mark: Mark) -> tuple[Point, float]:
    """The middle of a mark, and the longer side of a box around it, px; 0 without one."""
    if mark.around is not None:
        left, top, right, bottom = mark.around
        return (0.5 * (left + right), 0.5 * (top + bottom)), max(right - left, bottom - top)
    points = [*mark.clicks, *(point for stroke in mark.strokes for point in stroke.points)]
    xs, ys = zip(*points, strict=True)
    return (sum(xs) / len(xs), sum(ys) / len(ys)), 0.0


class CutJob:
    """One change of a scene. Started at once; once it has ended well, `take` puts it in place.

    Args:
        scene: folder of the package; read only until `take`.
        name: of the object.
        marks: in its photos.
        change: to be made.

    Raises:
        ValueError: as `cut_words`, `clean_words` and `sharpen_words`.
        OSError: the scene cannot be copied.
    """

    def __init__(
        self, scene: Path, name: str, marks: Sequence[Mark], *, change: Change = Change.CUT
    ) -> None:
        self.scene, self.change = scene, change
        self.pictures = scene.with_name(f"{scene.name}.{PICTURES}")
        self._copy = scene.with_name(f"{scene.name}.{AFTER}")
        match change:
            case Change.CUT:
                words = [*cut_words(self._copy, name, marks), "--preview", str(self.pictures)]
            case Change.CLEAN:
                words = clean_words(self._copy, marks)
            case Change.SHARPEN:
                words = sharpen_words(self._copy, name, marks=marks, scene=scene)
        shutil.rmtree(self._copy, ignore_errors=True)
        shutil.rmtree(self.pictures, ignore_errors=True)
        shutil.copytree(scene, self._copy)
        self._child = Child(words)

    @property
    def is_running(self) -> bool:
        """Whether it is at work."""
        return self._child.is_running

    @property
    def problem(self) -> str:
        """Why nothing was changed, with what to do; empty while it runs and where it went well."""
        if self._child.is_running or self._child.code == 0:
            return ""
        lines = [line for line in self._child.said() if line]
        return "cancelled" if self._child.is_cancelled else (lines or ["nothing was changed"])[-1]

    @property
    def doing(self) -> str:
        """The last line that it said of how far it is; empty before."""
        lines = [line for line in self._child.said() if line]
        return lines[-1] if lines else ""

    @property
    def report(self) -> dict[str, Any]:
        """Figures of `nexus cut --json` or `nexus refine --json`; empty before."""
        try:
            return dict(json.loads(self._child.printed()))
        except ValueError:
            return {}

    def cancel(self) -> None:
        """Ask it to end; the scene is as it was."""
        self._child.cancel()

    def wait(self, limit_s: float) -> bool:
        """Whether it has ended within a time."""
        return self._child.wait(limit_s)

    def take(self) -> Path:
        """Put the changed scene in the scene's place.

        Returns:
            Where the scene before it is kept, byte for byte; `undo` takes it.

        Raises:
            ValueError: it has not ended well.
            OSError: folders cannot be renamed.
        """
        if self.is_running or self._child.code != 0:
            raise ValueError(f"{self.scene}: nothing to take: {self.problem or 'still at work'}")
        number = 1
        while (kept := self.scene.with_name(f"{self.scene.name}.{BEFORE}-{number}")).exists():
            number += 1
        self.scene.rename(kept)
        self._copy.rename(self.scene)
        return kept


def undo(scene: Path, kept: Path) -> None:
    """Put back the scene that `CutJob.take` kept; what was cut since is deleted.

    Raises:
        ValueError: it is not there any more.
        OSError: folders cannot be renamed.
    """
    if not kept.is_dir():
        raise ValueError(f"{kept}: the scene before the cut is gone; it cannot be undone")
    away = scene.with_name(f"{scene.name}.undone")
    shutil.rmtree(away, ignore_errors=True)
    scene.rename(away)
    kept.rename(scene)
    shutil.rmtree(away, ignore_errors=True)
