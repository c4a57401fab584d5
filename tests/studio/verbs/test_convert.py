import json
import subprocess
import sys

import numpy as np
import pytest

from scenes.formats.ply import write_ply_blocks
from scenes.formats.registry import is_in_world_frame, read_splats, write_splats
from scenes.formats.storage.blocks import SplatBlocks
from scenes.frames import WORLD_FROM_FORWARD_CAMERA
from scenes.opening import open_scene
from scenes.package import ScenePackage, save_package
from scenes.pose import Pose
from scenes.splats import SplatCloud
from scenes.state import ObjectModel
from studio.cli import main
from studio.console.progress import Progress
from studio.verbs.convert import SHOWN_FROM
from studio.verbs.convert import convert as run_conversion

FORMATS = ("ply", "spz", "splat", "glb")


def cloud_of(n: int, coefficients: int = 1) -> SplatCloud:
    rng = np.random.default_rng(n)
    rotations = rng.normal(size=(n, 4))
    return SplatCloud(
        rng.uniform(-1, 1, (n, 3)),
        rng.uniform(0.01, 0.1, (n, 3)),
        rotations / np.linalg.norm(rotations, axis=1, keepdims=True),
        rng.uniform(0, 1, n),
        rng.uniform(-0.5, 0.5, (n, coefficients, 3)),
    )


@pytest.fixture
def convert(capsys):
    """convert(*words) -> exit code, standard output, standard error."""

    def call(*words):
        code = main(["convert", *map(str, words)])
        printed = capsys.readouterr()
        return code, printed.out, printed.err

    return call


def test_one_line_with_counts_and_bytes(convert, tmp_path):
    write_splats(tmp_path / "a.ply", cloud_of(1234, 4))
    code, out, err = convert(tmp_path / "a.ply", tmp_path / "b.spz")
    size = (tmp_path / "b.spz").stat().st_size
    assert (code, err) == (0, "")
    assert out.count("\n") == 1
    assert "1,234 splats, degree 1" in out
    assert f"{size:,} bytes" in out
    assert len(read_splats(tmp_path / "b.spz")) == 1234


def test_json_report(convert, tmp_path):
    write_splats(tmp_path / "a.ply", cloud_of(5, 4))
    code, out, _ = convert(tmp_path / "a.ply", tmp_path / "b.splat", "--json")
    report = json.loads(out)
    assert code == 0
    assert (report["verb"], report["splats"]) == ("convert", 5)
    assert (report["sh_degree"], report["written_sh_degree"]) == (1, 0)
    assert report["target_bytes"] == 5 * 32


def test_what_a_format_cannot_hold_is_said(convert, tmp_path):
    write_splats(tmp_path / "a.ply", cloud_of(5, 4))
    _, out, _ = convert(tmp_path / "a.ply", tmp_path / "b.splat")
    assert "view-dependent colour left out" in out


