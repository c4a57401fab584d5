"""Light is traced without noise, and as much of it as a formula says."""

import numpy as np
import pytest

from benchmarks.trace_light import _denoise, _Tracer
from scenes.samples.light import AreaLight, UnlitRoom, texels_of
from scenes.samples.pictures.textures import plain
from scenes.samples.shapes import quad


def test_noise_goes_and_edges_stay():
    rng = np.random.default_rng(0)
    clean = np.ones((60, 80, 3), np.float32)
    clean[:, 40:] = 0.3
    first, second = (
        (clean + rng.normal(0, 0.08, clean.shape)).astype(np.float32) for _ in range(2)
    )
    seen = np.ones(clean.shape[:2], bool)
    result = _denoise(first, second, seen)
    flat = np.s_[8:-8, 8:32]
    noise = np.std(0.5 * (first + second)[flat] - clean[flat])
    assert np.std(result[flat] - clean[flat]) < 0.35 * noise
    assert abs(result[flat].mean() - 1.0) < 0.01
    assert result[20:40, 37].mean() > 0.85
    assert result[20:40, 42].mean() < 0.45


def test_what_lies_inside_things_takes_its_neighbours_light():
    light = np.ones((20, 20, 3), np.float32)
    light[8:12, 8:12] = 0.0
    seen = light[..., 0] > 0
    assert _denoise(light, light, seen).min() > 0.95


def test_traced_light_is_the_form_factor():
    """Under a square lamp over black ground: the integral of cos·cos/(π r²), by hand."""
    pytest.importorskip("mitsuba")
    black = quad((0, 2.0, 0.0), (2.0, 0, 0), (0, -2.0, 0), material=plain((0, 0, 0)))
    lamp = AreaLight(
        np.array([0.5, 0.5, 1.0]), np.array([0, 1.0, 0]), np.array([1.0, 0, 0]), (2.0, 1.0, 0.5)
    )
    room = UnlitRoom("test", (black,), (), (), (lamp,), np.array([1.0, 1.0, 0.0]), 0.9)
    texels = texels_of([black])
    try:
        tracer = _Tracer(room)
    except ImportError as error:
        pytest.skip(f"no LLVM for Mitsuba: {error}")
    light, outside = tracer.light(texels, 1024, 1)
    s = (np.arange(40) + 0.5) / 40
    x, y = np.meshgrid(0.5 + s, 0.5 + s)
    for at in (0, len(light) // 2, len(light) - 7):
        px, py, _ = texels.centres[at]
        square = (x - px) ** 2 + (y - py) ** 2 + 1.0
        wanted = (1.0 / (np.pi * square**2)).mean()
        assert light[at] == pytest.approx(wanted * np.array([2.0, 1.0, 0.5]), rel=0.02)
    assert outside.min() == 1.0
