"""Kinds of dropped files and folders, and the action that opens each."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from studio.app.model.documents.document_file import SUFFIX
from studio.session.records.outputs import RECORDING

SPLATS = frozenset({".ply", ".spz", ".splat", ".sog", ".ksplat"})
MESHES = frozenset({".obj", ".glb", ".gltf", ".stl", ".off"})
HEAD_BYTES = 65_536
"""So much of a file is looked at: longer than any header of a splat file."""

FACES = re.compile(rb"^element face (\d+)", re.MULTILINE)
SPLATS_IN_GLTF = b"KHR_gaussian_splatting"
"""Extension that a glTF file of splats names."""

VIDEOS = frozenset({".mp4", ".mov", ".m4v", ".mkv", ".avi", ".webm", ".insv"})
PICTURES = frozenset(
    {".jpg", ".jpeg", ".png", ".tif", ".tiff", ".webp", ".bmp", ".heic", ".heif", ".hif", ".avif"}
)
"""Files that a room is prepared of; a test holds both to those that the preparation reads."""

POSES = ("transforms.json", "sparse/0/cameras.bin", "sparse/0/cameras.txt", "sparse/cameras.bin")
POSES += ("sparse/cameras.txt", "cameras.bin", "cameras.txt")
"""Files by which a folder is known to have the poses of its photos, from another program."""
PHOTOS_BESIDE = ("images", "photos", "frames", "input", "color")
"""Folders beside them in which the photos lie."""


@dataclass(frozen=True, slots=True)
class Dropped:
    """How a path is opened.

    Attributes:
        what: in words, for the log.
        action_id: opens it.
        argument: name under which the action takes the path.
    """

    what: str
    action_id: str
    argument: str = "path"


def what_is(path: Path) -> Dropped:
    """How a file or folder that was dropped on the window is opened.

    Raises:
        ValueError: it is nothing that the studio opens; the message says what it does.
    """
    if not path.exists():
        raise ValueError(f"{path}: there is no such file or folder")
    suffix = path.suffix.lower()
    if path.is_dir():
        return _folder(path)
    if suffix == SUFFIX:
        return Dropped("a project", "file.open")
    if suffix == ".mcap":
        return Dropped("a recording", "timeline.open")
    if suffix == ".toml":
        return Dropped("a scenario", "scenario.open")
    if suffix in MESHES and _holds(path, SPLATS_IN_GLTF):
        return Dropped("a splat file", "file.open_scene", "scene")
    if suffix in MESHES or (suffix == ".ply" and _has_faces(path)):
        return Dropped("a mesh", "twin.add_mesh")
    if suffix in SPLATS:
        return Dropped("a splat file", "file.open_scene", "scene")
    if suffix in VIDEOS:
        return Dropped("a video", "preparation.add")
    if suffix in PICTURES:
        return Dropped("a photo", "preparation.add")
    raise ValueError(
        f"{path.name}: the studio opens projects ({SUFFIX}), scene packages, splats (.ply .spz "
        ".sog .splat), meshes (.obj .ply .glb .stl), recordings (.mcap), scenarios (.toml), "
        "videos and photos"
    )


def poses_in(folder: Path) -> Path | None:
    """Poses of another program in a folder: a transforms.json, or the folder of a COLMAP model."""
    found = next((folder / name for name in POSES if (folder / name).is_file()), None)
    return found if found is None or found.suffix == ".json" else found.parent


def photos_of(folder: Path) -> Path:
    """The folder of the photos: beside poses often one of their own."""
    beside = (folder / name for name in PHOTOS_BESIDE)
    if poses_in(folder) is None or any(f.suffix.lower() in PICTURES for f in folder.iterdir()):
        return folder
    return next((each for each in beside if each.is_dir()), folder)


def _has_faces(path: Path) -> bool:
    """Whether a PLY file is a surface: one of splats has points only."""
    with path.open("rb") as file:
        head = file.read(HEAD_BYTES)
    found = FACES.search(head[: head.find(b"end_header")])
    return found is not None and int(found[1]) > 0


def _holds(path: Path, word: bytes) -> bool:
    with path.open("rb") as file:
        return word in file.read(HEAD_BYTES)


def _folder(path: Path) -> Dropped:
    if (path / "scene.json").is_file():
        return Dropped("a scene package", "file.open_scene", "scene")
    if (path / RECORDING).is_file():
        return Dropped("a rehearsal", "timeline.open")
    if (path / "meta.json").is_file():
        return Dropped("a splat folder", "file.open_scene", "scene")
    if any(file.suffix.lower() in PICTURES for file in photos_of(path).iterdir()):
        return Dropped("a folder of photos", "preparation.add")
    raise ValueError(f"{path.name}: this folder is no scene package, rehearsal or folder of photos")
