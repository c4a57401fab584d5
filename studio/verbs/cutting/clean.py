"""`nexus cut SCENE --clean`: splats that are marked by hand are taken out of the room."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from scenes.package import ScenePackage
from scenes.prepare.cutout.marks.drawn import Drawn, Stroke
from scenes.prepare.cutout.marks.masked_view import MaskedView
from scenes.prepare.cutout.remainder.cleaning import remove_marked
from scenes.render.native import NativeRenderer


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The flags of cleaning by hand."""
    group = parser.add_argument_group(
        "cleaning by hand",
        "Marks in one view take what hangs before the room there; in several views,\n"
        "what lies in all of them. --box marks, too.",
    )
    group.add_argument(
        "--clean", action="store_true", help="remove the splats that are marked from the room"
    )
    group.add_argument(
        "--lasso",
        action="append",
        nargs="+",
        default=[],
        metavar="VIEW X Y",
        help="a view, and the corners of an outline in pixels",
    )
    group.add_argument(
        "--brush",
        action="append",
        nargs="+",
        default=[],
        metavar="VIEW RADIUS X Y",
        help="a view, the radius of a brush and points of its stroke in pixels",
    )


def clean(
    args: argparse.Namespace, package: ScenePackage
) -> tuple[ScenePackage, dict[str, object], list[str]]:
    """The cleaned package, and what is reported of it.

    Raises:
        ValueError: nothing is marked, a mark is none, or it means no splat.
    """
    drawn = drawn_of(args.box, args.lasso, args.brush)
    known = {view.name: view for view in package.views}
    views: list[MaskedView] = []
    for name, marks in drawn.items():
        if name not in known:
            raise ValueError(
                f"scene {package.name!r} has no view {name!r}; 'nexus cut SCENE --views' lists them"
            )
        view = known[name]
        mask = marks.mask(view.camera.width_px, view.camera.height_px)
        views.append(MaskedView(name, view.camera, view.world_from_camera, mask))
    cleaned, count = remove_marked(package, views, renderer=NativeRenderer())
    report: dict[str, object] = {"cleaned": count, "views": [view.name for view in views]}
    return cleaned, report, [f"{args.scene}: {count:,} splats removed that were marked"]


def drawn_of(
    boxes: Sequence[Sequence[str]],
    lassos: Sequence[Sequence[str]],
    brushes: Sequence[Sequence[str]],
) -> dict[str, Drawn]:
    """Marks of the command line, by view.

    Raises:
        ValueError: nothing is marked, a number is none, or coordinates are odd in count.
    """
    found: dict[str, Drawn] = {}
    for view, *words in boxes:
        left, top, right, bottom = _numbers("--box", words)
        before = found.get(view, Drawn())
        found[view] = Drawn((left, top, right, bottom), before.outlines, before.strokes)
    for view, *words in lassos:
        before, outline = found.get(view, Drawn()), _points("--lasso", _numbers("--lasso", words))
        found[view] = Drawn(before.box, (*before.outlines, outline), before.strokes)
    for view, *words in brushes:
        before, (radius, *numbers) = found.get(view, Drawn()), _numbers("--brush", words)
        stroke = Stroke(radius, _points("--brush", numbers))
        found[view] = Drawn(before.box, before.outlines, (*before.strokes, stroke))
    if not found:
        raise ValueError(
            "nexus cut --clean: nothing is marked; give --box, --lasso or --brush in a view or more"
        )
    return found


def _points(flag: str, numbers: Sequence[float]) -> tuple[tuple[float, float], ...]:
    if len(numbers) % 2:
        raise ValueError(f"{flag}: {len(numbers)} numbers, wanted X Y of each point")
    return tuple(zip(numbers[::2], numbers[1::2], strict=True))


def _numbers(flag: str, words: Sequence[str]) -> list[float]:
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if not numbers:
        raise ValueError(f"{flag}: {' '.join(words)!r} are not pixels; wanted numbers")
    return numbers
