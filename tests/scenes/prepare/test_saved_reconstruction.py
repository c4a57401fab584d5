from __future__ import annotations

import numpy as np
import pytest

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose, rotation_from_vector
from scenes.prepare.reconstruction import (
    Reconstruction,
    View,
    load_reconstruction,
    save_reconstruction,
)


@pytest.fixture
def reconstruction(tmp_path) -> Reconstruction:
    rng = np.random.default_rng(0)
    cameras = (Pinhole(640, 480, 501.25, 499.5, 320.1, 239.7), Fisheye.from_fov(300, 3.4))
    views = tuple(
        View(
            f"{k}.jpg",
            tmp_path / "pictures" / f"{k}.jpg",
            camera,
            Pose(rotation_from_vector(rng.normal(size=3)), rng.normal(size=3)),
        )
        for k, camera in enumerate(cameras)
    )
    return Reconstruction(
        views,
        rng.normal(size=(50, 3)),
        rng.integers(0, 256, (50, 3), dtype=np.uint8),
        rng.uniform(0, 2, 50).astype(np.float32),
    )


def test_what_is_saved_is_loaded_to_the_same_bits(reconstruction, tmp_path):
    save_reconstruction(reconstruction, tmp_path / "saved")
    save_reconstruction(reconstruction, tmp_path / "saved")
    again = load_reconstruction(tmp_path / "saved")
    for name in ("points", "colours", "errors_px"):
        a, b = getattr(again, name), getattr(reconstruction, name)
        assert np.array_equal(a, b)
        assert a.dtype == b.dtype
    for a, b in zip(again.views, reconstruction.views, strict=True):
        assert (a.name, a.camera) == (b.name, b.camera)
        assert a.image.resolve() == b.image.resolve()
        assert np.array_equal(a.world_from_camera.matrix(), b.world_from_camera.matrix())


def test_it_moves_with_its_pictures(reconstruction, tmp_path):
    save_reconstruction(reconstruction, tmp_path / "work" / "saved")
    (tmp_path / "moved").mkdir()
    (tmp_path / "work" / "saved").rename(tmp_path / "moved" / "saved")
    again = load_reconstruction(tmp_path / "moved" / "saved")
    assert again.views[0].image.resolve() == (tmp_path / "pictures" / "0.jpg").resolve()


@pytest.mark.parametrize("file", ["views.json", "points.npz"])
@pytest.mark.parametrize("damage", ["missing", "cut", "empty"])
def test_damage_is_said(reconstruction, tmp_path, file, damage):
    save_reconstruction(reconstruction, tmp_path / "saved")
    path = tmp_path / "saved" / file
    data = path.read_bytes()
    path.unlink()
    if damage != "missing":
        path.write_bytes(data[: len(data) // 2] if damage == "cut" else b"")
    with pytest.raises(ValueError, match="no saved reconstruction"):
        load_reconstruction(tmp_path / "saved")
