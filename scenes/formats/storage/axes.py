"""Between the axes of splat PLY files and those of SPZ and glTF files."""

from __future__ import annotations

import numpy as np

from scenes.formats.storage.blocks import owned
from scenes.frames import RDF_FROM_RUB
from scenes.harmonics import turning_matrix
from scenes.splats import SplatCloud

_SIGNS = np.diag(RDF_FROM_RUB.rotation).astype(np.float32)
_SH_SIGNS = np.diag(turning_matrix(RDF_FROM_RUB.rotation, 3)).astype(np.float32)
# R' = F R F for a flip F of two axes, which leaves R S Sᵀ Rᵀ flipped for a diagonal S; wxyz.
_QUATERNION_SIGNS = np.concatenate([[1.0], _SIGNS]).astype(np.float32)


def flipped(cloud: SplatCloud) -> SplatCloud:
    """From x right, y down, z forward to x right, y up, z back, or back again; exact.

    These are `RDF_FROM_RUB` and, as glTF's axes are those of RUB, the axes of glTF too.
    """
    return owned(
        means=cloud.means * _SIGNS,
        scales=cloud.scales,
        rotations=cloud.rotations * _QUATERNION_SIGNS,
        opacities=cloud.opacities,
        sh=cloud.sh * _SH_SIGNS[: cloud.sh.shape[1], None],
    )
