"""`benchmarks.evaluate.dataset.layout`: what a folder says, and how it names what is wrong."""

import json

import numpy as np
import pytest

from benchmarks.evaluate.dataset.layout import read_dataset


def test_reads_what_the_folder_says(folder):
    dataset = read_dataset(folder)
    item = dataset.objects["box"]
    assert item.symmetry == 4
    np.testing.assert_allclose(item.box_m, 0.2)
    assert dataset.check_codes == ("A",)
    still = dataset.sets["room"].stills[0]
    assert still.visible["box"].width_px == 30
    assert dataset.sets["room"].moving == ("box",)
    assert set(dataset.world_from_camera) == {"a.png", "b.png"}
    assert dataset.photo_labels("a.png").max() == 1


@pytest.mark.parametrize("missing", ["room.obj", "qr.json", "objects/box.obj"])
def test_a_missing_file_is_named(folder, missing):
    (folder / missing).unlink()
    with pytest.raises(ValueError, match=missing):
        read_dataset(folder)


@pytest.mark.parametrize(
    ("file", "change", "said"),
    [
        ("qr.json", lambda v: v.pop("side_m"), "side_m"),
        ("objects.json", lambda v: v["objects"]["box"].update(symmetry="odd"), "symmetry"),
        ("objects.json", lambda v: v["objects"]["box"].update(world_from_object=[1]), "4 × 4"),
        ("capture/cameras.json", lambda v: v.update(fx="wide"), "fx"),
        ("fisheye/room/truth.json", lambda v: v.pop("moving"), "moving"),
    ],
)
def test_a_wrong_field_is_named_with_its_file(folder, file, change, said):
    path = folder / file
    values = json.loads(path.read_text())
    change(values)
    path.write_text(json.dumps(values))
    with pytest.raises(ValueError, match=said) as caught:
        read_dataset(folder)
    assert str(path) in str(caught.value)


def test_a_folder_without_sets_is_refused(folder):
    (folder / "fisheye/room/truth.json").unlink()
    with pytest.raises(ValueError, match=r"no set with a truth\.json"):
        read_dataset(folder)