@pytest.mark.parametrize(
    ("source", "target", "said"),
    [
        ("gone.ply", "b.spz", "No such file"),
        ("a.ply", "b.xyz", "unknown ending"),
        ("a.ply", "b.compressed.ply", "read only"),
        ("a.usda", "b.ply", "USD is written only"),
        ("a.ply", "a.ply", "is the file to read"),
        ("a.ply", "gone/b.ply", "make the folder"),
        ("cut.ply", "b.ply", "truncated"),
        ("text.txt", "b.ply", "not a splat file"),
        (".", "b.ply", "folder"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_3(convert, tmp_path, source, target, said):
    write_splats(tmp_path / "a.ply", cloud_of(5))
    whole = (tmp_path / "a.ply").read_bytes()
    (tmp_path / "cut.ply").write_bytes(whole[:-1])
    (tmp_path / "text.txt").write_text("hello")
    (tmp_path / "a.usda").write_text("#usda 1.0")
    before = sorted(p.name for p in tmp_path.iterdir())
    code, out, err = convert(tmp_path / source, tmp_path / target)
    assert (code, out) == (3, "")
    assert err.count("\n") == 1
    assert said in err
    assert sorted(p.name for p in tmp_path.iterdir()) == before
    assert (tmp_path / "a.ply").read_bytes() == whole


def test_a_scene_becomes_one_file_in_place(convert, tmp_path):
    room, chair = cloud_of(50, 4), cloud_of(20)
    placed = Pose.from_yaw(1.0, (2.0, 0.0, 0.0))
    item = ObjectModel("chair-1", "Chair", "chair", chair, (1, 1, 1), 0.0, placed)
    package = ScenePackage(
        "s", room, (item,), (), Pose.identity(), np.array([[-1, -1], [1, 1]]), None
    )
    save_package(package, tmp_path / "scene")
    where = placed @ chair.means.astype(float)
    for name in ("a.ply", "a.spz", "a.glb"):
        assert convert(tmp_path / "scene", tmp_path / name)[0] == 0
        opened = open_scene(tmp_path / name).room
        assert len(opened) == 70
        np.testing.assert_allclose(opened.means[:50], room.means, atol=2e-4)
        np.testing.assert_allclose(opened.means[50:], where, atol=2e-4)
    assert is_in_world_frame(tmp_path / "a.ply")
    in_file = read_splats(tmp_path / "a.spz").means.astype(float)
    np.testing.assert_allclose(WORLD_FROM_FORWARD_CAMERA @ in_file[:50], room.means, atol=2e-4)


def big_ply(path, count: int, coefficients: int = 1, *, bad: int | None = None) -> None:
    """`count` splats, written block by block; splat `bad` has a position that is not a number."""
    block = cloud_of(10_000, coefficients)
    blocks = iter([block] * (count // len(block)))
    write_ply_blocks(path, SplatBlocks(count, block.sh_degree, blocks))
    if bad is not None:
        row = path.stat().st_size - (count - bad) * 4 * (11 + 3 * coefficients)
        with path.open("r+b") as file:
            file.seek(row)
            file.write(np.float32(np.nan).tobytes())


@pytest.mark.parametrize("target", FORMATS)
def test_damage_found_on_the_way_leaves_the_target_as_it_was(convert, tmp_path, target):
    big_ply(tmp_path / "a.ply", 600_000)
    short = (tmp_path / "a.ply").read_bytes()[:-100]
    (tmp_path / "a.ply").write_bytes(short)
    (tmp_path / f"b.{target}").write_bytes(b"before")
    code, out, err = convert(tmp_path / "a.ply", tmp_path / f"b.{target}")
    assert (code, out) == (3, "")
    assert "vertex 599998" in err.splitlines()[-1]
    assert (tmp_path / f"b.{target}").read_bytes() == b"before"
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize("target", FORMATS)
def test_bad_splats_are_left_out_of_the_file_and_its_count(convert, tmp_path, target):
    big_ply(tmp_path / "a.ply", 200_000, bad=199_998)
    code, out, _ = convert(tmp_path / "a.ply", tmp_path / f"b.{target}", "--json")
    report = json.loads(out)
    assert (code, report["splats"], report["left_out"]) == (0, 199_999, 1)
    assert "number 199998 with means" in report["left_out_why"]
    assert len(read_splats(tmp_path / f"b.{target}")) == 199_999


def test_long_conversions_say_how_far_they_are(convert, tmp_path):
    big_ply(tmp_path / "a.ply", SHOWN_FROM // 10_000 * 10_000)
    assert convert(tmp_path / "a.ply", tmp_path / "b.splat")[2] == ""
    big_ply(tmp_path / "a.ply", (SHOWN_FROM // 10_000 + 1) * 10_000)
    code, out, err = convert(tmp_path / "a.ply", tmp_path / "b.splat", "--json")
    assert code == 0
    assert json.loads(out)["splats"] == (SHOWN_FROM // 10_000 + 1) * 10_000
    assert err.startswith("writing b.splat …\n")
    assert "530,000 splats" in err


def test_progress_tells_the_share_and_the_time_left(tmp_path, monkeypatch):
    big_ply(tmp_path / "a.ply", 530_000)
    seconds = iter(range(0, 10_000, 10))
    monkeypatch.setattr("studio.console.progress.time.monotonic", lambda: next(seconds))
    lines = []
    progress = Progress(lambda line, _: lines.append(line))
    run_conversion(tmp_path / "a.ply", tmp_path / "b.splat", progress=progress)
    assert len(lines) == 11
    assert lines[1].startswith("writing b.splat  12%, 1 min 1")
    assert lines[1].endswith("left  65,536 of 530,000 splats")
    assert lines[-1].startswith("writing b.splat: ")


PEAK = """
import resource, sys
from studio.cli import main
code = main(["convert", *sys.argv[1:], "--json"])
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, file=sys.stderr)
sys.exit(code)
"""


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.skipif(sys.platform == "win32", reason="peak memory is not in the resource module")
@pytest.mark.parametrize(("count", "coefficients"), [(5_000_000, 1), (1_000_000, 16)])
def test_memory_is_bounded_whatever_the_number_of_splats(tmp_path, count, coefficients):
    big_ply(tmp_path / "a.ply", count, coefficients)
    for source, target in [
        *(("a.ply", f"b.{f}") for f in FORMATS),
        ("b.spz", "c.ply"),
        ("b.glb", "c.ply"),
    ]:
        words = [sys.executable, "-c", PEAK, tmp_path / source, tmp_path / target]
        done = subprocess.run(words, capture_output=True, text=True, check=True)
        assert json.loads(done.stdout)["splats"] == count
        peak_bytes = int(done.stderr.split()[-1]) * (1 if sys.platform == "darwin" else 1024)
        assert peak_bytes < 600e6, f"{source} to {target}"


def test_a_scene_is_written_again_in_its_true_size(convert, tmp_path):
    package = ScenePackage(
        "room", cloud_of(9), (), (), Pose.identity(), np.array([[-1.0, -1], [1, 1]]), None
    )
    save_package(package, tmp_path / "a.gnx")
    code, out, _ = convert(tmp_path / "a.gnx", tmp_path / "b.gnx", "--metres-per-unit", "2")
    assert (code, out.count("\n")) == (0, 1)
    assert "all lengths times 2" in out
    found = open_scene(tmp_path / "b.gnx")
    np.testing.assert_allclose(found.room.means, 2 * package.room.means, rtol=1e-6)
    code, out, _ = convert(
        tmp_path / "b.gnx", tmp_path / "c.gnx", "--metres-per-unit", "0.5", "--json"
    )
    assert json.loads(out)["stages"]["scale"] == "all lengths times 0.5"


@pytest.mark.parametrize(
    "words", [[], ["--height", "2.5"], ["--metres-per-unit", "2", "--up", "z"]]
)
def test_of_a_scene_only_the_scale_can_be_set(convert, tmp_path, words):
    package = ScenePackage(
        "room", cloud_of(9), (), (), Pose.identity(), np.array([[-1.0, -1], [1, 1]]), None
    )
    save_package(package, tmp_path / "a.gnx")
    code, _, err = convert(tmp_path / "a.gnx", tmp_path / "b.gnx", *words)
    assert code == 3
    assert "is changed by --metres-per-unit N alone" in err
    assert not (tmp_path / "b.gnx").exists()
