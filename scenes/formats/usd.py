# pyright: standard
"""Splats in Universal Scene Description: a ParticleField3DGaussianSplat prim. Written only.

The schema is OpenUSD's UsdVol (26.03 and later): positions, orientations, linear scales, linear
opacities and, splat by splat, the coefficients of the spherical harmonics. The stage is Z up and in
metres, so clouds, which go in with x right, y down, z forward as in PLY files, are turned to the
world's axes as any opened splat file is.

Needs OpenUSD's Python package, the optional extra "usd". OpenUSD holds whole arrays in memory, so
that, unlike the other formats, memory grows with the number of splats.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from scenes.formats.storage.atomic import write_file
from scenes.formats.storage.blocks import SplatBlocks, in_blocks, whole
from scenes.formats.storage.error import refusal
from scenes.formats.storage.spool import contents
from scenes.frames import WORLD_FROM_FORWARD_CAMERA
from scenes.harmonics import turned
from scenes.splats import SplatCloud

ROOT, SPLATS = "/Scene", "/Scene/Splats"
REACH = 3.0
"""Standard deviations to which the extent of a splat counts."""


def write_usd(path: Path, cloud: SplatCloud) -> int:
    """Write a `.usdc` (binary), `.usda` (text) or `.usd` stage with one prim of splats; atomic.

    Args:
        path: the file to make or replace.
        cloud: axes x right, y down, z forward, metres.

    Returns:
        The size of the file in bytes.

    Raises:
        FormatError: OpenUSD's Python package is not installed, or too old for splats.
        WriteError: the disk is full or the folder is not writable; nothing is left behind.
    """
    return write_usd_blocks(path, in_blocks(cloud))


def write_usd_blocks(path: Path, splats: SplatBlocks) -> int:
    """As `write_usd`; blocks are put together in memory."""
    _require_openusd(path)
    return write_file(path, _stage(path, splats))


def _require_openusd(path: Path) -> None:
    try:
        from pxr import UsdVol  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise refusal(
            path,
            "",
            "writing USD needs the package usd-core, which is not installed",
            "install it (uv pip install usd-core) or write a .glb",
        ) from None
    if not hasattr(UsdVol, "ParticleField3DGaussianSplat"):
        raise refusal(
            path,
            "",
            "this OpenUSD does not know splats (ParticleField3DGaussianSplat)",
            "install usd-core 26.3 or later, or write a .glb",
        )


def _stage(path: Path, splats: SplatBlocks) -> Iterator[bytes]:
    """The bytes of the stage, which OpenUSD can only write to a file of its own."""
    cloud = whole(splats.changed(lambda block: turned(block, WORLD_FROM_FORWARD_CAMERA)))
    with tempfile.TemporaryDirectory(dir=path.resolve().parent, prefix=".usd-") as folder:
        file = Path(folder) / f"stage{path.suffix.lower()}"
        _save(path, file, cloud)
        with file.open("rb") as written:
            yield from contents(written)


def _openusd(*names: str) -> list[Any]:
    """Modules of OpenUSD by name."""
    return [import_module(f"pxr.{name}") for name in names]


def _save(path: Path, file: Path, cloud: SplatCloud) -> None:
    # OpenUSD makes its modules' contents at run time, where a type checker sees none of them.
    gf, sdf, tf, usd, usd_geom, usd_vol, vt = _openusd(
        "Gf", "Sdf", "Tf", "Usd", "UsdGeom", "UsdVol", "Vt"
    )
    try:
        stage = usd.Stage.CreateNew(str(file))
        usd_geom.SetStageUpAxis(stage, usd_geom.Tokens.z)
        usd_geom.SetStageMetersPerUnit(stage, 1.0)
        stage.SetDefaultPrim(usd_geom.Xform.Define(stage, sdf.Path(ROOT)).GetPrim())
        prim = usd_vol.ParticleField3DGaussianSplat.Define(stage, sdf.Path(SPLATS)).GetPrim()
        # Gf holds a quaternion's real part last, in memory as in numpy.
        xyzw = np.roll(cloud.rotations, -1, axis=1)
        values: dict[str, Any] = {
            "positions": vt.Vec3fArray.FromNumpy(cloud.means),
            "orientations": vt.QuatfArray.FromNumpy(np.ascontiguousarray(xyzw)),
            "scales": vt.Vec3fArray.FromNumpy(cloud.scales),
            "opacities": vt.FloatArray.FromNumpy(cloud.opacities),
            "radiance:sphericalHarmonicsDegree": cloud.sh_degree,
            "radiance:sphericalHarmonicsCoefficients": vt.Vec3fArray.FromNumpy(
                cloud.sh.reshape(-1, 3)
            ),
            "extent": vt.Vec3fArray([gf.Vec3f(*corner) for corner in _extent(cloud)]),
        }
        for name, value in values.items():
            if not prim.GetAttribute(name).Set(value):
                raise refusal(path, name, "OpenUSD does not take it", "write a .glb instead")
        stage.GetRootLayer().Save()
    except tf.ErrorException as error:
        raise OSError(f"OpenUSD: {str(error).strip().splitlines()[-1]}") from None


def _extent(cloud: SplatCloud) -> list[list[float]]:
    """Lowest and highest corner of all splats, however they are turned."""
    if not len(cloud):
        return [[0.0] * 3, [0.0] * 3]
    reach = REACH * cloud.scales.max(axis=1, keepdims=True)
    return [(cloud.means - reach).min(axis=0).tolist(), (cloud.means + reach).max(axis=0).tolist()]
