import numpy as np
import pytest

from scenes.opening import open_scene
from scenes.package.files import PackageError
from scenes.samples import SAMPLE_NAMES, sample_room


@pytest.mark.parametrize("name", SAMPLE_NAMES)
def test_a_built_in_scan_is_of_its_physical_room(name):
    scan, physical = open_scene(name), sample_room(name)
    assert scan.name == scan.physical == name
    assert {item.object_id for item in scan.objects} == {o.object_id for o in physical.objects}
    for thing in physical.objects:
        item = scan.object_by_id(thing.object_id)
        assert item.kind == thing.kind
        np.testing.assert_allclose(
            item.world_from_object.matrix(), thing.world_from_object.matrix(), atol=1e-9
        )
    for code, true in zip(scan.codes, physical.codes, strict=True):
        assert (code.payload, code.side_m) == (true.payload, true.side_m)
        np.testing.assert_allclose(
            code.world_from_code.matrix(), true.world_from_code.matrix(), atol=1e-9
        )
    np.testing.assert_allclose(scan.footprint_m, physical.footprint_m)


@pytest.mark.parametrize("name", SAMPLE_NAMES)
def test_a_built_in_scan_is_what_prepare_made(name):
    scan = open_scene(name)
    stages = {stage.name for stage in scan.stages}
    assert {"capture", "poses", "alignment", "training", "collision"} <= stages
    assert {f"cut {item.object_id}" for item in scan.objects} <= stages


def test_an_unknown_room_is_refused():
    with pytest.raises(PackageError, match=r"kitchen.*lab"):
        open_scene("kitchen")
