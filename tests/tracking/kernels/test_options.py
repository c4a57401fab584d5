"""The kernels' constants, which both languages take from one object."""

from dataclasses import FrozenInstanceError, fields

import pytest

from tracking.kernels.options import OPTIONS, KernelOptions


def test_the_native_kernels_get_every_constant_but_those_of_a_request():
    names = {field.name for field in fields(KernelOptions)}
    left_out = {"texture_correlation", "plain_correlation"}
    assert left_out < names
    assert OPTIONS.for_native() == {n: getattr(OPTIONS, n) for n in names - left_out}


def test_nobody_changes_what_the_product_runs_with():
    with pytest.raises(FrozenInstanceError):
        OPTIONS.foreign = 0.5
