"""Makes the scans of the built-in rooms: `python -m benchmarks.scan_built_in lab desk`.

A simulated phone films each physical room, `nexus prepare`'s pipeline makes splats of the photos,
and every movable object is cut out with one box in each of three photos, as anybody would do with
a room of their own. Only what comes after uses the truth: an object's frame is made the physical
object's, so that poses of the two can be compared.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
import time
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.evaluate.cutouts import marked, photos_of
from scenes.harmonics import turned
from scenes.mesh import PhysicalObject, PhysicalRoom
from scenes.opening import scan_folder
from scenes.package import ScenePackage, load_package, save_package
from scenes.prepare.cutout.cutout import cut_out
from scenes.prepare.cutout.marks.masks import GrabCutMasks
from scenes.prepare.cutout.marks.prompted_views import masked_views
from scenes.prepare.pipeline import PrepareOptions, prepare
from scenes.prepare.reconstruction import View
from scenes.prepare.stages import open_work_folder
from scenes.render.native import NativeRenderer
from scenes.samples import SAMPLE_NAMES, sample_room
from scenes.state import ObjectModel
from sim.phone.capture import IMAGES
from sim.phone.phone import PhoneOptions, film
from studio.console.progress import Progress, StageProgress, text_progress

WALKS = (
    ("around", PhoneOptions(frames=72)),
    ("near", PhoneOptions(frames=56, path="objects")),
    ("up", PhoneOptions(frames=36, path="up", duration_s=40.0)),
)
"""The room at large, close-ups of what may be moved, and the ceiling."""
STEPS = 4500
"""Of training at the default quality, some three minutes: the same splats on any machine."""

SEED = 2026
"""Decides the walk, the noise and the training."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Film, prepare, cut, and replace the scans that the program comes with."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.scan_built_in", description=__doc__)
    parser.add_argument("rooms", nargs="+", choices=SAMPLE_NAMES)
    parser.add_argument("--work", type=Path, metavar="DIR", help="keep photos and stages here")
    args = parser.parse_args(arguments)
    progress = text_progress()
    for name in args.rooms:
        kept = nullcontext(args.work / name) if args.work else tempfile.TemporaryDirectory()
        with kept as folder:
            scan = scanned(sample_room(name), Path(folder), progress=progress)
        save_package(scan, scan_folder(name), compact=True)


def scanned(room: PhysicalRoom, folder: Path, *, progress: Progress) -> ScenePackage:
    """The scan of a physical room, with all its movable objects cut out.

    Args:
        room: what is filmed.
        folder: gets photos and stages; what it already holds is used again.
        progress: shows how far it has come.
    """
    photos = _filmed(room, folder, progress)
    stages = StageProgress(progress)
    work = open_work_folder(folder / "stages", seconds=time.monotonic, progress=stages)
    renderer = NativeRenderer()
    target = folder / f"{room.name}.gnx"
    options = PrepareOptions(
        steps=STEPS,
        sides_m={code.payload: code.side_m for code in room.codes},
        known_codes=room.codes,
        seed=SEED,
    )
    prepared = prepare(photos, target, work=work, options=options, renderer=renderer)
    stages.finish()
    package = load_package(target)
    progress.begin("cutting out objects")
    for number, item in enumerate(room.objects):
        progress.advance(number / len(room.objects), item.object_id)
        views = prepared.reconstruction.views
        package = _without(package, item, room, views, renderer)
    progress.finish(f"{len(package.objects)} objects")
    save_package(package, target)
    return replace(
        package,
        name=room.name,
        physical=room.name,
        codes=room.codes,
        world_from_rig=room.world_from_rig,
        footprint_m=room.footprint_m,
    )


def _filmed(room: PhysicalRoom, folder: Path, progress: Progress) -> Path:
    """The folder with the photos of all walks."""
    photos = folder / "photos"
    if photos.exists():
        return photos
    together = folder / "photos.part"
    together.mkdir(parents=True, exist_ok=True)
    for walk, options in WALKS:
        progress.begin(f"filming {room.name}, {walk}")
        rng = np.random.default_rng(SEED)
        film(room, folder / walk, rng=rng, options=options, progress=progress.advance)
        for image in sorted((folder / walk / IMAGES).iterdir()):
            shutil.copyfile(image, together / f"{walk}-{image.name}")
        progress.finish(f"{options.frames} photos")
    return together.rename(photos)


def _without(
    package: ScenePackage,
    item: PhysicalObject,
    room: PhysicalRoom,
    views: tuple[View, ...],
    renderer: NativeRenderer,
) -> ScenePackage:
    """The package after one object was cut out."""
    prompted = [marked(view, outline) for view, outline in photos_of(item, room, views)]
    masked = masked_views(package.room, prompted, masks=GrabCutMasks(), renderer=renderer)
    cut = cut_out(
        package,
        masked,
        object_id=item.object_id,
        name=item.object_id.replace("-", " ").capitalize(),
        kind=item.kind,
        renderer=renderer,
    ).package
    *others, made = cut.objects
    return replace(cut, objects=(*others, _in_frame_of(made, item)))


def _in_frame_of(made: ObjectModel, item: PhysicalObject) -> ObjectModel:
    """The same splats and parts at the same place, in the physical object's frame.

    The box keeps its extents, each along the axis of the new frame that is nearest.
    """
    item_from_made = item.world_from_object.inverse() @ made.world_from_object
    x, y, z = made.box_m
    crosswise = abs(item_from_made.rotation[0, 1]) > abs(item_from_made.rotation[0, 0])
    return replace(
        made,
        splats=turned(made.splats, item_from_made),
        box_m=(y, x, z) if crosswise else (x, y, z),
        parts=tuple(
            replace(part, object_from_box=item_from_made @ part.object_from_box)
            for part in made.parts
        ),
        support_z_m=float(item.world_from_object.translation[2]),
        world_from_object=item.world_from_object,
    )


if __name__ == "__main__":
    main()
