import importlib
import sys

import numpy as np
import pytest

from scenes.formats.storage.atomic import WriteError
from scenes.formats.storage.error import FormatError
from scenes.formats.usd import write_usd
from scenes.frames import WORLD_FROM_FORWARD_CAMERA
from scenes.harmonics import turned


@pytest.fixture
def usd():
    """OpenUSD's Python package; the tests' lists hold it, so that these never skip."""
    return importlib.import_module("pxr.Usd")


def values_of(prim):
    return {name: prim.GetAttribute(name).Get() for name in prim.GetPropertyNames()}


@pytest.mark.parametrize("suffix", [".usdc", ".usda", ".usd", ".USDA"])
@pytest.mark.parametrize("degree", [0, 2, 3])
def test_what_openusd_reads_is_the_cloud_upright(usd, tmp_path, random_cloud, suffix, degree):
    cloud = random_cloud(20, degree)
    size = write_usd(tmp_path / f"a{suffix}", cloud)
    assert size == (tmp_path / f"a{suffix}").stat().st_size
    assert len(list(tmp_path.iterdir())) == 1
    stage = usd.Stage.Open(str(tmp_path / f"a{suffix}"))
    assert stage.GetMetadata("upAxis") == "Z"
    assert stage.GetMetadata("metersPerUnit") == 1.0
    (prim,) = (p for p in stage.Traverse() if p.GetTypeName() == "ParticleField3DGaussianSplat")
    assert prim.GetPath().HasPrefix(stage.GetDefaultPrim().GetPath())
    values = values_of(prim)
    upright = turned(cloud, WORLD_FROM_FORWARD_CAMERA)
    np.testing.assert_array_equal(values["positions"], upright.means)
    np.testing.assert_array_equal(values["scales"], upright.scales)
    np.testing.assert_array_equal(values["opacities"], upright.opacities)
    wxyz = [[q.GetReal(), *q.GetImaginary()] for q in values["orientations"]]
    np.testing.assert_array_equal(wxyz, upright.rotations)
    assert values["radiance:sphericalHarmonicsDegree"] == degree
    coefficients = np.array(values["radiance:sphericalHarmonicsCoefficients"])
    np.testing.assert_array_equal(coefficients.reshape(upright.sh.shape), upright.sh)
    low, high = np.array(values["extent"])
    assert (low < upright.means.min(axis=0)).all()
    assert (high > upright.means.max(axis=0)).all()


def test_no_attribute_is_foreign_to_the_schema(usd, tmp_path, random_cloud):
    write_usd(tmp_path / "a.usdc", random_cloud(3, 1))
    stage = usd.Stage.Open(str(tmp_path / "a.usdc"))
    prim = stage.GetPrimAtPath("/Scene/Splats")
    known = prim.GetPrimDefinition().GetPropertyNames()
    assert {p.GetName() for p in prim.GetAuthoredProperties()} <= set(known)
    assert not any(p.IsCustom() for p in prim.GetAuthoredProperties())


def test_no_splats_are_a_stage_too(usd, tmp_path, random_cloud):
    write_usd(tmp_path / "a.usda", random_cloud(0))
    stage = usd.Stage.Open(str(tmp_path / "a.usda"))
    prim = stage.GetPrimAtPath("/Scene/Splats")
    assert len(prim.GetAttribute("positions").Get()) == 0


def test_a_missing_folder_is_named(usd, tmp_path, random_cloud):
    with pytest.raises(WriteError, match="make the folder"):
        write_usd(tmp_path / "gone" / "a.usdc", random_cloud(1))


def test_without_openusd_the_way_out_is_named(monkeypatch, tmp_path, random_cloud):
    monkeypatch.setitem(sys.modules, "pxr", None)
    with pytest.raises(FormatError, match=r"usd-core.*not installed.*\.glb"):
        write_usd(tmp_path / "a.usdc", random_cloud(1))
    assert not list(tmp_path.iterdir())
