"""`studio.verbs.sessions.rehearse`: what a scene needs before it can be rehearsed in."""

import dataclasses
from argparse import Namespace

import pytest

from scenes.package import load_package, save_package
from studio.verbs.sessions.rehearse import add_reality, scene_to_rehearse
from tests.scanned_cell import scan

__all__ = ["scan"]


def asked(scene, tmp_path, **flags):
    values = {"scene": str(scene), "out": tmp_path / "out", "work": None}
    values |= {"metres_per_unit": None, "height": None, "up": None}
    return Namespace(**{**values, **flags})


def test_built_in_rooms_and_names_that_are_nothing_stay_as_they_are(tmp_path):
    assert scene_to_rehearse(asked("lab", tmp_path)) == "lab"
    assert scene_to_rehearse(asked("attic", tmp_path)) == "attic"


def test_a_scan_without_its_preparation_says_what_to_do(scan, tmp_path):
    save_package(scan.scene, tmp_path / "cell.gnx")
    with pytest.raises(ValueError, match=r"cell\.gnx\.prepare.*--rehearsable"):
        add_reality(tmp_path / "cell.gnx", None)


def test_a_scan_without_objects_needs_nothing_and_says_so(scan, tmp_path, capsys):
    folder = tmp_path / "empty.gnx"
    save_package(dataclasses.replace(scan.scene, objects=()), folder)
    add_reality(folder, None)
    assert load_package(folder).reality is None
    assert "no movable object" in capsys.readouterr().err


def test_a_splat_file_without_a_unit_asks_for_it(scan, tmp_path):
    from scenes.formats.ply import write_ply

    write_ply(tmp_path / "hall.ply", scan.room)
    with pytest.raises(ValueError, match="--metres-per-unit"):
        scene_to_rehearse(asked(tmp_path / "hall.ply", tmp_path))


def test_an_axis_that_is_none_is_refused(scan, tmp_path):
    from scenes.formats.ply import write_ply

    write_ply(tmp_path / "hall.ply", scan.room)
    with pytest.raises(ValueError, match="--up w"):
        scene_to_rehearse(asked(tmp_path / "hall.ply", tmp_path, up="w"))
