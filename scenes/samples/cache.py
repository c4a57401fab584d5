"""Keeps the lit part of a room on disk: drawing takes seconds, and the result never changes.

A file belongs to exactly one state of this package's sources; older ones are removed.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import logging
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import platformdirs

from scenes.formats.storage.atomic import write_whole
from scenes.mesh import BoxPart, TexturedMesh
from scenes.pose import Pose
from scenes.quad import QrCode
from scenes.samples.light import UnlitRoom, lit, texels_of
from scenes.samples.light_file import DATA, load_light
from scenes.samples.pictures.atlas import mesh_from_surfaces

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, eq=False)
class StaticPart:
    """Fixed part of a room: one lit mesh, the boxes that stop objects, the printed codes."""

    mesh: TexturedMesh
    solids: tuple[BoxPart, ...]
    codes: tuple[QrCode, ...]


def static_part(name: str, unlit: Callable[[], UnlitRoom]) -> StaticPart:
    """The static part of a built-in room under its traced light, from the cache where it is there.

    Raises:
        ValueError: the light was traced for a room of another shape.
    """

    def build() -> StaticPart:
        room = unlit()
        light = load_light(DATA / f"{name}.npz", texels_of(room.surfaces))
        mesh = mesh_from_surfaces(lit(room.surfaces, light), width_px=4096)
        return StaticPart(mesh, room.solids, room.codes)

    return cached(name, build)


def cached(name: str, build: Callable[[], StaticPart], *, folder: Path | None = None) -> StaticPart:
    """The static part from the cache, or built and kept there.

    A missing, damaged or unwritable cache costs time, never the result.

    Args:
        name: of the room.
        build: makes the part if it isn't there.
        folder: where it is kept; the user's cache folder if not given.
    """
    where = folder or Path(platformdirs.user_cache_dir("gaussiannexus-studio")) / "rooms"
    path = where / f"{name}-{_sources_hash()}.npz"
    try:
        return load(path)
    except FileNotFoundError:
        pass
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        log.warning("room cache %s is damaged (%s); building the room again", path, error)
    part = build()
    try:
        save(part, path)
    except OSError as error:
        log.warning("room cache %s cannot be written (%s); the next start is slow too", path, error)
        return part
    for old in where.glob(f"{name}-*.npz"):
        if old != path:
            with contextlib.suppress(OSError):
                old.unlink()
    return part


def save(part: StaticPart, path: Path) -> None:
    """Writes the part; the file appears whole or not at all.

    Raises:
        OSError: the folder or the file cannot be written.
    """
    labels = [{"payload": c.payload, "side_m": c.side_m} for c in part.codes]
    arrays = {
        "vertices": part.mesh.vertices,
        "faces": part.mesh.faces,
        "uv": part.mesh.uv,
        "texture": part.mesh.texture,
        "solid_poses": np.stack([s.object_from_box.matrix() for s in part.solids]),
        "solid_halves": np.array([s.half_size_m for s in part.solids]),
        "code_poses": np.stack([c.world_from_code.matrix() for c in part.codes]),
        "code_labels": np.array(json.dumps(labels)),
    }
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **arrays)
    write_whole(path, [file.getbuffer()], makes_folder=True)


def load(path: Path) -> StaticPart:
    """Reads what `save` wrote.

    Raises:
        FileNotFoundError: there is none.
        OSError, ValueError, KeyError, zipfile.BadZipFile: it is damaged.
    """
    with np.load(path, allow_pickle=False) as arrays:
        mesh = TexturedMesh(*(arrays[k] for k in ("vertices", "faces", "uv", "texture")))
        solids = tuple(
            BoxPart(Pose.from_matrix(pose), (float(half[0]), float(half[1]), float(half[2])))
            for pose, half in zip(arrays["solid_poses"], arrays["solid_halves"], strict=True)
        )
        labels = json.loads(str(arrays["code_labels"]))
        codes = tuple(
            QrCode(label["payload"], label["side_m"], Pose.from_matrix(pose))
            for label, pose in zip(labels, arrays["code_poses"], strict=True)
        )
    return StaticPart(mesh, solids, codes)


def _sources_hash() -> str:
    """Changes with this package's code and light, and with the libraries that draw."""
    digest = hashlib.sha256(f"{np.__version__} {cv2.__version__}".encode())
    here = Path(__file__).parent
    drawing = [*here.glob("*.py"), *(here / "pictures").glob("*.py")]
    for source in sorted([*drawing, *DATA.glob("*.npz")]):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]
