"""Shared by the tests of scenes: random clouds, real files."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from scenes.splats import SH_COUNTS, SplatCloud

DATA = Path(__file__).parents[2].parent / "shared" / "data" / "splats"


@pytest.fixture(scope="session")
def random_cloud() -> Callable[..., SplatCloud]:
    """make(n, degree, seed) -> a plausible cloud within ±2 m."""

    def make(n: int, degree: int = 0, seed: int = 0) -> SplatCloud:
        rng = np.random.default_rng(seed)
        rotations = rng.normal(size=(n, 4))
        rotations /= np.linalg.norm(rotations, axis=1, keepdims=True)
        return SplatCloud(
            rng.uniform(-2, 2, (n, 3)).astype(np.float32),
            np.exp(rng.uniform(-7, 0.5, (n, 3))).astype(np.float32),
            rotations.astype(np.float32),
            rng.uniform(0, 1, n).astype(np.float32),
            rng.uniform(-0.9, 0.9, (n, SH_COUNTS[degree], 3)).astype(np.float32),
        )

    return make


@pytest.fixture(scope="session")
def real_splats() -> Path:
    """The folder of real public splat files, which are not part of the repository."""
    if not DATA.is_dir():
        pytest.skip(f"real splat files are not at {DATA}")
    return DATA
