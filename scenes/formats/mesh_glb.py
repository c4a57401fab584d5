# pyright: standard
"""Triangle meshes as binary glTF (.glb): what headsets, engines and modellers exchange."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import numpy as np

from scenes.formats.storage.atomic import write_file
from scenes.formats.storage.error import refusal
from scenes.mesh import CollisionMesh

DECIMAL_COMMA = re.compile(r"^v[nt]?\s+-?\d+,\d", re.MULTILINE)


def write_mesh(path: Path, mesh: CollisionMesh) -> int:
    """Write the triangles; vertices keep their axes (Z up), which the file's name cannot say.

    Returns:
        The number of bytes.

    Raises:
        WriteError: the disk is full or the place not writable.
    """
    import trimesh

    surface = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False, validate=False)
    blob = surface.export(file_type="glb")
    assert isinstance(blob, bytes)
    return write_file(path, [blob])


def read_mesh(path: Path) -> CollisionMesh:
    """Read all triangles of a .glb, .gltf, .obj, .ply or .stl file as one mesh.

    Raises:
        FormatError: the file is missing, damaged, or holds no triangles.
    """
    if not path.is_file():
        raise refusal(path, "", "there is no such file", "check the path")
    try:
        surface = _load(path)
        return CollisionMesh(
            np.asarray(surface.vertices, dtype=np.float32),
            np.asarray(surface.faces, dtype=np.int32),
        )
    # What trimesh raises on damaged files is not documented, and files are hostile.
    except Exception as error:  # noqa: BLE001
        raise refusal(
            path,
            "",
            f"is no mesh that can be read ({type(error).__name__}: {error})",
            "export it again as .glb, .obj, .ply or .stl",
        ) from None


def _load(path: Path) -> Any:
    import trimesh

    if path.suffix.lower() == ".obj":
        text = path.read_text(encoding="utf-8-sig", errors="replace")
        if DECIMAL_COMMA.search(text):
            # Programs write the decimal mark of their user's language.
            text = "\n".join(
                line.replace(",", ".") if line.startswith("v") else line
                for line in text.splitlines()
            )
        return trimesh.load_mesh(io.BytesIO(text.encode()), file_type="obj", process=False)
    return trimesh.load_mesh(path, process=False)
