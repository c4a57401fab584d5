"""`nexus refine`: an object of a prepared room sharpened and put back on the command line."""

import json
import shutil

import pytest

from scenes.package import load_package, save_package
from studio.cli import main
from tests.prepared_floor import make_prepared_floor


@pytest.fixture(scope="module")
def prepared(tmp_path_factory):
    """A striped floor, prepared, and nothing cut out of it."""
    return make_prepared_floor(tmp_path_factory.mktemp("floor"))


@pytest.fixture
def scene(prepared, tmp_path):
    copied = tmp_path / "floor.gnx"
    shutil.copytree(prepared, copied)
    return copied


@pytest.fixture
def nexus(capsys, prepared):
    def call(*words, photos=True):
        work = ["--work", str(prepared) + ".prepare"] if photos else []
        code = main(["refine", *map(str, words), *work])
        printed = capsys.readouterr()
        return code, printed.out, printed.err

    return call


def bytes_of(scene):
    return {p.name: p.read_bytes() for p in (scene / "splats").rglob("*.ply")}


def test_a_region_is_sharpened_and_put_back_to_the_byte(scene, nexus):
    save_package(load_package(scene), scene)
    before = bytes_of(scene)
    asked = ("--at", "0,0,0", "--radius", "0.4", "--steps", "60", "--json")
    code, out, _ = nexus(scene, *asked)
    assert code == 0
    (row,) = json.loads(out)["refined"]
    assert (row["name"], row["photos"], row["after_db"]) == ("region", 6, None)
    assert row["splats"] > 50
    assert bytes_of(scene) != before
    assert [stage.name for stage in load_package(scene).stages] == ["refine region"]
    code, out, _ = nexus(scene, "--undo")
    assert (code, "region is as it was" in out) == (0, True)
    assert bytes_of(scene) == before


def test_what_cannot_be_refined_is_said_in_a_line(scene, nexus):
    refused = {
        (): "no object was cut out of it",
        ("mug",): "has no object 'mug'",
        ("mug", "--at", "0,0,0"): "objects and --at; give one of them",
        ("--at", "9,9,9"): "no splat within 0.3 m of (9, 9, 9) m",
        ("--undo",): "what was done last is no refinement",
    }
    for words, why in refused.items():
        code, _, err = nexus(scene, *words)
        assert code == 3
        assert why in err
        assert err.strip().count("\n") <= 1


def test_without_photos_it_says_so(scene, nexus):
    code, _, err = nexus(scene, "--at", "0,0,0", photos=False)
    assert code == 3
    assert "no finished preparation of 'floor'; to refine it, prepare it again" in err


@pytest.mark.parametrize(
    "words",
    [("--at", "1,2"), ("--at", "nan,0,0"), ("--radius", "0"), ("--radius", "x"), ("--steps", "3")],
)
def test_numbers_that_are_none_are_usage_errors(scene, nexus, words):
    assert nexus(scene, *words)[0] == 2
