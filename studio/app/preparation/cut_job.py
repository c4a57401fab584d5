"""A cut in a process of its own, on a copy of the scene; the scene before it stays beside it."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scenes.prepare.cutout.marks.drawn import Point, Stroke
from studio.app.preparation.child import Child

BEFORE, AFTER, PICTURES = "before", "cutting", "cut-pictures"


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


class CutJob:
    """One cut, or one cleaning. Started at once; once it has ended well, `take` puts it in place.

    Args:
        scene: folder of the package; read only until `take`.
        name: of the object.
        marks: in its photos.
        cleans: whether what is marked is removed, and no object made of it.

    Raises:
        ValueError: as `cut_words` and `clean_words`.
        OSError: the scene cannot be copied.
    """

    def __init__(
        self, scene: Path, name: str, marks: Sequence[Mark], *, cleans: bool = False
    ) -> None:
        self.scene = scene
        self.pictures = scene.with_name(f"{scene.name}.{PICTURES}")
        self._copy = scene.with_name(f"{scene.name}.{AFTER}")
        words = clean_words(self._copy, marks) if cleans else cut_words(self._copy, name, marks)
        shutil.rmtree(self._copy, ignore_errors=True)
        shutil.rmtree(self.pictures, ignore_errors=True)
        shutil.copytree(scene, self._copy)
        self._child = Child(words if cleans else [*words, "--preview", str(self.pictures)])

    @property
    def is_running(self) -> bool:
        """Whether it is at work."""
        return self._child.is_running

    @property
    def problem(self) -> str:
        """Why nothing was cut, with what to do; empty while it runs and where it went well."""
        if self._child.is_running or self._child.code == 0:
            return ""
        lines = [line for line in self._child.said() if line]
        return "cancelled" if self._child.is_cancelled else (lines or ["nothing was cut"])[-1]

    @property
    def report(self) -> dict[str, Any]:
        """Figures of `nexus cut --json`: splats, floaters removed, size; empty before."""
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
        """Put the cut scene in the scene's place.

        Returns:
            Where the scene before the cut is kept, byte for byte; `undo` takes it.

        Raises:
            ValueError: it has not ended well.
            OSError: folders cannot be renamed.
        """
        if self.is_running or self._child.code != 0:
            raise ValueError(f"{self.scene}: nothing to take: {self.problem or 'still cutting'}")
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
