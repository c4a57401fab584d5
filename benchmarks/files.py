"""`nexus bench files`: small files as people bring them, and whether each comes out right."""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np

from studio.console.rows import Row, as_json, as_table, at_least, exit_code

CASES = Path(__file__).parents[1] / "tests" / "data" / "cases"
MAX_POSE_ERROR_PX = 1.0
"""Median reprojection error: 0.4 px where lens and pixels belong to the poses, 1.6 and more where
the lens is read as another or the pictures are turned."""
MAX_SDR_DIFFERENCE = 3.0
"""Grey levels between an HDR film and the same scene in standard range, on average."""

Check = tuple[str, Callable[[Path], bool]]
"""The name of a case, and whether it comes out right; the folder is for what that takes."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's flags."""
    parser.add_argument(
        "--cases", type=Path, default=CASES, metavar="DIR", help="folders of cases (the tests')"
    )
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(args: argparse.Namespace) -> int:
    """Try every case; exit 1 if one comes out wrong."""
    if not args.cases.is_dir():
        raise ValueError(f"{args.cases}: no such folder of cases; give one with --cases")
    rows = measure_files(args.cases)
    print(json.dumps(as_json("bench files", rows, None), indent=2) if args.json else as_table(rows))
    return exit_code(rows)


def measure_files(cases: Path) -> list[Row]:
    """How many cases there are, and how many come out right; wrong ones are named on stderr."""
    count = right = 0
    for name, check in _checks(cases):
        count += 1
        with tempfile.TemporaryDirectory() as folder:
            try:
                is_right, why = check(Path(folder)), "came out wrong"
            except (ValueError, OSError) as error:
                is_right, why = False, str(error)
        right += is_right
        if not is_right:
            print(f"{name}: {why}", file=sys.stderr)
    return [Row("files.cases", count, ""), at_least("files.right", right, "", bar=max(count, 1))]


def _checks(cases: Path) -> Iterator[Check]:
    """Every case in the folder, by what kind its files are."""
    for folder in sorted(path for path in cases.iterdir() if path.is_dir()):
        for suffix, checks in _BY_SUFFIX.items():
            for file in sorted(folder.glob(f"*{suffix}")):
                yield f"{folder.name}/{file.name}", _bound(checks, file)
        if (folder / "sparse").is_dir():
            yield folder.name, _bound(_poses_fit, folder)
        elif not any(folder.glob("*.json")) and any(folder.glob("*.[jJ][pP]*")):
            yield folder.name, _bound(_photos_are_accounted_for, folder)


def _bound(check: Callable[[Path, Path], bool], file: Path) -> Callable[[Path], bool]:
    return lambda work: check(file, work)


def _poses_fit(poses: Path, work: Path) -> bool:
    """Poses of elsewhere belong to the pixels: all photos used or named, and points agree."""
    from scenes.prepare.poses.given_poses import import_poses
    from scenes.prepare.reconstruction import read_picture

    pictures = (poses if poses.is_dir() else poses.parent) / "images"
    found = import_poses(poses, pictures, work)
    if poses.is_dir():
        mode = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
        for view in found.views:
            stored = np.asarray(cv2.imread(str(pictures / view.name), mode))
            seen = cv2.resize(read_picture(view)[..., ::-1], stored.shape[1::-1])
            if np.abs(seen.astype(int) - stored).mean() > 10:
                return False
    return float(np.median(found.errors_px)) <= MAX_POSE_ERROR_PX


def _photos_are_accounted_for(folder: Path, work: Path) -> bool:
    """Every file is a frame of its own name, or named among those that are not used."""
    from scenes.prepare.footage.gather import gather

    capture = gather(folder, work)
    names = {frame.name.casefold() for frame in capture.frames}
    files = {file.name for file in folder.iterdir()}
    named = {frame.source for frame in capture.frames} | {r.source for r in capture.rejected}
    return len(names) == len(capture.frames) and files == named


def _splats_are_read(file: Path, work: Path) -> bool:
    """Good splats are read and bad ones counted; a file that is mostly bad is refused."""
    from scenes.formats.registry import read_splat_file
    from scenes.formats.storage.bad_rows import MAX_BAD_SHARE
    from scenes.formats.storage.error import FormatError

    splats = read_splat_file(file)
    try:
        read = sum(len(block) for block in splats.blocks)
    except FormatError:
        return splats.bad.count > MAX_BAD_SHARE * splats.count
    return 0 < read == splats.count - splats.bad.count


def _recording_is_read(file: Path, work: Path) -> bool:
    from devices.recording import read_recording

    return sum(1 for _ in read_recording(file)) > 0


def _film_is_read(file: Path, work: Path) -> bool:
    """A 360° film gives flat views; one in HDR looks like its control in standard range."""
    from scenes.prepare.footage.capture import CaptureKind, CaptureOptions
    from scenes.prepare.footage.gather import gather

    options = CaptureOptions(frames=24)
    capture = gather(file, work / "a", options=options)
    if "equirectangular" in file.name:
        return capture.kind is CaptureKind.PANORAMA and bool(capture.notes)
    control = file.with_name("control_sdr.mov")
    if not control.is_file() or control == file:
        return bool(capture.frames)
    other = gather(control, work / "b", options=options)

    def levels(folder: Path) -> np.ndarray:
        pictures = [np.asarray(cv2.imread(str(path))) for path in sorted(folder.glob("*.jpg"))]
        return np.mean([picture.mean(axis=(0, 1)) for picture in pictures], axis=0)

    difference = np.abs(levels(capture.folder) - levels(other.folder)).max()
    return float(difference) <= MAX_SDR_DIFFERENCE


def _mesh_is_laid(file: Path, work: Path) -> bool:
    """A headset's mesh of the built-in lab lies on it, mirrored in its file or not."""
    from scenes.formats.mesh_glb import read_mesh
    from scenes.mesh import CollisionMesh
    from scenes.prepare.headset_mesh import place_mesh
    from scenes.samples import sample_room

    meshes = sample_room("lab").static
    counts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    lab = CollisionMesh(
        np.concatenate([mesh.vertices for mesh in meshes]).astype(np.float32),
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, counts, strict=False)]),
    )
    _, registration = place_mesh(read_mesh(file), lab)
    return registration.overlap > 0.5 and registration.is_mirrored == ("mirrored" in file.name)


_BY_SUFFIX: dict[str, Callable[[Path, Path], bool]] = {
    ".json": _poses_fit,
    ".ply": _splats_are_read,
    ".mcap": _recording_is_read,
    ".obj": _mesh_is_laid,
    ".mov": _film_is_read,
    ".mp4": _film_is_read,
}
