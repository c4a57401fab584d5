"""The renderer's figures: all there, and the error within its bar."""

import json

import numpy as np
import pytest

from benchmarks.raster import gradients as raster_gradients
from benchmarks.raster import raster
from benchmarks.raster import stage_rows as raster_stages
from benchmarks.raster.splat_scenes import bench_object, bench_room, dual_fisheye, room_camera
from scenes.pose import Pose
from scenes.render.renderer import PosedSplats
from studio.cli import main
from studio.console.rows import Row


def test_quick_figures(capsys, monkeypatch):
    monkeypatch.setattr(raster, "QUICK_REPEATS", 2)
    assert main(["bench", "raster", "--quick", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["verb"] == "bench raster"
    rows = {row["name"]: row for row in report["rows"]}
    assert rows["raster.error.max"]["bar"] == 2e-4
    assert rows["raster.error.max"]["passed"]
    assert rows["raster.error.max"]["value"] > 0
    assert rows["raster.object_20k.2t.ms"]["value"] > 0
    assert rows["raster.object_20k.2t.ms"]["spread"] >= 0
    assert rows["raster.vs_reference"]["value"] > 1
    assert rows["raster.gradient.rel_error.max"]["bar"] == 1e-4
    assert rows["raster.gradient.rel_error.max"]["passed"]
    assert rows["raster.gradient.rel_error.max"]["value"] > 0


def test_every_stage_of_every_view_is_timed():
    native = raster.NativeRenderer()
    room = (PosedSplats(bench_room(2_000, np.random.default_rng(0)), Pose.identity()),)
    rows = {
        row.name: row.value
        for row in raster_stages.stage_rows(native, "dual_64", room, dual_fisheye(64), 2)
    }
    for stage in ("project", "sort", "bin", "blend"):
        assert rows[f"raster.dual_64.stage.{stage}.1t.ms"] >= 0
    assert rows["raster.dual_64.useful_blends"] > 0
    assert 0 < rows["raster.dual_64.lanes_used"] < 1


def test_the_blend_is_held_against_the_portable_kernel_and_its_own_inner_loop():
    native = raster.NativeRenderer()
    room = (PosedSplats(bench_room(5_000, np.random.default_rng(0)), Pose.identity()),)
    rows = {
        row.name: row
        for row in raster_stages.blend_rows(native, room, room_camera(160, 120), repeats=3)
    }
    assert rows["raster.blend_vs_scalar"].bar == 20.0
    assert rows["raster.blend_vs_scalar"].value > 0
    if native.instructions == "scalar":
        assert list(rows) == ["raster.blend_vs_scalar"]
        return
    assert rows["raster.blend_vs_peak"].bar == 0.55
    assert rows["raster.blend_vs_peak"].passed is (rows["raster.blend_vs_peak"].value >= 0.55)
    assert rows["raster.blend_vs_peak.useful"].value < rows["raster.blend_vs_peak"].value
    assert rows["raster.blend_peak"].value > 0


def test_a_wrong_gradient_fails(monkeypatch):
    """An error of one part in a thousand in one array must not pass the bar."""
    honest = raster_gradients.record

    class Off:
        def __init__(self, *args):
            self._recording = honest(*args)

        def gradients(self, d_rgb):
            found = self._recording.gradients(d_rgb)
            found.objects[0].scales[:] *= 1.001
            return found

    monkeypatch.setattr(raster_gradients, "record", Off)
    error = raster_gradients._error_row(raster.NativeRenderer(), seed=1)
    assert error.passed is False
    assert error.value == pytest.approx(1e-3, rel=0.05)


def test_the_backward_pass_has_its_bar(monkeypatch):
    error = Row("raster.gradient.rel_error.max", 0.0, "")
    monkeypatch.setattr(raster_gradients, "_error_row", lambda _native, _seed: error)
    rows = raster_gradients.gradient_rows(raster.NativeRenderer(), 1, repeats=2)
    assert rows[0] is error
    assert {row.name: row for row in rows}["raster.backward_vs_forward"].bar == 2.3


def test_the_moved_object_is_timed_on_every_still_view():
    rng = np.random.default_rng(0)
    room = (PosedSplats(bench_room(2_000, rng), Pose.identity()),)
    scene = raster._Scene("dual_64", room, dual_fisheye(64), None)
    row = raster._moved_row(raster.NativeRenderer(), scene, rng, 2)
    assert row.name == "raster.dual_64_moved.2t.ms"
    assert row.bar == 15.0
    assert row.value is not None
    assert row.value > 0


def test_a_wrong_picture_fails(monkeypatch):
    """An error of one part in a thousand in the colours must not pass the bar."""
    native = raster.NativeRenderer()
    exact = raster.ReferenceRenderer

    class Off(exact):
        def render(self, *args):
            picture = super().render(*args)
            picture.rgb[3, 4] += 1e-3
            return picture

    monkeypatch.setattr(raster, "ReferenceRenderer", Off)
    error = raster._error_row(native, seeds=1)
    assert error.passed is False
    assert error.value == pytest.approx(1e-3, rel=0.05)


def test_the_room_has_the_size_it_says_and_surrounds_the_cameras():
    room = bench_room(5_000, np.random.default_rng(0))
    assert len(room) == 5_000
    assert (room.means.min(axis=0) < [-2.9, -2.4, 0.1]).all()
    assert (room.means.max(axis=0) > [2.9, 2.4, 2.6]).all()
    camera, pose = room_camera(64, 48)
    views = [(camera, pose), *dual_fisheye(64)]
    seen = [camera.project(pose.inverse() @ room.means)[1].mean() for camera, pose in views]
    assert 0.05 < seen[0] < 0.4
    assert seen[1] + seen[2] > 0.95


def test_the_chair_stands_on_the_floor():
    chair = bench_object(2_000, np.random.default_rng(0))
    assert len(chair) == 2_000
    assert abs(chair.means[:, 2].min()) < 0.01
    assert 0.85 < chair.means[:, 2].max() < 0.95
